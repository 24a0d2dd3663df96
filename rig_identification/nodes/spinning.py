"""Start, spin and one clean shutdown, the same for every node."""

from __future__ import annotations

from collections.abc import Callable

import rclpy
from rclpy.experimental import EventsExecutor
from rclpy.signals import SignalHandlerOptions
from rclpy.task import Future

from rig_identification.nodes.last_resort import exit_after
from rig_identification.nodes.process import StopRequest
from rig_identification.nodes.rig_node import RigNode

#: EventsExecutor.spin() dispatches nothing; spinning until a future does.
_FOREVER = 1e9
#: s that the middleware and the interpreter get to clean up, once the node has given back what it held.
PATIENCE = 10


def spin(create: Callable[[], RigNode], stop: StopRequest, arguments: list[str] | None = None) -> None:
    """Make a node and spin it until ``stop``.

    Raises
    ------
    InputError
        The node's parameters cannot be used.
    """
    stop.notify = lambda: (
        None
    )  # from here on there is something to close: a signal is noted, and heeded below
    rclpy.init(args=arguments, signal_handler_options=SignalHandlerOptions.NO)
    node = None
    try:
        node = create()
        executor = EventsExecutor()
        executor.add_node(node)
        until: Future[None] = Future(executor=executor)

        def finish() -> None:
            until.set_result(None)
            executor.wake()

        stop.notify = finish
        if not stop.requested:
            executor.spin_until_future_complete(until, timeout_sec=_FOREVER)
        executor.shutdown()
    finally:
        stop.notify = lambda: None  # a second signal must not disturb the clean-up
        if node is not None:
            node.close()
            exit_after(PATIENCE)
            node.destroy_node()
        rclpy.try_shutdown()
