"""Parts that Exudyn mechanisms of the rig are made of: absolute coordinates, constraints by multipliers."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import exudyn as exu
import numpy as np
from exudyn.itemInterface import (
    LoadForceVector,
    LoadTorqueVector,
    MarkerBodyPosition,
    MarkerBodyRigid,
    NodePoint,
    ObjectConnectorCartesianSpringDamper,
    ObjectConnectorDistance,
    ObjectConnectorRigidBodySpringDamper,
    ObjectConnectorSpringDamper,
    ObjectGround,
    ObjectJointGeneric,
    ObjectJointSpherical,
    ObjectMassPoint,
    SensorNode,
    SensorObject,
)
from exudyn.utilities import RigidBodyInertia

from bench.concealed.inertia import about_origin, add_point
from bench.concealed.scene import Array, Body

OUT = exu.OutputVariableType


class Assembly:
    """The body, what hangs on it and what it hangs from.

    ``oil``: damping per mass, 1/s, on all that moves; 0 but while a rest is sought.
    """

    def __init__(self, body: Body, pose: tuple[Array, Array], gravity: float, oil: float) -> None:
        self._container = exu.SystemContainer()
        self.mbs = self._container.AddSystem()
        self.pose, self.gravity, self._oil = pose, gravity, oil
        self.ground = self.mbs.AddObject(ObjectGround())
        self.ceiling = self.ground  # what carries the ceiling points
        self._carried = body
        self.body, self.node = self.add_body(body, *pose)
        self.reference = np.array(self.mbs.GetNode(self.node)["referenceCoordinates"])[3:7]
        self.laws: list[Callable[[], Array]] = []  # torque on the body, body axes, of a connector's own
        self.cables: list[int] = []  # sensors of the cables' forces

    def add_body(self, body: Body, position: Array, rotation: Array, weighs: bool = True) -> tuple[int, int]:
        """Object and node of a rigid body whose frame is at ``position`` (3,), ``rotation`` (3, 3)."""
        inertia = RigidBodyInertia(
            mass=body.mass, inertiaTensor=about_origin(body), com=np.array(body.center_of_mass)
        )
        made = self.mbs.CreateRigidBody(
            inertia=inertia,
            referencePosition=list(position),
            referenceRotationMatrix=rotation,
            gravity=[0.0, 0.0, 0.0],
            returnDict=True,
        )
        number = int(made["bodyNumber"])
        if weighs:
            self.weigh(number, body.mass, body.center_of_mass)
        if self._oil > 0.0:
            at = position + rotation @ body.center_of_mass
            damping = np.zeros((6, 6))
            damping[:3, :3] = self._oil * body.mass * np.eye(3)
            damping[3:, 3:] = self._oil * np.trace(body.inertia) / 3.0 * np.eye(3)
            self.mbs.AddObject(
                ObjectConnectorRigidBodySpringDamper(
                    markerNumbers=[self.frame(self.ground, at), self.frame(number, body.center_of_mass)],
                    damping=damping,
                )
            )
        return number, int(made["nodeNumber"])

    def add_bob(self, mass: float, position: Array) -> int:
        """A point mass; its marker."""
        node = self.mbs.AddNode(NodePoint(referenceCoordinates=list(position)))
        bob = self.mbs.AddObject(ObjectMassPoint(mass=mass, nodeNumber=node))
        self.weigh(bob, mass, np.zeros(3))
        if self._oil > 0.0:
            self.damp(self.point(self.ground, position), self.point(bob, np.zeros(3)), self._oil * mass)
        return self.point(bob, np.zeros(3))

    def carry(self, mass: float, position: Array, weighs: bool = True) -> None:
        """Fix a point mass (kg) to the body at ``position`` (3,)."""
        self._carried = add_point(self._carried, mass, position)
        carried = self._carried
        inertia = about_origin(carried)
        six = [inertia[0, 0], inertia[1, 1], inertia[2, 2], inertia[1, 2], inertia[0, 2], inertia[0, 1]]
        self.mbs.SetObjectParameter(self.body, "physicsMass", carried.mass)
        self.mbs.SetObjectParameter(self.body, "physicsInertia", six)
        self.mbs.SetObjectParameter(self.body, "physicsCenterOfMass", list(carried.center_of_mass))
        if weighs:
            self.weigh(self.body, mass, position)

    def weigh(self, number: int, mass: float, position: Array) -> None:
        """Gravity on a mass (kg) at a point (3,) of an object."""
        marker = self.point(number, position)
        self.mbs.AddLoad(LoadForceVector(markerNumber=marker, loadVector=[0.0, 0.0, -mass * self.gravity]))

    def point(self, number: int, position: Array) -> int:
        """Marker of a point (3,) of an object, in its axes."""
        return int(self.mbs.AddMarker(MarkerBodyPosition(bodyNumber=number, localPosition=list(position))))

    def frame(self, number: int, position: Array) -> int:
        """Marker of a point (3,) of an object that has axes."""
        return int(self.mbs.AddMarker(MarkerBodyRigid(bodyNumber=number, localPosition=list(position))))

    def force(self, position: Array, turning: bool) -> int:
        """A force on the body's point (3,) that can be set; ``turning``: in body axes, else in world."""
        marker = self.frame(self.body, position)
        load = LoadForceVector(markerNumber=marker, loadVector=[0.0] * 3, bodyFixed=turning)
        return int(self.mbs.AddLoad(load))

    def moment(self) -> int:
        """A moment on the body, body axes, that can be set."""
        marker = self.frame(self.body, np.zeros(3))
        load = LoadTorqueVector(markerNumber=marker, loadVector=[0.0] * 3, bodyFixed=True)
        return int(self.mbs.AddLoad(load))

    def damp(self, first: int, second: int, damping: float) -> None:
        """A damper (N s/m) against the relative velocity of two markers."""
        self.mbs.AddObject(
            ObjectConnectorCartesianSpringDamper(markerNumbers=[first, second], damping=[damping] * 3)
        )

    def rigid_cable(self, top: Array, hinge: Array, length: float) -> None:
        """A massless cable that keeps its length."""
        ends = [self.point(self.ceiling, top), self.point(self.body, hinge)]
        self._felt(self.mbs.AddObject(ObjectConnectorDistance(markerNumbers=ends, distance=length)))

    def elastic_cable(
        self, top: Array, hinge: Array, length: float, stiffness: float, damping: float
    ) -> None:
        """A massless cable that stretches."""
        ends = [self.point(self.ceiling, top), self.point(self.body, hinge)]
        self._felt(
            self.mbs.AddObject(
                ObjectConnectorSpringDamper(
                    markerNumbers=ends, referenceLength=length, stiffness=stiffness, damping=damping
                )
            )
        )

    def pulled(
        self, anchor: Array, place: Array, length: float, law: Callable[[float, float], float]
    ) -> None:
        """Pull a point (3,) of the body to one of the room, by the stretch beyond ``length`` and its rate."""

        def force(_mbs: Any, _time: float, _item: int, stretch: float, rate: float, *_: float) -> float:
            return law(stretch, rate)

        self.mbs.AddObject(
            ObjectConnectorSpringDamper(
                markerNumbers=[self.point(self.ground, anchor), self.point(self.body, place)],
                referenceLength=length,
                springForceUserFunction=force,
            )
        )

    def rod(self, top: Array, hinge: Array, rod: Body, rotation: Array, length: float, cell: str) -> None:
        """A heavy straight cable on two ball joints; ``top`` is its frame's origin, it runs along -z."""
        number, _ = self.add_body(rod, top, rotation)
        ends = (
            (self.frame(self.ceiling, top), self.frame(number, np.zeros(3))),
            (self.frame(self.body, hinge), self.frame(number, np.array([0.0, 0.0, -length]))),
        )
        joints = [self.mbs.AddObject(ObjectJointSpherical(markerNumbers=list(pair))) for pair in ends]
        self._felt(joints[0 if cell == "ceiling" else 1])

    def hang(self, bob: int, pivot: Array, length: float) -> None:
        """Keep a bob's marker at ``length`` from a point (3,) of the body."""
        ends = [bob, self.point(self.body, pivot)]
        self.mbs.AddObject(ObjectConnectorDistance(markerNumbers=ends, distance=length))

    def slide_ceiling(self, mass: float, axis: int, stiffness: float, damping: float) -> None:
        """Put the ceiling points on a plate that slides along one world axis on a spring."""
        plate, _ = self.add_body(Body(mass, np.zeros(3), mass * np.eye(3)), np.zeros(3), np.eye(3), False)
        ends = [self.frame(self.ground, np.zeros(3)), self.frame(plate, np.zeros(3))]
        held = [int(k != axis) for k in range(3)] + [1, 1, 1]
        self.mbs.AddObject(ObjectJointGeneric(markerNumbers=ends, constrainedAxes=held))
        along = np.eye(3)[axis]
        self.mbs.AddObject(
            ObjectConnectorCartesianSpringDamper(
                markerNumbers=ends, stiffness=list(stiffness * along), damping=list(damping * along)
            )
        )
        self.ceiling = plate

    def spring_part(self, part: Body, place: Array, stiffness: Array, damping: Array, free: Array) -> None:
        """A part that turns with the body, its frame sprung to the body's point ``place`` (3,).

        Along the body axes: ``stiffness`` (3,) N/m, ``damping`` (3,) N s/m; ``free`` (3,) m is where the
        springs are without load.
        """
        origin, rotation = self.pose
        number, node = self.add_body(part, origin + rotation @ place, rotation)
        ends = [self.frame(self.body, place), self.frame(number, np.zeros(3))]
        self.mbs.AddObject(ObjectJointGeneric(markerNumbers=ends, constrainedAxes=[0, 0, 0, 1, 1, 1]))
        self.mbs.AddObject(
            ObjectConnectorRigidBodySpringDamper(
                markerNumbers=ends,
                stiffness=np.diag([*stiffness, 0.0, 0.0, 0.0]),
                damping=np.diag([*damping, 0.0, 0.0, 0.0]),
                offset=[*free, 0.0, 0.0, 0.0],
            )
        )
        get = self.mbs.GetNodeOutput

        def torque() -> Array:
            """Of the body's share, which the connector puts at ``place`` and slides put at the part."""
            turned = get(self.node, OUT.RotationMatrix).reshape(3, 3)
            away = turned.T @ (get(node, OUT.Position) - get(self.node, OUT.Position)) - place
            speed = turned.T @ (get(node, OUT.Velocity) - get(self.node, OUT.Velocity))
            speed -= np.cross(get(self.node, OUT.AngularVelocityLocal), place + away)
            return np.cross(away, stiffness * (away - free) + damping * speed)

        self.laws.append(torque)

    def _felt(self, connector: int) -> None:
        sensor = SensorObject(objectNumber=connector, outputVariableType=OUT.Force, storeInternal=True)
        self.cables.append(int(self.mbs.AddSensor(sensor)))

    def watch(self, output: Any) -> int:
        """A sensor of the body's node."""
        return int(
            self.mbs.AddSensor(
                SensorNode(nodeNumber=self.node, outputVariableType=output, storeInternal=True)
            )
        )
