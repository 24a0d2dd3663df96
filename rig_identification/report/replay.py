"""The motion as the model has it, for a drawing that a person plays back on the page."""

from __future__ import annotations

import base64
import json
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rig_identification.report.plain import plain
from rig_identification.report.rig_drawing import HEIGHT, MARGIN, VIEWS, WIDTH
from rig_identification.report.rig_scene import DRAWN
from rig_identification.result import BodyMotion, InertialEstimate
from rig_identification.rig import Rig

Array = NDArray[np.float64]

#: Frames of all runs together: 4000 take 150 kB. Beyond, every second one is left out, and so on.
MOST_FRAMES = 4000


def replay_json(rig: Rig, estimate: InertialEstimate, motions: Sequence[BodyMotion]) -> str:
    """JSON of what is drawn and of each run's poses; "" where no motion is known.

    Cables by their ends, devices and centre of mass in body axes, the view with its scale, and of each
    recording time, place (3) and quaternion (4) in four bytes each.
    """
    runs = _runs(motions)
    if not runs:
        return ""
    body, names = _points(rig, estimate)
    ceiling = np.array([cable.ceiling_point for cable in rig.cables])
    view = VIEWS[0]
    flat = np.concatenate([ceiling, *(_moved(poses, body) for poses in runs.values())]) @ view.axes.T
    low, high = flat.min(axis=0), flat.max(axis=0)
    scale = float(np.min((np.array([WIDTH, HEIGHT]) - 2.0 * MARGIN) / np.maximum(high - low, 1e-6)))
    packed = {name: base64.b64encode(poses.astype("<f4").tobytes()).decode() for name, poses in runs.items()}
    document = {
        "width": WIDTH, "height": HEIGHT, "axes": view.axes, "middle": 0.5 * (low + high), "scale": scale,
        "ceiling": ceiling, "cables": [cable.name for cable in rig.cables], "body": body, "names": names,
        "runs": packed,
    }  # fmt: skip
    return json.dumps(plain(document), allow_nan=False, ensure_ascii=False).replace("<", "\\u003c")


def _runs(motions: Sequence[BodyMotion]) -> dict[str, Array]:
    """Recording -> (n, 8) time, place, quaternion, of all its parts."""
    parts: dict[str, list[Array]] = {}
    for motion in motions:
        poses = np.column_stack([motion.time, motion.position, motion.orientation])
        parts.setdefault(motion.recording, []).append(poses[np.isfinite(poses).all(axis=1)])
    joined = {name: np.concatenate(some) for name, some in parts.items()}
    every = max(1, -(-sum(map(len, joined.values())) // MOST_FRAMES))
    ordered = {name: poses[np.argsort(poses[:, 0], kind="stable")][::every] for name, poses in joined.items()}
    return {name: poses for name, poses in ordered.items() if len(poses) > 1}


def _points(rig: Rig, estimate: InertialEstimate) -> tuple[Array, list[str]]:
    """Points of the body, (n, 3) in its axes, and what each is: hinges first, "" for the centre of mass."""
    points = [cable.body_point for cable in rig.cables]
    names = [cable.name for cable in rig.cables]
    for device, name in DRAWN.items():
        if (mount := getattr(rig, device)) is not None:
            points.append(mount.position)
            names.append(name)
    if not {"cx", "cy", "cz"} & set(estimate.unobservable):
        points.append(estimate.values[1:4])
        names.append("")
    return np.array(points), names


def _moved(poses: Array, body: Array) -> Array:
    """(n m, 3) m, world: the points at every pose."""
    turned = Rotation.from_quat(poses[:, 4:]).as_matrix() @ body.T
    return np.asarray((turned.transpose(0, 2, 1) + poses[:, None, 1:4]).reshape(-1, 3))
