"""Blocks of the simulated plant on a topic: a Float64MultiArray, one row a node."""

from __future__ import annotations

import numpy as np
from std_msgs.msg import Float64MultiArray, MultiArrayDimension

from rig_identification.live.plant_blocks import PlantBlock

#: Seconds, nanoseconds and step stand before the rows.
_HEAD = 3
TOPIC = "plant/outputs"


def to_message(block: PlantBlock) -> Float64MultiArray:
    """Message of a block."""
    seconds, nanoseconds = divmod(block.start_ns, 1_000_000_000)
    message = Float64MultiArray(
        data=[float(seconds), float(nanoseconds), block.step, *block.rows.ravel().tolist()]
    )
    nodes, width = block.rows.shape
    message.layout.data_offset = _HEAD
    message.layout.dim = [
        MultiArrayDimension(label="node", size=nodes, stride=nodes * width),
        MultiArrayDimension(label="output", size=width, stride=width),
    ]
    return message


def from_message(message: Float64MultiArray) -> PlantBlock:
    """Block of a message."""
    data = np.frombuffer(message.data, dtype=float)
    rows = data[_HEAD:].reshape(message.layout.dim[0].size, message.layout.dim[1].size)
    return PlantBlock(int(data[0]) * 1_000_000_000 + int(data[1]), float(data[2]), rows)
