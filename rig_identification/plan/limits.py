"""How strong a planned run may be: no cable slack, no hinge beyond the room that there is."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rig_identification.errors import InputError
from rig_identification.model import layout
from rig_identification.model.equilibrium import find_rest
from rig_identification.plan.means import Means
from rig_identification.plan.menu import Item
from rig_identification.rig import Rig
from rig_identification.simulate import Multisine, Pulled, RunSpec, SessionSpec, UnbalancedMass
from rig_identification.simulate.flight import fly
from rig_identification.simulate.start import rest_state, start_state
from rig_identification.simulate.true_rig import draw_true_rig

Array = NDArray[np.float64]

#: How often an amplitude is lowered until limits are kept, and the share of a limit that it aims at.
TRIES, AIM = 4, 0.9
#: Below this share of what the means allow a run is not worth its time.
LEAST = 0.05


@dataclass(frozen=True)
class Margins:
    """How near to its limits a run comes."""

    travel: float  # m, largest of any hinge on the body
    tension: float  # smallest share of its tension at rest that any cable keeps; below 0: slack
    amplitude: float  # share of what the means allow


def within_limits(spec: SessionSpec, item: Item, means: Means) -> tuple[Item, Margins] | None:
    """The item as strong as the limits allow, and its margins; None where hardly anything is allowed."""
    if item.run is None:
        return item, Margins(0.0, 1.0, 1.0)
    amplitude = 1.0
    for _ in range(TRIES):
        run = scaled(item.run, amplitude)
        found = _margins(spec, run, amplitude)
        if found is not None and found.travel <= means.travel and found.tension >= means.taut:
            return replace(item, run=run), found
        amplitude *= 0.5 if found is None else _share(found, means)
        if amplitude < LEAST:
            return None
    return None


def _share(found: Margins, means: Means) -> float:
    """Factor on the amplitude that would keep both limits if the motion were in proportion to it."""
    travel = means.travel / max(found.travel, 1e-9)
    tension = (1.0 - means.taut) / max(1.0 - found.tension, 1e-9)
    return AIM * min(1.0, travel, tension)


def scaled(run: RunSpec, factor: float) -> RunSpec:
    """The run with its pull and its exciter's force times ``factor``."""
    start, force = run.start, run.force
    if isinstance(start, Pulled):
        start = replace(start, force=factor * start.force)
    if isinstance(force, UnbalancedMass):
        force = replace(force, unbalance=factor * force.unbalance)
    elif isinstance(force, Multisine):
        force = replace(force, largest=factor * force.largest)
    return replace(run, start=start, force=force)


def _margins(spec: SessionSpec, run: RunSpec, amplitude: float) -> Margins | None:
    """Margins of one run of the body on its rig; None where it leaves every bound."""
    true = draw_true_rig(replace(spec, doubts=False), np.random.default_rng(0))
    rest = find_rest(true.model, rest_state(true.model))
    try:
        motion = fly(
            true, start_state(true.model, run.start, rest.state), run.force, run.duration, run.name
        ).motion
    except InputError:
        return None
    kept = motion.outputs[:, layout.OUT_TENSION :] / rest.tension
    return Margins(
        _travel(spec.rig, rest.state.position, rest.state.R_world_body, motion.states, motion.R_world_body),
        float(np.min(kept)),
        amplitude,
    )


def _travel(rig: Rig, position: Array, R: Array, states: Array, turns: Array) -> float:
    """Largest distance (m) of any hinge on the body from where it is at rest."""
    farthest = 0.0
    for cable in rig.cables:
        place = states[:, :3] + turns @ cable.body_point
        moved = np.linalg.norm(place - (position + R @ cable.body_point), axis=1)
        farthest = max(farthest, float(np.max(moved)))
    return farthest
