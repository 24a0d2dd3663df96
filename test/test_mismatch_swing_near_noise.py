"""Laws that damp a watched swing and hardly differ in pieces are told apart by whole runs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rig_identification.estimate.first_guess import rest_of
from rig_identification.estimate.fitted import Fitted
from rig_identification.estimate.growing import NEAR_SQUARE, misfit
from rig_identification.estimate.identify import pose_problem
from rig_identification.estimate.launch import launch_states
from rig_identification.estimate.parameters import INERTIAL
from rig_identification.estimate.prediction import model_at
from rig_identification.estimate.solve import Evaluation, Point, Problem, evaluate, solve
from rig_identification.estimate.whole import predicted
from rig_identification.mismatch.budget import UNLIMITED
from rig_identification.mismatch.candidate import Candidate
from rig_identification.mismatch.left_out_physics import left_out_physics
from rig_identification.mismatch.opened import extended
from rig_identification.mismatch.swing_effects import Choice
from rig_identification.mismatch.swing_near_noise import near_noise_models
from rig_identification.mismatch.swing_whole import Whole, likeliest
from rig_identification.mismatch.threads import physics_of_pendulums
from rig_identification.mismatch.trial import Trial
from rig_identification.rig import DEFAULT_TOLERANCE, Cable, Mount, Rig
from rig_identification.simulate import Posed, RunSpec, SampleRates, SessionSpec, simulate_session

BODY = np.array([1.1, 0.0, 0.0, -0.08, 0.05, 0.0, 0.0, 0.04, 0.0, 0.075])
#: N m s/rad of each hinge, which is all that damps.
DAMPING = 0.004
LINEAR, SQUARE = "hinge.damping", "air.plates_y"


class Turning:
    """A turn of half a radian that linear damping stops, read by a poor gyroscope, and models of it."""

    def __init__(self) -> None:
        cables = tuple(
            Cable(f"cable_{i + 1}", np.array([x, 0.0, 0.0]), np.array([x, 0.0, 0.0]), 1.5)
            for i, x in enumerate((-0.25, 0.25))
        )
        rig = Rig(
            9.80665,
            cables,
            1.1,
            0.002,
            imu=Mount(np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0])),
            noise={"angular_rate": 0.05, "specific_force": 0.5},
            tolerance=dict(DEFAULT_TOLERANCE),
        )
        start = Posed(np.array([0.0, 0.0, -1.49]), Rotation.from_rotvec([0.0, 0.0, 0.5]).as_quat())
        spec = SessionSpec(
            "turning",
            rig,
            BODY,
            (RunSpec("run_1", 30.0, start), RunSpec("run_2", 15.0, start, holdout=True)),
            rates=SampleRates(0.0, 0.0, 0.0, 20.0, 0.0, 0.0, 0.0),
            effects={"hinge_damping": (DAMPING,)},
        )
        session = simulate_session(spec, np.random.default_rng(4))[0]
        self.bare, _, self.held = pose_problem(session)
        parameters = self.bare.bench.parameters
        theta = np.concatenate([parameters.start(BODY)[:INERTIAL], np.zeros(parameters.size - INERTIAL)])
        self.rest = rest_of(model_at(parameters, theta))
        self.point = Point(theta, launch_states(self.bare.bench, self.bare.runs, theta, self.rest), ())
        every = [*left_out_physics(rig, parameters, 1.1), *physics_of_pendulums(rig, 1.1)]
        self.laws = {c.parameters[0].name: c for c in every if c.parameters[0].name in (LINEAR, SQUARE)}

    def begun(self, law: Candidate) -> tuple[Problem, Evaluation]:
        """A model with one law of next to no amount, at the true body."""
        problem = extended(self.bare, (law,))
        theta = np.concatenate([self.point.theta, [1e-3], np.zeros(len(law.parameters) - 1)])
        evaluation = evaluate(problem, replace(self.point, theta=theta))
        assert evaluation is not None
        return problem, evaluation

    def choice(self, name: str, behind: float) -> Choice:
        """Pieces chose the law ``name``; the other one trails by so many nats."""
        laws = [self.laws[name], *(law for other, law in self.laws.items() if other != name)]
        alone = tuple(Trial(law, *self.begun(law), -behind * k) for k, law in enumerate(laws))
        return Choice((laws[0],), (), tuple(laws), alone)

    def fitted(self, name: str, behind: float = 3.0) -> Whole:
        """Whole runs with the law ``name``."""
        problem, begun = self.begun(self.laws[name])
        return Whole(self.choice(name, behind), problem, *solve(problem, begun.point, tolerance=0.1))

    def predicted(self, model: Whole) -> Fitted:
        """A model and what it predicts of the held-out run."""
        runs, held, lost = predicted(model.problem, self.held, model.evaluation.point.theta, self.rest)
        assert not lost
        return Fitted(model.problem, model.evaluation, model.converged, self.rest, runs, held)

    def likeliest(self, first: Whole) -> Whole | None:
        return likeliest(
            near_noise_models(self.bare, first, self.rest, UNLIMITED), self.ideal, self.predicted
        )

    @property
    def ideal(self) -> Fitted:
        """Whole runs without any effect, and what that makes of the held-out run."""
        evaluation, converged = solve(self.bare, self.point, iterations=5)
        return self.predicted(Whole(self.choice(LINEAR, 3.0), self.bare, evaluation, converged))


@pytest.fixture(scope="module")
def turning() -> Turning:
    return Turning()


@pytest.mark.long
def test_whole_runs_choose_the_law_that_pieces_could_not_tell(turning: Turning) -> None:
    wrong = turning.fitted(SQUARE)
    assert misfit(wrong.evaluation) < NEAR_SQUARE
    found = turning.likeliest(wrong)
    assert found is not None
    assert found.choice.labels == (LINEAR,)
    parameters = found.problem.bench.parameters
    told = parameters.named(found.evaluation.point.theta)[LINEAR]
    assert told == pytest.approx(DAMPING, rel=0.3)


@pytest.mark.long
def test_the_law_that_is_there_stays(turning: Turning) -> None:
    found = turning.likeliest(turning.fitted(LINEAR))
    assert found is not None
    assert found.choice.labels == (LINEAR,)


def test_nothing_more_is_asked_far_from_the_noise(turning: Turning) -> None:
    problem, begun = turning.begun(turning.laws[SQUARE])
    assert misfit(begun) > NEAR_SQUARE
    first = Whole(turning.choice(SQUARE, 3.0), problem, begun, converged=False)
    assert near_noise_models(turning.bare, first, turning.rest, UNLIMITED) == [first]
