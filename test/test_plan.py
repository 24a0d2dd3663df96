"""A plan: what it expects is what the estimator's own matrices say, and its runs keep their limits."""

from __future__ import annotations

import csv
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rig_identification.cli.main import main
from rig_identification.errors import InputError
from rig_identification.estimate.identify import pose_problem
from rig_identification.estimate.observability import elements_covariance
from rig_identification.estimate.parameters import INERTIAL
from rig_identification.estimate.prediction import model_at
from rig_identification.estimate.solve import Evaluation, Point, Problem, evaluate
from rig_identification.model.body import can_exist
from rig_identification.plan import Means, Plan, box, plan
from rig_identification.plan.choose import Choice, choose, merit, worst
from rig_identification.plan.doubts import _beyond, _wide
from rig_identification.plan.information import (
    LEFT_AT_REST,
    Laboratory,
    informations,
    laboratory,
    recorded,
)
from rig_identification.plan.limits import within_limits
from rig_identification.plan.menu import Item, bare, frequencies, menu
from rig_identification.plan.planning import session_of
from rig_identification.plan_report import plan_document, render_plan, session_text, write_commands
from rig_identification.result import ELEMENTS
from rig_identification.rig import Cable, Mount, Rig
from rig_identification.session.exciter_commands import read_commands
from rig_identification.session.session_description import read_session_description
from rig_identification.simulate import (
    Multisine,
    Pulled,
    RunSpec,
    SampleRates,
    SessionSpec,
    UnbalancedMass,
    simulate_session,
)
from rig_identification.simulate.start import rest_state

LEVEL = np.array([0.0, 0.0, 0.0, 1.0])
RATES = SampleRates(tension=50.0, exciter=100.0, shaft=0.0, imu=50.0, inclinometer=25.0, ground_truth=0.0)
BODY = np.array([110.0, 0.5, 0.45, -0.4, 9.0, 0.3, -0.2, 12.0, 0.4, 15.0])
NOISE = {
    "tension": 0.5,
    "exciter_force": 0.2,
    "specific_force": 0.01,
    "angular_rate": 0.0003,
    "inclination": 0.0003,
}


@pytest.fixture(scope="module")
def rig() -> Rig:
    """Three inclined cables: three degrees of freedom."""
    hinges = np.array([[0.0, 0.0, 0.0], [1.0, 0.05, 0.0], [0.45, 1.1, 0.0]])
    middle = hinges.mean(axis=0)
    ceiling = middle + 1.4 * (hinges - middle) + [0.0, 0.0, 1.6]
    cables = tuple(
        Cable(f"cable_{i + 1}", ceiling[i], hinges[i], float(np.linalg.norm(ceiling[i] - hinges[i])))
        for i in range(3)
    )
    return Rig(
        gravity=9.80665,
        cables=cables,
        mass=110.0,
        mass_std=0.05,
        imu=Mount(np.array([0.4, 0.5, -0.2]), LEVEL),
        inclinometer=Mount(np.zeros(3), LEVEL),
        exciter=Mount(np.array([0.2, 0.3, -0.5]), LEVEL),
        noise=NOISE,
    )


@pytest.fixture(scope="module")
def spec(rig: Rig) -> SessionSpec:
    return SessionSpec("plan", rig, BODY, rates=RATES, noise=False, doubts=False)


def release(seconds: float = 4.0) -> Item:
    pull = Pulled(np.array([30.0, 45.0, 0.0]), BODY[1:4] + np.array([0.2, 0.1, 0.0]))
    motor = UnbalancedMass(30.0 / (2.0 * np.pi * 0.8) ** 2, 0.8, "xy", ramp=1.0)
    return Item("release", "pull and let go", RunSpec("release", seconds, pull, motor))


@pytest.fixture(scope="module")
def lab(spec: SessionSpec) -> Laboratory:
    return laboratory(spec, release())


def linearised(
    spec: SessionSpec, item: Item, effects: dict[str, tuple[float, ...]] | None = None
) -> tuple[Problem, Evaluation]:
    """The estimator's own linearisation of a session of one run and one rest, at the truth.

    Both are recorded as the plan records them, each by itself: devices then sample at the same instants.
    """
    sessions, starts = [], {}
    for one in (bare(Means(rest=4.0)), item):
        session, found = recorded(replace(spec, effects=effects or {}), [one])
        sessions.append(session)
        starts |= found
    whole = replace(sessions[0], recordings=tuple(r for s in sessions for r in s.recordings))
    problem, _, _ = pose_problem(whole)
    theta = problem.bench.parameters.start(spec.elements)
    rest = rest_state(model_at(problem.bench.parameters, theta))
    point = Point(theta, tuple(starts[r.recording.name] for r in problem.runs), (rest,) * len(problem.rests))
    found_there = evaluate(problem, point)
    assert found_there is not None
    return problem, found_there


