"""All case studies, one after the other or two at a time, with everything that is asked of each."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, ProcessPoolExecutor, wait
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rig_identification.model.equilibrium import design_pose, find_rest, settle
from rig_identification.model.modes import Mode, natural_modes
from rig_identification.model.motion import rig_model
from rig_identification.thesis.case import Case, load_case
from rig_identification.thesis_rerun.comparison import Comparison, compare
from rig_identification.thesis_rerun.integration import IntegrationCheck, check_integration
from rig_identification.thesis_rerun.motion import CaseMotion, case_elements, fly_case
from rig_identification.thesis_rerun.oddities import odd_statements
from rig_identification.thesis_rerun.output_error import with_noise
from rig_identification.thesis_rerun.patient import Examination, examine
from rig_identification.thesis_rerun.realistic import Realistic, realistic_uncertainty
from rig_identification.thesis_rerun.statics import StaticRerun, rerun_statics
from rig_identification.thesis_rerun.tracking import TrackingComparison, compare_tracking
from rig_identification.thesis_rerun.unknown_force import UnknownForceFit, fit_with_unknown_force
from rig_identification.thesis_rerun.windows import ConvergenceMap, convergence_map
from rig_identification.thesis_rerun.wrench import WrenchAccuracy, wrench_accuracy

Array = NDArray[np.float64]
Progress = Callable[[str, float], None]
Job = tuple[int, str]  # a case's number and variant

#: Part of each motion that is drawn, s, and samples a second.
DRAWN, DRAWN_RATE = 20.0, 50
#: Case whose data case 5 uses, and the case and time, s, on which the trackers are compared.
MAPPED, TRACKED, TRACKED_FOR = 5, 10, 250.0
#: Case that is examined with the thesis' assumptions.
EXAMINED = 14
#: Jobs beside the cases, by labels that no case has.
TRACKERS, PATIENT = (0, "trackers"), (0, "patient")
#: Case on which the thesis checks its own tracker (section 4.1.1).
CHECKED = 1
#: Seed of every simulated noise.
SEED = 0


@dataclass(frozen=True)
class Trace:
    """One quantity of the centre of mass as measured, and as the identified tensors predict it."""

    quantity: str  # "position", "acceleration", "rotational velocity"
    unit: str
    time: Array  # (k,) s
    measured: Array  # (k, 3)
    predicted: dict[str, Array]  # letter of the estimator -> (k, 3)


@dataclass(frozen=True)
class CaseResult:
    """Everything about one case."""

    case: Case
    least_tension: float  # N
    comparison: Comparison
    realistic: Realistic | None
    wrench: WrenchAccuracy | None  # of the preprocessor, with the sensors and doubts of ``realistic``
    unknown_force: UnknownForceFit | None
    windows: ConvergenceMap | None
    integration: IntegrationCheck | None  # chapter 3's tracker, on the case that the thesis checks it on
    modes: tuple[Mode, ...]
    traces: tuple[Trace, ...]
    statements: tuple[str, ...]


@dataclass(frozen=True)
class Rerun:
    """The thesis, rerun."""

    cases: tuple[CaseResult, ...]
    tracking: TrackingComparison | None
    statics: StaticRerun | None  # Table 2.1
    examination: Examination | None = None  # the thesis' assumptions as the ideal model of a session


def rerun_case(case: Case) -> CaseResult:
    """Simulate one case and run every estimator on it."""
    case = with_noise(case)
    motion = fly_case(case)
    comparison = compare(motion)
    unknown = None
    if not case.force_measured:
        unknown = fit_with_unknown_force(motion, case.window)
    windows = convergence_map(motion, comparison.momentum.inertia) if case.number == MAPPED else None
    realistic = realistic_uncertainty(case, SEED)
    integration = check_integration(motion, SEED) if case.number == CHECKED else None
    told = [] if integration is None else [integration.statement]
    told += [] if windows is None else [windows.statement(case.inertia)]
    return CaseResult(
        case,
        motion.least_tension,
        comparison,
        realistic,
        None if realistic is None else wrench_accuracy(motion, realistic.center_std),
        unknown,
        windows,
        integration,
        modes_of(case),
        _traces(motion, comparison),
        (*told, *odd_statements(motion, comparison)),
    )


def modes_of(case: Case) -> tuple[Mode, ...]:
    """Natural modes of a case's body on its rig."""
    model = rig_model(case.rig, case_elements(case))
    rest = find_rest(model, settle(model, design_pose(model)))
    return natural_modes(model, rest.state)


