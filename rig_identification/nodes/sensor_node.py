"""A sensor node: samples of one device from its source to the contract's topics."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from diagnostic_msgs.msg import DiagnosticStatus
from numpy.typing import NDArray
from rclpy.publisher import Publisher
from rclpy.subscription import Subscription
from std_msgs.msg import Float64MultiArray

from rig_identification.errors import InputError
from rig_identification.live.number_lines import LineFormat
from rig_identification.nodes.managed import ManagedNode
from rig_identification.nodes.parameters import OwnParameter, one_of, within
from rig_identification.nodes.plant_message import TOPIC, from_message
from rig_identification.nodes.rig_node import OK, WARN, diagnostic, reliable
from rig_identification.nodes.sources import DeviceErrors, FileSource, SerialSource, SimulatedSource, Source
from rig_identification.nodes.wire import TYPES
from rig_identification.rig import Rig
from rig_identification.session.messages import serialize
from rig_identification.topics import Topic, expected_topics

Array = NDArray[np.float64]

PARAMETERS = (
    OwnParameter(
        "source", "simulation", "simulation, serial or file", one_of("simulation", "serial", "file")
    ),
    OwnParameter("period", 0.005, "s between looks at the source", within(0.001, 1.0, "s")),
    OwnParameter("simulation.rate", 500.0, "Hz, samples of the simulated device", within(1.0, 10000.0, "Hz")),
    OwnParameter(
        "simulation.noise", [-1.0], "standard deviation of one sample, SI; -1: rig description's noise"
    ),
    OwnParameter("simulation.bias", [0.0], "constant error of each channel, SI; one number stands for all"),
    OwnParameter(
        "simulation.gain", [0.0], "error of each channel's scale: 0.01 reads 1 % high", within(-0.9, 9.0)
    ),
    OwnParameter(
        "simulation.position_error",
        [0.0, 0.0, 0.0],
        "m that the device sits off its description, body axes",
        within(-10.0, 10.0, "m"),
    ),
    OwnParameter(
        "simulation.rotation_error",
        [0.0, 0.0, 0.0],
        "rad, rotation vector of its frame, body axes",
        within(-3.2, 3.2, "rad"),
    ),
    OwnParameter(
        "simulation.time_constant", 0.0, "s of a first-order low-pass in the device", within(0.0, 10.0, "s")
    ),
    OwnParameter(
        "simulation.clock_offset", 0.0, "s that the device's stamps are late", within(-60.0, 60.0, "s")
    ),
    OwnParameter("simulation.seed", 0, "seed of the noise", within(0, 2**31)),
    OwnParameter("serial.port", "", "serial port, as /dev/ttyUSB0"),
    OwnParameter("serial.baud_rate", 115200, "baud", within(300, 12_000_000, "baud")),
    OwnParameter("file.path", "", "logger's CSV"),
    OwnParameter(
        "line.columns", [-1], "column of each channel, from 0; -1: in order, from 0", within(-1, 1000)
    ),
    OwnParameter("line.scale", [1.0], "SI value = scale * number + offset, for each channel or for all"),
    OwnParameter("line.offset", [0.0], "SI; see line.scale"),
    OwnParameter("line.separator", ",", "what stands between two numbers; a space stands for any blanks"),
    OwnParameter(
        "line.time_column", -1, "column of the time; -1: lines are stamped on arrival", within(-1, 1000)
    ),
    OwnParameter("line.time_scale", 1.0, "s for each unit of the time column"),
)


@dataclass(frozen=True)
class MountError:
    """How a simulated device truly sits, against its description."""

    position: Array  # (3,) m, body axes
    rotation: Array  # (3,) rotation vector, rad, body axes


@dataclass(frozen=True)
class Device:
    """What a sensor node has to know of its device."""

    node: str
    width: int  # columns of a sample
    topics: tuple[tuple[str, slice], ...]  # contract name of each topic, its columns of the sample
    noise: tuple[str, ...]  # (width) key of Rig.noise for each column
    read: Callable[[Array, MountError], Array]  # rows of the plant to true samples
    placed: bool = True  # what it reads depends on where on the body it sits
    turned: bool = True  # what it reads depends on how it is turned against the body


class SensorNode(ManagedNode):
    """Samples of one device, published as they come while the node is active."""

    def __init__(self, name: str, device_of: Callable[[Rig], Device]) -> None:
        super().__init__(name, PARAMETERS)
        self._description = self.rig()
        self.device = device_of(self._description)
        self._outlets: list[tuple[Topic, slice, Publisher]] = []
        self._plant: Subscription | None = None
        self.published = 0
        self.source: Source | None = None
        self.every(self.own.number("period"), self._publish)
        self.begin()

    def open(self) -> None:
        """Open the device and advertise its topics. Raises InputError."""
        self.source = self._make_source(self._description)
        known = expected_topics(tuple(cable.name for cable in self._description.cables), namespace="")
        for contract_name, columns in self.device.topics:
            topic = known[f"/{contract_name}"]
            # A second of samples, and more of a slow device: a listener may be kept waiting for its turn
            depth = max(1000, int(self.own.number("simulation.rate")))
            publisher = self.create_publisher(TYPES[topic.message_type], contract_name, reliable(depth))
            self._outlets.append((topic, columns, publisher))

    def shut(self) -> None:
        """Close the device and take back its topics."""
        if self.source is not None:
            self.source.close()
        for _, _, publisher in self._outlets:
            self.destroy_publisher(publisher)
        if self._plant is not None:
            self.destroy_subscription(self._plant)
        self.source, self._outlets, self._plant = None, [], None

    def _make_source(self, rig: Rig) -> Source:
        kind = self.own.text("source")
        if kind == "simulation":
            return self._simulated(rig)
        if kind == "serial":
            if not self.own.text("serial.port"):
                raise InputError(
                    "parameter serial.port: is empty; give the amplifier's port, as /dev/ttyUSB0"
                )
            # Started by itself it waits for its device; whoever configures it is told that there is none
            return SerialSource(
                self.own.text("serial.port"),
                self.own.whole("serial.baud_rate"),
                self._format(),
                at_once=not self.own.flag("autostart"),
            )
        return FileSource(Path(self.own.text("file.path")).expanduser(), self._format())

    def _simulated(self, rig: Rig) -> SimulatedSource:
        width = self.device.width
        noise = self.own.vector("simulation.noise", width)
        described = np.array([rig.noise.get(name, 0.0) for name in self.device.noise])
        errors = DeviceErrors(
            np.where(noise < 0.0, described, noise),
            self.own.vector("simulation.bias", width),
            self.own.vector("simulation.gain", width),
            self.own.number("simulation.clock_offset"),
            self.own.number("simulation.time_constant"),
        )
        # Two devices with one seed must not make the same noise
        rng = np.random.default_rng([self.own.whole("simulation.seed"), *self.get_name().encode()])
        mount = MountError(
            self.own.vector("simulation.position_error", 3), self.own.vector("simulation.rotation_error", 3)
        )
        for name, matters, error in (
            ("position", self.device.placed, mount.position),
            ("rotation", self.device.turned, mount.rotation),
        ):
            if np.any(error) and not matters:
                raise InputError(
                    f"parameter simulation.{name}_error: {self.device.node} reads the same at any {name}; "
                    "leave it out"
                )
        read = self.device.read
        source = SimulatedSource(
            self.own.number("simulation.rate"), lambda rows: read(rows, mount), errors, rng
        )

        def hear(message: Float64MultiArray) -> None:
            source.add(from_message(message))

        self._plant = self.create_subscription(Float64MultiArray, TOPIC, self.guarded(hear), reliable(200))
        return source

    def _format(self) -> LineFormat:
        width = self.device.width
        columns = [int(c) for c in self.own.vector("line.columns")]
        if columns == [-1]:
            columns = list(range(width))
        if len(columns) != width:
            raise InputError(
                f"parameter line.columns: has {len(columns)} columns; the device has {width} channels"
            )
        time_column = self.own.whole("line.time_column")
        return LineFormat(
            tuple(columns),
            self.own.vector("line.scale", width),
            self.own.vector("line.offset", width),
            self.own.text("line.separator"),
            None if time_column < 0 else time_column,
            self.own.number("line.time_scale"),
        )

    def _publish(self) -> None:
        if self.source is None:
            return
        now_ns = self.get_clock().now().nanoseconds
        if not self.active:
            self.source.skip(now_ns)
            return
        stamps, values = self.source.take(now_ns)
        if not len(stamps):
            return
        for topic, columns, publisher in self._outlets:
            for row in serialize(topic, stamps, values[:, columns]):
                publisher.publish(row.tobytes())
        self.published += len(stamps)

    def status(self) -> list[DiagnosticStatus]:
        """How many samples went out, and what the source complains of."""
        complaint = "" if self.source is None else self.source.complaint()
        line = diagnostic(
            f"{self.get_name()}: source",
            WARN if complaint else OK,
            complaint or ("samples flow" if self.active else f"nothing is sent: the node is {self.state}"),
            published=self.published,
        )
        return [*super().status(), line]


def noise_names(*counts: tuple[str, int]) -> tuple[str, ...]:
    """Names repeated: ``("tension", 4)`` is four columns of tension."""
    return tuple(name for name, count in counts for _ in range(count))


def columns_of(widths: Sequence[int]) -> list[slice]:
    """Slices of neighbouring columns of the given widths."""
    ends = np.cumsum(widths)
    return [slice(int(end - width), int(end)) for end, width in zip(ends, widths, strict=True)]
