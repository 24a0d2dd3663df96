"""Case studies of the thesis by their labels."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rig_identification.errors import ArgumentError

if TYPE_CHECKING:
    from rig_identification.thesis import Case


def case_named(label: str) -> Case:
    """The case of a label such as ``14`` or ``18b``. Raises ArgumentError where it is no single case."""
    from rig_identification.thesis import load_case

    number, variant = label.rstrip("abcd"), label.lstrip("0123456789")
    if not number.isdecimal():
        raise ArgumentError(f"case {label}: is no case study; give 1 to 17, or 18a to 18d")
    return load_case(int(number), variant)
