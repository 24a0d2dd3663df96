"""Some of the bench's hostile inputs, and that the bench tells what harm is."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("starlette", reason="pip install '.[ui]'")

from bench import hostile
from bench.hostile_inputs import KINDS, MARK, honest
from rig_identification.recording import Session

pytestmark = [
    pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="memory is Linux's to tell"),
    pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning"),
]
#: Of each kind one or two, those that once did harm among them.
NUMBERS = (0, 3, 9, 21, 27, 30, 33, 42, 48, 51, 54, 60, 70, 2, 8, 14, 17, 26, 29, 35, 235, 267, 301)


@pytest.fixture(scope="module")
def session() -> Session:
    return honest()


@pytest.mark.parametrize("number", NUMBERS)
def test_a_hostile_input_harms_nobody(number: int, session: Session) -> None:
    ended = hostile.attempt(number, session)
    assert ended.status in ("answered", "refused"), ended


def _leaves_a_file(root: Path, number: int) -> tuple[str, str]:
    (root / "home" / "left").write_text("x")
    return "answered", ""


def _leaves_a_name(root: Path, number: int) -> tuple[str, str]:
    (root / "folder" / "out").mkdir()
    (root / "folder" / "out" / "check.html").write_text(MARK)
    return "answered", ""


def _runs(root: Path, number: int) -> tuple[str, str]:
    while True:
        pass


def _grows(root: Path, number: int) -> tuple[str, str]:
    return "answered", str(np.ones(20 << 20).sum())


def _breaks(root: Path, number: int) -> tuple[str, str]:
    raise ValueError("of a defect")


@pytest.mark.parametrize(
    ("work", "status"),
    [
        (_leaves_a_file, "outside"), (_leaves_a_name, "unescaped"), (_runs, "time"), (_grows, "memory"),
        (_breaks, "crash"),
    ],
)  # fmt: skip
def test_harm_is_told(
    work: Callable[[Path, int], tuple[str, str]],
    status: str,
    session: Session,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(hostile, "_check", work)
    monkeypatch.setattr(hostile, "SECONDS", 0.3)
    monkeypatch.setattr(hostile, "MEMORY", 64 << 20)
    assert hostile.drawn(0)[0] == "check"
    assert hostile.attempt(0, session).status == status


def test_an_input_is_its_number(session: Session, tmp_path: Path) -> None:
    made = []
    for name in ("one", "other"):
        folder = tmp_path / name
        hostile.written(session, folder, np.random.default_rng([1, 3]))
        KINDS["flipped"](folder, np.random.default_rng([2, 3]), session)
        made.append({f.relative_to(folder): f.read_bytes() for f in folder.rglob("*") if f.is_file()})
    assert made[0] == made[1]
