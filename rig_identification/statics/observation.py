"""What is measured of a body at rest: two inclinations, tensions if there are load cells."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rig_identification.errors import InputError
from rig_identification.recording import Dummy, Recording, Series
from rig_identification.rig import Rig
from rig_identification.statics.equilibrium import Equilibrium

Array = NDArray[np.float64]


@dataclass(frozen=True)
class StaticObservation:
    """Means over one static recording with their standard errors; NaN where not measured."""

    name: str
    inclination: Array  # (2,) rad, inclinometer x and y axis above the horizontal plane
    inclination_std: Array  # (2,) rad, standard error of the means
    tension: Array  # (n,) N, in the order of the rig's cables
    tension_std: Array  # (n,) N, standard error of the means
    dummy: Dummy | None = None


def observe_static(recording: Recording, rig: Rig) -> StaticObservation:
    """Average a static recording.

    Standard errors come from the means of ten blocks, which keeps slow swinging and coloured
    noise in them, and are never below that of the described white noise. Raises ``InputError``
    for a recording that is not static.
    """
    if recording.kind != "static":
        raise InputError(f"{recording.name}: kind is {recording.kind!r}, a static recording is needed")
    noise = rig.noise
    inclination, inclination_std = _mean(recording.inclination, 2, noise.get("inclination", 0.0))
    cells = [_mean(recording.tension.get(cable.name), 1, noise.get("tension", 0.0)) for cable in rig.cables]
    return StaticObservation(
        name=recording.name,
        inclination=inclination,
        inclination_std=inclination_std,
        tension=np.array([mean[0] for mean, _ in cells]),
        tension_std=np.array([std[0] for _, std in cells]),
        dummy=recording.dummy,
    )


def observe_equilibrium(
    rig: Rig,
    equilibrium: Equilibrium,
    name: str = "static",
    dummy: Dummy | None = None,
    inclination_std: float = 0.0,
    tension_std: float | None = None,
    rng: np.random.Generator | None = None,
) -> StaticObservation:
    """What ideal instruments would read of an equilibrium; with ``rng`` noise is added.

    ``inclination_std`` in rad, ``tension_std`` in N; ``None`` leaves the tensions out.
    """
    inclination = inclinations(Rotation.from_quat(equilibrium.orientation), mount(rig))
    tension = equilibrium.tension if tension_std is not None else np.full(len(rig.cables), np.nan)
    if rng is not None:
        inclination = inclination + inclination_std * rng.standard_normal(2)
        tension = tension + (tension_std or 0.0) * rng.standard_normal(len(tension))
    return StaticObservation(
        name=name,
        inclination=inclination,
        inclination_std=np.full(2, inclination_std),
        tension=tension,
        tension_std=np.full(len(rig.cables), np.nan if tension_std is None else tension_std),
        dummy=dummy,
    )


def mount(rig: Rig) -> Rotation:
    """Rotation of inclinometer-frame vectors into body; the body's own axes where none is described."""
    return (
        Rotation.identity() if rig.inclinometer is None else Rotation.from_quat(rig.inclinometer.orientation)
    )


def inclinations(attitude: Rotation, mounted: Rotation) -> Array:
    """(2,) rad that an inclinometer reads: asin of the z component of its x and y axes in world."""
    return np.asarray(np.arcsin((attitude * mounted).as_matrix()[2, :2]))


def up_in_body(inclination: Array, mounted: Rotation) -> Array:
    """(3,) unit vector that points upwards, in body, from the two inclinations.

    It is the third row of the attitude, (c31, c32, c33) of thesis eq. 2.6. The sign of c33
    is not measured: the body is taken to hang the right way up.
    """
    horizontal = np.sin(inclination)
    rest = 1.0 - float(horizontal @ horizontal)
    if rest <= 0.0:
        raise InputError(
            f"inclinations {inclination[0]:.4g} and {inclination[1]:.4g} rad: "
            "no attitude has both; check the unit"
        )
    return np.asarray(mounted.apply(np.append(horizontal, np.sqrt(rest))))


def _mean(series: Series | None, width: int, noise: float, blocks: int = 10) -> tuple[Array, Array]:
    if series is None or len(series.time) == 0:
        return np.full(width, np.nan), np.full(width, np.nan)
    mean, std = np.full((2, width), np.nan)
    for part in series.parts():
        # What is measured together most often comes first, and stands
        missing = [c for c in part.components if np.isnan(mean[c])]
        values = part.series.values[:, [part.components.index(c) for c in missing]]
        mean[missing] = values.mean(axis=0)
        floor = noise / np.sqrt(len(values))
        if len(values) < 2 * blocks:
            std[missing] = max(noise, floor)
        else:
            means = np.array([block.mean(axis=0) for block in np.array_split(values, blocks)])
            std[missing] = np.maximum(means.std(axis=0, ddof=1) / np.sqrt(blocks), floor)
    return mean, std
