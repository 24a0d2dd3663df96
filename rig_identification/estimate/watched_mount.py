"""Where a tracker's marker sits on the body and how the room lies in its frame, from a motion others tell.

A turn of the body is one vector in body axes and another in marker axes, and so is a way of the marker:
R_body_marker takes all of one kind into the other at once. It is the rotation that does so best (Wahba's
problem, by singular values: Markley, Journal of the Astronautical Sciences 36, 1988). The marker's place
follows from its ways by least squares; a few rounds settle both.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rig_identification.estimate.evidence import Run
from rig_identification.estimate.first_guess import seen_pose
from rig_identification.estimate.track import Track
from rig_identification.model.sensors import MocapMount
from rig_identification.model.so3 import nearest_rotation

Array = NDArray[np.float64]

#: Rounds of orientation and place.
ROUNDS = 6


def without_mocap(run: Run) -> Run:
    """The run as all other devices tell it."""
    return replace(run, channels=tuple(c for c in run.channels if c.device != "mocap"))


def mount_from_track(run: Run, track: Track) -> MocapMount | None:
    """Mounts with which a tracker sees what ``track`` tells; None where it sees less than a pose."""
    pose = seen_pose(run)
    if pose is None or run.R_tracker_mean is None or not np.all(pose.known):
        return None
    inside = (pose.time > track.time[0]) & (pose.time < track.time[-1])
    time = pose.time[inside]
    node = np.clip(np.rint(time / (track.time[1] - track.time[0])).astype(int), 0, track.time.size - 1)
    R, x = track.R_world_body[node], track.states[node, :3]
    seen, turn = pose.position[inside], pose.turn[inside]
    mean = Rotation.from_matrix(R).mean().as_matrix()
    turned = Rotation.from_matrix(mean.T @ R).as_rotvec()
    turned_marker = turn - np.mean(turn, axis=0)
    R_mean = run.R_tracker_mean @ Rotation.from_rotvec(np.mean(turn, axis=0)).as_matrix()
    way_marker = (seen - np.mean(seen, axis=0)) @ R_mean
    marker, R_body_marker = np.zeros(3), np.eye(3)
    for _ in range(ROUNDS):
        way = x + R @ marker
        way_body = (way - np.mean(way, axis=0)) @ mean
        R_body_marker = _best_rotation(
            [(turned - np.mean(turned, axis=0), turned_marker), (way_body, way_marker)]
        )
        # What the body's datum does not move is the marker's arm about it
        arm = (R - np.mean(R, axis=0)).reshape(-1, 3)
        gone = way_marker @ R_body_marker.T @ mean.T - (x - np.mean(x, axis=0))
        marker = np.linalg.lstsq(arm, gone.ravel(), rcond=1e-2)[0]
    R_tracker_world = R_mean @ R_body_marker.T @ mean.T
    world = np.mean(seen, axis=0) - R_tracker_world @ np.mean(x + R @ marker, axis=0)
    return MocapMount(marker, R_body_marker, world, R_tracker_world)


def _best_rotation(pairs: list[tuple[Array, Array]]) -> Array:
    """(3, 3) rotation R with body = R marker, each kind of vectors weighed by its own size."""
    total = np.zeros((3, 3))
    for body, marker in pairs:
        total += body.T @ marker / max(float(np.sum(marker**2)), 1e-12)
    return nearest_rotation(total)
