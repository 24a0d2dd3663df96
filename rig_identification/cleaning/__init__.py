"""From every message to the usable samples: stamps of one clock, numbers within range, rest that is rest."""

from rig_identification.cleaning.recording import clean

__all__ = ["clean"]
