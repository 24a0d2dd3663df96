"""The faults, one kind a file."""

from __future__ import annotations

from bench.first_day.faults import axes, cells, files, host_clock, loggers, stamps, units, wiring
from bench.first_day.faults.base import Case
from rig_identification.raw import RawSession

MODULES = (units, axes, wiring, files, cells, loggers, stamps, host_clock)
#: First part of the faults' names.
GROUPS = ("unit", "axes", "wiring", "cells", "stamps")


def all_cases(raw: RawSession) -> tuple[Case, ...]:
    """Every fault that a session can have, kind by kind."""
    return tuple(case for module in MODULES for case in module.cases(raw))
