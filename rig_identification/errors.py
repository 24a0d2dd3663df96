"""The package's error root, the one error that bad input raises, and a word that it may end with."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches

#: Share of letters alike, as difflib counts them, from which a word is taken for another one misspelt: two
#: letters swapped or one wrong in a word of five.
_ALIKE = 0.75


class RigIdentificationError(Exception):
    """Root of every error that this package raises on purpose."""


class InputError(RigIdentificationError):
    """Input that cannot be used.

    The message is one line: what is wrong, where, which value, and what to do.
    """


class ArgumentError(InputError):
    """An argument of a function, or the option of a command by the same name, that cannot be used.

    The message begins with the argument's name.
    """


class FieldError(InputError):
    """One value of a description that cannot be used.

    key: its path from the top of the description, as ``cable_1.body_point[2]``. problem: the message without
    file and key, for who shows it beside the value.
    """

    def __init__(self, message: str, key: str = "", problem: str = "") -> None:
        super().__init__(message)
        self.key, self.problem = key, problem


class MissingDescription(InputError):
    """Bags without a session.yaml; ``proposal`` is the text of one that the user may edit and save."""

    def __init__(self, message: str, proposal: str = "") -> None:
        super().__init__(message)
        self.proposal = proposal


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """Ending of a message that names the word of ``known`` that ``word`` may be misspelt from, or nothing."""
    by_lower = {name.lower(): name for name in known}
    close = get_close_matches(word.lower(), by_lower, n=1, cutoff=_ALIKE)
    return f"; did you mean {by_lower[close[0]]}?" if close else ""
