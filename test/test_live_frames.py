"""The rig's frames, and the URDF of the same."""

from __future__ import annotations

from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rig_identification.live.frames import fixed_frames
from rig_identification.live.robot_description import robot_description
from rig_identification.rig import Mount, Rig

TURNED = Rotation.from_euler("zyx", [0.7, -0.4, 2.1]).as_quat()
UPRIGHT = Rotation.from_euler("y", 0.5 * np.pi).as_quat()  # pitch of a right angle


@pytest.fixture
def turned(rig: Rig) -> Rig:
    return replace(
        rig, imu=Mount(np.array([0.5, -0.2, 0.3]), TURNED), exciter=Mount(np.array([1.0, 0.0, 0.0]), UPRIGHT)
    )


def test_every_cable_and_device_has_its_frame(turned: Rig) -> None:
    frames = {frame.name: frame for frame in fixed_frames(turned)}
    assert len(frames) == 2 * len(turned.cables) + 3  # no motion capture is described
    for cable in turned.cables:
        top, bottom = frames[f"{cable.name}_ceiling"], frames[f"{cable.name}_body"]
        assert (top.parent, bottom.parent) == ("world", "body")
        assert np.array_equal(top.position, cable.ceiling_point)
        assert np.array_equal(bottom.position, cable.body_point)
    assert np.array_equal(frames["imu"].orientation, TURNED)
    assert "mocap" not in frames
    assert "mocap" in {frame.name for frame in fixed_frames(replace(turned, mocap=turned.imu))}


def test_the_urdf_is_a_tree_with_the_same_frames(turned: Rig) -> None:
    robot = ElementTree.fromstring(robot_description(turned))
    links = {link.attrib["name"] for link in robot.findall("link")}
    parents = {j.find("child").attrib["link"]: j for j in robot.findall("joint")}  # type: ignore[union-attr]
    assert links - set(parents) == {"world"}  # one root; every other link has one joint above it
    assert len(parents) == len(robot.findall("joint"))
    assert parents["body"].attrib["type"] == "floating"
    for frame in fixed_frames(turned):
        joint = parents[frame.name]
        origin, parent = joint.find("origin"), joint.find("parent")
        assert origin is not None
        assert parent is not None
        assert parent.attrib["link"] == frame.parent
        assert np.allclose([float(x) for x in origin.attrib["xyz"].split()], frame.position)
        roll, pitch, yaw = (float(x) for x in origin.attrib["rpy"].split())
        # URDF: R = Rz(yaw) Ry(pitch) Rx(roll)
        told = (
            Rotation.from_euler("z", yaw) * Rotation.from_euler("y", pitch) * Rotation.from_euler("x", roll)
        )
        assert np.allclose(told.as_matrix(), Rotation.from_quat(frame.orientation).as_matrix(), atol=1e-8)


def test_a_cables_odd_name_does_not_break_the_urdf(rig: Rig) -> None:
    odd = replace(rig, cables=(replace(rig.cables[0], name='a"<b>&'), *rig.cables[1:]))
    names = [link.attrib["name"] for link in ElementTree.fromstring(robot_description(odd)).findall("link")]
    assert 'a"<b>&_body' in names
