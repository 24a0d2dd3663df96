"""What the fuzz bench makes sessions of: recipes drawn from a seed, and the messages that they stand for."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rig_identification.errors import InputError
from rig_identification.raw import RawChannel, RawRecording, RawSession
from rig_identification.recording import Dummy, Recording, Series, Session
from rig_identification.rig import DEFAULT_TOLERANCE, Cable, CarryingFrame, Mount, Rig
from rig_identification.session.fields import Fields
from rig_identification.session.rig_description import rig_from_fields
from rig_identification.session.rig_document import rig_document
from rig_identification.simulate import (
    Pulled,
    RunSpec,
    SampleRates,
    SessionSpec,
    StaticSpec,
    UnbalancedMass,
    simulate_session,
)
from rig_identification.topics import FIXED_TOPICS, WRENCH

Array = NDArray[np.float64]

SHAPES = ("parallel", "splayed", "corner", "line", "one point", "anyhow")
DEVICES = ("tension", "imu", "inclinometer", "exciter", "mocap")
#: What may be wrong with a recording.
FAULTS = ("none", "none", "none", "gaps", "never a number", "cable missing", "jumbled", "constant", "spikes")
NOISE = {
    "tension": 2.0,
    "exciter_force": 0.5,
    "specific_force": 0.01,
    "angular_rate": 3e-4,
    "inclination": 3e-4,
    "mocap_position": 3e-4,
    "mocap_orientation": 1e-3,
}
#: Samples of one channel beyond which a long recording is drawn slower.
MOST_SAMPLES = 400_000


@dataclass(frozen=True)
class Recipe:
    """What a session is made of; the numbers behind it come from ``seed``."""

    seed: int
    cables: int
    shape: str
    mass: float  # kg
    devices: tuple[str, ...]  # that record
    mounted: tuple[str, ...]  # that are described
    rate: float  # Hz, of the fastest device
    seconds: float  # s, of a run
    runs: tuple[bool, ...]  # held out?
    statics: int
    dummies: tuple[float, ...]  # mass of each static recording's dummy as a share of the body's; 0: none
    moves: bool  # False: smooth numbers that are no motion of this rig
    shaken: bool
    fault: str
    noise_told: bool
    mass_told: bool
    frame: bool
    odd: bool  # hinges and body as no one would build them


def recipe_of(seed: int) -> Recipe:
    """The recipe that a seed stands for."""
    rng = np.random.default_rng([seed, 48])
    devices = tuple(d for d in DEVICES if rng.random() < (0.35 if d == "mocap" else 0.7)) or ("mocap",)
    if rng.random() < 0.15:
        devices = (str(rng.choice(DEVICES)),)
    seconds = float(np.exp(rng.uniform(0.0, np.log(1800.0))))
    statics = int(rng.choice([0, 1, 2, 2]))
    runs = tuple(bool(rng.random() < 0.35) for _ in range(rng.choice([0, 1, 1, 2, 2, 3])))
    return Recipe(
        seed=seed,
        cables=int(rng.integers(2, 9)),
        shape=str(rng.choice(SHAPES)),
        mass=float(np.exp(rng.uniform(np.log(0.05), np.log(40_000.0)))),
        devices=devices,
        mounted=tuple(d for d in DEVICES if d in devices or rng.random() < 0.3),
        rate=min(float(np.exp(rng.uniform(np.log(20.0), np.log(1000.0)))), MOST_SAMPLES / seconds),
        seconds=seconds,
        runs=runs if runs or statics else (False,),
        statics=statics,
        dummies=tuple(float(rng.choice([0.0, 0.02, 0.1, 0.5])) for _ in range(statics)),
        moves=bool(rng.random() < 0.85),
        shaken=bool(rng.random() < 0.5),
        fault=str(rng.choice(FAULTS)),
        noise_told=bool(rng.random() < 0.6),
        mass_told=bool(rng.random() < 0.7),
        frame=bool(rng.random() < 0.2),
        odd=bool(rng.random() < 0.2),
    )


def simpler(recipe: Recipe) -> Iterator[Recipe]:
    """Recipes one step simpler, for the search of the simplest one that fails alike."""
    usual = {
        "odd": False,
        "frame": False,
        "fault": "none",
        "noise_told": True,
        "mass_told": True,
        "shaken": False,
        "moves": True,
        "shape": "splayed",
        "statics": 0,
        "dummies": (0.0,) * recipe.statics,
        "runs": recipe.runs[:1],
        "mounted": recipe.devices,
        "mass": 100.0,
        "cables": 3,
        "rate": 50.0,
        "seconds": 5.0,
    }
    for name, value in usual.items():
        changed = replace(recipe, **{name: value})  # type: ignore[arg-type]
        if name == "statics":
            changed = replace(changed, dummies=())
        if changed != recipe and (changed.runs or changed.statics):
            yield changed
    for device in recipe.devices if len(recipe.devices) > 1 else ():
        kept = tuple(d for d in recipe.devices if d != device)
        yield replace(recipe, devices=kept, mounted=kept)


def rig_of(recipe: Recipe, rng: np.random.Generator) -> tuple[Rig, Array]:
    """The description, and the body (10,): m, c, J about the centre of mass."""
    n, m = recipe.cables, recipe.mass
    # A body of 1 to 1000 kg/m^3, in its own box
    extent = (m / np.exp(rng.uniform(np.log(1.0), np.log(1000.0)))) ** (1.0 / 3.0)
    extent = float(np.clip(extent, 0.05, 12.0))
    sides = extent * rng.uniform(0.4, 1.6, 3)
    length = float(np.clip(extent * rng.uniform(0.5, 4.0), 0.2, 20.0))
    turn = 2.0 * np.pi * (np.arange(n) + rng.uniform(0.0, 0.3, n)) / n
    body = 0.5 * np.stack([sides[0] * np.cos(turn), sides[1] * np.sin(turn), np.zeros(n)], axis=1)
    lengths = np.full(n, length)
    if recipe.shape == "corner":
        body = rng.uniform(-0.5, 0.5, (n, 3)) * sides
    elif recipe.shape == "line":
        body[:, 1] = 0.0
    elif recipe.shape == "one point":
        body[:] = rng.uniform(-1e-3, 1e-3, (n, 3))
    ceiling = body * [1.0, 1.0, 0.0]
    if recipe.shape in ("splayed", "one point"):
        ceiling = ceiling * rng.uniform(0.3, 2.0) + length * 0.2 * np.stack(
            [np.cos(turn), np.sin(turn), 0 * turn], 1
        )
    elif recipe.shape == "anyhow":
        ceiling = ceiling + rng.uniform(-0.5, 0.5, (n, 3)) * length
        lengths = lengths * rng.uniform(0.7, 1.3, n)
    if recipe.shape != "anyhow":
        # As long as it takes to hang level
        lengths = np.linalg.norm(ceiling - body + [0.0, 0.0, length], axis=1)
    if recipe.odd:
        lengths = lengths * rng.uniform(0.5, 1.5, n)
        body = body * np.exp(rng.uniform(-2.0, 2.0))
    lengths = np.clip(lengths, 1e-3, 100.0)
    cables = tuple(
        Cable(f"cable_{i + 1}", ceiling[i], body[i], float(lengths[i]), str(rng.choice(["ceiling", "body"])))
        for i in range(n)
    )
    squares = m * sides**2 / 12.0
    J = np.diag(np.sum(squares) - squares)
    tilt = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    J = tilt @ J @ tilt.T if recipe.odd else J
    center = np.mean(body, axis=0) - [0.0, 0.0, 0.5 * sides[2]] + 0.1 * sides * rng.uniform(-1.0, 1.0, 3)
    elements = np.array([m, *center, J[0, 0], J[0, 1], J[0, 2], J[1, 1], J[1, 2], J[2, 2]])

    def mount() -> Mount:
        q = rng.normal(size=4) if rng.random() < 0.5 else np.array([0.0, 0.0, 0.0, 1.0])
        return Mount(0.5 * sides * rng.uniform(-1.0, 1.0, 3), q / np.linalg.norm(q))

    heavy = max(m / 500.0, 1e-3)
    noise = {**NOISE, "tension": 2.0 * heavy, "exciter_force": 0.5 * heavy}
    tolerance = {**DEFAULT_TOLERANCE, "load_cell_zero": 3.0 * heavy}
    if rng.random() < 0.1:
        tolerance = dict.fromkeys(tolerance, 0.0)
    rig = Rig(
        9.80665,
        cables,
        mass=m if recipe.mass_told else None,
        mass_std=4e-4 * m if recipe.mass_told and rng.random() < 0.8 else None,
        frame=CarryingFrame(0.15 * m, center, 0.15 * J) if recipe.frame and recipe.mass_told else None,
        imu=mount() if "imu" in recipe.mounted else None,
        inclinometer=replace(mount(), position=np.zeros(3)) if "inclinometer" in recipe.mounted else None,
        exciter=mount() if "exciter" in recipe.mounted else None,
        mocap=mount() if "mocap" in recipe.mounted and rng.random() < 0.4 else None,
        noise=noise,
        tolerance=tolerance,
    )
    return rig, elements


def session_of(recipe: Recipe) -> RawSession:
    """The recorded session. Raises InputError where its description cannot be used."""
    rng = np.random.default_rng([recipe.seed, 2])
    rig, elements = rig_of(recipe, rng)
    session = None
    if recipe.moves:
        try:
            session = _simulated(recipe, rig, elements, rng)
        except InputError:
            # No rest on such cables, or a motion that leaves every bound: numbers take its place
            session = None
    if session is None:
        session = _smooth(recipe, rig, rng)
    noise = rig.noise if recipe.noise_told else {}
    document = rig_document(replace(session.rig, noise=noise))["/**"]["ros__parameters"]  # type: ignore[index]
    read = rig_from_fields(Fields(Path("rig.yaml"), "", document))
    raw = RawSession(f"fuzz_{recipe.seed}", read, tuple(_raw(recording) for recording in session.recordings))
    return _damaged(raw, recipe.fault, rng)


def _rates(recipe: Recipe, rng: np.random.Generator) -> dict[str, float]:
    return {
        d: (recipe.rate * float(rng.choice([1.0, 0.5, 0.2])) if d in recipe.devices else 0.0) for d in DEVICES
    }


def _simulated(recipe: Recipe, rig: Rig, elements: Array, rng: np.random.Generator) -> Session:
    rates = _rates(recipe, rng)
    weight = float(elements[0]) * rig.gravity
    runs = []
    for i, held in enumerate(recipe.runs):
        pull = weight * rng.uniform(0.01, 0.15) * rng.normal(size=3) * [1.0, 1.0, 0.1]
        force = None
        if recipe.shaken:
            hertz = float(rng.uniform(0.4, 2.0))
            force = UnbalancedMass(0.02 * weight / (2.0 * np.pi * hertz) ** 2, hertz, ramp=1.0)
        runs.append(RunSpec(f"run_{i + 1}", recipe.seconds, Pulled(pull, elements[1:4]), force, held))
    statics = tuple(
        StaticSpec(
            f"static_{i + 1}",
            float(rng.uniform(2.0, 10.0)),
            None
            if share == 0.0
            else Dummy(share * float(elements[0]), elements[1:4] + 0.1 * rng.normal(size=3)),
        )
        for i, share in enumerate(recipe.dummies)
    )
    spec = SessionSpec(
        f"fuzz_{recipe.seed}",
        rig,
        elements,
        runs=tuple(runs),
        statics=statics,
        rates=SampleRates(
            rates["tension"], rates["exciter"], 0.0, rates["imu"], rates["inclinometer"], rates["mocap"], 0.0
        ),
    )
    return simulate_session(spec, rng)[0]


def _smooth(recipe: Recipe, rig: Rig, rng: np.random.Generator) -> Session:
    """Numbers as smooth as a motion, and of no rig."""
    rates, weight = _rates(recipe, rng), recipe.mass * 9.80665

    def series(rate: float, seconds: float, means: Array, swing: float, noise: float) -> Series:
        time = np.arange(0.0, seconds, 1.0 / rate)
        phase = 2.0 * np.pi * rng.uniform(0.2, 1.5) * time[:, None] + rng.uniform(0.0, 6.0, means.size)
        return Series(time, means + swing * np.sin(phase) + noise * rng.normal(size=(time.size, means.size)))

    def recorded(name: str, kind: str, seconds: float, held: bool, dummy: Dummy | None) -> Recording:
        still = 0.0 if kind == "static" else 1.0
        tension = {
            c.name: series(
                rates["tension"],
                seconds,
                np.full(1, weight / recipe.cables),
                0.02 * still * weight,
                1e-4 * weight,
            )
            for c in rig.cables
            if rates["tension"] > 0.0
        }
        pose = None
        if rates["mocap"] > 0.0:
            pose = series(
                rates["mocap"], seconds, np.array([0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 1.0]), 0.03 * still, 1e-4
            )
            values = pose.values.copy()
            values[:, 3:] /= np.linalg.norm(values[:, 3:], axis=1, keepdims=True)
            pose = replace(pose, values=values)
        up = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 9.80665])
        return Recording(
            name, kind, held, 1_790_000_000_000_000_000, seconds, dummy, tension,
            exciter_force=series(rates["exciter"], seconds, np.zeros(3), 0.05 * weight, 1e-3 * weight)
            if rates["exciter"] > 0.0 and kind == "dynamic" else None,
            imu=series(rates["imu"], seconds, up, 0.05 * still, 1e-3) if rates["imu"] > 0.0 else None,
            inclination=series(rates["inclinometer"], seconds, np.zeros(2), 0.02 * still, 3e-4)
            if rates["inclinometer"] > 0.0 else None,
            mocap=pose,
        )  # fmt: skip

    recordings = [
        recorded(
            f"static_{i + 1}",
            "static",
            5.0,
            False,
            None if s == 0.0 else Dummy(s * recipe.mass, 0.1 * rng.normal(size=3)),
        )
        for i, s in enumerate(recipe.dummies)
    ]
    recordings += [
        recorded(f"run_{i + 1}", "dynamic", recipe.seconds, held, None) for i, held in enumerate(recipe.runs)
    ]
    return Session(f"fuzz_{recipe.seed}", rig, tuple(recordings))


def _raw(recording: Recording) -> RawRecording:
    """The recording as messages."""
    channels = []

    def add(topic: str, channel: str, kind: str, series: object, cable: str | None = None) -> None:
        if series is not None and series.time.size:  # type: ignore[attr-defined]
            stamp = recording.start_ns + np.round(series.time * 1e9).astype(np.int64)  # type: ignore[attr-defined]
            channels.append(
                RawChannel(topic, channel, kind, stamp, stamp + 2_000_000, series.values.copy(), cable)  # type: ignore[attr-defined]
            )

    for cable, series in recording.tension.items():
        add(f"/rig/{cable}/wrench", "tension", WRENCH, series, cable)
    for name, (channel, kind) in FIXED_TOPICS.items():
        add(f"/rig/{name}", channel, kind, getattr(recording, channel))
    listed = {c.topic: c.message_type for c in channels}
    counts = {c.topic: c.stamp_ns.size for c in channels}
    return RawRecording(
        recording.name,
        recording.kind,
        recording.holdout,
        recording.name,
        tuple(channels),
        listed,
        counts,
        recording.dummy,
    )


def _damaged(raw: RawSession, fault: str, rng: np.random.Generator) -> RawSession:
    """The session with one fault in some of its channels."""
    recordings = []
    for recording in raw.recordings:
        channels = []
        for c in recording.channels:
            values, stamp = c.values.copy(), c.stamp_ns.copy()
            n = stamp.size
            chosen = rng.random() < 0.5
            if fault == "gaps" and chosen:
                a = int(rng.integers(0, n))
                values[a : a + max(1, n // 4)] = np.nan
            elif fault == "never a number" and chosen:
                values[:] = np.nan
            elif fault == "cable missing" and chosen and c.cable is not None:
                continue
            elif fault == "jumbled" and chosen and n > 3:
                stamp[rng.integers(0, n, max(1, n // 20))] -= int(1e8)
            elif fault == "constant" and chosen:
                values[:] = values[0]
            elif fault == "spikes" and chosen:
                values[rng.integers(0, n, max(1, n // 100))] *= 100.0
            channels.append(replace(c, values=values, stamp_ns=stamp))
        if channels:
            recordings.append(replace(recording, channels=tuple(channels)))
    return replace(raw, recordings=tuple(recordings))
