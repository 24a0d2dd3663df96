"""An answer does not depend on how many cores it is computed on, how busy they are, or how Python hashes."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

#: Units of work: the ideal model's fit takes as much, the whole search ten times that.
LIMIT = 1.0
#: One answer in a process of its own, on as many threads as its first argument says.
ANSWER = """
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
from test_simulate_identify import shaken

from rig_identification.estimate import side_by_side
from rig_identification.report import write_result
from rig_identification.search.identify import identify
from rig_identification.simulate import simulate_session

side_by_side.cores = lambda: int(sys.argv[1])
spec = replace(shaken(14, 2.5), effects={"hinge_damping": (60.0,)}, doubts=False)
session, _ = simulate_session(spec, np.random.default_rng(3))
write_result(identify(session, work=float(sys.argv[2])), Path(sys.argv[3]))
"""


def answered(cores: int, hashed: str, path: Path) -> bytes:
    """result.json of a small session, of a search that ends at its limit."""
    here = Path(__file__).parent
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "PYTHONHASHSEED": hashed}
    environment["PYTHONPATH"] = os.pathsep.join([str(here.parent), os.environ.get("PYTHONPATH", "")])
    command = [sys.executable, "-c", ANSWER, str(cores), str(LIMIT), str(path)]
    subprocess.run(command, cwd=here, env=environment, check=True)
    return path.read_bytes()


def test_one_core_and_three_give_the_same_bytes(tmp_path: Path) -> None:
    one, three = answered(1, "1", tmp_path / "one.json"), answered(3, "2", tmp_path / "three.json")
    assert one == three
    work = json.loads(one)["work"]
    assert work["limit"] == LIMIT
    # It was broken off on its way, and says before what
    assert work["used"] > LIMIT
    assert work["left_untried"]
