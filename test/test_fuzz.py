"""A few of the fuzz bench's sessions, and that the bench tells how a session ended."""

from __future__ import annotations

from dataclasses import replace

import pytest

from bench import fuzz
from bench.fuzz_sessions import Recipe, recipe_of, simpler
from rig_identification.errors import InputError

#: Seeds of sessions that end soon: two to eight cables, bodies of grams and of tonnes,
#: cells alone, trackers alone, rest alone, gaps, spikes, jumbled stamps, rigs that no one would build.
SEEDS = (1, 2, 5, 6, 7, 8, 9, 1004, 1006, 1007, 1008, 2001)


@pytest.mark.filterwarnings("default::RuntimeWarning")
@pytest.mark.parametrize("seed", SEEDS)
def test_a_session_is_answered_or_refused_in_one_line(seed: int) -> None:
    recipe = recipe_of(seed)
    recipe = replace(recipe, seconds=min(recipe.seconds, 1.5), rate=min(recipe.rate, 100.0))
    said = _said(recipe)
    assert said in ("none", "explained", "unexplained") or said.startswith("refused: ")
    assert "\n" not in said


def _said(recipe: Recipe) -> str:
    """The verdict, or why the session was refused; a defect is raised."""
    try:
        return fuzz.answered(recipe, 0.0)
    except InputError as error:
        return f"refused: {error}"


def _refused(recipe: Recipe, seconds: float) -> str:
    raise InputError("rig.yaml: no")


def _defective(recipe: Recipe, seconds: float) -> str:
    raise ValueError("a defect")


def _endless(recipe: Recipe, seconds: float) -> str:
    while True:
        pass


@pytest.mark.parametrize(
    ("does", "status", "said"),
    [(_refused, "2", "rig.yaml: no"), (_defective, "1", "ValueError: a defect"), (_endless, "limit", "")],
)
def test_how_a_session_ends_is_told(does, status: str, said: str, monkeypatch: pytest.MonkeyPatch) -> None:  # type: ignore[no-untyped-def]
    monkeypatch.setattr(fuzz, "answered", does)
    ended = fuzz.attempt(recipe_of(3), 0.0, 1)
    assert (ended.status, ended.said) == (status, said)


def test_the_simplest_recipe_that_fails_alike_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """A defect of six cables and more, whatever else is drawn, ends at a recipe with nothing else odd."""

    def six(recipe: Recipe, seconds: float) -> str:
        if recipe.cables >= 6:
            raise ValueError("six cables")
        return "none"

    monkeypatch.setattr(fuzz, "answered", six)
    first = next(r for r in map(recipe_of, range(100)) if r.cables == 8 and r.odd)
    found = fuzz.simplest(first, 0.0, 5)
    assert found.cables == 8
    assert not found.odd
    assert found.fault == "none"
    assert len(found.runs) == 1


def test_a_seed_stands_for_one_recipe_and_all_kinds_are_drawn() -> None:
    recipes = [recipe_of(seed) for seed in range(300)]
    assert recipes[7] == recipe_of(7)
    assert {r.cables for r in recipes} == set(range(2, 9))
    assert min(r.mass for r in recipes) < 0.2
    assert max(r.mass for r in recipes) > 1e4
    assert max(r.seconds for r in recipes) > 1000.0
    assert any(all(r.runs) and not r.statics for r in recipes)
    assert all(next(simpler(r)) != r for r in recipes)
