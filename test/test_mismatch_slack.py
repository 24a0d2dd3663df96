"""A cable that carries nothing says so itself."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_estimate_prediction import recorded
from test_model_rigs import random_sample

from rig_identification.estimate.evidence import Run, heard_apart, prepare
from rig_identification.mismatch.slack import (
    Spell,
    blows,
    comes_after,
    quietened,
    shocks,
    slack_finding,
    slack_spells,
    taut_stretches,
)
from rig_identification.result import Finding, Mismatch


def _found(verdict: str, *effects: str) -> Mismatch:
    return Mismatch(verdict, "", tuple(Finding(effect, {}, {}, {}, "") for effect in effects), ())  # type: ignore[arg-type]


def test_what_makes_a_cable_slack_is_told_before_the_slack() -> None:
    both, none = {"taken": 7e9, "left_out": 12e9}, {"taken": 5.0, "left_out": 1e3}
    assert comes_after(_found("explained", "cable_elasticity"), **both, fails=True)
    assert comes_after(_found("unexplained", "cable_elasticity", "unknown"), **both, fails=True)
    # Where every cable pulls next to nothing is left: what was found there stands beside the slack
    assert not comes_after(_found("explained", "imu_bias"), **none, fails=False)
    assert comes_after(_found("explained", "imu_bias"), taken=2e3, left_out=1e3, fails=False)
    assert not comes_after(_found("unexplained", "unknown"), **both, fails=True)
    assert not comes_after(_found("explained"), **both, fails=True)


@pytest.fixture(scope="module")
def run() -> Run:
    session, _ = recorded(random_sample(3, 3), seed=4, duration=8.0)
    return prepare(session.rig, session.training[0])


def _with_nothing(run: Run, start: float, end: float) -> Run:
    channels = []
    for c in run.channels:
        values = c.values.copy()
        if c.quantity == "tension" and c.device == run.channels[0].device:
            loose = (c.time >= start) & (c.time <= end)
            values[loose] = c.noise * np.random.default_rng(1).normal(size=(int(loose.sum()), 1))
        channels.append(replace(c, values=values))
    return replace(run, channels=tuple(channels))


def test_a_taut_run_has_no_spells(run: Run) -> None:
    assert slack_spells(run, 3.0) == []
    assert [part.grid.nodes for part in taut_stretches(run, [])] == [run.grid.nodes]


def test_a_spell_is_found_and_cut_out(run: Run) -> None:
    loose = _with_nothing(run, 3.0, 3.4)
    (spell,) = slack_spells(loose, 3.0)
    assert spell.cable == run.channels[0].device
    assert spell.start == pytest.approx(3.0, abs=0.02)
    assert spell.end == pytest.approx(3.4, abs=0.02)
    before, after = taut_stretches(loose, [spell])
    assert before.offset == 0.0
    assert before.grid.duration < 3.0 < 3.4 < after.offset
    finding = slack_finding([spell])
    assert finding.effect == "cable_slack"
    assert finding.where["channel"] == spell.cable


def test_a_cable_that_hangs_loose_half_the_time_is_heard_where_it_is_quiet(run: Run) -> None:
    """It snaps so often that the noise of its own run hides that it carries nothing."""
    loose = _with_nothing(run, 1.0, 6.0)
    loud = replace(loose, channels=(replace(loose.channels[0], noise=np.array([60.0])), *loose.channels[1:]))
    assert slack_spells(loud, 3.0) == []
    at_rest = replace(run, recording=replace(run.recording, name="quiet"))
    (spell,) = slack_spells(quietened((loud, at_rest), ())[0], 3.0)
    assert spell.end - spell.start == pytest.approx(5.0, abs=0.05)


def test_a_taut_stretch_has_the_noise_of_its_own_samples(run: Run) -> None:
    session, _ = recorded(random_sample(3, 3), seed=4, duration=8.0)
    c = run.channels[0]
    loud = replace(run, channels=(replace(c, noise=30.0 * c.noise), *run.channels[1:]))
    (own,) = heard_apart(session.rig, loud).channels[0].noise
    assert own == pytest.approx(session.rig.noise["tension"])


def test_a_rod_that_pushes_is_not_slack(run: Run) -> None:
    """It passes through nothing on its way, and stays below it for longer."""
    c = run.channels[0]
    swing = 300.0 + 400.0 * np.sin(2.0 * np.pi * 0.7 * c.time)[:, None]
    assert slack_spells(replace(run, channels=(replace(c, values=swing), *run.channels[1:])), 3.0) == []
    # A rope on the same body stops at nothing
    rope = np.maximum(swing, 0.0)
    assert slack_spells(replace(run, channels=(replace(c, values=rope), *run.channels[1:])), 3.0)


def test_a_glitch_is_no_spell(run: Run) -> None:
    step = float(np.median(np.diff(run.channels[0].time)))
    assert slack_spells(_with_nothing(run, 3.0, 3.0 + 1.5 * step), 3.0) == []


def test_a_snap_between_two_samples_is_a_shock(run: Run) -> None:
    assert shocks(run) == []
    channels = list(run.channels)
    c = channels[0]
    values, at = c.values.copy(), int(np.searchsorted(c.time, 5.0))
    values[at] += 300.0
    channels[0] = replace(c, values=values)
    (shock,) = shocks(replace(run, channels=tuple(channels)))
    assert shock.cable == c.device
    assert shock.start <= c.time[at] <= shock.end < shock.start + 0.2


def test_what_jumps_before_any_cable_was_slack_is_no_blow(run: Run) -> None:
    c = run.channels[0]
    values = c.values.copy()
    for moment in (1.0, 5.0):
        values[int(np.searchsorted(c.time, moment))] += 300.0
    jumping = replace(run, channels=(replace(c, values=values), *run.channels[1:]))
    assert len(shocks(jumping)) == 2
    spell = Spell(c.device, run.recording.name, 4.0, 4.2)
    (blow,) = blows((jumping,), [spell])
    assert blow.start == pytest.approx(5.0, abs=0.05)
    assert blows((jumping,), [replace(spell, recording="another")]) == []


def test_spells_of_several_cables_at_once_are_told_once() -> None:
    one, other = Spell("cable_1", "run_1", 3.0, 3.4), Spell("cable_2", "run_1", 3.3, 3.7)
    finding = slack_finding([other, one, Spell("cable_1", "run_2", 3.0, 3.1)])
    assert finding.where["times"] == [
        {"recording": "run_1", "start": 3.0, "end": 3.7},
        {"recording": "run_2", "start": 3.0, "end": 3.1},
    ]
