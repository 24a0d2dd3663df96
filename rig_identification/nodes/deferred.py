"""A service whose answer comes later, without a thread and without holding the executor.

The events executor calls a service's callback and hands what it returns to ``send_response``; it does not
know coroutines. A callback here may return :class:`Later`: the request's header is kept, and the answer is
sent when there is one.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rclpy.callback_groups import CallbackGroup
from rclpy.node import Node
from std_srvs.srv import Trigger


class Later:
    """An answer that is still to come."""

    def __init__(self) -> None:
        self._send: Callable[[Trigger.Response], None] | None = None
        self._answer: Trigger.Response | None = None

    def answer(self, success: bool, message: str) -> None:
        """Send the answer; a client that is gone hears nothing, and nothing happens."""
        self._answer = Trigger.Response(success=success, message=message)
        self._flush()

    def bind(self, send: Callable[[Trigger.Response], None]) -> None:
        """Where the answer goes."""
        self._send = send
        self._flush()

    def _flush(self) -> None:
        if self._send is not None and self._answer is not None:
            send, self._send = self._send, None
            send(self._answer)


def serve_later(
    node: Node,
    name: str,
    begin: Callable[[], Later | Trigger.Response],
    group: CallbackGroup | None = None,
) -> None:
    """Offer a Trigger service; ``begin`` answers at once or returns a :class:`Later`."""

    def call(request: Trigger.Request, response: Trigger.Response) -> Any:
        _ = request, response
        return begin()

    service = node.create_service(Trigger, name, call, callback_group=group)
    send_now = service.send_response

    def send_response(answer: Later | Trigger.Response, header: object) -> None:
        if isinstance(answer, Later):
            answer.bind(lambda response: send_now(response, header))
        else:
            send_now(answer, header)

    service.send_response = send_response  # type: ignore[method-assign, assignment]
