"""The contract as shipped: its words are those of the code, and its examples have the code's keys."""

from __future__ import annotations

import ast
import json
import re
from dataclasses import fields
from pathlib import Path

import pytest

from rig_identification.examination import Examination, RestReading, SetupFault, TopicAccount

ROOT = Path(__file__).parents[1]
CONTRACT = (ROOT / "docs" / "recording-contract.md").read_text(encoding="utf-8")
CHECK = ROOT / "rig_identification" / "check"


def table_words() -> set[str]:
    """First column of the table of effects."""
    table = CONTRACT[CONTRACT.index("## Effects") : CONTRACT.index("## Check")]
    return set(re.findall(r"^\| `(\w+)` \|", table, re.MULTILINE))


def told_words() -> set[tuple[str, str]]:
    """Effects that the examiners tell by a word of their own, and the files that do."""
    found = set()
    for path in sorted(CHECK.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.args:
                first = node.args[0]
                named = node.func.id in ("SetupFault", "fault") and isinstance(first, ast.Constant)
                if named and isinstance(first, ast.Constant) and isinstance(first.value, str):
                    found.add((first.value, path.name))
    return found


def test_every_word_that_an_examiner_tells_is_in_the_contract() -> None:
    told = told_words()
    assert ("stamp_error", "told.py") in told  # the walk sees what it looks for
    assert {word for word, _ in told} <= table_words()


def test_the_words_of_the_table_stay() -> None:
    """A finding's word is an interface: none may go or be renamed."""
    assert {
        "unit", "axes", "wiring", "zeroed_cell", "wrapped_counts", "saturation", "frozen_channel",
        "zero_filled", "spikes", "held_samples", "averaged_samples", "cycling_samples",
        "stamp_error", "dummy_error",
        "mass_error",
        "imu_bias", "cable_slack", "load_cell_gain", "unknown",
    } <= table_words()  # fmt: skip


@pytest.mark.parametrize(
    ("key", "kind"), [("faults", SetupFault), ("rest", RestReading), ("topics", TopicAccount)]
)
def test_the_example_of_check_has_the_keys_of_the_code(key: str, kind: type) -> None:
    (text,) = re.findall(r"```json\n(.*?)```", CONTRACT[CONTRACT.index("## Check") :], re.DOTALL)
    example = json.loads(text)
    assert set(example) == {field.name for field in fields(Examination)}
    assert [*example[key][0]] == [field.name for field in fields(kind)]
