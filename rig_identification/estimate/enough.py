"""As much of long runs as a fit needs: cost grows with every second, accuracy hardly does.

A body's numbers come out of a fit with the doubts about its rig among them: of what 10 s leave, 250 s leave a
half to a tenth, and from there on lengths and hinge points decide, which no motion measures any better. A
fit's time and memory are in proportion to what it looks at. So all runs together are at most SECONDS long,
each its share; of a longer one the stretch is used in which it moves most, for a swing that has died away
tells nothing more. What is left out is told, and by how much it would make the intervals narrower.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.evidence import Run
from rig_identification.estimate.observability import root_of_inverse
from rig_identification.estimate.solve import Evaluation, Problem
from rig_identification.model.definite import integrated_out
from rig_identification.result import ELEMENTS, InertialEstimate

Array = NDArray[np.float64]

#: Length of all fitted runs together, and of all held-out ones, s.
SECONDS = 250.0
#: The same where the body is only seen to swing: some twenty to fifty periods, in most of which a free swing
#: has died away. Each way to roll and each effect that damps is fitted to all of it.
WATCHED_SECONDS = 48.0
#: Devices that see how a body moves and not what moves it.
ONLY_SEE = {"mocap", "inclinometer"}


def enough(runs: tuple[Run, ...], most: float | None = None) -> tuple[Run, ...]:
    """The runs with at most about ``most`` seconds in all (none given: what the devices in them take)."""
    if most is None:
        seen = all(c.device in ONLY_SEE for run in runs for c in run.channels)
        most = WATCHED_SECONDS if seen else SECONDS
    total = sum(run.grid.duration for run in runs)
    if total <= 1.01 * most:
        return runs
    return tuple(
        replace(liveliest(run, most * run.grid.duration / total), out_of=run.grid.duration) for run in runs
    )


def told(runs: Iterable[Run]) -> tuple[str, ...]:
    """What is told of those of the ``runs`` that are the liveliest stretch of a longer one."""
    return tuple(
        f"{run.recording.name}: used from {run.offset:.1f} to {run.offset + run.grid.duration:.1f} s, where "
        f"it moves most of its {run.out_of:.0f} s."
        for run in runs
        if run.out_of > 0.0
    )


def narrower(problem: Problem, evaluation: Evaluation) -> Array:
    """(10,) std of each element with all of the runs over its std with the stretches that are used.

    As far as noise counts: a stretch tells as much as it moves, and what is believed of rig and body stays.
    """
    p, information = problem.bench.parameters.size, evaluation.information
    heard = sum(run.jacobian[:, :p].T @ run.jacobian[:, :p] for run in evaluation.runs)
    believed = information[:p, :p] - heard
    told_now = integrated_out(information, p)
    seconds = np.array([run.grid.duration for run in problem.runs])
    more = float(np.sum(seconds / [run.lively for run in problem.runs]) / np.sum(seconds))
    return share_of_std(
        believed,
        told_now - believed,
        more,
        problem.bench.parameters.elements_jacobian(evaluation.point.theta),
    )


def share_of_std(believed: Array, told_by_runs: Array, more: float, elements: Array) -> Array:
    """(k,) std with ``more`` times what runs told, over the std with that.

    believed, told_by_runs: (p, p) information. elements: (k, b) slopes of what is asked by the first b of p.
    """
    std = []
    for times in (1.0, more):
        root = root_of_inverse(believed + times * told_by_runs)[:, : elements.shape[1]] @ elements.T
        std.append(np.sqrt(np.sum(root**2, axis=0)))
    return np.asarray(std[1] / std[0])


def loss_told(problem: Problem, evaluation: Evaluation, total: InertialEstimate) -> tuple[str, ...]:
    """One sentence on what the seconds that are not used would tell of the body; none where all are used."""
    if not any(run.out_of > 0.0 for run in problem.runs):
        return ()
    share = dict(zip(ELEMENTS, narrower(problem, evaluation), strict=True))
    asked = [name for name in ELEMENTS if name not in total.unobservable]
    if not asked:
        return ()
    most = min(asked, key=lambda name: share[name])
    return (
        f"All seconds of the recordings, used as those that are, would make the interval of {most} "
        f"{100.0 * (1.0 - share[most]):.0f} % narrower, as far as noise counts, and no other one by more.",
    )


def liveliest(run: Run, seconds: float) -> Run:
    """The stretch of so many ``seconds`` in which the run's readings are farthest from their middles."""
    nodes = max(8, round(seconds / run.grid.step) + 1)
    if nodes >= run.grid.nodes:
        return run
    moved, noise = np.zeros((2, run.grid.nodes))
    for channel in run.channels:
        away = (channel.grouped - np.median(channel.grouped, axis=0)) / channel.noise
        np.add.at(moved, channel.node, np.sum(away**2, axis=1))
        np.add.at(noise, channel.node, np.sum(channel.grouped_variance / channel.noise**2, axis=1))
    so_far = np.concatenate([[0.0], np.cumsum(moved)])
    begin = int(np.argmax(so_far[nodes:] - so_far[:-nodes]))
    moving = moved - noise
    whole = float(np.sum(moving))
    here = float(np.sum(moving[begin : begin + nodes])) / whole if whole > 0.0 else 1.0
    return replace(
        run.between(begin, begin + nodes - 1), lively=float(np.clip(here, nodes / moved.size, 1.0))
    )
