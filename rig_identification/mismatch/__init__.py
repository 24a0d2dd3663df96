"""Mismatch: where the ideal model fails, which physics or sensor error does it, and the fit with it."""

from rig_identification.mismatch.identify import identify

__all__ = ["identify"]
