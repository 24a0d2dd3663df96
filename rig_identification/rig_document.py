"""A :class:`~rig_identification.rig.Rig` as the document of a ROS 2 parameter file."""

from __future__ import annotations

from dataclasses import fields

from rig_identification.rig import Mount, Rig

_UPPER = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))  # xx xy xz yy yz zz


def rig_document(rig: Rig) -> dict[str, object]:
    """Mapping that, dumped as YAML, is the rig description of ``rig``."""
    parameters: dict[str, object] = {"gravity": float(rig.gravity)}
    for name in ("mass", "mass_std", "cable_linear_density"):
        if (value := getattr(rig, name)) is not None:
            parameters[name] = float(value)
    if rig.frame is not None:
        parameters["frame"] = {
            "mass": float(rig.frame.mass),
            "center_of_mass": rig.frame.center_of_mass.tolist(),
            "inertia": [float(rig.frame.inertia[place]) for place in _UPPER],
        }
    parameters["cables"] = [cable.name for cable in rig.cables]
    for cable in rig.cables:
        parameters[cable.name] = {
            "ceiling_point": cable.ceiling_point.tolist(),
            "body_point": cable.body_point.tolist(),
            "length": float(cable.length),
            "load_cell": cable.load_cell,
        }
    for name in ("imu", "inclinometer", "exciter", "mocap"):
        if (mount := getattr(rig, name)) is not None:
            parameters[name] = _mount(mount, with_position=name != "inclinometer")
    if rig.vehicle is not None:
        parameters["vehicle"] = {f.name: getattr(rig.vehicle, f.name).tolist() for f in fields(rig.vehicle)}
    if rig.noise:
        parameters["noise"] = {name: float(value) for name, value in rig.noise.items()}
    parameters["tolerance"] = {name: float(value) for name, value in rig.tolerance.items()}
    return {"/**": {"ros__parameters": parameters}}


def _mount(mount: Mount, *, with_position: bool) -> dict[str, object]:
    position = {"position": mount.position.tolist()} if with_position else {}
    return {**position, "orientation": mount.orientation.tolist()}
