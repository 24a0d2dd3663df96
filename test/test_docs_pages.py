"""README and docs: short enough, every link leads somewhere, every description in them can be read."""

from __future__ import annotations

import re
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

from rig_identification.cli.main import build_parser
from rig_identification.session.rig_description import read_rig
from rig_identification.session.session_description import read_session_description

ROOT = Path(__file__).parents[1]
README = ROOT / "README.md"
DOCS = ROOT / "docs"
PAGES = [README, ROOT / "CONTRIBUTING.md", ROOT / "CHANGELOG.md", *sorted(DOCS.rglob("*.md"))]
MOST_WORDS = 900
LINK = re.compile(r"\]\(([^)\s]+)\)")
FENCE = re.compile(r"^ *```.*?^ *```$", re.DOTALL | re.MULTILINE)


def links(page: Path) -> list[str]:
    """Links of a page to other files and chapters."""
    text = FENCE.sub("", page.read_text(encoding="utf-8"))
    return [link for link in LINK.findall(text) if not re.match(r"[a-z]+:", link)]


def anchors(page: Path) -> set[str]:
    """Fragments that name a page's chapters, as GitHub and mkdocs make them."""
    text = FENCE.sub("", page.read_text(encoding="utf-8"))
    titles = re.findall(r"^#+ (.+)$", text, re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", t.lower()).strip().replace(" ", "-") for t in titles}


def blocks(page: Path, language: str) -> list[str]:
    """Fenced blocks of a language."""
    found = re.findall(
        rf"^ *```{language}\n(.*?)^ *```$", page.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE
    )
    return [textwrap.dedent(block) for block in found]


def test_the_readme_is_a_page() -> None:
    assert len(README.read_text(encoding="utf-8").split()) <= MOST_WORDS


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_every_link_leads_somewhere(page: Path) -> None:
    for link in links(page):
        path, _, fragment = link.partition("#")
        target = (page.parent / path).resolve() if path else page
        assert target.exists(), link
        if fragment:
            assert fragment in anchors(target), link


@pytest.mark.parametrize("page", [README, DOCS / "how-to" / "own-rig.md"], ids=lambda page: page.name)
def test_descriptions_in_the_pages_are_read(page: Path, tmp_path: Path) -> None:
    """A newcomer copies them."""
    rig, session = blocks(page, "yaml")
    (tmp_path / "rig.yaml").write_text(rig, encoding="utf-8")
    (tmp_path / "session.yaml").write_text(session, encoding="utf-8")
    assert len(read_rig(tmp_path / "rig.yaml").cables) == 2
    described = read_session_description(tmp_path / "session.yaml")
    assert [r.holdout for r in described.entries] == [False, False, True]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_commands_in_the_pages_exist(page: Path) -> None:
    usage = build_parser().format_help()
    for name in re.findall(
        r"(?:^|bin/|`)rig-identification ([a-z]+)\b", page.read_text(encoding="utf-8"), re.MULTILINE
    ):
        assert re.search(rf"^    {name}\b", usage, re.MULTILINE), name


def test_every_effect_has_a_row() -> None:
    """Effects before ``unit`` in the contract's table; those after it are faults of the set-up."""
    contract = (DOCS / "recording-contract.md").read_text(encoding="utf-8")
    table = contract[contract.index("| effect | what it is") : contract.index("| `unit` |")]
    told = (DOCS / "effects.md").read_text(encoding="utf-8")
    names = re.findall(r"^\| `(\w+)` \|", table, re.MULTILINE)
    assert len(names) >= 27
    assert [name for name in names if f"`{name}`" not in told] == []


def test_every_decision_is_in_the_index() -> None:
    index = (DOCS / "adr" / "README.md").read_text(encoding="utf-8")
    names = sorted(page.name for page in (DOCS / "adr").glob("0*.md"))
    assert re.findall(r"^\| \[\d{4}\]\(([^)]+)\) \|", index, re.MULTILINE) == names


def test_the_site_is_built_without_a_warning(tmp_path: Path) -> None:
    pytest.importorskip("mkdocs", reason="pip install '.[docs]'")
    pytest.importorskip("material")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(tmp_path / "site")]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "site" / "effects" / "index.html").exists()
