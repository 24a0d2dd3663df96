"""The audit of dependencies: what is vulnerable is told; where nothing can be known, that is said."""

from __future__ import annotations

import json
import os
import runpy
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

SCRIPT = Path(__file__).parents[1] / ".ci" / "audit.py"
#: Stands in for pip-audit: looks packages up in a table, and ends as it does.
STAND_IN = """#!{python}
import json, sys
known = json.loads({known!r})
if known is None:
    sys.exit("ConnectionError: Max retries exceeded")
wanted = open(sys.argv[sys.argv.index("--requirement") + 1]).read().split()
out = [
    {{"name": n, "version": v, **({{"vulns": known[n]}} if n in known else {{"skip_reason": "not found"}})}}
    for n, v in (line.split("==") for line in wanted)
]
json.dump({{"dependencies": out, "fixes": []}}, open(sys.argv[sys.argv.index("--output") + 1], "w"))
sys.exit(any(one.get("vulns") for one in out))
"""
VERSIONS = {"jinja2": "3.1.2", "numpy": "2.0.0", "rclpy": "7.1.1"}
pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="the stand-in is run by its first line")


def audited(known: Any, folder: Path, capsys: pytest.CaptureFixture[str]) -> tuple[int | None, str]:
    """Status, None where it was skipped, and what was told."""
    stand_in = folder / "pip-audit"
    stand_in.write_text(STAND_IN.format(python=sys.executable, known=json.dumps(known)))
    stand_in.chmod(0o755)
    script = runpy.run_path(str(SCRIPT))
    try:
        status = script["audit"](str(stand_in), VERSIONS, folder)
    except script["Skipped"] as why:
        return None, str(why)
    return status, capsys.readouterr().out


def test_what_a_newer_version_mends_fails(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    found = [{"id": "CVE-2024-1", "fix_versions": ["3.1.3"]}]
    status, told = audited({"numpy": [], "jinja2": found}, tmp_path, capsys)
    assert status == 1
    assert "jinja2 3.1.2: CVE-2024-1, mended in 3.1.3" in told
    assert "2 packages were looked up; not on the index: rclpy" in told


def test_what_nothing_mends_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    status, told = audited(
        {"numpy": [{"id": "CVE-2024-2", "fix_versions": []}], "jinja2": []}, tmp_path, capsys
    )
    assert status == 0
    assert "numpy 2.0.0: CVE-2024-2, nothing mends it yet" in told


def test_no_answer_is_no_clean_bill(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Neither a database out of reach nor an index that has none may read as if nothing were known."""
    assert audited(None, tmp_path, capsys) == (
        None, "the database gave no answer (ConnectionError: Max retries exceeded)"
    )  # fmt: skip
    status, told = audited({}, tmp_path, capsys)
    assert status is None
    assert "cannot be reached" in told


def test_a_tool_that_is_not_there_is_said(tmp_path: Path) -> None:
    (tmp_path / "bin").mkdir()
    (tmp_path / "bin" / "python").symlink_to(sys.executable)
    done = subprocess.run(
        [sys.executable, str(SCRIPT), str(tmp_path)], capture_output=True, text=True, check=False,
        env={**os.environ, "PIP_AUDIT": str(tmp_path / "none")},
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith("audit: skipped: ")
