"""A push beside a rotor that the scale did not weigh, told by the wrench that the motion asks for."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_mismatch_push_beside import moved
from test_simulate_identify import shaken

from rig_identification.mismatch.burst import standing_out
from rig_identification.recording import Session
from rig_identification.search.identify import identify
from rig_identification.simulate import simulate_session

ROTOR, PUSH, START, LASTS = 28.0, 150.0, 9.0, 1.2  # kg; N at the peak along the exciter's z; s


@pytest.fixture(scope="module")
def session() -> Session:
    spec = replace(shaken(12, 16.0), effects={"exciter_rotor": (ROTOR,)})
    (run,) = spec.runs
    other = replace(run, name="run_2", holdout=True, duration=12.0)
    made = simulate_session(replace(spec, runs=(run, other)), np.random.default_rng(8))[0]
    recordings = tuple(moved(r, PUSH, START, LASTS) if r.name == "run_1" else r for r in made.recordings)
    return replace(made, recordings=recordings)


def test_rotor_and_push_are_named(session: Session) -> None:
    said: list[str] = []
    mismatch = identify(session, lambda stage, share: said.append(stage)).mismatch
    assert mismatch.verdict == "explained", said[-20:]
    rotor, push = mismatch.findings
    assert (rotor.effect, push.effect) == ("exciter_rotor", "external_force")
    told = rotor.parameters["rotor_mass"]
    assert abs(told["value"] - ROTOR) < 4.0 * told["std"]
    (times,) = push.where["times"]  # type: ignore[misc]
    assert times["recording"] == "run_1"
    assert times["start"] < START + LASTS
    assert times["end"] > START


def test_what_stands_out_for_a_while() -> None:
    rng = np.random.default_rng(2)
    squares = rng.chisquare(6, size=100) / 6.0
    assert standing_out(squares) is None
    squares[40:44] = [30.0, 90.0, 100.0, 25.0]
    assert standing_out(squares) == (40, 44)
    # It comes again
    squares[70] = 60.0
    assert standing_out(squares) is None
    assert standing_out(np.exp(-np.arange(100) / 20.0)) is None
    # A constant beside it, in one piece alone, is less
    squares = np.where(np.arange(100) < 16, 4.0, 0.1)
    squares[50:53] = 100.0
    assert standing_out(squares) == (50, 53)
