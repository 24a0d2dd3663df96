"""``replay``: a recorded session into the live graph, with ``/clock``, at any rate."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticStatus
from numpy.typing import NDArray
from rcl_interfaces.msg import Parameter as ParameterMessage
from rcl_interfaces.msg import ParameterType, ParameterValue
from rcl_interfaces.srv import SetParameters
from rclpy.client import Client
from rclpy.task import Future
from rosgraph_msgs.msg import Clock as ClockMessage
from std_msgs.msg import String
from std_srvs.srv import Trigger

from rig_identification.errors import InputError
from rig_identification.nodes.parameters import OwnParameter, within
from rig_identification.nodes.rig_node import LATCHED, OK, RigNode, diagnostic, reliable
from rig_identification.nodes.wire import TYPES
from rig_identification.session.bag import Bag, read_bag
from rig_identification.session.rig_description import read_rig
from rig_identification.session.session_description import BagEntry, read_session_description
from rig_identification.topics import DEFAULT_NAMESPACE, expected_topics

PARAMETERS = (
    OwnParameter("session", "", "folder of the session, or its session.yaml"),
    OwnParameter("recordings", [""], "names of the recordings to play, in order; empty: all"),
    OwnParameter("rate", 1.0, "seconds of recording a second", within(0.01, 1000.0)),
    OwnParameter("publish_clock", True, "publish /clock, for nodes with use_sim_time"),
    OwnParameter("bag_namespace", DEFAULT_NAMESPACE, "namespace of the topics in the bags"),
    OwnParameter(
        "pause", 1.0, "s before each recording, for subscribers to be found", within(0.0, 600.0, "s")
    ),
    OwnParameter(
        "operate", "", "name of an identifier or recorder that is told when each recording starts and stops"
    ),
)
#: Wall seconds between two looks at what is due, and messages sent at a look at most.
TICK, AT_ONCE = 0.002, 400
#: s between the last message and an operated node's stop: it waits itself for what was sent before.
SETTLE = 0.1
#: s that listeners of a recording that another node is told of get to be found.
DISCOVERY = 20.0
#: Services that an identifier and a recorder offer.
_WINDOW, _RECORDING = ("start_window", "stop_window"), ("start", "stop")


@dataclass(frozen=True)
class Played:
    """Messages of one recording in the order in which they are sent."""

    entry: BagEntry
    due_ns: NDArray[np.int64]  # (n,) stamps, or receive times where a stamp is odd
    topic: NDArray[np.int64]  # (n,) index into names
    row: NDArray[np.int64]  # (n,) index into the topic's messages
    names: tuple[str, ...]
    messages: tuple[list[bytes], ...]


def in_order(entry: BagEntry, bag: Bag) -> Played:
    """A bag's messages by receive time, as they once came."""
    names = tuple(bag.topics)
    messages, due, which, rows = [], [], [], []
    for number, raw in enumerate(bag.topics.values()):
        one: list[bytes] = [b""] * raw.count
        for block in raw.blocks:
            for index, data in zip(block.index.tolist(), block.data, strict=True):
                one[index] = data.tobytes()
        messages.append(one)
        due.append(raw.received_ns)
        which.append(np.full(raw.count, number))
        rows.append(np.arange(raw.count))
    if not messages:
        raise InputError(
            f"{bag.folder}: no topic of the contract in the bag; map its namespace with bag_namespace"
        )
    times = np.concatenate(due)
    order = np.argsort(times, kind="stable")
    return Played(
        entry, times[order], np.concatenate(which)[order], np.concatenate(rows)[order], names, tuple(messages)
    )


