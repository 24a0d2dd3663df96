"""What the preprocessor's wrench is worth in one case, with real sensors on a rig to ordinary tolerances."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rig_identification.live.generalized_wrench import generalized_wrench
from rig_identification.live.wrench_uncertainty import wrench_uncertainty
from rig_identification.simulate.thesis_case import NOISE
from rig_identification.thesis_rerun.motion import CaseMotion

Array = NDArray[np.float64]

#: Instants of the thesis' window that it is taken at.
INSTANTS = 60


@dataclass(frozen=True)
class WrenchAccuracy:
    """Root mean squares over the window: force N and moment N m about the centre of mass, body axes."""

    size: Array  # (6,) of the wrench itself, about its mean
    std: Array  # (6,) of its standard deviation
    by_source: dict[str, Array]  # (6,) what is in doubt -> its share

    @property
    def main_source(self) -> str:
        """What makes most of the moment's uncertainty."""
        return max(self.by_source, key=lambda name: float(np.linalg.norm(self.by_source[name][3:])))


def wrench_accuracy(motion: CaseMotion, center_std: Array) -> WrenchAccuracy:
    """Uncertainty of the wrench; ``center_std`` (3,) m is what the centre of mass is known to."""
    case = motion.case
    rig = replace(case.rig, noise=dict(NOISE))
    samples = motion.samples()
    chosen = samples[:: max(1, samples.size // INSTANTS)]
    turn = Rotation.from_matrix(motion.R_world_body[chosen]).as_quat()
    pose = np.concatenate([motion.position[chosen], turn], axis=1)
    force = motion.force[chosen]
    wrench = generalized_wrench(rig, pose, motion.tension[chosen], force, case.center_of_mass)
    found = [
        wrench_uncertainty(rig, pose[k], motion.tension[node], force[k], case.center_of_mass, center_std)
        for k, node in enumerate(chosen)
    ]
    return WrenchAccuracy(
        np.std(wrench, axis=0),
        _rms([one.std for one in found]),
        {name: _rms([one.by_source[name] for one in found]) for name in found[0].by_source},
    )


def _rms(rows: list[Array]) -> Array:
    return np.asarray(np.sqrt(np.mean(np.square(rows), axis=0)))
