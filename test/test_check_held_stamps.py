"""When a device took its samples that publishes more often than it measures: one pace in all recordings."""

from __future__ import annotations

import numpy as np
import pytest

from rig_identification.check.readings.held_stamps import steady

FILM = 1.0 / 30.0


def shown(camera: float, seconds: float, begins: float = 0.0) -> np.ndarray:
    """(n,) ns, when a film of 30 Hz first shows each picture that a camera of ``camera`` Hz takes."""
    taken = begins + np.arange(1, int(seconds * camera)) / camera
    return np.asarray(np.rint(np.ceil(taken / FILM) * FILM * 1e9), dtype=np.int64)


def paces(stamps: list[np.ndarray]) -> list[float]:
    return [float(np.median(np.diff(one))) / 1e9 for one in stamps]


def test_two_films_of_one_camera_tell_one_pace() -> None:
    camera = 15.073
    films = [shown(camera, 12.9), shown(camera, 8.6, begins=0.021)]
    alone = [paces(steady([one], FILM))[0] for one in films]
    first, second = paces(steady(films, FILM))
    assert first == pytest.approx(second, rel=1e-8)
    assert min(alone) <= first <= max(alone)
    # The longer film tells more
    assert abs(first - alone[0]) < abs(first - alone[1])
    # An interval over both films: 0.033 / 21.5
    assert first == pytest.approx(1.0 / camera, rel=1.5e-3)


def test_films_that_contradict_each_other_keep_their_own_pace() -> None:
    slow, fast = paces(steady([shown(15.07, 12.9), shown(17.2, 12.9)], FILM))
    assert slow == pytest.approx(1.0 / 15.07, rel=1e-3)
    assert fast == pytest.approx(1.0 / 17.2, rel=1e-3)


def test_stamps_of_no_steady_device_stay_as_they_are() -> None:
    wild = np.cumsum(np.random.default_rng(1).integers(1, 9, 200)) * int(FILM * 1e9)
    steady_one = shown(15.07, 12.9)
    kept, moved = steady([wild, steady_one], FILM)
    assert np.array_equal(kept, wild)
    assert not np.array_equal(moved, steady_one)
