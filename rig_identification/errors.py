"""The package's error root and the one error that bad input raises."""


class RigIdentificationError(Exception):
    """Root of every error that this package raises on purpose."""


class InputError(RigIdentificationError):
    """Input that cannot be used.

    The message is one line: what is wrong, where, which value, and what to do.
    """
