"""Estimate: from recordings to parameters with honest uncertainty."""

from rig_identification.estimate.identify import identify

__all__ = ["identify"]
