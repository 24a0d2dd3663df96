"""Where an estimate starts from when nothing is known of the body: rest, geometry and the first samples."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rig_identification.estimate.evidence import Run
from rig_identification.model import sensors
from rig_identification.model.equilibrium import design_pose, settle
from rig_identification.model.motion import RigModel, State, on_cables
from rig_identification.recording import Recording, Session
from rig_identification.rig import Rig

Array = NDArray[np.float64]

#: Radius of gyration over the extent of a body: 0.29 for a uniform box, more where mass sits outside.
GYRATION = 0.35


def extent(rig: Rig) -> Array:
    """(3,) m: size of the box that the body's hinges span; a missing side gets a third of the longest."""
    points = np.array([cable.body_point for cable in rig.cables])
    span = np.ptp(points, axis=0)
    return np.asarray(np.maximum(span, max(float(np.max(span)), 1e-3) / 3.0))


def weighed_mass(session: Session) -> float:
    """Mass from the ground scale, else from the mean tensions, else one kilogram for each metre of rig."""
    rig = session.rig
    if rig.mass is not None:
        return rig.mass
    for recording in (*session.statics, *session.training):
        if recording.dummy is None and len(recording.tension) == len(rig.cables):
            total = 0.0
            for cable in rig.cables:
                across = cable.ceiling_point - cable.body_point
                across = across - [0.0, 0.0, across[2]]
                drop = np.sqrt(max(cable.length**2 - float(across @ across), 0.01 * cable.length**2))
                total += float(np.mean(recording.tension[cable.name].values)) * drop / cable.length
            if total > 0.0:
                return total / rig.gravity
    return float(np.sum(extent(rig)))


def first_elements(session: Session) -> Array:
    """(10,) a body of the weighed mass, as large as the rig's hinges, hanging below them."""
    rig = session.rig
    size = extent(rig)
    mass = weighed_mass(session)
    points = np.array([cable.body_point for cable in rig.cables])
    center = np.mean(points, axis=0) - [0.0, 0.0, 0.35 * size[2] + 0.15 * float(np.max(size))]
    spread = (GYRATION * size) ** 2
    inertia = mass * np.array([spread[1] + spread[2], spread[0] + spread[2], spread[0] + spread[1]])
    return np.array([mass, *center, inertia[0], 0.0, 0.0, inertia[1], 0.0, inertia[2]])


def weak_prior(rig: Rig) -> Array:
    """(10,) std of the log-Cholesky vector of a body about which only its rough size is known.

    Half the logarithm of mass within 0.5, logarithms of the mass spread within 1, shears
    within half the rig's extent and the centre of mass within the extent, metres.
    """
    size = float(np.max(extent(rig)))
    return np.array([0.5, 1.0, 1.0, 1.0, 0.5 * size, 0.5 * size, 0.5 * size, size, size, size])


def rest_of(model: RigModel) -> State:
    """Where a body hangs on a rig."""
    return settle(model, design_pose(model))


def mocap_mount(rig: Rig, recording: Recording, rest: State, R_tracker_mean: Array, heading: float) -> sensors.MocapMount:
    """Mounts under which the mean recorded pose is the rest pose, the tracker's z up and turned by ``heading``."""
    if recording.mocap is None:
        raise ValueError("the recording holds no motion capture")
    mean_position = np.mean(recording.mocap.values[:, :3], axis=0)
    R_tracker_world = Rotation.from_rotvec([0.0, 0.0, heading]).as_matrix()
    if rig.mocap is not None:
        R_body_marker = Rotation.from_quat(rig.mocap.orientation).as_matrix()
        marker = rig.mocap.position
        R_tracker_world = R_tracker_mean @ R_body_marker.T @ rest.R_world_body.T
    else:
        R_body_marker = (R_tracker_world @ rest.R_world_body).T @ R_tracker_mean
        marker = np.zeros(3)
    world = mean_position - R_tracker_world @ (rest.position + rest.R_world_body @ marker)
    return sensors.MocapMount(marker, R_body_marker, world, R_tracker_world, R_tracker_mean)


def start_from_mocap(model: RigModel, run: Run, mount: sensors.MocapMount, span: float = 0.25) -> State:
    """Pose and velocity at time 0 from straight lines through the first ``span`` seconds of motion capture."""
    place = next(c for c in run.channels if c.device == "mocap" and c.quantity == "position")
    turn = next(c for c in run.channels if c.device == "mocap" and c.quantity == "orientation")
    early = place.time <= place.time[0] + span
    line = np.polynomial.polynomial.polyfit(place.time[early], place.values[early], 1)
    spin = np.polynomial.polynomial.polyfit(turn.time[early], turn.values[early], 1)
    R_tracker_body = mount.R_tracker_mean @ Rotation.from_rotvec(spin[0]).as_matrix() @ mount.R_body_marker.T
    R = mount.R_tracker_world.T @ R_tracker_body
    rate = mount.R_body_marker @ spin[1]
    marker = mount.R_tracker_world.T @ (line[0] - mount.world_position)
    arm = R @ mount.marker_position
    velocity = mount.R_tracker_world.T @ line[1] - np.cross(R @ rate, arm)
    return on_cables(model, State(marker - arm, R, velocity, rate))
