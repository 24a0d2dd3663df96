"""The program that checks a set-up in a process of its own: it takes seconds, and a node goes on meanwhile.

``python -m rig_identification.nodes.check_program SESSION``. It speaks as :mod:`worker_program` says.
"""

from __future__ import annotations

import sys
from pathlib import Path

from rig_identification.nodes.worker_program import begun, run


def check(path: Path) -> dict[str, object]:
    """What check.json holds of the session. Raises InputError: it cannot be used, and no fault says why."""
    from rig_identification.identification import check_raw
    from rig_identification.report import examination_to_dict
    from rig_identification.session import read_raw

    return {"check": examination_to_dict(check_raw(read_raw(path, progress=begun), begun).examination)}


if __name__ == "__main__":
    run(lambda: check(Path(sys.argv[1])))
