"""Where all is quiet at rest and much moves otherwise, what gives way is asked before errors of numbers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from test_simulate_identify import shaken

from rig_identification.estimate.growing import misfit
from rig_identification.estimate.identify import ORDINARY, fit_ideal
from rig_identification.mismatch.hypotheses import catalogue
from rig_identification.mismatch.outcome import Trials
from rig_identification.mismatch.search import trials
from rig_identification.mismatch.standing import short_pieces
from rig_identification.mismatch.trial import VERY_FAR
from rig_identification.recording import Recording, Session
from rig_identification.simulate import simulate_session

#: N/m and kg of a ceiling that yields; m that the IMU is drawn too low.
STIFFNESS, HEAVY = 4e5, 80.0
LOWER = 0.08
#: The same of a ceiling that yields a little, and s by which the first cell is late.
FIRM, HEAVIER, LATE = 3e6, 800.0, 0.0123


def _drawn_lower(session: Session) -> Session:
    """The session with an IMU that its rig's description has lower than it is."""
    imu = session.rig.imu
    assert imu is not None
    drawn = replace(imu, position=imu.position - np.array([0.0, 0.0, LOWER]))
    return replace(session, rig=replace(session.rig, imu=drawn))


def _late(session: Session) -> Session:
    """The session with a load cell whose clock is off."""

    def wrong(recording: Recording) -> Recording:
        name, cell = next(iter(recording.tension.items()))
        late = replace(cell, time=cell.time + LATE)
        return replace(recording, tension={**recording.tension, name: late})

    return replace(session, recordings=tuple(wrong(r) for r in session.recordings))


def _looked(
    effects: dict[str, tuple[float, ...]], wrong: Callable[[Session], Session], stages: list[str]
) -> Trials:
    spec = replace(shaken(14, 10.0), effects=effects, doubts=False)
    made, _ = simulate_session(spec, np.random.default_rng(4))
    problem, evaluation = short_pieces(fit_ideal(wrong(made), lambda stage, share: None)) or (None, None)
    assert problem is not None
    assert evaluation is not None
    assert misfit(evaluation) > VERY_FAR
    return trials(problem, evaluation, catalogue(problem), ORDINARY, stages.append, more=True)


def test_a_ceiling_that_yields_leads_to_an_imu_off_its_place() -> None:
    effects = {"ceiling_compliance.stiffness": (0.0, 0.0, STIFFNESS), "ceiling_compliance.mass": (HEAVY,)}
    stages: list[str] = []
    found = _looked(effects, _drawn_lower, stages)
    assert found.led
    first = found.done[0]
    assert first.candidate.label == "ceiling_compliance ceiling z"
    values = first.problem.bench.parameters.named(first.evaluation.point.theta)
    assert values["ceiling.compliance.z"] == pytest.approx(1.0 / STIFFNESS, rel=0.1)
    assert "from where nothing is bent" not in stages


@pytest.mark.long
def test_what_gives_way_is_seen_once_a_clock_is_right() -> None:
    effects = {"ceiling_compliance.stiffness": (0.0, 0.0, FIRM), "ceiling_compliance.mass": (HEAVIER,)}
    stages: list[str] = []
    found = _looked(effects, _late, stages)
    assert found.led
    assert found.beside
    labels = {found.done[0].candidate.label, found.beside[0].candidate.label}
    assert labels == {"clock_offset cable_1", "ceiling_compliance ceiling z"}
    assert misfit(found.beside[0].evaluation) < 1.05
