# %% [markdown]
# # A notebook: a car with stiff hinges
#
# `read`, `check`, `simulate` and `identify` do in a notebook what the command line does, and their results
# are tables. A car is simulated whose hinges damp more than anybody thinks; the session is read, checked
# and identified as a recorded one would be.
#
# Needs `pip install 'rig_identification[notebook]'`. The page of [Python](../how-to/python.md) explains
# each function.

# %%
import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

import rig_identification as ri

pd.set_option("display.precision", 4)

# %% [markdown]
# ## Simulate
#
# Case study 14 of the thesis: 1145 kg on four inclined cables, pulled aside, let go and shaken at 0.7 Hz.
# The hinges' damping is switched on and stands in no description. `trial.values` is the truth; a recorded
# session has no such thing.

# %%
trial = ri.simulate(
    case=14,
    start="pulled",
    shake=(0.05, 0.7),
    duration=10.0,
    rest=5.0,
    effects={"hinge_damping": (20.0,)},
    seed=3,
)
trial.write("car", overwrite=True)

# %% [markdown]
# ## Read
#
# `read` takes a session's folder. Each topic of each recording is a DataFrame over time in seconds.

# %%
recorded = ri.read("car")
recorded.recordings

# %%
recorded.frame("run_1", "imu/data_raw").head()

# %% [markdown]
# ## Check
#
# Units, axes, wiring, stamps: what is set up wrongly is found before anything is fitted. `faults` has a
# row for each.

# %%
checked = ri.check(recorded)
checked.sound, len(checked.faults)

# %% [markdown]
# ## Identify
#
# The ideal model is fitted, its residuals are no noise, and the search for what it lacks runs: a minute or
# two.

# %%
result = ri.identify(checked)
result.verdict

# %%
result.numbers

# %% [markdown]
# ## What was left out

# %%
result.findings[["effect", "statement", "log_likelihood_gain"]]

# %% [markdown]
# The finding's own number, and the experiment that would confirm it, stand on [the effect's
# page](../effects/hinge_damping.md). The simulation had 20 N m s/rad:

# %%
damping = result.identification.mismatch.findings[0].parameters["damping"]
damping

# %% [markdown]
# ## Beside the truth
#
# Error of each number in its own standard deviations. Within two of them is what 95 % should be.

# %%
beside = result.numbers[["value", "std"]].assign(truth=trial.values)
beside["error / std"] = (beside["value"] - beside["truth"]) / beside["std"]
beside

# %% [markdown]
# ## A plot
#
# Every channel is there with what was measured, predicted, and left. With the finding in the model the
# residual is noise.

# %%
fit = result.channel("run_1", "imu", "angular_rate", "y")
figure, (course, left) = plt.subplots(
    2, 1, sharex=True, figsize=(8, 4), height_ratios=(2, 1), layout="constrained"
)
course.plot(fit.index, fit["measured"], label="measured")
course.plot(fit.index, fit["predicted"], "--", label="predicted")
course.set(ylabel="rate about y (rad/s)")
course.legend(loc="upper right")
left.plot(fit.index, fit["residual"], color="0.5", linewidth=0.8)
left.set(xlabel="time (s)", ylabel="residual (rad/s)")
plt.show()

# %%
assert result.verdict == "explained"
assert result.findings["effect"].tolist() == ["hinge_damping"]
assert abs(damping["value"] - 20.0) < 4.0 * damping["std"]
assert np.all(np.abs(beside["error / std"]) < 4.5)
result.write("answer")
