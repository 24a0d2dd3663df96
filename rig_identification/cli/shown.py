"""What a command prints of its answer, and the answers that it is to fail on: for scripts and pipelines."""

from __future__ import annotations

import argparse
import io
import sys
from collections.abc import Sequence
from typing import TextIO

#: Exit status where the answer is one that ``--fail-on`` names.
FAILED = 3


def add_shown_options(parser: argparse.ArgumentParser, answer: str, fail_on: Sequence[str]) -> None:
    """Take ``--json``, ``--quiet`` and ``--fail-on``; ``fail_on``: the words that it may name."""
    how = parser.add_mutually_exclusive_group()
    how.add_argument("--json", action="store_true", help=f"print {answer} as JSON and nothing else")
    how.add_argument("--quiet", action="store_true", help="print nothing but errors")
    parser.add_argument(
        "--fail-on",
        nargs="+",
        choices=tuple(fail_on),
        default=[],
        metavar="ANSWER",
        help=f"leave with exit status {FAILED} where the answer is one of these: {', '.join(fail_on)}",
    )


def progress_stream(arguments: argparse.Namespace) -> TextIO:
    """Where progress goes: standard error, or nowhere with ``--quiet``."""
    return io.StringIO() if arguments.quiet else sys.stderr


def status_of(arguments: argparse.Namespace, answer: str) -> int:
    """Exit status of an answer."""
    return FAILED if answer in arguments.fail_on else 0
