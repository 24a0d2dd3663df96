"""Case studies of the thesis as a command line names them."""

from rig_identification.api.cases import case_named

__all__ = ["case_named"]
