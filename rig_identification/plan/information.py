"""What a recording would tell: the estimator's own linearisation about a simulated run without noise.

Runs are simulated by the forward model as described, prepared as recordings are, and linearised where the
body is known. Each gives an information matrix on what all recordings share, its own start state integrated
out. Information adds up over recordings, and what a session would tell is a sum with the priors.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from rig_identification.errors import InputError
from rig_identification.estimate.identify import pose_problem, runs_of
from rig_identification.estimate.observability import inertial_estimate
from rig_identification.estimate.prediction import linearise_run, model_at
from rig_identification.estimate.rest_evidence import (
    BLOCKS,
    RestEvidence,
    linearise_rest,
    prepare_rest,
    with_dummy,
)
from rig_identification.estimate.side_by_side import side_by_side
from rig_identification.estimate.solve import Evaluation, Point, Problem, evaluate
from rig_identification.model.motion import State, redundant
from rig_identification.model.sensors import MocapMount
from rig_identification.plan.before import Known
from rig_identification.plan.menu import Item
from rig_identification.recording import Recording, Session
from rig_identification.result import InertialEstimate
from rig_identification.simulate import SessionSpec, simulate_session
from rig_identification.simulate.start import rest_state

Array = NDArray[np.float64]

#: A mean at rest counts with the larger of its samples' variance and what the scatter of BLOCKS block means
#: shows (rest_evidence.mean_variance). Of white noise that scatter is chi-square with BLOCKS - 1 degrees of
#: freedom over them; on average over it, 1 / max(1, x) of the information is left.
_DRAWS = chi2.ppf((np.arange(1000) + 0.5) / 1000.0, BLOCKS - 1) / (BLOCKS - 1)
LEFT_AT_REST = float(np.mean(1.0 / np.maximum(1.0, _DRAWS)))


@dataclass(frozen=True)
class Laboratory:
    """A session's problem without its recordings, and where it is linearised: everything as described."""

    spec: SessionSpec  # without runs
    problem: Problem  # without runs and rests
    theta: Array
    shown: Item  # a run in which every device that records is seen
    probed: int = 0  # states, the last of every run's, that stay where they are (mismatch/supports.py)
    known: Known | None = None  # what an earlier session told

    @property
    def size(self) -> int:
        """Number of what all recordings share."""
        return self.problem.bench.parameters.size

    @cached_property
    def prior(self) -> Array:
        """(p, p) information of tolerances, ground scale, and what is believed of any body."""
        there = evaluate(self.problem, Point(self.theta, (), ()))
        if there is None:
            raise AssertionError("nothing is predicted")
        return there.information

    @cached_property
    def before(self) -> Array:
        """(p, p) information that is there before anything is recorded: priors, and an earlier session's."""
        if self.known is None:
            return self.prior
        return np.asarray(self.prior + self.known.on(self.problem.bench.parameters, self.theta))

    def expected(self, information: Array) -> InertialEstimate:
        """The ten numbers as an estimate with this information (p, p), priors included, would tell them."""
        return inertial_estimate(self.problem, self.evaluation(information))

    def evaluation(self, information: Array) -> Evaluation:
        """Such an estimate, at its optimum."""
        point, size = Point(self.theta, (), ()), information.shape[0]
        return Evaluation(point, (), (), 0.0, information, np.diag(self.prior).copy(), np.zeros(size))


def laboratory(spec: SessionSpec, first: Item, known: Known | None = None) -> Laboratory:
    """The problem of a session of the rig and body of ``spec``. first: any run of it. known: from before.

    Raises InputError where the rig is held by more cables than the model can share a load among.
    """
    if redundant(spec.rig):
        raise InputError(
            "rig: more cables hold the body than it takes, and no description says how they share the load; "
            "plan with three or four of them"
        )
    spec = replace(spec, runs=(), statics=(), noise=False, doubts=False)
    session, _ = recorded(spec, [first])
    problem, _, _ = pose_problem(session)
    bench = replace(problem.bench, mocap=_tracker(spec) if spec.rates.mocap > 0.0 else None)
    problem = replace(problem, bench=bench, runs=(), rests=())
    return Laboratory(spec, problem, problem.bench.parameters.start(spec.elements), first, known=known)


def _tracker(spec: SessionSpec) -> MocapMount:
    """How the simulated tracker stands, which a fit finds."""
    marker = spec.rig.mocap
    return MocapMount(
        np.zeros(3) if marker is None else marker.position,
        np.eye(3) if marker is None else Rotation.from_quat(marker.orientation).as_matrix(),
        spec.world_in_tracker.position,
        Rotation.from_quat(spec.world_in_tracker.orientation).as_matrix(),
    )


def recorded(spec: SessionSpec, items: Sequence[Item]) -> tuple[Session, dict[str, State]]:
    """A session of ``items`` as it would be recorded without noise; start states by name."""
    runs = tuple(item.run for item in items if item.run is not None)
    statics = tuple(item.static for item in items if item.static is not None)
    session, truth = simulate_session(replace(spec, runs=runs, statics=statics), np.random.default_rng(0))
    return session, dict(truth.starts)


def informations(lab: Laboratory, items: Sequence[Item]) -> list[Array | None]:
    """(p, p) what each item tells of what all recordings share; None where it cannot be recorded."""
    return side_by_side(lambda item: _information(lab, item), items)


def _information(lab: Laboratory, item: Item) -> Array | None:
    try:
        session, starts = recorded(lab.spec, [item])
    except InputError:
        return None
    (recording,) = session.recordings
    if item.static is not None:
        return _at_rest(lab, recording)
    return _in_motion(lab, recording, starts[recording.name])


def _at_rest(lab: Laboratory, recording: Recording) -> Array | None:
    evidence: RestEvidence = prepare_rest(lab.spec.rig, recording)
    if not evidence.channels:
        return np.zeros((lab.size, lab.size))
    model = with_dummy(model_at(lab.problem.bench.parameters, lab.theta), evidence.dummy)
    rest = linearise_rest(lab.problem.bench, evidence, lab.theta, rest_state(model))
    return None if rest is None else np.asarray(LEFT_AT_REST * rest.jacobian.T @ rest.jacobian)


def _in_motion(lab: Laboratory, recording: Recording, start: State) -> Array | None:
    total = np.zeros((lab.size, lab.size))
    for run in runs_of(lab.spec.rig, (recording,)):
        linearised = linearise_run(lab.problem.bench, run, lab.theta, start)
        if linearised is None:
            return None
        shared, own = linearised.jacobian[:, : lab.size], linearised.jacobian[:, lab.size :]
        own = own[:, : own.shape[1] - lab.probed]
        basis, _ = np.linalg.qr(own)
        # What its start state, which nothing else tells, could as well account for
        shared = shared - basis @ (basis.T @ shared)
        total += shared.T @ shared
    return total
