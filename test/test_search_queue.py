"""The order in which models are expanded, with what is fitted given: no session is simulated here."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import SimpleNamespace

import pytest

from rig_identification.mismatch.budget import UNLIMITED, Budget
from rig_identification.mismatch.candidate import MANY, Candidate, added
from rig_identification.mismatch.opened import Promise
from rig_identification.model import work
from rig_identification.search import expand
from rig_identification.search import search as queue
from rig_identification.search.expand import Standing, worthy
from rig_identification.search.levels import ALONE


@dataclass(frozen=True)
class _Rung:
    """The least of a fitted model: its evidence, and how strong a wrench it asks for."""

    evidence: float
    level: int = ALONE
    problem: None = None
    model: None = None

    @property
    def evaluation(self) -> SimpleNamespace:
        return SimpleNamespace(point=self.evidence)

    @property
    def alone(self) -> bool:
        return self.level == ALONE

    @property
    def within_reach(self) -> float:
        return self.evidence


def _candidate(name: str, numbers: int = 1) -> Candidate:
    return Candidate(name, tuple(added(f"{name}.{k}", "1", 1.0, k) for k in range(numbers)), "", "")


def _model(names: str, evidence: float, level: int = ALONE) -> Standing:
    return Standing(_Rung(evidence, level), tuple(map(_candidate, names.split())))  # type: ignore[arg-type]


#: Of each model those with one more effect: their effects, log evidence and level.
Tree = dict[str, list[tuple[str, float, int]]]


def searched(
    monkeypatch: pytest.MonkeyPatch,
    tree: Tree,
    explained: tuple[str, ...] = (),
    traced: tuple[str, ...] = (),
    budget: Budget = UNLIMITED,
    beside: Tree | None = None,
) -> tuple[queue.Outcome, list[str], list[str]]:
    """What a search comes to where models have these children; what it expands, and what it asks whole runs.

    tree: of each model its children (names, log evidence, level). explained: models that explain all;
    traced: those that leave a trace. beside: of each rival of a first effect itself with the second one.
    """
    expanded: list[str] = []
    whole: list[str] = []

    def name(standing: Standing) -> str:
        return " ".join(c.effect for c in standing.found)

    def children(problem: object, standing: Standing, *_: object) -> list[Standing]:
        expanded.append(name(standing))
        return [_model(*child) for child in tree.get(name(standing), [])]

    def in_whole_runs(ideal: object, problem: object, standing: Standing, *_: object) -> object:
        whole.append(name(standing))
        wholly = name(standing) in explained
        return SimpleNamespace(wholly=wholly, told=wholly or name(standing) in traced, of=name(standing))

    def crossed(
        problem: object, standing: object, best: object, rivals: list[Standing], *_: object
    ) -> list[Standing]:
        return [_model(*both) for rival in rivals for both in (beside or {}).get(name(rival), [])]

    monkeypatch.setattr(queue, "children", children)
    monkeypatch.setattr(queue, "crossed", crossed)
    monkeypatch.setattr(queue, "in_whole_runs", in_whole_runs)
    monkeypatch.setattr(queue, "stretch_of", lambda rung: rung)
    monkeypatch.setattr(queue, "described_closer", lambda *_: [])
    monkeypatch.setattr(queue, "problem_of", lambda ideal: None)
    monkeypatch.setattr(queue, "catalogue", lambda problem: [_candidate("a")])
    first = _Rung(0.0, 0)
    found = queue.search(None, first, lambda label, share: None, budget)  # type: ignore[arg-type]
    return found, expanded, whole


def test_the_likeliest_model_is_expanded_until_whole_runs_are_explained(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    tree = {"": [("a", 100.0, 3), ("b", 80.0, 3)], "a": [("a c", 300.0, ALONE)]}
    found, expanded, whole = searched(monkeypatch, tree, ("a c",))
    assert expanded == ["", "a"]
    # A model that needs a strong wrench is not asked of whole runs
    assert whole == ["a c"]
    assert found.told is found.partly
    assert found.told is not None
    assert found.likeliest.label == "a, c"


def test_another_first_effect_has_its_turn_where_the_likeliest_path_ends(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    tree = {"": [("a", 100.0, 3), ("b", 80.0, 3)], "a": [], "b": [("b c", 300.0, ALONE)]}
    found, expanded, _ = searched(monkeypatch, tree, ("b c",))
    assert expanded == ["", "a", "b"]
    assert found.told is not None
    assert found.told.of == "b c"  # type: ignore[attr-defined]


def test_what_stood_first_is_asked_again_beside_what_came_second(monkeypatch: pytest.MonkeyPatch) -> None:
    tree = {"": [("a", 100.0, 3), ("b", 80.0, 3), ("d", 40.0, 3)], "a": [("a c", 300.0, ALONE)]}
    beside = {"b": [("b c", 320.0, ALONE)], "d": [("d c", 500.0, ALONE)]}
    found, expanded, whole = searched(monkeypatch, tree, ("a c", "b c"), beside=beside)
    assert expanded == ["", "a"]
    # "d" gained less than half of what the best first effect did and has no turn
    assert whole == ["b c"]
    assert found.told is not None


def test_two_effects_that_leave_the_wrench_as_strong_as_it_was_are_a_path_s_end(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    tree = {
        "": [("a", 100.0, 0), ("b", 80.0, 1)],
        "a": [("a c", 300.0, 0)],
        "b": [("b c", 250.0, ALONE)],
    }
    found, expanded, _ = searched(monkeypatch, tree, ("b c",))
    # The first one may: of two that are there it takes the second one away
    assert expanded == ["", "a", "b"]
    assert found.told is not None


def test_no_model_has_more_than_three_effects_and_no_more_than_four_are_expanded(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    tree = {
        "": [("a", 100.0, 1), ("b", 60.0, 1), ("c", 55.0, 1), ("d", 40.0, 1)],
        "a": [("a b", 200.0, 2)],
        "a b": [("a b c", 300.0, 3)],
    }
    found, expanded, _ = searched(monkeypatch, tree)
    assert expanded == ["", "a", "a b", "b"]
    assert found.told is None
    assert found.likeliest.label == "a, b, c"


def test_what_gains_less_than_half_of_the_best_has_no_turn(monkeypatch: pytest.MonkeyPatch) -> None:
    tree = {"": [("a", 100.0, 3), ("b", 40.0, 3)], "a": [], "b": [("b c", 300.0, ALONE)]}
    found, expanded, _ = searched(monkeypatch, tree, ("b c",))
    assert expanded == ["", "a"]
    assert found.told is None


def test_what_gains_no_more_than_chance_gives_is_no_child(monkeypatch: pytest.MonkeyPatch) -> None:
    found, expanded, whole = searched(monkeypatch, {"": [("a", queue.MEANT, ALONE)]}, ("a",))
    assert (expanded, whole) == ([""], [])
    assert found.likeliest is found.first
    assert found.partly is None


def test_what_leaves_a_trace_is_told_where_nothing_leaves_none(monkeypatch: pytest.MonkeyPatch) -> None:
    tree = {"": [("a", 100.0, ALONE), ("b", 80.0, ALONE)], "a": [("a c", 105.0, ALONE)]}
    found, _, whole = searched(monkeypatch, tree, traced=("a",))
    assert whole[0] == "a"
    assert found.told is not None
    assert found.told.of == "a"  # type: ignore[attr-defined]


def test_a_spent_budget_expands_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    found, expanded, _ = searched(monkeypatch, {"": [("a", 100.0, ALONE)]}, ("a",), budget=Budget(0.0))
    assert not expanded
    assert found.told is None


def promise(name: str, gain: float, numbers: int = 1) -> Promise:
    """A promise of a hypothesis of so many numbers, nats."""
    return Promise(_candidate(name, numbers), gain, {})


def begun_of(
    monkeypatch: pytest.MonkeyPatch, promises: list[Promise], gains: dict[str, float], budget: Budget
) -> list[str]:
    """Which of ``promises`` are fitted where first fits gain so much (nats)."""
    asked: list[str] = []

    def begun(standing: Standing, promise: Promise, *_: object) -> Standing | None:
        effect = promise.candidate.effect
        asked.append(effect)
        return _model(effect, gains[effect]) if effect in gains else None

    monkeypatch.setattr(expand, "begun_with", begun)
    first = expand._first_fits(_model("", 0.0), promises, budget, lambda label: None)
    assert [child.label for child in first] == [effect for effect in asked if effect in gains]
    return asked


def test_what_promises_less_than_half_of_what_was_gained_is_not_fitted(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    promises = [promise("a", 100.0), promise("b", 60.0), promise("c", 40.0)]
    assert begun_of(monkeypatch, promises, {"a": 100.0, "b": 60.0}, UNLIMITED) == ["a", "b"]
    # What did not come to its promise, or could not be followed, spares nobody
    assert begun_of(monkeypatch, promises, {"a": 70.0, "b": 5.0, "c": 5.0}, UNLIMITED) == ["a", "b", "c"]
    assert begun_of(monkeypatch, promises, {"c": 5.0}, UNLIMITED) == ["a", "b", "c"]


def test_what_is_fitted_soon_comes_before_a_hose_and_may_spare_its_fit(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    promises = [promise("hose", 150.0, MANY), promise("mass", 100.0)]
    assert begun_of(monkeypatch, promises, {"mass": 80.0, "hose": 150.0}, UNLIMITED) == ["mass", "hose"]
    less = [promise("hose", 45.0, MANY), promise("mass", 100.0)]
    assert begun_of(monkeypatch, less, {"mass": 100.0, "hose": 150.0}, UNLIMITED) == ["mass"]
    # What gains more than it promised says that first order tells little: it spares no more than that
    more = [promise("hose", 90.0, MANY), promise("mass", 100.0)]
    assert begun_of(monkeypatch, more, {"mass": 500.0, "hose": 150.0}, UNLIMITED) == ["mass", "hose"]


def test_what_time_was_short_of_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    with work.counted():
        budget = Budget(1.0)
        work.add(work.UNIT)
        promises = [promise("a", 100.0), promise("b", 60.0)]
        assert begun_of(monkeypatch, promises, {"a": 1.0}, budget) == []
    assert budget.untried == ["a", "b"]


def test_a_twin_is_fitted_after_what_first_order_cannot_tell_from_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    one = promise("one", 50.0)
    twins = ((_candidate("twin"), {"twin.0": 2.0}),)
    one = replace(one, candidate=replace(one.candidate, twins=twins))
    assert begun_of(monkeypatch, [one, promise("b", 40.0)], {"one": 5.0}, UNLIMITED) == ["one", "twin", "b"]


def test_a_twin_that_is_in_the_model_is_not_fitted_again() -> None:
    """A part on springs that hides in a ceiling is asked beside that ceiling, and not the ceiling twice."""
    ceiling = _candidate("ceiling")
    one = promise("part", 50.0)
    one = replace(one, candidate=replace(one.candidate, twins=((ceiling, {"ceiling.0": 2.0}),)))
    assert [p.candidate.effect for p in expand._with_twins([one], ())] == ["part", "ceiling"]
    assert [p.candidate.effect for p in expand._with_twins([one], (ceiling,))] == ["part"]


def test_of_each_kind_a_few_of_the_best_promises_are_worth_a_fit() -> None:
    hinges = [
        replace(promise(f"h{k}", 100.0 - k), candidate=replace(_candidate(f"h{k}"), effect="hinge"))
        for k in range(4)
    ]
    others = [promise("a", 60.0), promise("b", 9.0), promise("c", 1.0)]
    chosen = [p.candidate.effect for p in worthy([*others, *hinges], 10)]
    # Less than a tenth of the best promise is too little, and so is what noise gives
    assert chosen == ["hinge"] * expand.ALIKE + ["a"]
    many = [promise(f"m{k}", 100.0 - k) for k in range(9)]
    assert len(worthy(many, 10)) == expand.FITTED
    assert worthy([promise("c", 1.0)], 10) == []


def children_of(
    monkeypatch: pytest.MonkeyPatch, promises: list[Promise], absurd: tuple[str, ...] = ()
) -> tuple[list[str], list[str]]:
    """Children where each fit gains what was promised; and what was fitted. absurd: effects of no sense."""
    fitted: list[str] = []

    def begun(standing: Standing, promise: Promise, *_: object) -> Standing:
        fitted.append(promise.candidate.effect)
        return _model(promise.candidate.effect, promise.gain)

    monkeypatch.setattr(expand, "begun_with", begun)
    monkeypatch.setattr(expand, "_alike", lambda *_: [])
    monkeypatch.setattr(expand, "contradicted", lambda trial: trial.candidate.effect == "clock")
    monkeypatch.setattr(expand, "walked_down", lambda model, point, level: _Rung(point, 5))
    monkeypatch.setattr(expand, "_closer", lambda *_: [])
    monkeypatch.setattr(expand, "_unbent", lambda *_: [])
    monkeypatch.setattr(expand, "leaves_noise", lambda rung: False)
    monkeypatch.setattr(expand, "_giving_way", lambda *_: [])
    monkeypatch.setattr(expand, "_stretching", lambda *_: [])
    monkeypatch.setattr(expand, "_clocks_and_lags", lambda ranked: ranked)
    monkeypatch.setattr(expand, "_last_of", lambda child: SimpleNamespace(candidate=child.found[-1]))
    monkeypatch.setattr(expand, "makes_sense", lambda standing, _: standing.found[-1].effect not in absurd)
    monkeypatch.setattr(expand, "earned", lambda before, after: after)
    candidates = [p.candidate for p in promises]
    found = expand.children(
        None,  # type: ignore[arg-type]
        _model("", 0.0, 0),
        candidates,
        UNLIMITED,
        lambda label: None,
        promises,
    )
    return [child.label for child in found], fitted


def test_a_clock_that_stamps_contradict_is_no_child(monkeypatch: pytest.MonkeyPatch) -> None:
    """However likely it is: where two devices share a clock neither can be late."""
    assert children_of(monkeypatch, [promise("clock", 100.0), promise("lag", 80.0)])[0] == ["lag"]


def test_what_ends_absurd_keeps_nothing_from_a_fit(monkeypatch: pytest.MonkeyPatch) -> None:
    """A tenth of the best promise is too little for a fit only where the best one makes sense."""
    promises = [promise("mount", 1000.0), promise("springs", 80.0), promise("tank", 70.0)]
    assert children_of(monkeypatch, promises) == (["mount"], ["mount"])
    found = children_of(monkeypatch, promises, absurd=("mount",))
    assert found == (["springs", "tank"], ["mount", "springs", "tank"])


@pytest.mark.parametrize(
    ("gain", "leaves", "beside", "led"),
    [(120.0, 5, 130.0, True), (80.0, 5, 130.0, False), (120.0, 8, 130.0, False), (120.0, 5, 70.0, False)],
)
def test_what_else_is_there_is_asked_beside_cables_that_stretch(
    monkeypatch: pytest.MonkeyPatch, gain: float, leaves: int, beside: float, led: bool
) -> None:
    """Where they gain what anything promises, and more is promised beside them; not where nothing is left."""

    def down(model: object, point: object, level: int) -> object:
        return replace(_model("cables", gain, leaves).rung)

    monkeypatch.setattr(expand, "walked_down", down)
    monkeypatch.setattr(expand, "_closer", lambda *_: [])
    monkeypatch.setattr(expand, "makes_sense", lambda standing, problem: True)
    about = [promise("mass", beside)]
    monkeypatch.setattr(expand, "_screened", lambda *_: about)
    taut = _model("cables", gain, 4)
    found = expand._led_by(
        None,  # type: ignore[arg-type]
        _model("", 0.0, 4),
        [taut],
        [promise("mass", 100.0)],
        [],
        UNLIMITED,
        lambda label: None,
    )
    assert [child.label for child in found] == (["cables"] if led else [])
    assert [child.promises for child in found] == ([tuple(about)] if led else [])
