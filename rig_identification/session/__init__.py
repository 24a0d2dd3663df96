"""Sessions on disk: bags and descriptions in and out."""

from rig_identification.cleaning import clean
from rig_identification.session.read import read_raw, read_session
from rig_identification.session.rig_description import read_rig
from rig_identification.session.write import write_session

__all__ = ["clean", "read_raw", "read_rig", "read_session", "write_session"]
