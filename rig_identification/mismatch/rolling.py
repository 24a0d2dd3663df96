"""How a body on a line of hinges rolls about it: every frequency at which it may, tried in turn.

A body on two threads swings across their plane in two ways, nearly as a whole, and rolling about its hinges
while its centre of mass stays. The second is fast and small and dies out early: a fit that begins with it out
of step finds nothing that pulls it there, and what it then makes of the body's depth and of its moments about
the line is worth nothing. With L the cables' length, d the depth of the centre of mass below the line and k
the radius of gyration about the line's direction, both ways have (L k^2) w^4 - g (d^2 + k^2 + L d) w^2 + g^2 d = 0
(the double pendulum's). So a body of ordinary k rolls at w with one d, and a scan over w is one over d.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.launch import launch_state
from rig_identification.estimate.parameters import INERTIAL
from rig_identification.estimate.solve import Point, Problem, solve
from rig_identification.estimate.start_state import fit_start
from rig_identification.mismatch.threads import line_of_hinges
from rig_identification.mismatch.trial import Trial, finished, log_evidence

Array = NDArray[np.float64]

#: Highest frequency of rolling, as a multiple of the pendulum's own.
HIGHEST = 6.0
#: Lowest one: nearer to it than this the two ways of swinging are one.
LOWEST = 1.1
#: Steps of the fit from the best frequency.
STEPS = 24
#: What fits of start states may take of rig and devices, in tolerances.
DOUBTED = 1.0


def depth_of(frequency: float, length: float, gyration: float, gravity: float) -> float:
    """Depth (m) of the centre of mass below its hinges with which a body rolls at ``frequency`` (Hz)."""
    square = (2.0 * np.pi * frequency) ** 2
    a, b = gravity * square, gravity * square * length - gravity**2
    c = -square * gyration**2 * (square * length - gravity)
    return float((-b + np.sqrt(b * b - 4.0 * a * c)) / (2.0 * a))


def _bodies(problem: Problem, point: Point, span: float) -> list[Array]:
    """Vectors of bodies that roll at every frequency which ``span`` seconds tell apart, the rig undisturbed."""
    rig, parameters = problem.bench.rig, problem.bench.parameters
    line = line_of_hinges(rig)
    if line is None:
        return []
    length = float(np.mean([c.length for c in rig.cables]))
    hinges = np.mean([c.body_point for c in rig.cables], axis=0)
    own = np.sqrt(rig.gravity / length) / (2.0 * np.pi)
    believed = parameters.elements(np.concatenate([problem.weak_center, np.zeros(parameters.size - INERTIAL)]))
    mass, vertical = parameters.elements(point.theta)[[0, 9]]
    J = _round(believed[4:]) * vertical / believed[9]
    gyration = float(np.sqrt(line @ J @ line / mass))
    out = []
    for frequency in np.arange(LOWEST * own, HIGHEST * own, 0.5 / span):
        center = hinges - [0.0, 0.0, depth_of(float(frequency), length, gyration, rig.gravity)]
        elements = np.concatenate([[mass], center, J[np.triu_indices(3)]])
        theta = np.concatenate([parameters.start(elements)[:INERTIAL], point.theta[INERTIAL:]])
        for i, p in enumerate(parameters.free):
            # What the rig's errors were bent to belongs to another body
            theta[INERTIAL + i] = 0.0 if p.bounded else theta[INERTIAL + i]
        out.append(theta)
    return out


def _round(upper: Array) -> Array:
    """(3, 3) diagonal tensor of (6,) xx xy xz yy yz zz."""
    return np.diag(upper[[0, 3, 5]])


def rolling_otherwise(trial: Trial) -> Trial:
    """The trial with its body rolling at the frequency that fits best, where that is likelier."""
    problem, point = trial.problem, trial.evaluation.point
    rest, first = point.starts[0], problem.runs[0]
    best, kept = np.inf, None
    for theta in _bodies(problem, point, first.grid.duration):
        start = launch_state(problem.bench, first, theta, rest)
        found = fit_start(problem.bench, first, theta, start, iterations=6, tolerance=1.0, doubted=DOUBTED)
        if found is not None and found[0].cost < best:
            best, kept = found[0].cost, theta
    if kept is None:
        return trial
    starts = tuple(
        launch_state(problem.bench, run, kept, start)
        for run, start in zip(problem.runs, point.starts, strict=True)
    )
    try:
        fitted, _ = solve(problem, replace(point, theta=kept, starts=starts), iterations=STEPS, tolerance=0.5)
    except FloatingPointError:
        return trial
    again = finished(Trial(trial.candidate, problem, fitted, log_evidence(fitted), True))
    return again if again.evidence > trial.evidence else trial