def test_a_box_is_a_body(rig: Rig) -> None:
    elements = box(rig, 12.0, np.array([1.0, 2.0, 3.0]))
    assert elements[4:] == pytest.approx([13.0, 0.0, 0.0, 10.0, 0.0, 5.0])
    assert elements[3] == pytest.approx(-1.5)
    assert can_exist(elements)


def test_a_multisine_keeps_its_limit() -> None:
    force = Multisine(40.0, (0.4, 0.9, 1.7), ramp=2.0)(np.linspace(0.0, 30.0, 3001))
    assert np.max(np.abs(force)) <= 40.0
    assert np.all(force[0] == 0.0)
    assert np.all(np.std(force, axis=0) > 8.0)


def test_information_is_the_estimators_own(spec: SessionSpec, lab: Laboratory) -> None:
    """One run and one rest: priors and both parts add up to the posterior of a fit to both."""
    problem, evaluation = linearised(spec, release())
    motion, rest = informations(lab, [release(), bare(Means(rest=4.0))])
    assert motion is not None
    assert rest is not None
    expected = lab.expected(lab.prior + motion + rest / LEFT_AT_REST)
    own = np.sqrt(np.diag(elements_covariance(problem, evaluation)))
    assert np.sqrt(np.diag(expected.covariance)) == pytest.approx(own, rel=1e-6)


def test_twice_the_time_tells_at_most_twice_as_much(lab: Laboratory) -> None:
    (motion,) = informations(lab, [release()])
    assert motion is not None
    once = np.diag(lab.expected(lab.prior + motion).covariance)
    twice = np.diag(lab.expected(lab.prior + 2.0 * motion).covariance)
    assert np.all(twice < once)
    assert np.all(twice > 0.5 * once * (1.0 - 1e-6))


def test_runs_are_weakened_until_they_keep_their_limits(spec: SessionSpec) -> None:
    means = Means(travel=0.03)
    limited = within_limits(spec, release(), means)
    assert limited is not None
    item, margins = limited
    assert margins.travel <= 0.03
    assert margins.tension >= means.taut
    assert 0.05 < margins.amplitude < 1.0
    again = within_limits(spec, item, means)
    assert again is not None
    assert again[1].amplitude == 1.0
    assert again[1].travel == pytest.approx(margins.travel)
    assert within_limits(spec, release(), Means(travel=1e-5)) is None


def test_shakes_stay_away_from_where_the_body_swings(rig: Rig) -> None:
    from rig_identification.model.modes import natural_modes
    from rig_identification.model.motion import rig_model

    model = rig_model(rig, BODY)
    swings = [m.frequency for m in natural_modes(model, rest_state(model))]
    asked = frequencies(rig, BODY, Means(highest=3.0))
    assert asked
    assert all(max(f / s, s / f) > 1.2 for f in asked for s in swings)
    names = [item.name for item in menu(rig, BODY, Means(exciter="shaker"))]
    assert "multisine" in names
    assert len(names) == len(set(names))


def test_the_choice_serves_the_element_that_is_known_worst(lab: Laboratory) -> None:
    """Of two runs the one is taken that tells of what is known worst, and no second one of those at rest."""
    (motion,) = informations(lab, [release()])
    assert motion is not None
    base = Choice(release(), motion)
    relative = np.sqrt(np.diag(lab.expected(lab.prior + motion).covariance))
    assert merit(0.5 * relative, ELEMENTS) < merit(relative, ELEMENTS)
    weak = Choice(replace(release(), name="weak"), 0.01 * motion)
    still = Choice(bare(Means(rest=4.0)), np.zeros_like(motion))
    chosen = choose(lab, [weak, base, still], seconds=17.0, most=100.0, first=[still])
    assert chosen.blocks() == {"static_bare": 1, "release": 3}
    shares = [worst(step.relative, chosen.determined) for step in chosen.steps]
    assert shares == sorted(shares, reverse=True)
    short = choose(lab, [weak, base, still], seconds=100.0, most=8.0, first=[still])
    assert short.blocks()["release"] == 2


def test_a_bias_is_what_an_effect_does_to_a_fit(spec: SessionSpec, lab: Laboratory) -> None:
    """Hinges that damp a little, left out of the model: the fit's first step moves as told."""
    problem, evaluation = linearised(spec, release(), {"hinge_damping": (0.02,)})
    _, ideal = linearised(spec, release())
    step = np.linalg.solve(ideal.information, evaluation.gradient - ideal.gradient)
    map_ = problem.bench.parameters.elements_jacobian(evaluation.point.theta)
    moved = map_ @ step[:INERTIAL]
    candidates, wide = _wide(lab, [release()])
    parts = informations(wide, [release(), bare(Means(rest=4.0))])
    assert all(part is not None for part in parts)
    total = wide.prior + parts[0] + parts[1] / LEFT_AT_REST  # type: ignore[operator]
    damping = next(b for b in _beyond(lab, wide, total, candidates) if b.candidate.effect == "hinge_damping")
    told = damping.bends[:, 0] * 0.02 / damping.units[0]
    std = np.sqrt(np.diag(elements_covariance(problem, ideal)))
    assert np.max(np.abs(told / std)) > 0.01
    assert told / std == pytest.approx(moved / std, rel=0.05, abs=0.02 * np.max(np.abs(moved / std)))
    gained = 0.5 * float(damping.F[0, 0]) * (0.02 / damping.units[0]) ** 2
    left = evaluation.cost - ideal.cost - 0.5 * float(step @ ideal.information @ step)
    assert gained == pytest.approx(left, rel=0.1)


