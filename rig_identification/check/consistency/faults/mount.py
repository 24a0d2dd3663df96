"""An IMU that sits where the description puts another device."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from rig_identification.check.consistency.evidence import Evidence
from rig_identification.check.consistency.hypothesis import Change, Hypothesis, fault
from rig_identification.check.consistency.rest import RestFit
from rig_identification.examination import SetupFault
from rig_identification.rig import Mount


def hypotheses(evidence: Evidence) -> Iterator[Hypothesis]:
    """Every other mount of the description, its orientation alone too."""
    rig = evidence.session.rig
    others = {"exciter": rig.exciter, "inclinometer": rig.inclinometer, "mocap": rig.mocap}
    given = {name: mount for name, mount in others.items() if mount is not None}
    if rig.imu is None:
        return
    for name, mount in given.items():
        if name != "inclinometer":  # its position is not described
            yield _filed(name, mount, len(given))
        yield _filed(name, replace(rig.imu, orientation=mount.orientation), len(given))


def _filed(name: str, mount: Mount, count: int) -> Hypothesis:
    def describe(rest: RestFit | None) -> SetupFault:
        turn = ", ".join(f"{v:.6g}" for v in mount.orientation)
        place = ", ".join(f"{v:.6g}" for v in mount.position)
        return fault(
            "wiring",
            {"channel": "imu", "kind": "another_mount", "mount": name},
            {},
            f"The IMU is mounted as the description says of the {name}.",
            "Correct the IMU's mount in the rig description.",
            f"imu:\n  position: [{place}]\n  orientation: [{turn}]",
        )

    return Hypothesis(
        Change(rig=lambda rig: replace(rig, imu=mount)), describe, frozenset(["imu"]), variants=2 * count,
        fresh=True,
    )  # fmt: skip
