"""An answer does not depend on how many cores it is computed on, nor on how busy they are."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from test_simulate_identify import shaken

from rig_identification.estimate import side_by_side
from rig_identification.recording import Session
from rig_identification.report import write_result
from rig_identification.search.identify import identify
from rig_identification.simulate import simulate_session

#: Units of work: the ideal model's fit takes as much, the whole search ten times that.
LIMIT = 1.0


@pytest.fixture(scope="module")
def session() -> Session:
    spec = replace(shaken(14, 2.5), effects={"hinge_damping": (60.0,)}, doubts=False)
    return simulate_session(spec, np.random.default_rng(3))[0]


def answered(session: Session, cores: int, folder: Path, monkeypatch: pytest.MonkeyPatch) -> bytes:
    """result.json of the session, computed on so many cores and with a search that ends at its limit."""
    monkeypatch.setattr(side_by_side, "cores", lambda: cores)
    path = folder / f"{cores}.json"
    write_result(identify(session, work=LIMIT), path)
    return path.read_bytes()


def test_one_core_and_three_give_the_same_bytes(
    session: Session, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    one, three = (answered(session, cores, tmp_path, monkeypatch) for cores in (1, 3))
    assert one == three
    work = json.loads(one)["work"]
    assert work["limit"] == LIMIT
    # It was broken off on its way, and says before what
    assert work["used"] > LIMIT
    assert work["left_untried"]
