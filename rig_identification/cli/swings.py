"""How a body swings by itself on its cables, in lines for a person."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from rig_identification.model.modes import Mode
    from rig_identification.rig import Rig


def swings(rig: Rig, elements: NDArray[np.float64]) -> tuple[Mode, ...]:
    """Natural modes of a body, elements (10,) m c J about the centre of mass, at rest on a described rig.

    Raises InputError where the body does not come to rest.
    """
    from rig_identification.model.modes import natural_modes
    from rig_identification.model.motion import rig_model
    from rig_identification.simulate.start import rest_state

    model = rig_model(rig, elements)
    return natural_modes(model, rest_state(model))


def swing_line(mode: Mode) -> str:
    """Frequency and shape of one mode."""
    return f"swings at {mode.frequency:.3f} Hz: {mode.shape}"