class ReplayNode(RigNode):
    """Sends recordings one after the other."""

    def __init__(self) -> None:
        super().__init__("replay", PARAMETERS)
        if not self.own.text("session"):
            raise InputError("parameter session: is empty; give the folder of a session")
        description = read_session_description(Path(self.own.text("session")).expanduser())
        rig = read_rig(description.rig_file)
        cables = tuple(cable.name for cable in rig.cables)
        self._wanted = expected_topics(cables, self.own.text("bag_namespace"))
        here = expected_topics(cables, self.get_namespace())
        self._outlets = {
            old: self.create_publisher(TYPES[topic.message_type], new, reliable(2000))
            for (old, topic), new in zip(self._wanted.items(), here, strict=True)
        }
        names = self.own.words("recordings")
        unknown = set(names) - {entry.name for entry in description.entries}
        if unknown:
            raise InputError(
                f"parameter recordings: {', '.join(sorted(unknown))} is no recording of the session"
            )
        entries = {entry.name: entry for entry in description.entries}
        self._queue = [entries[name] for name in names] if names else list(description.entries)
        self._told = self.create_publisher(String, "~/recording", LATCHED)
        self._time_topic = (
            self.create_publisher(ClockMessage, "/clock", 10) if self.own.flag("publish_clock") else None
        )
        self._played: Played | None = None
        self._sent = 0
        self._state = "loading"
        self._since = time.monotonic()
        self._begun = 0.0
        self._pending: list[Future[Any]] = []
        self._clients_of_operated = self._make_clients(self.own.text("operate"))
        self.every(TICK, self._work)

    def _make_clients(self, target: str) -> dict[str, Client]:
        if not target:
            return {}
        start, stop = _WINDOW if "identifier" in target else _RECORDING
        return {
            "set": self.create_client(SetParameters, f"{target}/set_parameters"),
            "start": self.create_client(Trigger, f"{target}/{start}"),
            "stop": self.create_client(Trigger, f"{target}/{stop}"),
        }

    def _enter(self, state: str) -> None:
        self._state, self._since = state, time.monotonic()

    def _work(self) -> None:
        waited = time.monotonic() - self._since
        if self._state == "loading":
            self._load()
        elif self._state == "pause" and waited > self.own.number("pause") and self._is_met(waited):
            self._describe()
            self._enter("describing")
        elif self._state == "describing" and self._answered():
            self._trigger("start")
            self._enter("starting")
        elif self._state == "starting" and self._answered():
            self._begun = time.monotonic()
            self._enter("playing")
        elif self._state == "playing":
            self._play()
        elif self._state == "settling" and waited > SETTLE:
            self._trigger("stop")
            self._enter("stopping")
        elif self._state == "stopping" and self._answered():
            self._enter("loading")

    def _load(self) -> None:
        if not self._queue:
            self._enter("over")
            self._told.publish(String(data=""))
            return
        entry = self._queue.pop(0)
        bag = read_bag(entry.folder, self._wanted)
        for note in bag.notes:
            self.get_logger().warning(f"{entry.name}: {note}")
        self._played, self._sent = in_order(entry, bag), 0
        self._told.publish(String(data=entry.name))
        self._enter("pause")

    def _play(self) -> None:
        played = self._played
        assert played is not None
        elapsed = (time.monotonic() - self._begun) * self.own.number("rate")
        now_ns = int(played.due_ns[0]) + round(1e9 * elapsed)
        due = int(np.searchsorted(played.due_ns, now_ns, side="right"))
        last = min(due, self._sent + AT_ONCE)
        if last < due:  # too fast for this machine: time waits for the messages
            now_ns = int(played.due_ns[last])
            self._begun = time.monotonic() - (now_ns - int(played.due_ns[0])) / (
                1e9 * self.own.number("rate")
            )
        if self._time_topic is not None:
            message = ClockMessage()
            message.clock.sec, message.clock.nanosec = divmod(now_ns, 1_000_000_000)
            self._time_topic.publish(message)
        for k in range(self._sent, last):
            number = played.topic[k]
            self._outlets[played.names[number]].publish(played.messages[number][played.row[k]])
        self._sent = last
        if last == len(played.due_ns):
            self._enter("settling")

    def _is_met(self, waited: float) -> bool:
        """Whether the operated node's services are there, and somebody listens to every topic to come.

        What is published before a listener is found is lost to it, and a busy machine takes its time.
        """
        if not self._clients_of_operated:
            return True
        if not all(client.service_is_ready() for client in self._clients_of_operated.values()):
            return False
        alone = [name for name in self._coming() if not self._outlets[name].get_subscription_count()]
        if alone and waited > DISCOVERY:
            self.fault(f"nobody listens to {', '.join(alone)}; played all the same")
        return not alone or waited > DISCOVERY

    def _coming(self) -> tuple[str, ...]:
        return self._played.names if self._played is not None else ()

    def _describe(self) -> None:
        """Tell the operated node what comes, without waiting in a callback."""
        if self._clients_of_operated and self._played is not None:
            request = SetParameters.Request(parameters=_recording(self._played.entry))
            self._pending = [self._clients_of_operated["set"].call_async(request)]

    def _trigger(self, name: str) -> None:
        if self._clients_of_operated:
            self._pending = [self._clients_of_operated[name].call_async(Trigger.Request())]

    def _answered(self) -> bool:
        if any(not future.done() for future in self._pending):
            return False
        for future in self._pending:
            answer = future.result()
            if getattr(answer, "success", True) is False:
                self.fault(f"{self.own.text('operate')} refused: {answer.message}")
        self._pending = []
        return True

    def status(self) -> list[DiagnosticStatus]:
        """What is being played."""
        name = self._played.entry.name if self._played else ""
        total = len(self._played.due_ns) if self._played else 0
        line = diagnostic(f"{self.get_name()}: {name}", OK, self._state, sent=self._sent, messages=total)
        return [*super().status(), line]


def _recording(entry: BagEntry) -> list[ParameterMessage]:
    """Parameters ``recording.*`` of an operated node."""
    dummy = entry.dummy
    position = dummy.position.tolist() if dummy else [0.0, 0.0, 0.0]
    kinds = ParameterType
    values = {
        "name": ParameterValue(type=kinds.PARAMETER_STRING, string_value=Path(entry.name).name),
        "kind": ParameterValue(type=kinds.PARAMETER_STRING, string_value=entry.kind),
        "holdout": ParameterValue(type=kinds.PARAMETER_BOOL, bool_value=entry.holdout),
        "dummy_mass": ParameterValue(type=kinds.PARAMETER_DOUBLE, double_value=dummy.mass if dummy else 0.0),
        "dummy_position": ParameterValue(type=kinds.PARAMETER_DOUBLE_ARRAY, double_array_value=position),
    }
    return [ParameterMessage(name=f"recording.{name}", value=value) for name, value in values.items()]


def create() -> ReplayNode:
    """The node."""
    return ReplayNode()
