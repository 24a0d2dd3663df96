"""Every hypothesis of a session, what each has to promise, and which promises are worth a fit."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import numpy as np
from scipy.stats import chi2

from rig_identification.estimate.parameters import INERTIAL
from rig_identification.estimate.solve import Problem
from rig_identification.estimate.verdict import DOUBTED, FALSE_ALARM
from rig_identification.mismatch.amounts import WORTH
from rig_identification.mismatch.bent_cells import bent_cells
from rig_identification.mismatch.candidate import Candidate
from rig_identification.mismatch.cross_sensitivity import cross_sensitivity
from rig_identification.mismatch.drifts import drifts
from rig_identification.mismatch.left_out_physics import left_out_physics
from rig_identification.mismatch.locate import devices_of
from rig_identification.mismatch.riders import SWINGS
from rig_identification.mismatch.rig_errors import rig_errors
from rig_identification.mismatch.screen import Promise
from rig_identification.mismatch.sensor_errors import sensor_errors

#: How many effects every rig has some of: cables weigh, air is taken along, an exciter's mass moves.
EVERYWHERE = 3
#: Hypotheses that get their first steps after each screening; to those that are not slow, slow ones are none.
FITTED = 4
#: Of these, at most so many of one effect: its other places are its rivals anyway; and of one with as many
#: parameters of its own as a hose or a rider has, whose fits are slow and whose place is found already.
ALIKE, ALIKE_IF_MANY = 3, 2


def catalogue(problem: Problem) -> list[Candidate]:
    """Every hypothesis that this session's rig and channels admit."""
    rig, parameters = problem.bench.rig, problem.bench.parameters
    mass = float(
        parameters.elements(np.concatenate([problem.weak_center, np.zeros(parameters.size - INERTIAL)]))[0]
    )
    every = [
        *sensor_errors(rig, parameters, devices_of(problem)),
        *bent_cells(rig, parameters, mass),
        *cross_sensitivity(rig, parameters, devices_of(problem)),
        *drifts(parameters, devices_of(problem), longest(problem)),
        *rig_errors(rig, parameters),
        *left_out_physics(rig, parameters, mass),
    ]
    # What is slow has several descriptions and one place
    places = Counter(c.kind for c in every if not c.slow)
    return [c if c.slow else replace(c, places=places[c.kind]) for c in every]


def longest(problem: Problem) -> float:
    """Duration (s) of the longest recording that is fitted."""
    return max((run.recording.duration for run in problem.runs), default=0.0)


def compatible(candidates: list[Candidate], found: list[Candidate]) -> list[Candidate]:
    """Candidates that can stand beside what was found: they write no number that is in the model already.

    A second hose would write its numbers over the first one's, and the lag of all cells over one cell's.
    """
    names = {q.name for c in found for q in c.parameters}
    entries = {entry for c in found for entry in _written(c)}
    return [c for c in candidates if not names & {q.name for q in c.parameters} and not entries & _written(c)]


def _written(candidate: Candidate) -> set[tuple[str, int]]:
    """Entries of the model or a device that a candidate writes; one that builds has its own."""
    if candidate.build is not None:
        return set()
    return {(q.kind, entry) for q in candidate.parameters for entry in (q.index, *q.also)}


def count_of(candidates: list[Candidate]) -> int:
    """How many hypotheses are tried: riders swing in many ways."""
    return len(candidates) + len(SWINGS)


def needed_gain(candidate: Candidate, count: int) -> float:
    """Gain (nats) that noise exceeds with chance FALSE_ALARM over ``count`` trials (Wilks).

    Bonferroni's correction, weighted (Genovese, Roeder and Wasserman, Biometrika 93, 2006): what the lab
    doubts itself is likelier wrong than what it leaves out. What every rig has some of is a family of its
    own: no chance among many, of that only the amount is asked.
    """
    share = 1.0 / EVERYWHERE if candidate.everywhere else (DOUBTED if candidate.doubted else 1.0) / count
    return 0.5 * float(chi2.isf(FALSE_ALARM * share, len(candidate.parameters)))


def net_gain(promise: Promise, count: int) -> float:
    """What a promise gains (nats) beyond what noise gives one of ``count``."""
    return promise.gain - needed_gain(promise.candidate, count)


def worth_a_fit(promises: list[Promise], count: int, device: str | None = None) -> list[Promise]:
    """The promises worth a fit, of ``count`` that were made; those of one device where it is known to lie.

    A steady pull, of six numbers, bends to any cell's zero or a level: it is worth one where it is likelier.
    """
    single = max((net_gain(p, count) for p in promises if not p.steady), default=0.0)
    worthy = [p for p in promises if net_gain(p, count) > (max(single, 0.0) if p.steady else 0.0)]
    # A cell that bends, or that feels its neighbour, promises whatever its zero does, and a little more
    worthy.sort(key=lambda p: -net_gain(p, count))
    most = max((p.gain for p in worthy), default=0.0)
    if device is not None:
        worthy = [p for p in worthy if p.candidate.where.get("channel") == device] or worthy
    out: list[Promise] = []
    for p in worthy:
        alike = sum(q.candidate.kind == p.candidate.kind for q in out)
        places = ALIKE_IF_MANY if p.candidate.many else ALIKE
        # A hose's nine numbers promise more of anything, and take no place from what is fitted in a second
        others = out if p.candidate.slow else [q for q in out if not q.candidate.slow]
        if p.gain > WORTH * most and alike < places and len(others) < FITTED:
            out.append(p)
    return out


def as_likely(promises: list[Promise], worthy: list[Promise], meant: float) -> list[Promise]:
    """Near the noise: of effects without a promise among the ``worthy``, the best that are about as likely.

    An effect is as likely beforehand wherever it is: a level that promises less than one hinge of twenty-four
    may be as likely as that, and is told beside it. What takes long to fit is not. meant: nats that count.
    """

    def likely(promise: Promise) -> float:
        return promise.gain - float(np.log(promise.candidate.places))

    least = max(map(likely, worthy), default=np.inf) - meant
    seen = {p.candidate.kind for p in worthy}
    out: list[Promise] = []
    for p in promises:
        if p.candidate.kind not in seen and not p.candidate.slow and likely(p) > least:
            seen.add(p.candidate.kind)
            out.append(p)
    return out
