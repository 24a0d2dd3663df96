"""Blows of something loose: their line, the slide from one to the next, and what chance does not do.

The part is integrated here by itself, with stops that are hit at an instant (SciPy's events).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from rig_identification.mismatch.knocks import Knocks, Spikes, likelier, lines_of, spike_of
from rig_identification.model import layout
from rig_identification.model.motion import Motion

Array = NDArray[np.float64]

STEP, SECONDS = 0.005, 30.0
MASS, TRAVEL, RATE, REBOUND = 5.0, 0.012, 1.2, 0.3
AT = np.array([0.4, 0.0, -0.7])
ALONG, DOWN = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, -9.8])
WRENCH = np.concatenate([ALONG, np.cross(AT, ALONG)])
#: What whitens a newton held for a node interval: the six are not seen alike, nor apart.
SEEN = np.diag([0.1, 0.25, 0.1, 0.25, 0.2, 0.3]) @ (np.eye(6) + 0.2 * np.eye(6, k=1))


def felt(t: float | Array, phase: float) -> float | Array:
    """Specific force along y, m/s^2: two swings and a slow one."""
    return 0.5 * np.sin(4.1 * t + phase) + 0.25 * np.sin(6.7 * t) + 0.1 * np.sin(1.3 * t + phase)


def blows_of(phase: float, friction: float = 0.0) -> list[tuple[float, float]]:
    """Time (s) and impulse (N s) of every blow of a part that begins at its upper stop.

    friction: m/s^2, dry, smoothed over a tenth of a millimetre per second.
    """

    def moves(t: float, x: Array) -> list[float]:
        return [x[1], -float(felt(t, phase)) - RATE * x[1] - friction * float(np.tanh(x[1] / 1e-4))]

    def upper(_: float, x: Array) -> float:
        return x[0] - TRAVEL

    def lower(_: float, x: Array) -> float:
        return x[0] + TRAVEL

    upper.terminal = lower.terminal = True  # type: ignore[attr-defined]
    upper.direction, lower.direction = 1.0, -1.0  # type: ignore[attr-defined]
    now, x, out = 0.0, np.array([TRAVEL, 0.0]), []
    while now < SECONDS - STEP:
        side = np.sign(x[0]) if abs(abs(x[0]) - TRAVEL) < 1e-9 else 0.0
        if side and abs(x[1]) < 1e-4:
            # It lies there as long as it is pressed
            while -float(felt(now, phase)) * side > -friction and now < SECONDS - STEP:
                now += 1e-3
            x = np.array([side * TRAVEL * (1.0 - 1e-12), 0.0])
        found = solve_ivp(moves, (now, SECONDS - STEP), x, events=(upper, lower), rtol=1e-8, atol=1e-10)
        now, x = float(found.t[-1]), found.y[:, -1]
        if found.status == 1:
            speed = x[1]
            out.append((now, MASS * (1.0 + REBOUND) * float(speed)))
            x = np.array([np.sign(x[0]) * TRAVEL, -REBOUND * speed if abs(speed) > 2e-3 else 0.0])
    return out


def spikes(
    phase: float, seed: int, *, shuffled: bool = False, impulses: bool = True, friction: float = 0.0
) -> Spikes:
    """The spikes of a run with that part, as whitened as they would be; at any times where ``shuffled``."""
    rng = np.random.default_rng(seed)
    t = STEP * np.arange(round(SECONDS / STEP))
    outputs = np.zeros((t.size, 22))
    outputs[:, layout.OUT_SPECIFIC_FORCE + 1] = felt(t, phase)
    motion = Motion(STEP, np.zeros((t.size, 12)), np.zeros((t.size, 3, 3)), outputs, t.size)
    blows = [b for b in blows_of(phase, friction) if abs(b[1]) > 0.02] if impulses else []
    times = np.array([b[0] for b in blows])
    if shuffled:
        times = np.sort(rng.uniform(0.5, SECONDS - 1.0, times.size))
    nodes = np.array(np.round(times / STEP), dtype=np.int64)
    size = np.array([b[1] for b in blows]) / STEP
    whitened = np.outer(size, SEEN @ WRENCH) + rng.normal(size=(size.size, 6))
    return Spikes(motion, nodes, whitened, SEEN)


def knocking_in(fitted: list[Spikes], held: list[Spikes]) -> Knocks | None:
    """What knocks where a spike has all of its blow."""
    spike = spike_of([*fitted, *held])
    return None if spike is None else likelier(lines_of(spike, spike, DOWN), fitted, held)


def told(*, shuffled: bool = False, seed: int = 1, friction: float = 0.0) -> Knocks | None:
    fitted, held = (
        spikes(phase, seed + i, shuffled=shuffled, friction=friction) for i, phase in enumerate((0.3, 1.9))
    )
    return knocking_in([fitted], [held])


def test_what_slides_is_told_by_when_and_how_hard_it_knocks() -> None:
    found = told()
    assert found is not None
    assert found.line.axis == "y"
    # A body that does not turn tells by no slide where the line lies
    np.testing.assert_allclose(found.line.at[[0, 2]], AT[[0, 2]], atol=0.2)
    assert found.timed > 50.0
    assert found.confirmed > 20.0
    assert found.mass == pytest.approx(MASS, rel=0.1)
    assert abs(found.mass - MASS) < 3.0 * found.std
    assert found.travel == pytest.approx(TRAVEL, rel=0.1)


def test_what_sticks_between_blows_is_told_as_well() -> None:
    """Dry friction holds it for a third of the time; a slide that is only slowed cannot wait."""
    found = told(friction=0.12)
    assert found is not None
    assert found.timed > 50.0
    assert found.confirmed > 20.0
    assert abs(found.mass - MASS) < 3.0 * found.std
    assert found.travel == pytest.approx(TRAVEL, rel=0.1)


def test_a_blow_that_seems_to_rise_is_asked_as_a_level_one_too() -> None:
    """What few sensors feel of it at once shows some of it along the cables."""
    rising = np.array([0.8, 0.5, 0.3])
    wrench = np.concatenate([rising, np.cross(AT, rising)])
    _, level, measured = lines_of(wrench, wrench, DOWN)
    np.testing.assert_allclose(level.along, np.array([0.8, 0.5, 0.0]) / np.hypot(0.8, 0.5))
    np.testing.assert_allclose(measured.along, rising / np.linalg.norm(rising))
    up = np.array([0.1, 0.0, 1.0])
    assert len(lines_of(np.concatenate([up, up]), np.concatenate([up, up]), DOWN)) == 2


@pytest.mark.parametrize("seed", [11, 21, 31])
def test_blows_along_one_line_at_any_times_are_no_part_that_slides(seed: int) -> None:
    """A hammer falls along one line as well."""
    found = told(shuffled=True, seed=seed)
    assert found is not None
    assert found.timed < 0.0


def test_blows_along_many_lines_are_none() -> None:
    rng = np.random.default_rng(4)
    every = [spikes(0.3, 1), spikes(1.9, 2)]
    scattered = [replace(s, whitened=30.0 * rng.normal(size=s.whitened.shape)) for s in every]
    assert knocking_in([scattered[0]], [scattered[1]]) is None


def test_what_knocks_in_one_run_alone_is_none() -> None:
    assert knocking_in([spikes(0.3, 1)], [spikes(1.9, 2, impulses=False)]) is None
    assert knocking_in([], []) is None


def test_a_line_is_found_as_it_lies_in_the_body() -> None:
    """Of blows along no axis of the body, whose runs whiten differently."""
    along = np.array([0.8, 0.6, 0.0])
    at = np.cross(along, np.cross([0.3, -0.2, -0.9], along))
    wrench = np.concatenate([along, np.cross(at, along)])
    every = []
    for seed, seen in ((1, SEEN), (2, 0.3 * SEEN.T)):
        known = spikes(0.3, seed)
        size = np.random.default_rng(seed).normal(0.0, 400.0, known.nodes.size)
        every.append(replace(known, whitened=np.outer(size, seen @ wrench), seen=seen))
    spike = spike_of(every)
    assert spike is not None
    nearest, level, measured = lines_of(spike, spike, DOWN)
    np.testing.assert_allclose(level.along, along, atol=1e-9)
    np.testing.assert_allclose(measured.along, along, atol=1e-9)
    np.testing.assert_allclose(measured.at, at, atol=1e-9)
    assert nearest.axis == measured.axis == "x"
    assert measured.share(every) == pytest.approx(1.0)
    np.testing.assert_allclose(nearest.along, [1.0, 0.0, 0.0])
    for known in every:
        np.testing.assert_allclose(
            measured.impulses(known) / STEP,
            known.whitened @ (known.seen @ wrench) / np.sum((known.seen @ wrench) ** 2),
        )
