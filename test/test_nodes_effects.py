"""Left-out physics switched on by parameter in real nodes, and what the preprocessor says of its wrench."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="ROS 2 is not installed: pip install '.[ros]'")

from geometry_msgs.msg import InertiaStamped, WrenchStamped
from nav_msgs.msg import Odometry
from node_processes import BODY, SIMULATOR, Graph, Probe, graph_of_the_test, probe_of_the_test  # noqa: F401
from ruamel.yaml import YAML
from sensor_msgs.msg import Imu
from std_msgs.msg import Float64MultiArray

from rig_identification.live.plant import Plant, odometry_values
from rig_identification.live.wrench_uncertainty import wrench_uncertainty
from rig_identification.model import layout
from rig_identification.model.motion import rig_model
from rig_identification.nodes.rig_node import LATCHED
from rig_identification.session.fields import Fields
from rig_identification.session.rig_description import rig_from_fields

MASS_STD, CENTER_STD = 0.3, 0.0005  # kg, m: what the identifier is made to say
QUIET = [part for part in SIMULATOR if not part.startswith("shake")]


def six(message: WrenchStamped) -> list[float]:
    force, torque = message.wrench.force, message.wrench.torque
    return [force.x, force.y, force.z, torque.x, torque.y, torque.z]


def stamp(message: WrenchStamped | Imu) -> int:
    return int(message.header.stamp.sec * 10**9 + message.header.stamp.nanosec)


def core_std(graph: Graph) -> np.ndarray:
    """(6,) deviations by the core alone, at rest, mass and centre known as the test tells them."""
    top = YAML(typ="safe").load(graph.rig_file.read_text())["/**"]["ros__parameters"]
    rig = rig_from_fields(Fields(graph.rig_file, "", top))
    plant = Plant(rig_model(rig, np.array(BODY)), 1)
    block, motion = plant.advance(0.01)
    tension = block.rows[0, layout.OUT_TENSION : layout.OUT_TENSION + 4]
    pose, weights = odometry_values(motion, 0)[:7], rig.gravity * np.array([BODY[0], MASS_STD])
    center, center_std = np.array(BODY[1:4]), np.full(3, CENTER_STD)
    return wrench_uncertainty(rig, pose, tension, np.zeros(3), center, center_std, *weights).std


def test_effects_switched_on_by_parameter_show_in_what_the_sensors_publish(
    graph: Graph, probe: Probe
) -> None:
    """A push knocks twice on the IMU; part and ceiling ring after it; a cell reads high."""
    center = f"[{BODY[1]}, {BODY[2]}, {BODY[3]}]"
    simulator = graph.start(
        "rig_simulator", *QUIET, "shake.amplitude:=[0.0]",
        "effect.external_force.peak_force:=3000.0", "effect.external_force.start:=[0.5, 1.5]",
        "effect.external_force.duration:=0.05", f"effect.external_force.position:={center}",
        "effect.sprung_mass.mass:=40.0", f"effect.sprung_mass.position:={center}",
        "effect.sprung_mass.frequency:=6.0", "effect.sprung_mass.damping_ratio:=0.01",
        "effect.ceiling_compliance.stiffness:=[0.0, 0.0, 1e7]",
    )  # fmt: skip
    cells = graph.start(
        "load_cells", "simulation.rate:=100.0", "simulation.noise:=[0.0]",
        "simulation.gain:=[0.0, 0.1, 0.0, 0.0, 0.0, 0.0, 0.0]",
    )  # fmt: skip
    imu = graph.start("imu", "simulation.rate:=500.0", "simulation.noise:=[0.0]")
    felt = probe.listen(Imu, "imu/data_raw", 20_000)
    truth = probe.listen(Odometry, "ground_truth/odometry")
    pulls = [probe.listen(WrenchStamped, f"cable_{i}/wrench") for i in range(1, 5)]
    probe.spin_until(lambda: felt and all(pulls) and truth, 120.0, "the graph")
    met = [len(pull) for pull in pulls]
    probe.spin_until(
        lambda: all(len(pull) > n + 50 for pull, n in zip(pulls, met, strict=True)), 30.0, "its rest"
    )
    rest = np.array([pull[-1].wrench.force.z for pull in pulls])
    before = len(felt)
    assert probe.call("rig_simulator/shake").success
    begun = stamp(felt[-1])
    probe.spin_until(lambda: stamp(felt[-1]) > begun + 3_500_000_000, 60.0, "both pushes and their ringing")
    knocked = felt[before:]
    time = 1e-9 * np.array([stamp(message) - stamp(knocked[0]) for message in knocked])
    sideways = np.array([message.linear_acceleration.y for message in knocked])  # the IMU is turned by 90 deg
    jolt = np.abs(np.diff(sideways))
    loud = time[1:][jolt > 0.3 * np.max(jolt)]
    first, second = loud[loud < loud[0] + 0.5], loud[loud >= loud[0] + 0.5]
    assert second[0] - first[0] == pytest.approx(1.0, abs=0.02)
    # What rings after the second push: the part's 6 Hz on a body that yields, the body on its ceiling
    after = sideways[(time > second[0] + 0.2) & (time < second[0] + 1.5)]
    after = np.diff(after - np.mean(after))  # the body's own slow swing counts less
    spectrum = np.abs(np.fft.rfft(after * np.hanning(after.size), 1 << 14))
    frequency = np.fft.rfftfreq(1 << 14, 0.002)
    part, ceiling = ((frequency > low) & (frequency < 2.5 * low) for low in (4.0, 11.0))
    assert 5.8 < frequency[part][np.argmax(spectrum[part])] < 7.5
    bounce = np.sqrt(1e7 / (BODY[0] + 100.0)) / (2.0 * np.pi)
    assert frequency[ceiling][np.argmax(spectrum[ceiling])] == pytest.approx(bounce, rel=0.05)
    for process in (simulator, cells, imu):
        assert graph.end(process) == (0, "")
    assert rest[1] / rest[0] == pytest.approx(1.1 * 4646.8 / 4523.9, rel=0.03)


def test_the_wrench_comes_with_what_it_is_known_to(graph: Graph, probe: Probe) -> None:
    """At rest the wrench is nought within its deviation; a known centre of mass narrows the moment."""
    simulator = graph.start("rig_simulator", *QUIET)
    for name in ("load_cells", "imu", "inclinometer"):
        graph.start(name, "simulation.rate:=100.0")
    graph.start("tracker")
    preprocessor = graph.start("preprocessor", "std_rate:=20.0")
    wrenches = probe.listen(WrenchStamped, "generalized_wrench")
    deviations = probe.listen(WrenchStamped, "generalized_wrench_std")
    probe.spin_until(lambda: len(deviations) > 20, 120.0, "the wrench's deviations")
    guessed = np.array(six(deviations[-1]))
    of_wrenches = [stamp(message) for message in wrenches]
    told_of = {
        stamp(message) for message in deviations if of_wrenches[0] <= stamp(message) <= of_wrenches[-1]
    }
    assert len(told_of) > 10
    assert told_of <= set(of_wrenches)
    steps = np.diff([stamp(message) for message in deviations]) / 1e9
    assert np.median(steps) == pytest.approx(0.05, abs=1e-6)
    assert deviations[-1].header.frame_id == "center_of_mass"
    assert np.all(guessed > 0.0)
    # The guess lies off by what it is said to be: moments as large as weight times the rig's size
    assert np.max(guessed[3:]) > 0.3 * 9.8 * BODY[0]
    moment = np.array([six(message) for message in wrenches[-100:]]).mean(axis=0)[3:]
    assert np.linalg.norm(moment) > 100.0
    assert np.all(np.abs(moment) < 3.0 * guessed[3:])
    inertia = probe.node.create_publisher(InertiaStamped, "identifier/inertia", LATCHED)
    covariance = probe.node.create_publisher(Float64MultiArray, "identifier/covariance", LATCHED)
    known = InertiaStamped()
    known.inertia.m = BODY[0]
    known.inertia.com.x, known.inertia.com.y, known.inertia.com.z = BODY[1:4]
    inertia.publish(known)
    variance = np.diag([MASS_STD**2, *[CENTER_STD**2] * 3, *np.ones(6)])
    covariance.publish(Float64MultiArray(data=variance.ravel().tolist()))
    probe.spin_until(lambda: six(deviations[-1])[3] < 0.1 * guessed[3], 20.0, "a narrower moment")
    count = len(wrenches)
    probe.spin_until(lambda: len(wrenches) > count + 200, 20.0, "two seconds of wrenches")
    std = np.array(six(deviations[-1]))
    at_rest = np.array([six(message) for message in wrenches[count:]])
    assert np.all(np.abs(at_rest.mean(axis=0)) < 3.0 * std)
    assert std == pytest.approx(core_std(graph), rel=0.05)
    # White noise of the cells is part of what is doubted, never more
    assert np.all(np.std(at_rest, axis=0) < std)
    assert graph.end(preprocessor) == (0, "")
    assert graph.end(simulator) == (0, "")
