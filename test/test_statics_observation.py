"""Averages of static recordings and the meaning of inclinations."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rig_identification.errors import InputError
from rig_identification.recording import Recording, Series
from rig_identification.statics import observe_static
from rig_identification.statics.observation import inclinations, up_in_body
from rig_identification.thesis import load_case


def recording(inclination=None, tension=None, kind="static"):
    return Recording("bare", kind, False, 0, 10.0, tension=tension or {}, inclination=inclination)


def series(values):
    return Series(np.linspace(0.0, 10.0, len(values)), np.asarray(values, dtype=float))


@pytest.mark.parametrize("seed", range(5))
def test_up_is_the_third_row_of_the_attitude(seed):
    rng = np.random.default_rng(seed)
    attitude = Rotation.from_rotvec(rng.normal(0.0, 0.3, 3))
    mounted = Rotation.from_rotvec(rng.normal(0.0, 0.5, 3))
    up = up_in_body(inclinations(attitude, mounted), mounted)
    if (attitude * mounted).as_matrix()[2, 2] > 0.0:
        assert up == pytest.approx(attitude.as_matrix()[2], abs=1e-12)


def test_an_axis_turned_upwards_reads_positive():
    nose_up = Rotation.from_euler("y", -0.1)
    assert inclinations(nose_up, Rotation.identity()) == pytest.approx([0.1, 0.0])


def test_impossible_inclinations_name_their_values():
    with pytest.raises(InputError, match=r"1\.2 and 1\.1 rad"):
        up_in_body(np.array([1.2, 1.1]), Rotation.identity())


def test_means_and_standard_errors_of_white_noise():
    rng = np.random.default_rng(3)
    rig = load_case(14).rig
    angles = series([0.02, -0.01] + 1e-3 * rng.standard_normal((5000, 2)))
    cells = {"cable_2": series(3000.0 + 2.0 * rng.standard_normal((5000, 1)))}
    seen = observe_static(recording(angles, cells), rig)
    assert seen.inclination == pytest.approx([0.02, -0.01], abs=6e-5)
    assert np.all((seen.inclination_std > 0.4e-5) & (seen.inclination_std < 3.5e-5))
    assert np.isnan(seen.tension[[0, 2, 3]]).all()
    assert seen.tension[1] == pytest.approx(3000.0, abs=0.15)


def test_a_drift_widens_the_standard_error():
    rig = load_case(14).rig
    still = np.zeros((1000, 2))
    drifting = still + np.linspace(0.0, 0.01, 1000)[:, None]
    seen = observe_static(recording(series(drifting)), rig)
    assert np.all(seen.inclination_std > 5e-4)


def test_a_recording_of_motion_is_refused():
    with pytest.raises(InputError, match="dynamic"):
        observe_static(recording(kind="dynamic"), load_case(14).rig)


def test_missing_channels_are_nan():
    seen = observe_static(recording(), load_case(14).rig)
    assert np.isnan(seen.inclination).all()
    assert np.isnan(seen.tension).all()
