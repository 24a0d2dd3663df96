"""The rig as URDF, for RViz, Foxglove and whatever else reads ``robot_description``.

URDF is a tree of rigid links, which a body on several cables is not: the cables are left out, and the body
floats in ``world``. Its pose comes by tf, the cables as markers.
"""

from __future__ import annotations

import warnings
from xml.sax.saxutils import quoteattr

from scipy.spatial.transform import Rotation

from rig_identification.live.frames import BODY, WORLD, Frame, fixed_frames
from rig_identification.rig import Rig

#: m, radius of the ball that stands for a hinge or a device.
_BALL = 0.03


def robot_description(rig: Rig) -> str:
    """URDF: links ``world`` and ``body``, and one with a ball for each of :func:`fixed_frames`."""
    frames = fixed_frames(rig)
    links = [f"  <link name={quoteattr(name)}/>" for name in (WORLD, BODY)]
    links += [_ball(frame.name) for frame in frames]
    floating = (
        f'  <joint name="{WORLD}_to_{BODY}" type="floating">\n'
        f'    <parent link="{WORLD}"/>\n    <child link="{BODY}"/>\n  </joint>'
    )
    joints = [floating, *(_joint(frame) for frame in frames)]
    return "\n".join(['<?xml version="1.0"?>', '<robot name="rig">', *links, *joints, "</robot>", ""])


def _ball(name: str) -> str:
    return (
        f"  <link name={quoteattr(name)}>\n    <visual>\n"
        f'      <geometry><sphere radius="{_BALL}"/></geometry>\n    </visual>\n  </link>'
    )


def _joint(frame: Frame) -> str:
    xyz = " ".join(f"{value:.9g}" for value in frame.position)
    with warnings.catch_warnings():  # a pitch of a right angle leaves roll and yaw open: any pair will do
        warnings.simplefilter("ignore", UserWarning)
        # URDF's rpy turns about the parent's axes, x first
        angles = Rotation.from_quat(frame.orientation).as_euler("xyz")
    rpy = " ".join(f"{angle:.9g}" for angle in angles)
    return (
        f'  <joint name={quoteattr(frame.name + "_mount")} type="fixed">\n'
        f'    <parent link="{frame.parent}"/>\n    <child link={quoteattr(frame.name)}/>\n'
        f'    <origin xyz="{xyz}" rpy="{rpy}"/>\n  </joint>'
    )
