"""What is to be simulated: a body on a rig, its programme of motion, and the devices that watch."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from rig_identification.recording import Dummy
from rig_identification.rig import Mount, Rig
from rig_identification.simulate.exciter import ForceProgram
from rig_identification.simulate.start import AtRest, Start

Array = NDArray[np.float64]

#: A motion-capture system that stands somewhere in the room, turned by 23 degrees.
TRACKER = Mount(np.array([1.2, -0.4, 0.1]), np.array([0.0, 0.0, np.sin(0.2), np.cos(0.2)]))


@dataclass(frozen=True)
class SampleRates:
    """Rate of each device, Hz; 0: not there. A device that the rig does not mount is not there either."""

    tension: float = 500.0
    exciter: float = 500.0
    shaft: float = 100.0  # of the exciter; only where its program turns a shaft
    imu: float = 200.0
    inclinometer: float = 50.0
    mocap: float = 0.0
    ground_truth: float = 100.0

    def of(self, device: str) -> float:
        """Rate of imu, inclinometer or mocap, and of any other name as of a cable."""
        rates = {"imu": self.imu, "inclinometer": self.inclinometer, "mocap": self.mocap}
        return rates.get(device, self.tension)


@dataclass(frozen=True)
class RunSpec:
    """One dynamic recording."""

    name: str
    duration: float  # s
    start: Start = field(default_factory=AtRest)
    force: ForceProgram | None = None  # None: the body swings freely
    holdout: bool = False


@dataclass(frozen=True)
class StaticSpec:
    """One recording of the body at rest."""

    name: str
    duration: float  # s
    dummy: Dummy | None = None


@dataclass(frozen=True)
class SessionSpec:
    """One session.

    ``noise``: every sample has the noise of ``rig.noise``. ``doubts``: the true rig is drawn
    about the description, each quantity by its tolerance (normal, cut at three tolerances:
    what lies beyond would be a finding), and the scale's reading about the true mass.
    ``given_doubts``: doubts that are not drawn, each so many tolerances off its description: what sessions
    of one rig share. ``scale_reading``: kg that the scale showed instead of a drawn reading.
    ``rods``: the cables push as well. ``effects``: left-out physics by the switches of
    ``live/plant_switches.py`` (a push's start counts from the run's), and errors of devices by the names of
    their doubts (``imu.gyroscope_bias.x``), on top of what is drawn.
    """

    name: str
    rig: Rig  # what the lab believes
    elements: Array  # (10,) the body: m, c, J about the centre of mass (model/body.py)
    runs: tuple[RunSpec, ...] = ()
    statics: tuple[StaticSpec, ...] = ()
    rates: SampleRates = field(default_factory=SampleRates)
    noise: bool = True
    doubts: bool = True
    rods: bool = False
    effects: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    world_in_tracker: Mount = field(default_factory=lambda: TRACKER)
    start_ns: int = 1_790_000_000_000_000_000  # stamp at which the first recording starts
    given_doubts: Mapping[str, float] = field(default_factory=dict)
    scale_reading: float | None = None
