"""How fast the forward model is, beside scipy's DOP853 on the same equations.

Free swing of the thesis' case 14 at 100 Hz, warm, one core: forward motion, the Jacobian of every output
in 12 columns, and the same motion by ``solve_ivp`` with numpy on each right-hand side.

    python -m bench.forward_model [--seconds 250] [--repeats 3] [--reference-seconds 25]
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from rig_identification.model import layout
from rig_identification.model.body import six_elements
from rig_identification.model.motion import Input, Motion, RigModel, State, on_cables, rig_model, simulate
from rig_identification.thesis import load_case

Array = NDArray[np.float64]

STEP = 0.01  # s between outputs
FORWARD_GOAL, JACOBIAN_GOAL = 0.5, 5.0  # s for 250 s of motion


def case_14() -> tuple[RigModel, State]:
    """A car on four splayed cables, let go away from rest."""
    case = load_case(14)
    elements = np.concatenate([[case.mass], case.center_of_mass, six_elements(case.inertia)])
    model = rig_model(case.rig, elements, rods=True)
    R = Rotation.from_quat(case.orientation).as_matrix()
    return model, on_cables(model, State(case.position, R, np.zeros(3), np.zeros(3)))


def twelve_columns() -> NDArray[np.int64]:
    """The ten inertial parameters and two cable lengths."""
    lengths = [layout.cable_offset(i) + layout.LENGTH for i in range(2)]
    return np.array([*range(layout.INERTIAL, layout.INERTIAL + 10), *lengths])


def best_of(repeats: int, work: Callable[[], object]) -> float:
    """Shortest wall time of ``repeats`` calls after one that warms up, s."""
    work()
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return min(times)


def slope_of(model: RigModel) -> Callable[[float, Array], Array]:
    """Newton and Euler about the datum with the cables' accelerations, in numpy: state (13,) to its rate."""
    inertial = model.physics[layout.INERTIAL : layout.INERTIAL + 10]
    mass, h = inertial[0], inertial[1:4]
    inertia = np.zeros((3, 3))
    inertia[np.triu_indices(3)] = inertial[4:]
    inertia = inertia + np.triu(inertia, 1).T
    cables = model.cable_numbers()
    ceiling, hinges, n = cables[:, 0:3], cables[:, 3:6], model.cables
    skew = np.array([[0.0, -h[2], h[1]], [h[2], 0.0, -h[0]], [-h[1], h[0], 0.0]])
    K = np.zeros((6 + n, 6 + n))
    K[:3, :3], K[:3, 3:6], K[3:6, :3], K[3:6, 3:6] = mass * np.eye(3), -skew, skew, inertia
    right = np.zeros(6 + n)

    def slope(_: float, y: Array) -> Array:
        x, y0, y1, y2 = y[3:7] / np.linalg.norm(y[3:7])
        R = np.array(
            [
                [1 - 2 * (y1 * y1 + y2 * y2), 2 * (y0 * y1 - x * y2), 2 * (y0 * y2 + x * y1)],
                [2 * (y0 * y1 + x * y2), 1 - 2 * (y0 * y0 + y2 * y2), 2 * (y1 * y2 - x * y0)],
                [2 * (y0 * y2 - x * y1), 2 * (y1 * y2 + x * y0), 1 - 2 * (y0 * y0 + y1 * y1)],
            ]
        )
        w = y[10:13]
        gravity = R.T @ model.physics[:3]
        span = (ceiling - y[:3]) @ R - hinges
        length = np.sqrt(np.sum(span**2, axis=1))
        unit = span / length[:, None]
        spin = np.cross(w, hinges)
        speed = R.T @ y[7:10] + spin
        arms = np.cross(hinges, unit)
        K[:3, 6:], K[3:6, 6:] = -unit.T, -arms.T
        K[6:, :3], K[6:, 3:6] = -unit, -arms
        right[:3] = mass * gravity - np.cross(w, np.cross(w, h))
        right[3:6] = np.cross(h, gravity) - np.cross(w, inertia @ w)
        along = np.sum(unit * speed, axis=1)
        right[6:] = np.sum(unit * np.cross(w, spin), axis=1) - (np.sum(speed**2, axis=1) - along**2) / length
        z = np.linalg.solve(K, right)
        q, v = y[3], y[4:7]
        turning = 0.5 * np.concatenate([[-v @ w], q * w + np.cross(v, w)])
        return np.concatenate([y[7:10], turning, R @ z[:3], z[3:6]])

    return slope


def by_scipy(model: RigModel, start: State, seconds: float) -> Array:
    """(N, 3) datum positions by DOP853 to the forward model's own accuracy."""
    q = Rotation.from_matrix(start.R_world_body).as_quat()[[3, 0, 1, 2]]
    y = np.concatenate([start.position, q, start.velocity, start.rate])
    at = STEP * np.arange(round(seconds / STEP) + 1)
    solution = solve_ivp(slope_of(model), (0.0, at[-1]), y, "DOP853", t_eval=at, rtol=1e-9, atol=1e-11)
    return np.asarray(solution.y[:3].T)


def report(seconds: float, repeats: int, reference_seconds: float) -> None:
    """Print times, goals and ratio."""
    model, start = case_14()
    drive = Input.none(round(seconds / STEP) + 1, STEP)
    directions = twelve_columns()

    def forward() -> Motion:
        return simulate(model, start, drive)

    def jacobian(threads: int = 1, directions: NDArray[np.int64] = directions) -> Motion:
        return simulate(model, start, drive, directions=directions, threads=threads)

    def state_only() -> Motion:
        return jacobian(directions=directions[:0])

    forward_s, jacobian_s = best_of(repeats, forward), best_of(repeats, jacobian)
    shared_s, state_s = best_of(repeats, lambda: jacobian(2)), best_of(repeats, state_only)
    begin = time.perf_counter()
    reference = by_scipy(model, start, reference_seconds)
    scipy_s = (time.perf_counter() - begin) * seconds / reference_seconds
    apart = np.max(np.abs(forward().states[: len(reference), :3] - reference))
    scale = seconds / 250.0
    print(f"{seconds:.0f} s at {1.0 / STEP:.0f} Hz, {model.cables} cables, best of {repeats}, one core")
    print(f"forward           {forward_s:8.3f} s   goal {FORWARD_GOAL * scale:.2f} s")
    print(f"12-column Jacobian{jacobian_s:8.3f} s   goal {JACOBIAN_GOAL * scale:.2f} s")
    print(f"  by two threads  {shared_s:8.3f} s")
    print(f"  in state alone  {state_s:8.3f} s")
    print(f"scipy DOP853      {scipy_s:8.3f} s   (scaled up from {reference_seconds:.0f} s)")
    print(f"forward is {scipy_s / forward_s:.0f} times as fast as DOP853; positions agree to {apart:.1e} m")


def main(arguments: Sequence[str] | None = None) -> None:
    """Command line of this bench."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seconds", type=float, default=250.0)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--reference-seconds", type=float, default=25.0)
    given = parser.parse_args(arguments)
    report(given.seconds, given.repeats, min(given.reference_seconds, given.seconds))


if __name__ == "__main__":
    main()
