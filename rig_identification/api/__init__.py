"""The package for a Python program or a notebook: read, check, identify, simulate.

Importing it loads neither numpy nor the compiler nor ROS. Each function loads what it needs when called.
"""

from rig_identification.api.checking import Check, check
from rig_identification.api.identifying import Stopped, identify
from rig_identification.api.reading import Recorded, read
from rig_identification.api.result import Result
from rig_identification.api.simulating import Simulated, simulate

__all__ = [
    "Check",
    "Recorded",
    "Result",
    "Simulated",
    "Stopped",
    "check",
    "identify",
    "read",
    "simulate",
]
