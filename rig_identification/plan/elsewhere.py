"""What else would help than other runs: one more device, another hanging of the body, a weighed cable."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rig_identification.errors import InputError
from rig_identification.estimate.observability import elements_covariance
from rig_identification.estimate.parameters import INERTIAL
from rig_identification.model.definite import integrated_out
from rig_identification.plan.choose import Choice, Chosen, relative_std, worst
from rig_identification.plan.information import Laboratory, informations, laboratory
from rig_identification.result import ELEMENTS, natural_size
from rig_identification.rig import Mount, Rig
from rig_identification.simulate import SessionSpec
from rig_identification.simulate.thesis_case import NOISE

Array = NDArray[np.float64]

#: Hz of motion capture that is not there yet, and by how much cables on one side are shortened for another
#: hanging, share of their length.
TRACKED, SHORTER = 100.0, 0.15
LEVEL = np.array([0.0, 0.0, 0.0, 1.0])


@dataclass(frozen=True)
class Other:
    """One thing that could be changed, and what the same runs would tell then."""

    text: str
    worst: float  # worst relative std of what of the inertia can be determined without it
    determined: tuple[str, ...]  # elements that it determines beside those


def others(lab: Laboratory, chosen: Sequence[tuple[Choice, int]], steps: Chosen) -> tuple[Other, ...]:
    """Every change that can be evaluated, best first."""
    out = [_with_device(lab, text, spec, chosen, steps) for text, spec in _devices(lab.spec)]
    out.append(_hung_otherwise(lab, chosen, steps))
    return tuple(sorted((o for o in out if o is not None), key=lambda o: o.worst))


def _devices(spec: SessionSpec) -> Iterator[tuple[str, SessionSpec]]:
    """The session with one device more, at the centre of mass, as noisy as good industrial ones are."""
    rig, center = spec.rig, np.array(spec.elements[1:4])
    noise = {**NOISE, **rig.noise}
    if spec.rates.mocap <= 0.0:
        rates = replace(spec.rates, mocap=TRACKED)
        rig_seen = replace(rig, noise=noise, mocap=rig.mocap or Mount(center, LEVEL))
        yield f"motion capture at {TRACKED:g} Hz", replace(spec, rig=rig_seen, rates=rates)
    if rig.imu is None:
        yield "an IMU on the body", replace(spec, rig=replace(rig, noise=noise, imu=Mount(center, LEVEL)))
    if rig.inclinometer is None:
        level = Mount(np.zeros(3), LEVEL)
        yield "an inclinometer on the body", replace(spec, rig=replace(rig, noise=noise, inclinometer=level))


def _summed(
    lab: Laboratory, chosen: Sequence[tuple[Choice, int]], share: float = 1.0, *, rests: bool = True
) -> Array | None:
    """(p, p) what the chosen items tell in another laboratory, runs to a share of their time; no priors."""
    kept = [(c.item, times) for c, times in chosen if rests or c.item.run is not None]
    found = informations(lab, [item for item, _ in kept])
    total = np.zeros((lab.size, lab.size))
    for (item, times), part in zip(kept, found, strict=True):
        if part is None:
            return None
        total += (share * times if item.run is not None else 1.0) * part
    return total


def _with_device(
    lab: Laboratory, text: str, spec: SessionSpec, chosen: Sequence[tuple[Choice, int]], steps: Chosen
) -> Other | None:
    run = next((c.item for c, _ in chosen if c.item.run is not None), None)
    if run is None:
        return None
    richer = laboratory(spec, run, lab.known)
    told = _summed(richer, chosen)
    if told is None:
        return None
    total = richer.before + told
    now = {n for n in ELEMENTS if n not in richer.expected(total).unobservable}
    more = tuple(n for n in ELEMENTS if n in now and n not in steps.determined)
    return Other(text, worst(relative_std(richer, total), steps.determined), more)


def _hung_otherwise(lab: Laboratory, chosen: Sequence[tuple[Choice, int]], steps: Chosen) -> Other | None:
    """Half of each run's time with the cables of one side shortened.

    All doubts but the lengths of the cables are those of the first hanging: hinges, mounts, gains and biases
    stay as they are.
    """
    rig, names = shortened(lab.spec.rig)
    run = next((c.item for c, _ in chosen if c.item.run is not None), None)
    if run is None:
        return None
    try:
        tilted = laboratory(replace(lab.spec, rig=rig), run)
    except InputError:
        return None
    first, second = _summed(lab, chosen, 0.5), _summed(tilted, chosen, 0.5, rests=False)
    if first is None or second is None or tilted.size != lab.size:
        return None
    together = _shared(lab, first, second)
    covariance = elements_covariance(lab.problem, lab.evaluation(together))
    relative = np.sqrt(np.diag(covariance)) / natural_size(lab.spec.elements)
    lost = lab.expected(together).unobservable
    more = tuple(n for n in ELEMENTS if n not in lost and n not in steps.determined)
    text = f"half of the time with {' and '.join(names)} shorter by {100 * SHORTER:g} %"
    return Other(f"{text} (a second session)", worst(np.asarray(relative), steps.determined), more)


def shortened(rig: Rig) -> tuple[Rig, tuple[str, ...]]:
    """The rig with the cables of its side towards body +x, or +y where all stand in one line, shorter."""
    points = np.array([cable.body_point for cable in rig.cables])
    axis = int(np.argmax(np.ptp(points[:, :2], axis=0)))
    middle = 0.5 * (np.min(points[:, axis]) + np.max(points[:, axis]))
    shorter = tuple(
        replace(c, length=(1.0 - SHORTER) * c.length) if c.body_point[axis] > middle else c
        for c in rig.cables
    )
    names = tuple(c.name for c in rig.cables if c.body_point[axis] > middle)
    return replace(rig, cables=shorter), names


def _shared(lab: Laboratory, first: Array, second: Array) -> Array:
    """(p, p) information of both hangings, lengths of the second one, which are its own, integrated out."""
    free = lab.problem.bench.parameters.free
    own = [i for i, p in enumerate(free, start=INERTIAL) if p.name.endswith(".length")]
    p, extra = lab.size, len(own)
    moved = np.zeros((p, p + extra))
    moved[np.arange(p), np.arange(p)] = 1.0
    for k, i in enumerate(own):
        moved[i, i], moved[i, p + k] = 0.0, 1.0
    total = moved.T @ second @ moved
    total[:p, :p] += first + lab.before
    total[p:, p:] += np.eye(extra)
    return integrated_out(total, p)
