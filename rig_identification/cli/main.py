"""``rig-identification``: finds the command, and turns errors into one line and an exit status."""

from __future__ import annotations

import argparse
import contextlib
import importlib
import io
import os
import pkgutil
import re
import sys
import traceback
from collections.abc import Sequence
from typing import NoReturn

# Fits share the machine's cores among their runs themselves; linear algebra that does so as well, on matrices
# this small, makes two fits side by side take three times as long. Before anything imports numpy.
os.environ.setdefault("OMP_NUM_THREADS", "1")

from rig_identification import __version__
from rig_identification.cli import commands
from rig_identification.errors import ArgumentError, InputError, MissingDescription, did_you_mean

PROGRAM = "rig-identification"

SUCCESS, DEFECT, UNUSABLE, INTERRUPTED = 0, 1, 2, 130  # and status.FAILED, which a command returns


class OneLineParser(argparse.ArgumentParser):
    """Says what is wrong with the arguments in one line, like every other error."""

    def error(self, message: str) -> NoReturn:
        """Print one line and leave; of a word misspelt the line names the right one."""
        if found := re.search(r"invalid choice: '([^']*)' \(choose from (.*)\)", message):
            message += did_you_mean(found[1], re.findall(r"[\w-]+", found[2]))
        self.exit(UNUSABLE, f"{PROGRAM}: error: {message}; see {self.prog} --help\n")


def build_parser() -> argparse.ArgumentParser:
    """Parser of every command found in ``cli/commands``."""
    parser = OneLineParser(
        prog=PROGRAM,
        description="Mass, centre of mass and inertia tensor of a body on a cable rig, "
        "and what the rig's model left out.",
    )
    parser.add_argument("--version", action="version", version=f"{PROGRAM} {__version__}")
    subparsers = parser.add_subparsers(metavar="COMMAND", required=True)
    for found in sorted(pkgutil.iter_modules(commands.__path__), key=lambda module: module.name):
        command = importlib.import_module(f"{commands.__name__}.{found.name}")
        summary, _, details = (command.__doc__ or "").partition("\n")
        subparser = subparsers.add_parser(
            found.name,
            help=summary,
            description=summary,
            epilog=details.strip(),
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        command.configure(subparser)
        subparser.add_argument(
            "--effects",
            metavar="DIR",
            help="folder of effects of your own, one Python file each; default: $RIG_IDENTIFICATION_EFFECTS",
        )
        subparser.add_argument(
            "--debug", action="store_true", help="show where a defect of this package lies"
        )
        subparser.set_defaults(run=command.run, parser=subparser)
    return parser


def parsed(argv: Sequence[str] | None) -> argparse.Namespace:
    """Arguments of a command line; leaves with one line where they are wrong."""
    arguments, unknown = build_parser().parse_known_args(argv)
    if unknown:
        parser: argparse.ArgumentParser = arguments.parser
        options = [name for action in parser._actions for name in action.option_strings]
        word = unknown[0].partition("=")[0]
        # An option that stands before the command is nobody's
        near = "; it belongs after the command" if word in options else did_you_mean(word, options)
        parser.error(f"unrecognized arguments: {' '.join(unknown)}{near}")
    return arguments


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command.

    Returns
    -------
    int
        0; 1 for a defect of this package; 2 for input that cannot be used; 3 where the answer is one that
        --fail-on names, or some sessions of several have no result; 130 where the user interrupted.
    """
    _accept_any_terminal()
    arguments = parsed(argv)
    try:
        if arguments.effects is not None:
            from rig_identification.own import VARIABLE  # it imports numpy, which --help needs not

            os.environ[VARIABLE] = arguments.effects
        return arguments.run(arguments) or SUCCESS
    except InputError as error:
        option = "--" if isinstance(error, ArgumentError) else ""
        _say(f"error: {option}{error}")
        if isinstance(error, MissingDescription):
            _show(error.proposal)
        return UNUSABLE
    except BrokenPipeError:  # whoever read the output has seen enough
        _print_no_more()
        return SUCCESS
    except KeyboardInterrupt as stopped:
        _say(str(stopped) or "interrupted")
        return INTERRUPTED
    except Exception as error:
        if arguments.debug:
            traceback.print_exc()
        _say(f"defect: {type(error).__name__}: {error}. Please report it, with the output of --debug")
        return DEFECT


def _say(message: str) -> None:
    """One line, whatever the message holds."""
    print(f"{PROGRAM}: {' '.join(message.split())}", file=sys.stderr)


def _show(text: str) -> None:
    """Text on standard output, for whoever still reads it."""
    try:
        print(text, end="", flush=True)
    except BrokenPipeError:
        _print_no_more()


def _print_no_more() -> None:
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _accept_any_terminal() -> None:
    """A terminal without ± must not turn a result into an error."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            with contextlib.suppress(io.UnsupportedOperation):
                stream.reconfigure(errors="replace")


if __name__ == "__main__":
    sys.exit(main())
