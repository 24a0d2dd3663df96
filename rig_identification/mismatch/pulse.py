"""A push as a pulse: one force at one point, for a while, in a run that is otherwise near the noise.

What was pushed swings on otherwise than before, for the rest of the run: so a push far below the noise of a
second shows in the whole run. Half a sine from t to t + d, with a force and a moment that keep their
directions in the world, changes every later sample in proportion to these six numbers, which one pass of
response.py tells for each t and d. With the body, the rig and the starts free beside them (beyond.py), the
best six gain
    1/2 g^T F^-1 g
nats. Only t and d are searched. Another course of the same push, a raised cosine or a rectangle, has the same
momentum, and its peak differs by a few percent.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from rig_identification.estimate.first_guess import extent
from rig_identification.estimate.fitted import Fitted
from rig_identification.estimate.side_by_side import side_by_side
from rig_identification.estimate.solve import Evaluation, Point, Problem, evaluate
from rig_identification.mismatch.beyond import Beyond
from rig_identification.mismatch.findings import pushed
from rig_identification.mismatch.opened import free_without, with_reference
from rig_identification.mismatch.response import whitened_response
from rig_identification.mismatch.riders import middle_of
from rig_identification.mismatch.trial import mass_of
from rig_identification.result import Finding

Array = NDArray[np.float64]

#: Durations (s) that are scanned, each at starts this share of it apart; so many pulses are tried at once.
#: What is shorter or longer has its momentum at much the same time.
DURATIONS, APART, AT_ONCE = (0.5, 1.5), 0.3, 16
#: Prior std of a push, as a share of the body's weight: a hand's, a gust's.
LIKELY = 0.05
#: A push may take up this share of a run.
EVENT_SHARE = 0.4
#: Steps of the simplex that finds start and duration, and the sides of its first triangle: in durations,
#: and in the log of the duration.
STEPS, NUDGE = 60, (0.25, 0.2)
#: Share by which the peak of another course of the same momentum differs.
COURSE = 0.05


@dataclass(frozen=True)
class Pulse:
    """A push of six amplitudes: half a sine over time."""

    recording: str
    start: float  # s after the recording's start
    end: float  # s
    force: Array  # (3,) N at the peak, world
    std: Array  # (3,) N
    gain: float  # nats
    charge: float  # nats: what evidence charges it for what it could have explained, and for the scan
    point: Array  # (3,) m, body: on the line of the force, nearest the body's middle

    @property
    def net(self) -> float:
        """Log Bayes factor, roughly, against no push."""
        return self.gain - self.charge

    def within(self, recording: str, start: float, end: float) -> bool:
        """Whether it is likelier than none, and acts at some time of a stretch (s) of a recording."""
        return self.net > 0.0 and self.recording == recording and self.start < end and start < self.end


def likeliest_pulse(fitted: Fitted) -> Pulse | None:
    """The push that takes most away of what a fit of whole runs leaves, held-out runs included.

    None where nothing can be followed, or what takes most away acts for as good as ever.
    """
    seen = _everything(fitted)
    if seen is None:
        return None
    problem, evaluation = seen
    size = problem.bench.parameters.size
    beyond = Beyond(evaluation, free_without(problem, evaluation.point, evaluation, set(), 0), size)
    mass = mass_of(problem, evaluation)
    weight = LIKELY * mass * problem.bench.rig.gravity
    prior = 1.0 / np.repeat([weight, weight * float(np.max(extent(problem.bench.rig)))], 3) ** 2
    every = [_Pulses(problem, evaluation, beyond, index, prior) for index in range(len(problem.runs))]
    scans = side_by_side(_Pulses.scanned, every)
    pulses, (best, _) = max(zip(every, scans, strict=True), key=lambda found: _gain(found[1][0]))
    if best is None:
        return None
    shot = pulses.polished(best)
    if not pulses.gone(shot):
        return None
    tried = float(np.log(sum(count for _, count in scans)))
    return pulses.told(shot, tried, middle_of(problem.bench.rig))


def _gain(shot: _Shot | None) -> float:
    return 0.0 if shot is None else shot.gain


def all_runs(fitted: Fitted) -> tuple[Problem, Point]:
    """All runs that can be followed, fitted or held out, as one problem, and where the fit has it."""
    problem = replace(fitted.problem, runs=(*fitted.problem.runs, *fitted.holdout_runs))
    starts = (*fitted.evaluation.point.starts, *(held.motion.state(0) for held in fitted.holdouts))
    point = replace(fitted.evaluation.point, starts=starts, latents=())
    return with_reference(problem, fitted.rest), point


def _everything(fitted: Fitted) -> tuple[Problem, Evaluation] | None:
    """All whole runs, fitted or held out, linearised about the fit."""
    problem, point = all_runs(fitted)
    evaluation = evaluate(problem, point)
    return None if evaluation is None else (problem, evaluation)


@dataclass(frozen=True)
class _Shot:
    """A pulse as the scan has it."""

    begin: float  # s after the run's start
    duration: float  # s
    gain: float  # nats
    amounts: Array  # (6,) peak force N and moment N m about the datum, world axes
    information: Array  # (6, 6)


class _Pulses:
    """Pulses in one run of a linearised problem."""

    def __init__(
        self, problem: Problem, evaluation: Evaluation, beyond: Beyond, index: int, prior: Array
    ) -> None:
        self._beyond, self._prior = beyond, prior
        self._index, self._count = index, len(evaluation.runs)
        self._run, self._own = problem.runs[index], evaluation.runs[index]
        self._turned = self._own.motion.R_world_body.transpose(0, 2, 1)
        self._time = self._run.grid.step * (np.arange(self._turned.shape[0]) + 0.5)

    def scanned(self) -> tuple[_Shot | None, int]:
        """The best pulse of the scan, and how many there were."""
        length = self._run.grid.duration
        pulses = [
            (float(begin), duration)
            for duration in DURATIONS
            for begin in np.arange(0.0, length - duration, APART * duration)
        ]
        best: _Shot | None = None
        for first in range(0, len(pulses), AT_ONCE):
            for shot in self._shots(pulses[first : first + AT_ONCE]):
                best = shot if best is None or shot.gain > best.gain else best
        return best, len(pulses)

    def polished(self, shot: _Shot) -> _Shot:
        """The same with start and duration as fit best."""
        x = np.array([shot.begin, np.log(shot.duration)])
        nudges = np.diag([NUDGE[0] * shot.duration, NUDGE[1]])

        def at(x: Array) -> _Shot:
            return self._shots([(float(x[0]), float(np.exp(x[1])))])[0]

        found = minimize(
            lambda x: -at(x).gain,
            x,
            method="Nelder-Mead",
            options={
                "maxfev": STEPS,
                "initial_simplex": x + np.vstack([np.zeros(2), nudges]),
                "xatol": 1e-3,
                "fatol": 0.1,
            },
        )
        return max(at(found.x), shot, key=lambda s: s.gain)

    def gone(self, shot: _Shot) -> bool:
        """Whether a shot acts for a while within its run and is gone: what does not is no push."""
        length = self._run.grid.duration
        within = shot.begin > 0.0 and shot.begin + shot.duration < length
        return within and shot.duration < EVENT_SHARE * length

    def told(self, shot: _Shot, trials: float, middle: Array) -> Pulse:
        """A shot in the recording's words. trials: log of how many were tried. middle: (3,) m, body."""
        at = int(np.clip((shot.begin + 0.5 * shot.duration) / self._run.grid.step, 0, self._time.size - 1))
        force, moment = (self._turned[at] @ part for part in (shot.amounts[:3], shot.amounts[3:]))
        about = moment - np.cross(middle, force)
        point = middle + np.cross(force, about) / max(float(force @ force), 1e-12)
        scaled = shot.information / np.sqrt(np.outer(self._prior, self._prior))
        charge = 0.5 * float(np.linalg.slogdet(np.eye(6) + scaled)[1])
        start = self._run.offset + shot.begin
        return Pulse(
            self._run.recording.name,
            float(start),
            float(start + shot.duration),
            shot.amounts[:3],
            np.sqrt(np.diag(np.linalg.inv(shot.information + np.diag(self._prior))))[:3],
            shot.gain,
            charge + trials,
            point,
        )

    def _shots(self, pulses: Sequence[tuple[float, float]]) -> list[_Shot]:
        """Pulses (begin s, duration s) with the amplitudes that fit best."""
        wrenches = np.zeros((self._time.size, 6, 6 * len(pulses)))
        for i, (begin, duration) in enumerate(pulses):
            phase = (self._time - begin) / duration
            course = np.sin(np.pi * np.clip(phase, 0.0, 1.0))[:, None, None] * self._turned
            wrenches[:, :3, 6 * i : 6 * i + 3] = course
            wrenches[:, 3:, 6 * i + 3 : 6 * i + 6] = course
        own = whitened_response(self._own, wrenches)
        columns = self._beyond.of([own if i == self._index else None for i in range(self._count)])
        out = []
        for i, (begin, duration) in enumerate(pulses):
            six = slice(6 * i, 6 * i + 6)
            part = columns.part(six)
            information = part.information([own[:, six]])
            amounts = np.asarray(np.linalg.solve(information + np.diag(self._prior), part.right), float)
            out.append(_Shot(begin, duration, 0.5 * float(part.right @ amounts), amounts, information))
        return out


def pulse_finding(pulse: Pulse) -> Finding:
    """A push in words and numbers, without evidence."""
    stds = np.hypot(pulse.std, COURSE * np.abs(pulse.force))
    beside = "No motion tells where along its line it acts. "
    return pushed(pulse.recording, pulse.start, pulse.end, pulse.force, stds, pulse.point, beside)
