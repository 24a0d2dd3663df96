"""What was found first is dropped where the second explains as much alone, and kept where it does not."""

from __future__ import annotations

import pytest
from test_mismatch_whole_rivals import fit_of, ideal_of, search_in
from test_simulate_identify import shaken

from rig_identification.mismatch.hypotheses import catalogue, count_of
from rig_identification.mismatch.outcome import Trials
from rig_identification.mismatch.screen import promises_of
from rig_identification.mismatch.standing import Search
from rig_identification.mismatch.trial import Trial, fitted_to_its_end
from rig_identification.mismatch.without_first import without_first

#: What is found first, and what is found beside it.
CABLE = shaken(10).rig.cables[0].name
FIRST, SECOND = f"load_cell_gain {CABLE}", "hinge_damping"
GAIN = f"{CABLE}.load_cell_gain"
DAMPING, TOO_MUCH = 1.0, 0.02


def fit_beside(search: Search, label: str) -> Trial:
    """A hypothesis fitted beside what was found."""
    candidate = next(c for c in catalogue(search.problem) if c.label == label)
    (promise,) = promises_of(search.here, search.evaluation, [candidate])
    ended = fitted_to_its_end(search.here, search.evaluation, promise)
    assert ended is not None
    return ended


def _beside(search: Search, label: str) -> tuple[Search, Trial]:
    """A search with the first in its model, and a fit of a hypothesis beside it."""
    first = fit_of(search, FIRST)
    after = search.forked()
    after.adopt(Trials([first]), first)
    return after, fit_beside(after, label)


def _gain(trial: Trial) -> tuple[float, float]:
    """The first's error in a trial, and the std of its prior there."""
    parameters = trial.problem.bench.parameters
    nominal, prior = next((p.nominal, p.prior_std) for p in parameters.free if p.name == GAIN)
    return float(parameters.named(trial.evaluation.point.theta)[GAIN] - nominal), prior


@pytest.mark.parametrize("there", [False, True])
def test_the_first_goes_where_the_second_needs_none(there: bool) -> None:
    effects: dict[str, tuple[float, ...]] = {"hinge_damping": (DAMPING,)}
    if there:
        effects[GAIN] = (TOO_MUCH,)
    origin = search_in(ideal_of(shaken(10, 10.0), effects, 5))
    search, second = _beside(origin, SECOND)
    assert _gain(second)[0] == pytest.approx(TOO_MUCH if there else 0.0, abs=0.002)
    found = without_first(origin, search, Trials([second]), count_of(catalogue(origin.problem)))
    if there:
        assert found is None
    else:
        assert found is not None
        assert [t.candidate.label for t in found.done] == [SECOND]
        # Its lab's own doubt is left of the first
        assert _gain(found.done[0])[1] < 0.1 * _gain(second)[1]
