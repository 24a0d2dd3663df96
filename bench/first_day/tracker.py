"""Motion capture beside the engine's devices: poses of a marker frame, from the true motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from bench.concealed.scene import Array
from rig_identification.recording import Recording, Series, Session
from rig_identification.rig import Mount

EVERY = 2  # samples of the true motion: 100 Hz
POSITION_NOISE, ORIENTATION_NOISE = 0.0003, 0.001  # m, rad
CLOCK = 0.0005  # s, standard deviation
MOUNT_POSITION, MOUNT_ORIENTATION = 0.001, 0.001  # m, rad: how well the description knows the marker's place
#: The tracker's axes against the room's, as a calibration with a wand on the floor leaves them.
TRACKER_TILT = 0.01  # rad


def watched(session: Session, seed: int, size: float, *, described: bool, inclinometer: bool) -> Session:
    """The session with motion capture; without its inclinometer where ``inclinometer`` is False.

    size: m, the room for the marker on the body. described: whether the description knows its place.
    """
    rng = np.random.default_rng([seed, 11])
    marker = rng.uniform(-0.3, 0.3, 3) * size
    R_body_marker = Rotation.from_rotvec(rng.uniform(-0.5, 0.5, 3))
    # Right-handed, z up, any heading, origin anywhere in the room
    turn = [rng.normal(0.0, TRACKER_TILT), rng.normal(0.0, TRACKER_TILT), rng.uniform(-np.pi, np.pi)]
    R_tracker_world = Rotation.from_euler("xyz", turn)
    origin = rng.uniform(-1.5, 1.5, 3)
    clock = float(np.clip(rng.normal(0.0, CLOCK), -3.0 * CLOCK, 3.0 * CLOCK))
    rig = replace(session.rig, inclinometer=session.rig.inclinometer if inclinometer else None)
    rig = replace(
        rig,
        noise={**rig.noise, "mocap_position": POSITION_NOISE, "mocap_orientation": ORIENTATION_NOISE},
        mocap=_described(rng, marker, R_body_marker) if described else None,
    )
    recordings = []
    for recording in session.recordings:
        poses = _poses(recording, marker, R_body_marker, R_tracker_world, origin, clock, rng)
        inclination = recording.inclination if inclinometer else None
        recordings.append(replace(recording, mocap=poses, inclination=inclination))
    return replace(session, rig=rig, recordings=tuple(recordings))


def _described(rng: np.random.Generator, marker: Array, turn: Rotation) -> Mount:
    believed = turn * Rotation.from_rotvec(rng.normal(0.0, MOUNT_ORIENTATION, 3).clip(-0.003, 0.003))
    place = marker + rng.normal(0.0, MOUNT_POSITION, 3).clip(-0.003, 0.003)
    return Mount(np.round(place, 5), believed.as_quat())


def _poses(
    recording: Recording,
    marker: Array,
    R_body_marker: Rotation,
    R_tracker_world: Rotation,
    origin: Array,
    clock: float,
    rng: np.random.Generator,
) -> Series:
    truth = recording.ground_truth
    assert truth is not None
    values = truth.values[::EVERY]
    R_world_body = Rotation.from_quat(values[:, 3:7])
    place = R_tracker_world.apply(values[:, :3] + R_world_body.apply(marker)) + origin
    turn = R_tracker_world * R_world_body * R_body_marker
    noisy = turn * Rotation.from_rotvec(rng.normal(0.0, ORIENTATION_NOISE, (len(values), 3)))
    place = place + rng.normal(0.0, POSITION_NOISE, place.shape)
    # A device's clock may be early: no stamp before the recording's first, which its start defines
    time = truth.time[::EVERY] + clock
    inside = time >= 0.0
    return Series(np.round(time, 9)[inside], np.concatenate([place, noisy.as_quat()], axis=1)[inside])