@pytest.fixture(scope="module")
def planned(rig: Rig) -> Plan:
    return plan(replace(rig, exciter=None), BODY, Means(minutes=0.7, rest=3.0, rates=RATES))


def test_a_plan_is_within_its_time_and_held_out(planned: Plan) -> None:
    assert sum(p.item.seconds for p in planned.recordings) <= 42.0
    roles = [p.role for p in planned.recordings]
    assert roles.count("held out") == 1
    assert "fitted" in roles
    assert planned.worst < 1.0
    for planned_one in planned.recordings:
        assert planned_one.margins.travel <= planned.means.travel
        assert planned_one.margins.tension >= planned.means.taut
    session, _ = simulate_session(session_of(planned), np.random.default_rng(1))
    assert len(session.holdouts) == 1


def test_what_is_undecided_widens(planned: Plan) -> None:
    assert planned.doubts is not None
    wider = np.diag(planned.expected.covariance) / np.diag(planned.alone)
    assert np.all(wider > 1.0 - 1e-9)
    sizes = [bias.in_sigma for bias in planned.doubts.biases]
    assert sizes == sorted(sizes, reverse=True)
    assert {"hinge_damping", "cable_mass", "ceiling_compliance"} <= {b.effect for b in planned.doubts.biases}


def test_the_files_of_a_plan_are_read_back(planned: Plan, tmp_path: Path) -> None:
    (tmp_path / "session.yaml").write_text(session_text(planned, "rig.yaml"))
    described = read_session_description(tmp_path)
    assert [e.name for e in described.entries] == [p.item.name for p in planned.recordings]
    assert sum(e.holdout for e in described.entries) == 1
    document = json.loads(json.dumps(plan_document(planned), allow_nan=False))
    assert document["recordings"][-1]["role"] == "held out"
    assert set(document["expected_std"]) == set(ELEMENTS)
    page = render_plan(planned)
    assert page.count("<svg") == len(ELEMENTS)
    assert planned.recordings[-1].item.name in page


def test_the_exciters_commands_are_its_force(planned: Plan, tmp_path: Path) -> None:
    shaken = replace(planned.recordings[-1], item=release(2.0))
    write_commands(replace(planned, recordings=(shaken,)), tmp_path / "exciter.csv")
    rows = list(csv.DictReader((tmp_path / "exciter.csv").read_text(encoding="utf-8").splitlines()))
    assert len(rows) == 100
    force = release().run.force(np.array([1.0]))  # type: ignore[union-attr]
    assert float(rows[50]["force_x_N"]) == pytest.approx(force[0, 0], rel=1e-3)
    assert float(rows[-1]["speed_hz"]) == pytest.approx(0.8)
    (read,) = read_commands(tmp_path / "exciter.csv").values()
    assert read.time == pytest.approx(np.arange(100) / 50.0)
    assert read.values == pytest.approx(release().run.force(read.time), rel=1e-3, abs=1e-3)  # type: ignore[union-attr]


def test_what_cannot_be_planned_is_refused(rig: Rig) -> None:
    with pytest.raises(InputError, match=r"--minutes 0\.2"):
        plan(rig, BODY, Means(minutes=0.2))
    with pytest.raises(InputError, match=r"noise\.tension"):
        plan(replace(rig, noise={}), BODY, Means())


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--box", "1", "1", "1", "--minutes", "0"], "--minutes 0"),
        (["--box", "1", "-1", "1"], "--box"),
        (["--body", "1", *"000", "1", "0", "0", "1", "0", "9"], "no body"),
        (["--body", "1", *"000", "1", "0", "0", "1", "0", "1", "--mass", "3"], "--mass: belongs to --box"),
        ([], "--box"),
    ],
)
def test_the_command_refuses_in_a_line(
    options: list[str], message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    description = Path(__file__).parents[1] / "config" / "car_four_cables.yaml"
    arguments = ["plan", str(description), "--out", str(tmp_path / "out"), *options]
    try:
        status = main(arguments)
    except SystemExit as left:
        status = int(left.code or 0)
    told = capsys.readouterr().err
    assert status == 2
    assert message in told
    assert told.count("\n") == 1
    assert not (tmp_path / "out").exists()
