"""Every hypothesis of a session, what each has to promise, and which promises are worth a fit."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import numpy as np
from scipy.stats import chi2

from rig_identification.estimate.parameters import INERTIAL
from rig_identification.estimate.solve import Problem
from rig_identification.estimate.verdict import DOUBTED, FALSE_ALARM
from rig_identification.mismatch.bent_cells import bent_cells
from rig_identification.mismatch.candidate import LIGHT, Candidate
from rig_identification.mismatch.cross_sensitivity import cross_sensitivity
from rig_identification.mismatch.drifts import drifts
from rig_identification.mismatch.lagging_cells import lagging_cells
from rig_identification.mismatch.left_out_physics import left_out_physics
from rig_identification.mismatch.locate import devices_of
from rig_identification.mismatch.mount_errors import mount_errors
from rig_identification.mismatch.opened import Promise
from rig_identification.mismatch.riders import SWINGS
from rig_identification.mismatch.rig_errors import rig_errors
from rig_identification.mismatch.sensor_errors import sensor_errors
from rig_identification.mismatch.shared_errors import shared_errors
from rig_identification.mismatch.soft_mount import soft_mounts

#: How many effects every rig has some of: cables weigh, air is taken along, an exciter's mass moves.
EVERYWHERE = 3


def catalogue(problem: Problem) -> list[Candidate]:
    """Every hypothesis that this session's rig and channels admit."""
    rig, parameters = problem.bench.rig, problem.bench.parameters
    mass = float(
        parameters.elements(np.concatenate([problem.weak_center, np.zeros(parameters.size - INERTIAL)]))[0]
    )
    every = [
        *sensor_errors(rig, parameters, devices_of(problem)),
        *bent_cells(rig, parameters, mass),
        *lagging_cells(rig, parameters, mass),
        *cross_sensitivity(rig, parameters, devices_of(problem)),
        *drifts(rig, parameters, devices_of(problem), longest(problem)),
        *rig_errors(rig, parameters),
        *mount_errors(rig, parameters),
        *shared_errors(rig, parameters),
        *soft_mounts(parameters, {c.quantity for run in problem.runs for c in run.channels}),
        *left_out_physics(rig, parameters, mass),
    ]
    every = [_as_on_every_rig(c, mass) for c in every]
    # What is slow has several descriptions and one place
    places = Counter(c.kind for c in every if not c.slow)
    return [c if c.slow else replace(c, places=places[c.kind]) for c in every]


def _as_on_every_rig(candidate: Candidate, mass: float) -> Candidate:
    """The same with how much of it every rig has, where it is a mass beside the body's ``mass`` (kg)."""
    amount = candidate.parameters[0]
    if candidate.ordinary or not candidate.positive or amount.unit != "kg":
        return candidate
    return replace(candidate, ordinary={amount.name: LIGHT * mass})


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
    return {
        (q.kind, entry) for q in candidate.parameters for entry in (*q.written, *(e for e, _ in q.shifts))
    }


def count_of(candidates: list[Candidate]) -> int:
    """How many hypotheses are tried: riders swing in many ways."""
    return len(candidates) + len(SWINGS)


def needed_gain(candidate: Candidate, count: int, numbers: int | None = None) -> float:
    """Gain (nats) that noise exceeds with chance FALSE_ALARM over ``count`` trials (Wilks).

    Bonferroni's correction, weighted (Genovese, Roeder and Wasserman, Biometrika 93, 2006): what the lab
    doubts itself is likelier wrong than what it leaves out. What every rig has some of is a family of its
    own: no chance among many, of that only the amount is asked. numbers: of the candidate's, all by default.
    """
    share = 1.0 / EVERYWHERE if candidate.everywhere else (DOUBTED if candidate.doubted else 1.0) / count
    numbers = len(candidate.parameters) if numbers is None else numbers
    return 0.5 * float(chi2.isf(FALSE_ALARM * share, numbers))


def net_gain(promise: Promise, count: int) -> float:
    """What a promise gains (nats) beyond what noise gives one of ``count``."""
    return promise.gain - needed_gain(promise.candidate, count)


def stood_for(promise: Promise, others: list[Promise], count: int) -> bool:
    """Whether a special case of a hypothesis promises as much: what its further numbers add is chance.

    With its cells' zeros free a law of two cells that feel each other promises what each zero does, and more.
    """
    own = {p.name for p in promise.candidate.parameters}
    for other in others:
        part = {p.name for p in other.candidate.parameters}
        if part < own:
            further = needed_gain(promise.candidate, count, len(own) - len(part))
            if promise.gain - other.gain < further:
                return True
    return False
