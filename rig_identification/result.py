"""What the tool answers with: frozen values, SI units (recording contract, section "Result")."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from rig_identification.examination import Examination
from rig_identification.joint import JointInformation

Array = NDArray[np.float64]

#: Order of the covariance and of names in ``unobservable``.
ELEMENTS = ("m", "cx", "cy", "cz", "Jxx", "Jxy", "Jxz", "Jyy", "Jyz", "Jzz")


@dataclass(frozen=True)
class UncertaintySource:
    """What one source of doubt adds to the covariance of the ten numbers."""

    name: str  # "cable_1 tension", "tolerance.cable_length", "ground scale"
    kind: str  # "noise", "rest", "tolerance", "scale", "belief", "frame", "model"
    covariance: Array  # (10, 10) in the order of ELEMENTS; of a "model" a variance may be below nothing
    degrees_of_freedom: float | None = (
        None  # of the std that the source has; None: it is stated, not estimated
    )


@dataclass(frozen=True)
class InertialEstimate:
    """Mass, centre of mass (body frame) and inertia about it (body axes), with their joint covariance."""

    values: Array  # (10,) in the order of ELEMENTS: kg, m, kg m^2
    covariance: Array  # (10, 10)
    unobservable: tuple[str, ...] = ()  # names of ELEMENTS that the recordings cannot determine
    sources: tuple[UncertaintySource, ...] = ()  # they add up to ``covariance``; none: not told


@dataclass(frozen=True)
class ParameterEstimate:
    """One fitted nuisance parameter beside what the lab believed of it."""

    name: str  # e.g. "cable_1.length"
    unit: str
    nominal: float  # value of the description
    prior_std: float  # tolerance
    value: float
    std: float  # posterior


@dataclass(frozen=True)
class ChannelFit:
    """One measured channel of one recording against its prediction."""

    recording: str
    channel: str  # "cable_1", "imu", "inclinometer", "exciter", "mocap"
    quantity: str  # "tension", "angular_rate", "specific_force", "inclination", "position", "orientation"
    axis: str | None  # "x", "y", "z" or None
    unit: str
    noise_std: float  # of one sample
    noise_estimated: bool  # True: estimated from the recordings, False: from the description
    time: Array  # (n,) s after the recording's start
    measured: Array  # (n,)
    predicted: Array  # (n,)

    @property
    def residual_in_sigma(self) -> Array:
        """(n,) measured less predicted, in units of the noise of one sample."""
        return np.asarray((self.measured - self.predicted) / self.noise_std)

    @property
    def rms_in_sigma(self) -> float:
        """Root mean square of :attr:`residual_in_sigma`: 1 is a perfect model."""
        return float(np.sqrt(np.mean(self.residual_in_sigma**2)))


@dataclass(frozen=True)
class BodyMotion:
    """Where the fitted model has the body in one run, at a rate for the eye."""

    recording: str
    time: Array  # (n,) s after the recording's start
    position: Array  # (n, 3) m, the body's datum in world
    orientation: Array  # (n, 4) quaternion xyzw, rotates body vectors into world


@dataclass(frozen=True)
class Finding:
    """One piece of physics or one sensor error that the ideal model left out."""

    effect: str  # a word of the contract's table, or "unknown"
    where: dict[str, object]
    parameters: dict[str, dict[str, object]]  # name -> {"value", "std", "unit"}
    evidence: dict[str, float | None]
    statement: str
    advice: str = ""  # of a fault of the set-up: what to change
    correction: str = ""  # of a fault of the set-up: the corrected lines
    #: The model's own parameters, each with its std, by which it can be built again
    numbers: Mapping[str, tuple[float, float]] = field(default_factory=dict)


@dataclass(frozen=True)
class Mismatch:
    """Whether, where and why the ideal model fails."""

    verdict: str  # "none", "explained" or "unexplained"
    explanation: str  # one or two sentences for a person: on what the verdict rests
    findings: tuple[Finding, ...] = ()
    alternatives: tuple[dict[str, object], ...] = ()


@dataclass(frozen=True)
class TextbookAnswer:
    """What a formula that everyone knows makes of the same recordings, beside the whole model's answer."""

    formula: str  # "bifilar", "trifilar", ...
    element: str  # of ELEMENTS
    value: float
    std: float
    unit: str
    period: float  # s, at small amplitudes and without damping
    period_std: float  # s
    amplitude: float  # rad, the widest that was used
    decay: float  # 1/s, of the amplitude
    shares: dict[str, float]  # part of std that comes from each thing measured, in the unit of value
    text: str  # a sentence or two for a person
    leaves_out: tuple[str, ...]  # what the formula knows nothing of


@dataclass(frozen=True)
class Work:
    """What an answer took, in units of work (model/work.py): a count, the same on every machine."""

    used: float
    limit: float  # after which the search begins nothing new
    untried: tuple[str, ...] = ()  # hypotheses that would still have been begun


@dataclass(frozen=True)
class Quantity:
    """A number that follows from the ten, with its std."""

    name: str  # "center_of_mass_height", "front_axle_share"
    value: float
    std: float
    unit: str


@dataclass(frozen=True)
class Identification:
    """Everything that ``identify`` found out about a session."""

    total: InertialEstimate
    without_frame: InertialEstimate | None
    mismatch: Mismatch
    parameters: tuple[ParameterEstimate, ...]
    channels: tuple[ChannelFit, ...]  # training, statics and holdout alike
    holdout_error: float | None  # contract: rms of held-out prediction errors in units of noise
    training_error: float | None  # of the fitted runs, of rest where there is no run; None: nothing fitted
    converged: bool
    notes: tuple[str, ...] = ()  # sentences for the report: warnings, what was left aside
    figures: dict[str, object] = field(default_factory=dict)  # numbers behind further pictures
    examination: Examination | None = None  # of the set-up, before anything was fitted; None: there was none
    work: Work | None = None  # of the fit and the search; None: not counted
    vehicle: tuple[Quantity, ...] = ()  # what follows of the body alone for a vehicle (estimate/vehicle.py)
    textbook: tuple[TextbookAnswer, ...] = ()  # what formulas make of the fitted runs
    interrupted: bool = False  # whether the user broke the search off: the best answer until then
    joint: JointInformation | None = (
        None  # body and rig together; None: the model leaves something, or no fit
    )
    motions: tuple[BodyMotion, ...] = ()  # of the runs, or of their parts, in the order of time
    tie: str | None = None  # a number of the description that Jzz rests on, or is hidden by: one of ``notes``


class Interrupted(KeyboardInterrupt):
    """The user broke the search off when there was an answer already; ``answer``: the best one until then."""

    def __init__(self, answer: Identification) -> None:
        super().__init__("interrupted")
        self.answer = answer


def natural_size(elements: Array) -> Array:
    """(10,) what an error of each element is to be held against.

    The mass, the largest radius of gyration, each moment, and sqrt(Jii Jjj) for the products.
    """
    mass, (xx, yy, zz) = elements[0], elements[[4, 7, 9]]
    moments = np.sqrt([xx * xx, xx * yy, xx * zz, yy * yy, yy * zz, zz * zz])
    radius = np.sqrt(max(xx, yy, zz) / mass)
    return np.concatenate([[mass], np.full(3, radius), moments])
