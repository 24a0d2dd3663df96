"""More cables than the body needs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from test_estimate_prediction import recorded
from test_model_rigs import four_parallel, thesis_case_14

from rig_identification.estimate.determinate import determinate
from rig_identification.mismatch import identify
from rig_identification.result import ELEMENTS


def test_splayed_cables_all_count() -> None:
    session, _ = recorded(thesis_case_14(), seed=3, duration=1.2)
    same, note = determinate(session)
    assert same is session
    assert note is None


def test_four_parallel_cables_are_three_and_the_answer_holds() -> None:
    session, truth = recorded(four_parallel(), seed=3, duration=8.0, holdout=True, doubts=False)
    fewer, note = determinate(session)
    assert len(fewer.rig.cables) == 3
    assert note is not None
    assert not any(r.tension for r in fewer.recordings)
    found = identify(replace(session, recordings=tuple(replace(r, tension={}) for r in session.recordings)))
    assert found.mismatch.verdict == "none"
    assert note in found.notes
    z = (found.total.values - truth.elements) / np.sqrt(np.diag(found.total.covariance))
    seen = [i for i, name in enumerate(ELEMENTS) if name not in found.total.unobservable]
    assert np.max(np.abs(z[seen])) < 3.5
