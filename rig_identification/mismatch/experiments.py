"""Which experiment would tell an effect from what these recordings cannot tell it from."""

from __future__ import annotations

from rig_identification.own import own_effects

_TURNED = (
    "hang the body turned by 180 degrees about the vertical: what belongs to the ceiling stays, what belongs "
    "to the body turns along"
)
_TWO_AMPLITUDES = (
    "let it swing down from two amplitudes: viscous hinges take the same share of every swing, dry ones more "
    "of small swings, air more of wide ones"
)
_KNOWN_WEIGHT = "hang a known weight on that cable alone: a scale error grows with it, an offset does not"
_SUNK = "measure how far hinges and ceiling sink under a known weight"

#: By the effect's name in the recording contract, and the law of a reading that it has no word for.
_EXPERIMENTS = {
    "imu_bias": "average the IMU at rest, turned by 180 degrees about one axis after the other",
    "imu_scale": "hold the IMU against gravity in six positions, and turn it by a known angle",
    "imu_misalignment": "tilt the body at rest by a known angle, about one axis after the other",
    "imu_position": "shake at two frequencies: what a lever adds grows with the square of the frequency",
    "load_cell_gain": _KNOWN_WEIGHT,
    "load_cell_offset": _KNOWN_WEIGHT,
    "exciter_gain": "weigh the unbalance and measure its radius: that gives the force without any cell",
    "exciter_position": "shake in two planes: what a lever adds turns with the force",
    "exciter_misalignment": "tilt the body at rest: the exciter's cells feel the weight of the motor",
    "inclinometer_offset": "turn the inclinometer by 180 degrees on its mount, then the body: its own error "
    "stays, a tilt changes sides",
    "clock_offset": "knock on the body at rest: every device has to show it at the same instant",
    "sensor_lag": "shake at two frequencies: a lag weakens the higher one, a late clock does not",
    "sensor_resonance": "knock on the body beside the IMU: a soft mount rings, a bolted one does not",
    "cable_length": _TURNED,
    "cable_edge": "clamp the cables where they leave the ceiling, and repeat",
    "hinge_position": _TURNED,
    "level_error": _TURNED,
    "cable_elasticity": _SUNK,
    "ceiling_compliance": "hang a known weight from the ceiling beside the rig and watch the hinges sink",
    "cable_mass": "weigh a length of the cable",
    "hinge_damping": _TWO_AMPLITUDES,
    "hinge_friction": _TWO_AMPLITUDES,
    "air_drag": _TWO_AMPLITUDES,
    "air_added_mass": "hang a light shell of the body's shape: what it shows beyond its own mass is air",
    "exciter_rotor": "weigh what moves in the exciter, or repeat with the exciter taken off",
    "gyroscopic_term": "repeat about one principal axis alone: there the term is nothing",
    "liquid_slosh": "repeat with the tank full or empty",
    "sprung_mass": "repeat with the part blocked; a liquid would swing to both sides",
    "loose_mass": "tilt the body at rest: what is loose slides to the other stop, and the weight shows it",
    "tether": "take off one hose and wire after the other and repeat",
    "external_force": "repeat the run: a push does not come again at the same instant",
    "unknown": "repeat at another amplitude, and at two frequencies",
    "unknown held end": _TURNED,
    "unknown pose error": "add a camera, or turn the marker frame on the body: where the error is then tells",
    "unknown hold against rolling": "hang the body on single points, and repeat",
    "unknown turn that softens": "repeat with small turns alone, and with a plate of known size hung beside",
    "unknown torsion of the cables": "repeat with the body turned slowly, and with swivels in the cables",
    "unknown hysteresis": "load that cell alone, rising and then falling through the same weights",
    "unknown curvature": "load that cell alone, with several known weights over its range",
    "unknown cross-sensitivity": "load one cell, or turn and tilt about one axis, alone: no other reads it",
    "unknown drift": "leave all at rest for as long as a recording takes: what drifts does so by itself",
    "unknown gain drift": "hang a known weight on it for as long as a recording takes",
}


def kinds() -> tuple[str, ...]:
    """Every kind of effect (Candidate.kind) with an experiment, the lab's own ones aside."""
    return tuple(_EXPERIMENTS)


def experiment_for(kind: str) -> str:
    """What to do to tell a kind of effect (Candidate.kind) from its rivals; empty where nothing is known."""
    own = {effect.name: effect.experiment for effect in own_effects()}
    return _EXPERIMENTS.get(kind, own.get(kind, ""))
