"""Where an estimate starts from when nothing is known of the body: rest, geometry and the first samples."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rig_identification.estimate.evidence import Run
from rig_identification.estimate.symmetry import turns
from rig_identification.model import sensors
from rig_identification.model.equilibrium import design_pose, find_rest, settle
from rig_identification.model.motion import RigModel, State, on_cables, rig_model
from rig_identification.recording import Session
from rig_identification.rig import Rig
from rig_identification.statics import observe_static, solve_center_of_mass

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


def elements_that_hang(session: Session) -> Array:
    """(10,) the first elements; the centre of mass from rest where with a guessed one a cable would push.

    Cables that splay and differ in length hold a body only with its centre of mass above a part of the floor.
    With one guessed beside that it rests, if at all, in another pose, in which cables push, and no fit comes
    back from there. How it hangs in the static recordings tells where it is (chapter 2 of the thesis).
    """
    elements = first_elements(session)
    model = rig_model(session.rig, elements)
    hung = find_rest(model, rest_of(model))
    if hung.converged and np.all(hung.tension > 0.0):
        return elements
    seen = [observe_static(recording, session.rig) for recording in session.statics]
    seen = [o for o in seen if np.all(np.isfinite([*o.inclination, *o.tension]))]
    center = solve_center_of_mass(session.rig, *seen).center_of_mass if seen else np.full(3, np.nan)
    elements[1:4] = np.where(np.isfinite(center), center, elements[1:4])
    return elements


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


@dataclass(frozen=True)
class SeenPose:
    """What a tracker sees of a run, each component where it was measured; 0 where it never was."""

    time: Array  # (n,) s
    values: Array  # (n, 6) position m, rotation vector about the mean orientation rad
    known: NDArray[np.bool_]  # (6,) which of them the tracker measures

    @property
    def position(self) -> Array:
        """(n, 3) m, tracker frame."""
        return self.values[:, :3]

    @property
    def turn(self) -> Array:
        """(n, 3) rad, marker axes at the mean orientation."""
        return self.values[:, 3:]

    @property
    def turned(self) -> bool:
        """Whether the tracker tells anything of the attitude."""
        return bool(np.any(self.known[3:]))


def seen_pose(run: Run) -> SeenPose | None:
    """What the run's tracker sees; None without one."""
    parts = sorted((c for c in run.channels if c.device == "mocap"), key=lambda c: -c.time.size)
    if not parts or run.R_tracker_mean is None:
        return None
    time = parts[0].time
    values, known = np.zeros((time.size, 6)), np.zeros(6, dtype=bool)
    for part in parts:
        for k, component in enumerate(part.components):
            if not known[component]:
                values[:, component] = np.interp(time, part.time, part.values[:, k])
                known[component] = True
    return SeenPose(time, values, known)


def seen_whole(run: Run) -> bool:
    """Whether the run's tracker measures place and attitude, all of both."""
    seen = seen_pose(run)
    return seen is not None and bool(np.all(seen.known))


def headings(rig: Rig, run: Run) -> list[float]:
    """Candidate angles (rad) of world x about the tracker's z.

    A body on two cables tilts about the line e of its hinges as it swings across it: the
    horizontal rotation follows the displacement as r = e (n . d)/h, n = z x e, so that e is the
    left singular vector of the regression of r on d. Its sign stays open: a body on two cables swings
    alike turned by half a circle, and the smaller turn comes first. Otherwise eight of a round, or of that
    part of it after which the rig falls on itself (symmetry.py), about no turn. A tracker that tells only
    attitude, or only height, does not feel which way world x points.
    """
    pose = seen_pose(run)
    beside = pose is not None and bool(np.any(pose.known[:2]))
    if not beside or (rig.mocap is not None and pose is not None and pose.turned):
        return [0.0]
    if len(rig.cables) > 2 or pose is None or run.R_tracker_mean is None or not np.all(pose.known):
        seen = all(c.device == "mocap" for c in run.channels)
        part = 2.0 * np.pi / (1 + (sum(turn.exact for turn in turns(rig)) if seen else 0))
        return sorted((part * (k / 8.0) for k in range(-3, 5)), key=abs)
    # Rotation in tracker axes: the mean orientation carries the vector about it there
    r = (pose.turn @ run.R_tracker_mean.T)[:, :2]
    d = pose.position[:, :2]
    r, d = r - np.mean(r, axis=0), d - np.mean(d, axis=0)
    slope = np.linalg.lstsq(d, r, rcond=None)[0].T
    e = np.linalg.svd(slope)[0][:, 0]
    along = rig.cables[1].body_point - rig.cables[0].body_point
    angle = np.arctan2(e[1], e[0]) - np.arctan2(along[1], along[0])
    either = np.mod(angle + np.array([0.0, np.pi]) + np.pi, 2.0 * np.pi) - np.pi
    return [float(a) for a in sorted(either, key=abs)]


def mocap_mount(rig: Rig, run: Run, rest: State, heading: float) -> sensors.MocapMount:
    """Mounts under which the mean recorded pose is the rest pose.

    Where the marker's mount is not described, or the tracker tells no attitude, the tracker's z is taken to
    be up, turned by ``heading`` (rad) about it; the marker sits where it is described, else at the datum: a
    start for the fit.
    """
    pose = seen_pose(run)
    if pose is None or run.R_tracker_mean is None:
        raise ValueError("the run holds no motion capture")
    mean_position = np.mean(pose.position, axis=0)
    if rig.mocap is not None and pose.turned:
        R_body_marker = Rotation.from_quat(rig.mocap.orientation).as_matrix()
        marker = rig.mocap.position
        R_tracker_world = run.R_tracker_mean @ R_body_marker.T @ rest.R_world_body.T
    else:
        R_tracker_world = Rotation.from_rotvec([0.0, 0.0, heading]).as_matrix()
        R_body_marker = (R_tracker_world @ rest.R_world_body).T @ run.R_tracker_mean
        marker = np.zeros(3) if rig.mocap is None else rig.mocap.position
    world = mean_position - R_tracker_world @ (rest.position + rest.R_world_body @ marker)
    return sensors.MocapMount(marker, R_body_marker, world, R_tracker_world)


def start_from_mocap(
    model: RigModel, run: Run, mount: sensors.MocapMount, device: Array, span: float = 0.2
) -> State | None:
    """Pose and velocity at time 0 from lines through the first ``span`` seconds; None without motion capture.

    What the tracker does not measure is taken to be as at rest.

    device (12,): current errors of the mount (model/sensors.py).
    """
    pose = seen_pose(run)
    if pose is None or run.R_tracker_mean is None:
        return None
    early = pose.time <= pose.time[0] + span
    line, spin = np.split(
        np.polynomial.polynomial.polyfit(pose.time[early], pose.values[early], 1), 2, axis=1
    )
    mount = mount.off_by(device)
    R_bm, R_tw = mount.R_body_marker, mount.R_tracker_world
    R_tracker_body = run.R_tracker_mean @ Rotation.from_rotvec(spin[0]).as_matrix() @ R_bm.T
    R = R_tw.T @ R_tracker_body
    rate = R_bm @ spin[1]
    arm = R @ mount.marker_position
    marker = R_tw.T @ (line[0] - mount.world_position)
    return on_cables(model, State(marker - arm, R, R_tw.T @ line[1] - np.cross(R @ rate, arm), rate))
