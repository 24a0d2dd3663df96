"""Print the JSON Schema of rig.yaml or session.yaml, for editors and other tools.

The schema comes from the validation itself. 'rig-identification init' writes it beside the files that it
makes, with the line by which editors find it.

  rig-identification schema rig > rig.schema.json
"""

from __future__ import annotations

import argparse
import json


def configure(parser: argparse.ArgumentParser) -> None:
    """Take which file it is about."""
    parser.add_argument("of", choices=("rig", "session"), help="the file that it describes")


def run(arguments: argparse.Namespace) -> None:
    """Print it."""
    from rig_identification.session.schema import SCHEMAS

    print(json.dumps(SCHEMAS[arguments.of](), indent=2, ensure_ascii=False))
