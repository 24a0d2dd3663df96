"""All hypotheses at once, to first order: which would explain most of what is left?

The model is linearised once with every candidate's parameters among its columns. Freeing or
adding a set S of parameters then promises a gain in log posterior of
    1/2 g^T (F + P_S)^-1 g   less the same without S
(a score test, Rao 1948, with priors; F: Fisher information, g: gradient, P_S: prior
precisions with S's wide ones). It costs one small linear solve a candidate. Riders, of which
many frequencies and directions are tried, add columns of their own (response.py).
"""

from __future__ import annotations

from rig_identification.estimate.solve import Evaluation, Problem
from rig_identification.estimate.stretching import STIFFNESS
from rig_identification.mismatch.candidate import Candidate
from rig_identification.mismatch.opened import Promise, opened_with, promise_of
from rig_identification.mismatch.rider_promises import rider_promises
from rig_identification.mismatch.supports import (
    cable_elasticity,
    ceiling_candidate,
    gives_way,
    largest_compliance,
    stiffnesses,
    taut_cables,
    yielding_like,
)
from rig_identification.mismatch.tethers import placed_tethers


def screen(
    problem: Problem, evaluation: Evaluation, candidates: list[Candidate], mass: float
) -> list[Promise]:
    """Promises of all candidates, and of riders and supports, about ``evaluation``, best first.

    mass: kg, of the body.
    """
    rig, model = problem.bench.rig, problem.bench.parameters.model
    axes = () if gives_way(model) else range(3)
    probes = [ceiling_candidate(rig, model, mass, a, probe=True) for a in axes]
    # Beside a wrench they are begun whatever they promise (search/expand.py)
    taut = taut_cables(rig, model, mass) if problem.discrepancy is None else []
    opened = opened_with(problem, evaluation, [*candidates, *probes, *taut])
    if opened is None:
        return []
    wide, beyond, boxed = opened
    full = beyond.full
    out = [promise_of(wide, beyond, boxed, c) for c in (*candidates, *taut)]
    for probe in (promise_of(wide, beyond, boxed, c) for c in probes):
        out += _supports(problem, mass, probe)
    placed = [
        Promise(hose, gain, values) for hose, gain, values in placed_tethers(wide, full, beyond, candidates)
    ]
    instead = {p.candidate.label for p in placed}
    out = [*(p for p in out if p.candidate.label not in instead), *placed]
    out += rider_promises(problem, beyond, mass, len(candidates))
    return sorted(out, key=lambda promise: -promise.gain)


def _supports(problem: Problem, mass: float, probe: Promise) -> list[Promise]:
    """What a ceiling's probe promises of a ceiling, and the vertical one of cables that stretch."""
    rig, model = problem.bench.rig, problem.bench.parameters.model
    name, compliance = next(iter(probe.values.items()))
    if compliance <= 0.0:
        return []
    compliance = min(compliance, largest_compliance(rig, mass))
    axis = "xyz".index(name[-1])
    out = [Promise(ceiling_candidate(rig, model, mass, axis), probe.gain, probe.values)]
    if axis == 2:
        stiffness = yielding_like(rig, model, compliance)
        elasticity = cable_elasticity(rig, model, mass)
        # A ceiling's probe says how much they yield where all carry alike
        also = tuple(Promise(elasticity, probe.gain, {STIFFNESS: s}) for s in stiffnesses(rig, mass))
        out.append(Promise(elasticity, probe.gain, {STIFFNESS: stiffness}, elsewhere=also))
    return out
