"""``simulate``: a session in memory from the tool's own forward model, with the truth behind it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rig_identification.api.cases import case_named
from rig_identification.errors import ArgumentError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from rig_identification.recording import Session
    from rig_identification.rig import Rig
    from rig_identification.simulate import RunSpec, SessionSpec, Truth

    Array = NDArray[np.float64]

#: How a run may begin, and the devices that may be left out.
STARTS = ("thesis", "pulled", "rest")
DEVICES = ("tension", "exciter", "imu", "inclinometer")


@dataclass(frozen=True)
class Simulated:
    """A session that nobody recorded, and what is true of it."""

    session: Session
    truth: Truth
    spec: SessionSpec  # what was asked for

    @property
    def values(self) -> Array:
        """(10,) the true body in the order of ``ELEMENTS``: kg, m, kg m^2 about the centre of mass."""
        return self.truth.elements

    def write(self, folder: str | Path, *, storage: str = "mcap", overwrite: bool = False) -> Path:
        """Write bags, ``session.yaml``, ``rig.yaml`` and ``truth.json`` into a new folder.

        storage: ``mcap`` or ``sqlite3``.

        Raises
        ------
        InputError
            The folder exists and ``overwrite`` is not given, or it cannot be written to.
        """
        from rig_identification.api.truth import write_simulated

        write_simulated(self.session, self.truth, Path(folder), storage=storage, overwrite=overwrite)
        return Path(folder)


def simulate(
    rig: Rig | str | Path | None = None,
    *,
    case: int | str | None = None,
    body: Sequence[float] | Array | None = None,
    duration: float = 20.0,
    rest: float = 10.0,
    start: str | None = None,
    pull: float = 0.06,
    displaced: Sequence[float] | None = None,
    shake: Sequence[float] | None = None,
    motor: Sequence[float] | None = None,
    plane: str = "xy",
    mocap: float = 0.0,
    without: Sequence[str] = (),
    noise: bool = True,
    doubts: bool = True,
    rods: bool = False,
    effects: Mapping[str, Sequence[float]] | None = None,
    seed: int = 0,
    name: str = "simulated",
) -> Simulated:
    """Simulate two runs, the second held out, and recordings at rest.

    Parameters
    ----------
    rig : Rig, str or Path
        A rig, or the file that describes it. Either this or ``case``.
    case : int or str
        Case study of the thesis, with its own body: 1 to 17, or ``"18a"`` to ``"18d"``.
    body : ten numbers
        m, cx, cy, cz, Jxx, Jxy, Jxz, Jyy, Jyz, Jzz: kg, m, kg m^2 about the centre of mass.
    duration, rest : float
        s, of a run and of a recording at rest; ``rest`` 0: none.
    start : str, optional
        ``pulled`` aside and let go, at ``rest``, or as in the ``thesis`` (the default of a case).
    pull : float
        Force that pulls aside, as a share of the weight.
    displaced : six numbers, optional
        In place of ``start``: the runs begin so far off the rest pose, in the nearest pose that the cables
        allow: x y z in m, then turns about world x, y and z in rad.
    shake : two numbers, optional
        Unbalanced mass of the exciter: its force as a share of the weight, at a speed in Hz.
    motor : three numbers, optional
        The same as mass (kg), radius (m) and speed (Hz).
    plane : str
        Of its turning, in the exciter's frame: ``xy``, ``xz`` or ``yz``.
    mocap : float
        Hz of motion capture; 0: none.
    without : names
        Devices that do not record although they are mounted: of ``DEVICES``.
    noise, doubts : bool
        Noise of the sensors; a rig that is not quite as described.
    rods : bool
        Cables that push as well.
    effects : mapping, optional
        Left-out physics: name to its numbers, ``{"hinge_damping": (20.0,)}``.
    seed : int
        Of every random number. The same arguments give the same session.
    name : str
        The session's name.

    Raises
    ------
    InputError
        The arguments do not fit together, or the body finds no rest.
    """
    import numpy as np

    from rig_identification.simulate import simulate_session

    asked = _Asked(case, rig, body, duration, rest, start, pull, displaced, shake, motor, plane)
    _check(asked, mocap, seed, without)
    spec = _of_case(asked) if case is not None else _of_rig(asked)
    spec = replace(
        spec,
        name=name,
        rates=replace(spec.rates, mocap=mocap, **dict.fromkeys(without, 0.0)),
        noise=noise,
        doubts=doubts,
        rods=rods,
        effects={key: _numbers(value) for key, value in (effects or {}).items()},
        runs=tuple(_moved(asked, spec, run, i) for i, run in enumerate(spec.runs)),
    )
    session, truth = simulate_session(spec, np.random.default_rng(seed))
    return Simulated(session, truth, spec)


@dataclass(frozen=True)
class _Asked:
    """Arguments of :func:`simulate` by its names: which body on which rig, and how it is moved."""

    case: int | str | None
    rig: Any
    body: Any
    duration: float
    rest: float
    start: str | None
    pull: float
    displaced: Sequence[float] | None
    shake: Sequence[float] | None
    motor: Sequence[float] | None
    plane: str


def _numbers(value: Sequence[float] | float) -> tuple[float, ...]:
    return (float(value),) if isinstance(value, (int, float)) else tuple(map(float, value))


def _check(asked: _Asked, mocap: float, seed: int, without: Sequence[str]) -> None:
    amounts = {"duration": asked.duration, "rest": asked.rest, "pull": asked.pull, "mocap": mocap}
    for name, value in amounts.items():
        if not 0.0 <= value < 1e5:
            raise ArgumentError(f"{name} {value:g}: must be positive")
    if asked.duration < 1.0:
        raise ArgumentError(f"duration {asked.duration:g}: a run lasts at least 1 s")
    if seed < 0:
        raise ArgumentError(f"seed {seed}: must not be negative")
    if asked.start not in (None, *STARTS):
        raise ArgumentError(f"start {asked.start}: is unknown; give {', '.join(STARTS)}")
    if asked.plane not in ("xy", "xz", "yz"):
        raise ArgumentError(f"plane {asked.plane}: is unknown; give xy, xz or yz")
    if asked.displaced is not None and (len(asked.displaced) != 6 or asked.start is not None):
        raise ArgumentError("displaced: give six numbers, x y z in m and three turns in rad, and no start")
    for device in without:
        if device not in DEVICES:
            raise ArgumentError(f"without {device}: is no device; give any of {', '.join(DEVICES)}")
    if (asked.case is None) == (asked.rig is None):
        raise ArgumentError("rig: give either a rig or a case")


def _of_case(asked: _Asked) -> SessionSpec:
    from rig_identification.simulate import case_spec

    if asked.body is not None:
        raise ArgumentError("body: a case study has its own body; leave it out, or give a rig")
    return case_spec(case_named(str(asked.case)), duration=asked.duration, rest=asked.rest)


def _of_rig(asked: _Asked) -> SessionSpec:
    import numpy as np

    from rig_identification.model.body import can_exist
    from rig_identification.result import ELEMENTS
    from rig_identification.rig import Rig
    from rig_identification.session import read_rig
    from rig_identification.simulate import RunSpec, SessionSpec
    from rig_identification.simulate.thesis_case import resting

    rig = asked.rig if isinstance(asked.rig, Rig) else read_rig(Path(asked.rig))
    if asked.body is None:
        raise ArgumentError(
            "body: missing; a rig description says nothing of the inertia, so give all ten numbers"
        )
    elements = np.array(asked.body, dtype=float)
    if elements.shape != (len(ELEMENTS),):
        raise ArgumentError(f"body: has shape {elements.shape}; give ten numbers, {' '.join(ELEMENTS)}")
    if not can_exist(elements):
        raise ArgumentError("body: no body has this mass and inertia; check the order " + " ".join(ELEMENTS))
    if asked.start == "thesis":
        raise ArgumentError("start thesis: only a case study has it; give pulled or rest")
    runs = (RunSpec("run_1", asked.duration), RunSpec("run_2", asked.duration, holdout=True))
    return SessionSpec("", rig, elements, runs, resting(rig, float(elements[0]), asked.rest))


def _moved(asked: _Asked, spec: SessionSpec, run: RunSpec, number: int) -> RunSpec:
    """The run with the start and the exciter asked for; a second run differs from the first."""
    import numpy as np

    from rig_identification.simulate import AtRest, Displaced, Pulled, UnbalancedMass

    weight = float(spec.elements[0]) * spec.rig.gravity
    start = asked.start or ("thesis" if asked.case is not None else "pulled")
    if asked.displaced is not None:
        six = np.array(asked.displaced, dtype=float)
        run = replace(run, start=Displaced(six[:3], six[3:]))
    elif start == "rest":
        run = replace(run, start=AtRest())
    elif start == "pulled":
        heading = 0.9 + 1.2 * number
        force = asked.pull * weight * np.array([np.cos(heading), np.sin(heading), 0.0])
        hinges = np.array([cable.body_point for cable in spec.rig.cables])
        aside = 0.15 * np.ptp(hinges, axis=0) * (1.0 - 2.0 * number)
        run = replace(run, start=Pulled(force, spec.elements[1:4] + aside))
    shaken = _unbalance(asked, weight)
    if shaken is None:
        return run
    if spec.rig.exciter is None:
        option = "motor" if asked.motor is not None else "shake"
        raise ArgumentError(f"{option}: the rig description mounts no exciter; add one, or leave it out")
    unbalance, frequency = shaken
    motor = UnbalancedMass(unbalance, frequency, asked.plane, ramp=3.0, angle=float(number))
    return replace(run, force=motor)


def _unbalance(asked: _Asked, weight: float) -> tuple[float, float] | None:
    """(kg m, Hz) of the motor that is asked for; None: none."""
    import math

    if asked.motor is not None:
        mass, radius, frequency = asked.motor
        if not (mass > 0.0 and radius > 0.0 and 0.0 < frequency <= 20.0):
            text = f"motor {mass:g} {radius:g} {frequency:g}"
            raise ArgumentError(f"{text}: give mass and radius above 0 and a speed up to 20 Hz")
        return mass * radius, frequency
    if asked.shake is None:
        return None
    share, frequency = asked.shake
    if not (share > 0.0 and 0.0 < frequency <= 20.0):
        raise ArgumentError(f"shake {share:g} {frequency:g}: give a share above 0 and a speed up to 20 Hz")
    return share * weight / (2.0 * math.pi * frequency) ** 2, frequency
