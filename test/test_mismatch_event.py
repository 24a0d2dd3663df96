"""A push is told by the pieces that it disturbs."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from rig_identification.estimate.solve import Point
from rig_identification.mismatch import locate

SAMPLES, SECONDS = 3000, 4.0


class _Problem(SimpleNamespace):
    """The least of a problem: pieces of one recording."""


def event(monkeypatch: pytest.MonkeyPatch, squares: list[float], alone: bool = True) -> object:
    """What is found in pieces whose residuals have these mean squares, whatever is fitted."""
    rng = np.random.default_rng(3)

    def residual(square: float) -> np.ndarray:
        values = rng.normal(size=SAMPLES)
        return values * np.sqrt(square / np.mean(values**2))

    parts = [
        SimpleNamespace(
            recording=SimpleNamespace(name="run_1"),
            offset=SECONDS * i,
            grid=SimpleNamespace(duration=SECONDS),
            residual=residual(s),
        )
        for i, s in enumerate(squares)
    ]
    point = Point(np.zeros(1), tuple(range(len(parts))), ())  # type: ignore[arg-type]

    def evaluation(problem: _Problem, point: Point) -> SimpleNamespace:
        return SimpleNamespace(runs=problem.runs, point=point)

    replace = locate.replace

    def changed(thing: object, **changes: object) -> object:
        if isinstance(thing, _Problem):
            return _Problem(**{**vars(thing), **changes})
        return replace(thing, **changes)  # type: ignore[type-var]

    monkeypatch.setattr(locate, "replace", changed)
    monkeypatch.setattr(locate, "solve", lambda p, at, **_: (evaluation(p, at), True))
    monkeypatch.setattr(locate, "settled_starts", lambda p, at: at.starts)
    monkeypatch.setattr(locate, "evaluate", evaluation)
    problem = _Problem(runs=tuple(parts))
    return locate.find_event(problem, evaluation(problem, point), alone)  # type: ignore[arg-type]


def test_a_gentle_push_stands_out_of_noise(monkeypatch: pytest.MonkeyPatch) -> None:
    found = event(monkeypatch, [0.97, 1.01, 0.99, 1.0, 2.0, 1.02, 1.0, 1.03])
    assert isinstance(found, locate.Event)
    assert (found.start, found.end) == (16.0, 20.0)
    assert found.calm == (0, 1, 2, 3, 5, 6, 7)


def test_noise_alone_is_no_event(monkeypatch: pytest.MonkeyPatch) -> None:
    assert event(monkeypatch, [0.97, 1.03, 0.99, 1.0, 1.04, 1.02, 1.0, 1.03]) is None


def test_a_push_beside_something_else_stands_out_of_it(monkeypatch: pytest.MonkeyPatch) -> None:
    squares = [29.0, 31.0, 735.0, 31.4, 32.4, 32.5, 31.5, 32.1]
    assert event(monkeypatch, squares) is None
    found = event(monkeypatch, squares, alone=False)
    assert isinstance(found, locate.Event)
    assert (found.start, found.end) == (8.0, 12.0)


def test_what_dies_away_is_no_push(monkeypatch: pytest.MonkeyPatch) -> None:
    assert event(monkeypatch, [735.0, 80.0, 31.0, 31.4, 32.4, 32.5, 31.5, 32.1], alone=False) is None
