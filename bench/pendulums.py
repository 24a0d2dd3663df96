"""Pendulums that motion capture alone watches, drawn at random, one effect concealed in each: what is told.

By the project's own simulator: a check of the way from recordings to an answer, not of the model. Body, rig
and doubts about it are drawn; two runs, the second held out. Each row is written as it is done.

    python -m bench.pendulums --out FILE [--seeds 2 3 4] [--kinds clean damping ...] [--threads 2]
    python -m bench.pendulums --out FILE --seeds 2 --kinds damping --seconds 1800 --rate 180 --bags

With ``--bags`` a session goes the whole way: written as bags, read, examined and identified.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rig_identification.identification import identify_prepared, prepare
from rig_identification.recording import Session
from rig_identification.result import ELEMENTS, Identification
from rig_identification.rig import DEFAULT_TOLERANCE, Cable, Rig
from rig_identification.search.identify import identify
from rig_identification.session import read_raw, write_session
from rig_identification.simulate import Posed, RunSpec, SampleRates, SessionSpec, simulate_session

Array = NDArray[np.float64]
Effects = dict[str, tuple[float, ...]]

#: By number of threads n, mass of the body m and length of the threads: what is concealed.
KINDS: dict[str, Callable[[int, float, float], Effects]] = {
    "clean": lambda n, m, length: {},
    "damping": lambda n, m, length: {"hinge_damping": (0.002 * m * length,)},
    "friction": lambda n, m, length: {"hinge_friction": (0.0049 * m,)},
    "drag": lambda n, m, length: {"air_drag": (0.3,)},
    "length": lambda n, m, length: {"cable_length": (*[0.0] * (n - 1), 0.03)},
    "hinge": lambda n, m, length: {"hinge_position.ceiling": (*[0.0] * (3 * n - 3), 0.02, 0.0, 0.0)},
    "ends": lambda n, m, length: {"held_ends": (*[0.0] * (3 * n - 3), 0.0, 0.0, 0.08 * m * 9.8 / n * length)},
}


def drawn(
    kind: str, seed: int, threads: int, seconds: float = 30.0, rate: float = 100.0
) -> tuple[SessionSpec, Array]:
    """A session's specification, and m, c, J (10,) of its body. seconds: of the first run; rate: Hz."""
    rng = np.random.default_rng([seed, *kind.encode(), threads])
    length, apart, mass = rng.uniform(1.0, 2.0), rng.uniform(0.35, 0.8), rng.uniform(0.8, 8.0)
    angles = 2.0 * np.pi * np.arange(threads) / threads
    points = 0.5 * apart * np.stack([np.cos(angles), np.sin(angles), np.zeros(threads)], axis=1)
    cables = tuple(Cable(f"cable_{i + 1}", p, p, length) for i, p in enumerate(points))
    tolerance = {**DEFAULT_TOLERANCE, "cable_length": 0.002, "hinge_position": 0.001}
    noise = {"mocap_position": 3e-4, "mocap_orientation": 1e-3}
    rig = Rig(9.80665, cables, mass, 0.002, noise=noise, tolerance=tolerance)
    sides = (apart * rng.uniform(0.3, 0.5, 3)) ** 2
    moments = mass * (np.sum(sides) - sides) / 1.5
    across = rng.normal(0.0, 0.02 * np.min(moments), 3)
    # Two threads hold the centre of mass in their own plane
    aside = rng.normal(0.0, 0.01, 2) * [1.0, float(threads > 2)]
    center = [*aside, -rng.uniform(0.05, 0.2)]
    tensor = [moments[0], across[0], across[1], moments[1], across[2], moments[2]]
    elements = np.array([mass, *center, *tensor])

    def let_go(yaw: float, y: float, roll: float) -> Posed:
        turn = Rotation.from_euler("zx", [yaw, roll])
        return Posed(np.array([rng.normal(0.0, 0.01), y, 0.01 - length]), turn.as_quat())

    runs = (
        RunSpec("run_1", seconds, let_go(0.3, 0.02, 0.03)),
        RunSpec("run_2", 20.0, let_go(-0.2, -0.02, -0.03), holdout=True),
    )
    rates = SampleRates(0.0, 0.0, 0.0, 0.0, 0.0, rate, 0.0)
    effects = KINDS[kind](threads, mass, length)
    return SessionSpec(kind, rig, elements, runs, rates=rates, effects=effects), elements


def row(spec: SessionSpec, seed: int, answer: Identification, elements: Array, seconds: float) -> str:
    """One line of the table."""
    std = np.sqrt(np.diag(answer.total.covariance))
    off = {
        name: abs(float(answer.total.values[i] - elements[i]) / std[i])
        for i, name in enumerate(ELEMENTS)
        if name not in answer.total.unobservable
    }
    worst = max(off, key=lambda name: off[name])
    told = []
    for f in answer.mismatch.findings:
        name, first = next(iter(f.parameters.items()))
        place = next((str(f.where[k]) for k in ("channel", "law", "axis") if f.where.get(k)), "")
        told.append(f"{f.effect} {place} {name} {first['value']:.4g} ± {first['std']:.2g}")
    concealed = [v for values in spec.effects.values() for v in values]
    amount = f" {max(concealed, key=abs):.4g}" if concealed else ""
    before = answer.figures["ideal"].holdout_error if "ideal" in answer.figures else answer.holdout_error
    return (
        f"| {spec.name}{amount} | {seed} | {answer.mismatch.verdict} | {'; '.join(told)} | {before:.3g}, "
        f"{answer.holdout_error:.3g} | {worst} {off[worst]:.1f} σ | {seconds:.0f} s |"
    )


def timed(session: Session) -> tuple[Identification, float]:
    """The answer, and seconds until then."""
    begin = time.monotonic()
    return identify(session), time.monotonic() - begin


def whole_way(session: Session) -> tuple[Identification, float]:
    """The answer to the session as bags, and seconds of all threads' processor from reading to it."""
    with tempfile.TemporaryDirectory() as folder:
        bags = write_session(session, Path(folder) / "session", compression="storage")
        begin = time.process_time()
        prepared = prepare(read_raw(bags))
        examined = time.process_time() - begin
        answer = identify_prepared(prepared)
        seconds = time.process_time() - begin
    print(
        f"examined in {examined:.1f} of {seconds:.1f} s of processor; {'; '.join(answer.notes)}", flush=True
    )
    return answer, seconds


def main() -> None:
    """Write the table, row by row."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2, 3, 4])
    parser.add_argument("--kinds", nargs="+", choices=tuple(KINDS), default=list(KINDS))
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--seconds", type=float, default=30.0, help="length of the fitted run")
    parser.add_argument("--rate", type=float, default=100.0, help="Hz, of the motion capture")
    parser.add_argument("--bags", action="store_true", help="written, read and examined as well")
    parser.add_argument("--out", type=Path, required=True)
    given = parser.parse_args()
    with given.out.open("w", encoding="utf-8") as file:
        file.write(f"# Simulated pendulums on {given.threads} threads\n\n")
        file.write("| concealed | seed | verdict | told | held-out error before, after | worst | time |\n")
        file.write("| --- | --- | --- | --- | --- | --- | --- |\n")
        for kind in given.kinds:
            for seed in given.seeds:
                spec, elements = drawn(kind, seed, given.threads, given.seconds, given.rate)
                session, _ = simulate_session(spec, np.random.default_rng(seed))
                answer, seconds = whole_way(session) if given.bags else timed(session)
                line = row(spec, seed, answer, elements, seconds)
                print(line, flush=True)
                file.write(line + "\n")
                file.flush()


if __name__ == "__main__":
    main()