def rerun(cases: tuple[Case, ...], progress: Progress, workers: int = 2, tracking: bool = True) -> Rerun:
    """Every case of ``cases``, ``workers`` processes at a time; progress(what, fraction done).

    tracking: chapters 2 and 3 as well, Table 2.1 and the trackers.
    """
    statics = rerun_statics() if tracking else None
    jobs = [(case.number, case.variant) for case in cases]
    beside = [PATIENT] * any(case.number == EXAMINED for case in cases) + [TRACKERS] * tracking
    # The long ones first, so that no process ends up alone with one of them
    longest = sorted(cases, key=lambda case: -case.duration)
    order = [*beside, *((case.number, case.variant) for case in longest)]
    alone = workers < 2 or len(order) < 2
    found: dict[Job, Any] = dict(
        _in_turn(order, progress) if alone else _side_by_side(order, workers, progress)
    )
    return Rerun(tuple(found[job] for job in jobs), found.get(TRACKERS), statics, found.get(PATIENT))


def _in_turn(jobs: list[Job], progress: Progress) -> Iterator[tuple[Job, Any]]:
    for k, job in enumerate(jobs):
        progress(_name(job), k / len(jobs))
        yield job, _work(job)


def _work(job: Job) -> Any:
    """What a process is given to do."""
    if job == TRACKERS:
        return compare_tracking(load_case(TRACKED), TRACKED_FOR, SEED)
    if job == PATIENT:
        return examine(load_case(EXAMINED), SEED)
    return rerun_case(load_case(*job))


def _name(job: Job) -> str:
    beside = {TRACKERS: "tracker beside integration", PATIENT: "the thesis' assumptions examined"}
    return beside.get(job) or f"case {job[0]}{job[1]}"


def _side_by_side(jobs: list[Job], workers: int, progress: Progress) -> Iterator[tuple[Job, Any]]:
    with ProcessPoolExecutor(workers, mp_context=multiprocessing.get_context("spawn")) as pool:
        try:
            waiting = {pool.submit(_work, job): job for job in jobs}
            while waiting:
                done, _ = wait(waiting, return_when=FIRST_COMPLETED)
                for future in done:
                    job = waiting.pop(future)
                    progress(f"{_name(job)} done", 1.0 - len(waiting) / len(jobs))
                    yield job, future.result()
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def _traces(motion: CaseMotion, comparison: Comparison) -> tuple[Trace, ...]:
    """Position, acceleration, rotational velocity, in the order of the thesis' figures."""
    case = motion.case
    until = min(DRAWN, case.duration)
    tensors = comparison.tensors
    flown = {
        key: fly_case(case, inertia=tensors[key], duration=until) for key in "ad" if _can_fly(tensors[key])
    }
    every = round(1.0 / DRAWN_RATE / float(motion.time[1]))
    nodes = np.arange(0, round(until / float(motion.time[1])) + 1, every)

    def trace(quantity: str, unit: str, attribute: str) -> Trace:
        predicted = {key: getattr(other, attribute)[nodes] for key, other in flown.items()}
        return Trace(quantity, unit, motion.time[nodes], getattr(motion, attribute)[nodes], predicted)

    return (
        trace("position", "m", "center"),
        trace("acceleration", "m/s²", "acceleration"),
        trace("rotational velocity", "rad/s", "rate"),
    )


def _can_fly(inertia: Array) -> bool:
    """Whether a body can move with this tensor at all."""
    return bool(np.isfinite(inertia).all() and np.linalg.eigvalsh(inertia)[0] > 0.0)
