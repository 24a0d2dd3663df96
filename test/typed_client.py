"""A client of the action in a process of its own, as another lab's tool would be: a line of JSON an event.

``python typed_client.py ACTION GOAL [CANCEL_AT]``: GOAL is JSON; CANCEL_AT is a stage's first words, at which
the goal is cancelled, or "accepted". Events: accepted, feedback, cancelling, result, gone.
"""

from __future__ import annotations

import json
import math
import sys
import time
from typing import Any

import rclpy
from rclpy.action import ActionClient
from rclpy.node import Node
from rig_identification_interfaces.action import IdentifyInertia

#: action_msgs/GoalStatus
STATES = {4: "succeeded", 5: "canceled", 6: "aborted"}
PATIENCE = 240.0


def tell(event: str, **content: Any) -> None:
    print(json.dumps({"event": event, **content}), flush=True)


class Client:
    def __init__(self, node: Node, action: str, cancel_at: str) -> None:
        self.node, self.cancel_at = node, cancel_at
        self.client = ActionClient(node, IdentifyInertia, action)
        self.cancel_now = cancel_at == "accepted"

    def wait(self, future: Any) -> bool:
        """Whether the answer came; False where the server is gone."""
        end = time.monotonic() + PATIENCE
        while not future.done():
            assert time.monotonic() < end, "no answer"
            rclpy.spin_once(self.node, timeout_sec=0.1)
            if not self.client.server_is_ready():
                return False
        return True

    def hear(self, message: Any) -> None:
        told = message.feedback
        mass = told.so_far.inertia.m
        std = told.so_far.covariance[0] ** 0.5
        numbers = {"mass": None if math.isnan(mass) else mass, "std": None if math.isnan(std) else std}
        tell("feedback", stage=told.stage, fraction=told.fraction, **numbers)
        if self.cancel_at and told.stage.startswith(self.cancel_at):
            self.cancel_now = True

    def run(self, goal: dict[str, Any]) -> None:
        assert self.client.wait_for_server(timeout_sec=60.0)
        time.sleep(0.5)  # the server knows this side a moment after this side knows the server
        sent = self.client.send_goal_async(IdentifyInertia.Goal(**goal), feedback_callback=self.hear)
        if not self.wait(sent):
            tell("gone")
            return
        handle = sent.result()
        tell("accepted")
        ended = handle.get_result_async()
        while not ended.done():
            if self.cancel_now:
                self.cancel_now, self.cancel_at = False, ""
                tell("cancelling")
                handle.cancel_goal_async()
            if not self.client.server_is_ready():
                tell("gone")
                return
            rclpy.spin_once(self.node, timeout_sec=0.1)
        self.tell_result(ended.result())

    @staticmethod
    def tell_result(ended: Any) -> None:
        result = ended.result
        tell(
            "result",
            state=STATES[ended.status],
            message=result.message,
            interrupted=result.interrupted,
            verdict=result.verdict,
            mass=str(result.body.inertia.m),
            sha256=result.body.session_sha256,
            findings=[finding.effect for finding in result.findings],
            recordings=list(result.recordings),
            files=[result.result_file, result.report_file],
        )


if __name__ == "__main__":
    rclpy.init()
    asker = rclpy.create_node("asker")
    Client(asker, sys.argv[1], sys.argv[3] if len(sys.argv) > 3 else "").run(json.loads(sys.argv[2]))
