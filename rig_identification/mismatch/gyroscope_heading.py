"""A gyroscope turned about the vertical against its description, told by how a body on two threads rolls.

On two alike threads a body turns about the vertical and rolls about the line of its hinges, and in no third
way: swinging along that line it stays upright. So what the gyroscope reads beside the vertical, less what
goes with the turning, is along one line, the hinges' in its own axes. A gyroscope alone does not feel which
way it was mounted, and a fit that holds it near its description is out by more than any effect. The mount is
turned before anything is fitted, and told. Which of the line's two ends is which stays open: the smaller turn
is taken.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rig_identification.estimate.alike_threads import alike_threads
from rig_identification.mismatch.findings import NO_EVIDENCE, with_mended, written
from rig_identification.quantity import with_interval
from rig_identification.recording import Recording, Session
from rig_identification.result import Finding, Mismatch

Array = NDArray[np.float64]

#: Tolerances of the description beyond which a mount is turned (recording contract).
ORDINARY = 3.0
#: How many times as much power along the line as across it: in both ways noise has as much, and a body that
#: rolls about no line, on cables that splay for one, has a third at least.
ONE_LINE = 100.0
#: Lines of a Hann window's spectrum to either side that a swing reaches to, and samples that it takes.
REACH, FEWEST = 3, 200
#: rad, by which recordings may differ beside their own std.
AGREE = 0.05


@dataclass(frozen=True)
class Turned:
    """How far a gyroscope is turned about the body's z against its description."""

    angle: float  # rad
    std: float  # rad


def gyroscope_heading(session: Session) -> Turned | None:
    """The turn that the rolling tells; None where it does not, or where it is an ordinary one."""
    rig, imu = session.rig, session.rig.imu
    if imu is None or len(rig.cables) != 2 or alike_threads(rig) is None:
        return None
    runs = (*session.training, *session.holdouts)
    if any(run.mocap is not None or run.inclination is not None or run.tension for run in runs):
        return None
    hinges = rig.cables[1].body_point - rig.cables[0].body_point
    line = float(np.arctan2(hinges[1], hinges[0]))
    mount = Rotation.from_quat(imu.orientation)
    told = [found for run in runs if (found := _rolls_about(run, mount)) is not None]
    if not told:
        return None
    away = np.array([_half_turn(line - angle) for angle, _ in told])
    # About the first, so that a line's two ends are no disagreement
    away = away[0] + np.array([_half_turn(a - away[0]) for a in away])
    stds = np.array([std for _, std in told])
    angle = _half_turn(float(np.average(away, weights=1.0 / stds**2)))
    std = float(np.sqrt(1.0 / np.sum(1.0 / stds**2) + np.var(away)))
    if np.ptp(away) > AGREE + 3.0 * float(np.max(stds)):
        return None
    return Turned(angle, std) if abs(angle) > ORDINARY * rig.tolerance["imu_orientation"] else None


def with_heading(session: Session, turned: Turned | None) -> Session:
    """The session with its gyroscope's mount as it is."""
    imu = session.rig.imu
    if turned is None or imu is None:
        return session
    mount = Rotation.from_rotvec([0.0, 0.0, turned.angle]) * Rotation.from_quat(imu.orientation)
    return replace(session, rig=replace(session.rig, imu=replace(imu, orientation=mount.as_quat())))


def heading_told(mismatch: Mismatch, turned: Turned | None) -> Mismatch:
    """The mismatch with what is to be said of a mount that was turned."""
    if turned is None:
        return mismatch
    text = (
        f"The gyroscope is turned about the body's z by {with_interval(turned.angle, turned.std, 'rad')} "
        f"({np.degrees(turned.angle):.3g}°) against its description: the body on its two threads rolls about "
        "a line so far from the one through its hinges. Its mount is taken to be turned so. Write the mount "
        "as it is into the rig description, or the hinges where they are."
    )
    where: dict[str, object] = {"channel": "imu", "axis": "z"}
    told = written({"angle": (turned.angle, turned.std, "rad")})
    return with_mended(
        mismatch,
        [Finding("imu_misalignment", where, told, NO_EVIDENCE, text)],
        "the gyroscope's mount turned",
    )


def _half_turn(angle: float) -> float:
    """The same line's angle (rad) within a quarter of a turn of none."""
    return float((angle + 0.5 * np.pi) % np.pi - 0.5 * np.pi)


def _rolls_about(run: Recording, mount: Rotation) -> tuple[float, float] | None:
    """Azimuth (rad, body axes as described) of the line that a body rolls about, and its std; None: none."""
    if run.imu is None or np.any(np.isfinite(run.imu.values[:, 3:])):
        return None
    known = np.isfinite(run.imu.values[:, :3]).all(axis=1)
    time = run.imu.time[known]
    if time.size < FEWEST:
        return None
    rates = mount.apply(run.imu.values[known, :3])
    even = np.linspace(time[0], time[-1], time.size)
    rates = np.stack([np.interp(even, time, axis) for axis in rates.T], axis=1)
    rates -= np.mean(rates, axis=0)
    turning = rates[:, 2:]
    across = rates[:, :2] - turning @ np.linalg.lstsq(turning, rates[:, :2], rcond=None)[0]
    lines = np.fft.rfft(across * np.hanning(time.size)[:, None], axis=0)
    top = int(np.argmax(np.sum(np.abs(lines[REACH:]) ** 2, axis=1))) + REACH
    near = lines[max(1, top - REACH) : top + REACH + 1]
    # What is out of phase is no line
    powers, ways = np.linalg.eigh(np.real(near.conj().T @ near))
    if powers[1] < ONE_LINE * powers[0]:
        return None
    azimuth = float(np.arctan2(ways[1, 1], ways[0, 1]))
    return azimuth, float(np.sqrt(powers[0] / powers[1]))
