"""Print the script by which a shell completes commands and options.

rig-identification completion bash > ~/.local/share/bash-completion/completions/rig-identification
"""

from __future__ import annotations

import argparse

SHELLS = ("bash", "zsh", "tcsh")


def configure(parser: argparse.ArgumentParser) -> None:
    """Take the shell."""
    parser.add_argument("shell", choices=SHELLS)


def run(arguments: argparse.Namespace) -> None:
    """Print it."""
    from rig_identification.cli.main import build_parser
    from rig_identification.optional import needed

    print(needed("shtab", "completion", "completion").complete(build_parser(), arguments.shell))
