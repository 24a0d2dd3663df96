"""The body for other tools: URDF, MJCF, SDF and CSV, as text to copy."""

from __future__ import annotations

import numpy as np

from rig_identification.report.ten_numbers import UNITS
from rig_identification.result import ELEMENTS, InertialEstimate

_NAMES = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
#: MuJoCo's order of the tensor: diagonal first.
_FULL_INERTIA = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")


def body_files(estimate: InertialEstimate) -> dict[str, str]:
    """Format -> text. A simulator needs all ten numbers: where one is not determined, the CSV alone."""
    files = {"CSV": _csv(estimate)}
    if not estimate.unobservable and np.all(np.isfinite(estimate.values)):
        numbers = [f"{value:.9g}" for value in estimate.values]
        mass, center, inertia = numbers[0], numbers[1:4], dict(zip(_NAMES, numbers[4:], strict=True))
        files = {
            "URDF": _urdf(mass, center, inertia),
            "MJCF": _mjcf(mass, center, inertia),
            "SDF": _sdf(mass, center, inertia),
            **files,
        }
    return files


def _csv(estimate: InertialEstimate) -> str:
    """Value and standard deviation of each element; empty where it is not determined."""
    lines = ["element,value,std,unit"]
    std = np.sqrt(np.clip(np.nan_to_num(np.diag(estimate.covariance)), 0.0, None))
    for name, value, sigma, unit in zip(ELEMENTS, estimate.values, std, UNITS, strict=True):
        known = name not in estimate.unobservable and bool(np.isfinite(value))
        lines.append(f"{name},{f'{value:.9g},{sigma:.3g}' if known else ','},{unit.replace('²', '^2')}")
    return "\n".join(lines) + "\n"


def _urdf(mass: str, center: list[str], inertia: dict[str, str]) -> str:
    """Axes of the inertial frame are those of body, its origin is the centre of mass."""
    tensor = " ".join(f'{name}="{value}"' for name, value in inertia.items())
    return f"""<robot name="body">
  <link name="body">
    <inertial>
      <origin xyz="{" ".join(center)}" rpy="0 0 0"/>
      <mass value="{mass}"/>
      <inertia {tensor}/>
    </inertial>
  </link>
</robot>
"""


def _mjcf(mass: str, center: list[str], inertia: dict[str, str]) -> str:
    full = " ".join(inertia[name] for name in _FULL_INERTIA)
    return f"""<mujoco model="body">
  <worldbody>
    <body name="body">
      <freejoint/>
      <inertial pos="{" ".join(center)}" mass="{mass}" fullinertia="{full}"/>
    </body>
  </worldbody>
</mujoco>
"""


def _sdf(mass: str, center: list[str], inertia: dict[str, str]) -> str:
    tensor = "".join(f"<{name}>{value}</{name}>" for name, value in inertia.items())
    return f"""<sdf version="1.9">
  <model name="body">
    <link name="body">
      <inertial>
        <pose>{" ".join(center)} 0 0 0</pose>
        <mass>{mass}</mass>
        <inertia>{tensor}</inertia>
      </inertial>
    </link>
  </model>
</sdf>
"""
