"""The document of a rig description, where sessions are written."""

from rig_identification.rig_document import rig_document

__all__ = ["rig_document"]
