"""Inertia as far as the data that came in tells: momentum balanced over windows, again each second.

A quick look with an interval, for the operator who asks whether enough was recorded. Poses and
tensions enter as if exact; what that costs shows as scatter of the balance that is correlated
over seconds, and the interval is widened by it (Newey & West, Econometrica 55, 1987).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid
from scipy.spatial.transform import Rotation

from rig_identification.estimate.first_guess import first_elements, weak_prior
from rig_identification.estimate.momentum import momentum_map, regress, weight_map
from rig_identification.estimate.track import Track
from rig_identification.live.generalized_wrench import generalized_wrench
from rig_identification.model.body import (
    complex_step_jacobian,
    elements_from_linear,
    linear_from_elements,
    linear_from_log_cholesky,
    linear_in_log_cholesky,
    log_cholesky_from_linear,
)
from rig_identification.recording import Session
from rig_identification.rig import Rig

Array = NDArray[np.float64]
Stamps = NDArray[np.int64]

#: s over which momentum is balanced, and windows over which its scatter is taken to be correlated.
WINDOW, LAGS = 0.25, 8
#: Windows that a first estimate needs.
FEWEST = 20


@dataclass(frozen=True)
class RunningEstimate:
    """Ten inertial parameters with standard deviations, so far."""

    elements: Array  # (10,) m, c, J about the centre of mass
    covariance: Array  # (10, 10)
    seconds: float  # of motion that went in


class RunningInertia:
    """Collects momentum balances of windows of motion."""

    def __init__(self, rig: Rig) -> None:
        self._rig = rig
        guess = first_elements(Session("live", rig, ()))
        self._guess = log_cholesky_from_linear(linear_from_elements(guess))
        self._weak = weak_prior(rig)
        self._gravity = np.array([0.0, 0.0, -rig.gravity])
        self._rows: list[Array] = []  # (6, 10) each
        self._right: list[Array] = []  # (6,)
        self._stamps = np.zeros(0, np.int64)
        self._motion, self._tension, self._force = (
            np.zeros((0, 13)),
            np.zeros((0, len(rig.cables))),
            np.zeros((0, 3)),
        )

    def add(self, stamp_ns: Stamps, motion: Array, tension: Array, exciter_force: Array) -> None:
        """Samples at common instants.

        Parameters
        ----------
        stamp_ns : (k,)
            Ascending.
        motion : (k, 13)
            Position, quaternion xyzw of body in world, velocity and rate in body axes.
        tension : (k, n)
            N.
        exciter_force : (k, 3)
            N, exciter frame.
        """
        self._stamps = np.concatenate([self._stamps, stamp_ns])
        self._motion = np.concatenate([self._motion, motion])
        self._tension = np.concatenate([self._tension, tension])
        self._force = np.concatenate([self._force, exciter_force])
        while len(self._stamps) > 1:
            breaks = np.flatnonzero(np.diff(self._stamps) > 1e8)
            if len(breaks):
                self._drop(int(breaks[0]) + 1)
                continue
            last = int(np.searchsorted(self._stamps, self._stamps[0] + round(1e9 * WINDOW)))
            if last >= len(self._stamps):
                return
            self._balance(last + 1)
            self._drop(last)

    def _drop(self, count: int) -> None:
        self._stamps, self._motion = self._stamps[count:], self._motion[count:]
        self._tension, self._force = self._tension[count:], self._force[count:]

    def _balance(self, count: int) -> None:
        time = (self._stamps[:count] - self._stamps[0]) / 1e9
        pose, twist = self._motion[:count, :7], self._motion[:count, 7:]
        R = Rotation.from_quat(pose[:, 3:]).as_matrix()
        states = np.zeros((count, 12))
        states[:, :3] = pose[:, :3]
        states[:, 6:9] = np.einsum("nij,nj->ni", R, twist[:, :3])
        states[:, 9:] = twist[:, 3:]
        none = np.zeros(0)
        track = Track(time, states, R, none, none, none)
        wrench = generalized_wrench(self._rig, pose, self._tension[:count], self._force[:count], np.zeros(3))
        force = np.einsum("nij,nj->ni", R, wrench[:, :3])
        moment = np.einsum("nij,nj->ni", R, wrench[:, 3:]) + np.cross(pose[:, :3], force)
        momentum = momentum_map(track)
        weight = cumulative_trapezoid(weight_map(track, self._gravity), time, axis=0)[-1]
        self._rows.append(momentum[-1] - momentum[0] - weight)
        self._right.append(cumulative_trapezoid(np.concatenate([force, moment], axis=1), time, axis=0)[-1])

    @property
    def seconds(self) -> float:
        """Motion that went in, s."""
        return WINDOW * len(self._rows)

    def estimate(self) -> RunningEstimate | None:
        """The body so far; None before :data:`FEWEST` windows."""
        if len(self._rows) < FEWEST:
            return None
        rows, right = np.array(self._rows), np.array(self._right)
        theta = regress([(rows.reshape(-1, 10), right.reshape(-1))], self._guess, self._weak)[0]
        covariance = self._covariance(rows, right, theta)
        to_elements = complex_step_jacobian(
            lambda t: elements_from_linear(linear_from_log_cholesky(t)), theta
        )
        elements = elements_from_linear(linear_from_log_cholesky(theta))
        return RunningEstimate(elements, to_elements @ covariance @ to_elements.T, self.seconds)

    def _covariance(self, rows: Array, right: Array, theta: Array) -> Array:
        """(10, 10) of theta: information in the middle, its scores' correlated scatter around it."""
        miss = right - rows @ linear_from_log_cholesky(theta)
        spread = (
            np.repeat([np.sqrt(np.mean(miss[:, :3] ** 2)), np.sqrt(np.mean(miss[:, 3:] ** 2))], 3) + 1e-12
        )
        slope = (rows @ linear_in_log_cholesky(theta)) / spread[:, None]
        scores = np.einsum("kij,ki->kj", slope, miss / spread)
        normal = np.einsum("kij,kil->jl", slope, slope) + np.diag(1.0 / self._weak**2)
        scatter = scores.T @ scores
        for lag in range(1, LAGS + 1):
            across = scores[lag:].T @ scores[:-lag]
            scatter += (1.0 - lag / (LAGS + 1.0)) * (across + across.T)
        inverse = np.linalg.inv(normal)
        white = inverse  # never narrower than white scatter would make it
        widened = inverse @ (scatter + np.diag(1.0 / self._weak**2)) @ inverse
        factor = np.sqrt(np.maximum(np.diag(widened) / np.diag(white), 1.0))
        return np.asarray(factor[:, None] * white * factor)
