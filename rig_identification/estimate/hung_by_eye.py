"""Where the centre of mass is taken to be when nothing that was measured tells.

A turn alone, or its rate, does not tell how far beside the middle of the cables a body's centre of mass
hangs: its cables then share the weight otherwise, and the body turns as slowly as a larger one that hangs in
the middle. Of two parallel cables, 2 a apart, with the centre of mass e beside the middle,
    J = m g (a^2 - e^2) / (h w^2).
The formulas that people use take e = 0, and people hang a body so: by hand and by eye the cables are felt to
pull alike.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.evidence import Run
from rig_identification.estimate.first_guess import extent
from rig_identification.estimate.rest_evidence import RestEvidence
from rig_identification.estimate.solve import Problem
from rig_identification.estimate.unseen_sway import one_turn

Array = NDArray[np.float64]

#: How far beside the middle, as a share of the cables' distance: tensions that differ by a fifth are felt,
#: (1/2 + s) / (1/2 - s) = 1.2.
BESIDE = 1.0 / 22.0
#: Quantities that tell nothing of the centre of mass beside the middle.
TURNS = frozenset({"orientation", "angular_rate"})
#: Inertia about the vertical among the ten elements.
VERTICAL = 9
#: Entries of the body's vector: the centre of mass along x and y, and its height.
HORIZONTAL, DEPTH = (7, 8), 9
#: How deep it hangs, as a share of the rig's extent, one standard deviation about the first guess: one turn
#: tells nothing of that, and a fit that nothing holds ends a rig's height below the rig.
DEEP = 0.2


def only_turns(runs: tuple[Run, ...], rests: tuple[RestEvidence, ...]) -> bool:
    """Whether nothing but the body's turning is measured."""
    measured = {c.quantity for run in runs for c in run.channels}
    measured |= {c.quantity for rest in rests for c in rest.channels}
    return bool(measured) and measured <= TURNS


def hung_by_eye(problem: Problem) -> Problem:
    """The problem with what is believed where nothing that was measured tells: midway, hardly swinging."""
    if not only_turns(problem.runs, problem.rests):
        return problem
    weak, size = problem.weak.copy(), extent(problem.bench.rig)
    weak[list(HORIZONTAL)] = BESIDE * float(max(size[:2]))
    if all(one_turn(run) for run in problem.runs):
        weak[DEPTH] = DEEP * float(np.max(size))
    return replace(problem, weak=weak, taken=HORIZONTAL, bench=replace(problem.bench, unseen=True))


def note_of(problem: Problem) -> tuple[str, ...]:
    """What is told of a centre of mass that is taken to hang midway."""
    if not problem.taken:
        return ()
    beside = float(problem.weak[problem.taken[0]])
    return (
        "Nothing that was recorded tells where the centre of mass hangs beside the middle of the cables: it "
        f"is taken to hang there to within {beside:.2g} m, as one sees and feels. The inertia rests on that; "
        "record positions, tensions, inclinations or specific forces as well to measure it.",
    )


def beside_middle(problem: Problem, elements: Array) -> Array:
    """(10,) std of the ten elements for a centre of mass that does hang beside the middle.

    At the middle the inertia does not change with e to first order: J falls by the share e^2 / r^2, r the
    hinges' distance from the middle. For e normal along each of the d ways in which hinges lie apart, of std
    s, the root mean square of that is s^2 / r^2 sqrt(d^2 + 2 d).
    """
    out = np.zeros(elements.size)
    if problem.taken:
        points = np.array([c.body_point for c in problem.bench.rig.cables])[:, :2]
        spread = np.var(points, axis=0)
        ways = int(np.count_nonzero(spread > 1e-4 * np.max(spread)))
        share = problem.weak[problem.taken[0]] ** 2 / float(np.sum(spread)) * np.sqrt(ways**2 + 2.0 * ways)
        out[VERTICAL] = share * elements[VERTICAL]
    return out
