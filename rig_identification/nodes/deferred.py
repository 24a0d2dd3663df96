"""A service whose answer comes later, and is not lost, without a thread and without holding the executor.

The events executor calls a service's callback and hands what it returns to ``send_response``; it does not
know coroutines. A callback here may return :class:`Later`: the request's header is kept, and the answer is
sent when there is one.

A client that the graph has only just met can ask before this side knows where its answers go (DDS-RPC 1.0,
section 7.6.2: the endpoints of one client are discovered one by one). The middleware then waits 100 ms, drops
the answer and warns, and the client waits for ever. Here such an answer is sent again until it arrives or
:data:`GIVEN_UP` has passed. A client that is gone is no such case: the middleware knows it and says nothing.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any

from rclpy.callback_groups import CallbackGroup
from rclpy.clock import Clock, ClockType
from rclpy.node import Node

#: s between two attempts to send an answer, and after which it is given up.
AGAIN, GIVEN_UP = 0.25, 10.0


class Later:
    """An answer that is still to come."""

    def __init__(self) -> None:
        self._send: Callable[[bool, str], None] | None = None
        self._answer: tuple[bool, str] | None = None

    def answer(self, success: bool, message: str) -> None:
        """Send the answer; a client that is gone hears nothing, and nothing happens."""
        self._answer = success, message
        self._flush()

    def bind(self, send: Callable[[bool, str], None]) -> None:
        """Where the answer goes."""
        self._send = send
        self._flush()

    def _flush(self) -> None:
        if self._send is not None and self._answer is not None:
            send, self._send = self._send, None
            send(*self._answer)


def serve_later(
    node: Node,
    kind: type,
    name: str,
    begin: Callable[[Any, Any], tuple[bool, str] | Later],
    group: CallbackGroup | None = None,
) -> None:
    """Offer a service whose responses hold ``success`` and ``message``.

    begin: given request and response, it returns both or a :class:`Later` that will. Whatever else the
    response holds, it fills in, until then.
    """
    clock = Clock(clock_type=ClockType.STEADY_TIME)

    def call(request: object, response: object) -> Any:
        return begin(request, response), response

    def after(seconds: float, work: Callable[[], None]) -> None:
        def once() -> None:
            node.destroy_timer(timer)
            work()

        timer = node.create_timer(seconds, once, clock=clock)

    service = node.create_service(kind, name, call, callback_group=group)
    send_now = service.send_response

    def send_response(answered: tuple[tuple[bool, str] | Later, Any], header: object) -> None:
        answer, response = answered

        def send(success: bool, message: str) -> None:
            response.success, response.message = success, message
            send_until_heard(lambda: send_now(response, header), after)

        if isinstance(answer, Later):
            answer.bind(send)
        else:
            send(*answer)

    service.send_response = send_response  # type: ignore[method-assign, assignment]


def send_until_heard(
    send: Callable[[], None], after: Callable[[float, Callable[[], None]], None], spent: float = 0.0
) -> None:
    """Call ``send``; as long as it warns that nobody was there, ``after`` a while again."""
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        send()
    lost = any("failed to send response" in str(warning.message) for warning in told)
    if lost and spent < GIVEN_UP:
        after(AGAIN, lambda: send_until_heard(send, after, spent + AGAIN))
