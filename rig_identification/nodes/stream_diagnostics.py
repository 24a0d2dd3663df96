"""The state of every incoming topic as lines of ``/diagnostics``: rate, gaps, stamps, clocks, silence."""

from __future__ import annotations

import numpy as np
from diagnostic_msgs.msg import DiagnosticStatus
from rclpy.node import Node

from rig_identification.nodes.intake import Intake
from rig_identification.nodes.rig_node import ERROR, OK, WARN, diagnostic

#: A topic that was there and has been still for so long, s, is silent.
SILENT = 1.0
#: Clocks of two devices that differ by more, s, are worth a word.
CLOCKS_APART = 0.1


def stream_status(node: Node, intake: Intake) -> list[DiagnosticStatus]:
    """One line a topic; called each second."""
    intake.look_for_clipping()
    return [_topic_status(node, intake, name) for name in intake.topics]


def _reference(intake: Intake, name: str) -> float:
    """Median offset (s) of the other topics' clocks; this one's own where there are none."""
    offsets = [g.offset for other, g in intake.gates.items() if other != name and np.isfinite(g.offset)]
    return float(np.median(offsets)) if offsets else intake.gates[name].offset


def _topic_status(node: Node, intake: Intake, name: str) -> DiagnosticStatus:
    gate = intake.gates[name]
    if gate.received == 0:
        return diagnostic(f"{node.get_name()}: {name}", OK, "not there")
    level, message = OK, f"{gate.rate:.4g} Hz"
    late = _reference(intake, name) - gate.offset  # positive: its stamps are late
    publishers = node.count_publishers(name)
    if gate.rejected or intake.not_finite[name] or intake.garbled[name]:
        level, message = WARN, f"{gate.rejected} stamps refused, {intake.not_finite[name]} samples not finite"
    if intake.clipped[name]:
        level, message = WARN, f"{intake.clipped[name]} samples clipped: the sensor's range is too small"
    if abs(late) > CLOCKS_APART:
        level, message = WARN, f"clock is {late:+.3f} s off the other devices'"
    if publishers > 1:
        level, message = WARN, f"{publishers} publishers: end all but one"
    if intake.silence(name) > SILENT:
        level, message = ERROR, f"silent for {intake.silence(name):.0f} s"
    return diagnostic(
        f"{node.get_name()}: {name}", level, message,
        received=gate.received, admitted=gate.admitted, rate=f"{gate.rate:.6g}",
        gaps=gate.gaps, missing=gate.missing, duplicated=gate.duplicated, backward=gate.backward,
        ahead=gate.ahead, zero=gate.zero, restarts=gate.restarts, not_finite=intake.not_finite[name],
        clipped=intake.clipped[name],
        garbled=intake.garbled[name], publishers=publishers, clock_difference=f"{late:.6f}",
    )  # fmt: skip
