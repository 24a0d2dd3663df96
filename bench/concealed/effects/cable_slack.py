"""A cable goes slack and snaps tight again."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import mujoco
import numpy as np

from bench.concealed.draw import scaled
from bench.concealed.effects.base import Effect, quantity
from bench.concealed.scene import Array, Plan, Scene
from bench.concealed.signals import Trajectory

# MuJoCo's limits act only where they are exceeded. A cable that yields by less than a step's truncation,
# 1e-8 m, lets go under thousands of newtons for a step and snaps; these yield by a micrometre.
LIMIT_TIME = 0.002  # s
LIMIT_IMPEDANCE = 0.99
LEAST_SLACK = 0.02  # s, of one cable over the session
GRAZE = 0.003  # s: shorter than that a cable was never loose
REBOUND = 0.2  # s: a cable that snaps tight bounces; that is one spell


@dataclass(frozen=True)
class CableSlack(Effect):
    """Cables that only pull, in runs violent enough that one of them goes slack."""

    name = "cable_slack"
    mechanical = True
    own_cables = True
    lets_go = True
    violence: float  # how much more pull and force than the calm run has

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, size: float) -> CableSlack:
        """The runs grow until a cable is slack; a larger size goes on from there."""
        return cls(1.2 + 0.6 * size)

    def truth(self) -> dict[str, Any]:
        """The times follow from the motion: see :meth:`observe`."""
        return {"parameters": {"violence": quantity(self.violence, "1")}}

    def alter(self, scene: Scene) -> Scene:
        """See :class:`Effect`."""
        plans = tuple(scaled(p, self.violence) for p in scene.plans)
        return replace(scene, plans=plans)

    def stronger(self) -> CableSlack:
        """What to try if no cable went slack."""
        return replace(self, violence=1.4 * self.violence)

    def build(self, spec: Any, scene: Scene, plan: Plan) -> None:
        """See :class:`Effect`."""
        for i, length in enumerate(scene.geometry.length):
            tendon = spec.add_tendon(
                name=f"cable_{i}",
                limited=True,
                range=[0.0, length],
                solref_limit=[LIMIT_TIME, 1.0],
                solimp_limit=[LIMIT_IMPEDANCE, LIMIT_IMPEDANCE, 0.001, 0.5, 2.0],
            )
            tendon.wrap_site(f"ceiling_{i}")
            tendon.wrap_site(f"hinge_{i}")

    def tension(self, model: Any, data: Any, scene: Scene) -> Array:
        """See :class:`Effect`."""
        out = np.zeros(len(scene.geometry.length))
        first = model.tendon("cable_0").id  # another effect's tendon may come before the cables
        for row in np.flatnonzero(data.efc_type == mujoco.mjtConstraint.mjCNSTR_LIMIT_TENDON):
            out[data.efc_id[row] - first] = data.efc_force[row]
        return out

    def observe(self, scene: Scene, paths: Sequence[Trajectory]) -> dict[str, Any] | None:
        """Channel and times of slack, None if no cable went slack."""
        times, slack_time = [], np.zeros(len(scene.geometry.length))
        for plan, path in zip(scene.plans, paths, strict=True):
            slack = path.tension < 1.0
            slack_time += path.time[1] * slack.sum(axis=0)
            for first, last in _spells(path.time[slack.any(axis=1)] - plan.first_sample):
                if last > 0.0 and last - first > GRAZE:
                    times.append({"recording": plan.name, "start": max(first, 0.0), "end": last})
        # A fit must see it in the run that it is fitted to.
        if slack_time.max() < LEAST_SLACK or all(t["recording"] != "run_1" for t in times):
            return None
        return {"channel": f"cable_{int(np.argmax(slack_time)) + 1}", "times": times}


def _spells(time: Array) -> list[tuple[float, float]]:
    """Start and end of each spell of instants no further apart than ``REBOUND``."""
    if len(time) == 0:
        return []
    breaks = np.flatnonzero(np.diff(time) > REBOUND)
    starts = time[np.concatenate([[0], breaks + 1])]
    ends = time[np.concatenate([breaks, [len(time) - 1]])]
    return [(float(a), float(b)) for a, b in zip(starts, ends, strict=True)]
