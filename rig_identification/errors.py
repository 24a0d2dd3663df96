"""The package's error root and the one error that bad input raises."""


class RigIdentificationError(Exception):
    """Root of every error that this package raises on purpose."""


class InputError(RigIdentificationError):
    """Input that cannot be used.

    The message is one line: what is wrong, where, which value, and what to do.
    """


class MissingDescription(InputError):
    """Bags without a session.yaml, with the text of one that the user may edit and save."""

    def __init__(self, message: str, proposal: str) -> None:
        super().__init__(message)
        self.proposal = proposal
