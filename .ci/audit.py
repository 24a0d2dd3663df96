"""Asks pip-audit for known vulnerabilities in what the package needs; run by .ci/run after the tests.

    python .ci/audit.py VENV

VENV is the environment that the tests ran in. Where pip-audit cannot be installed, or its database cannot be
reached, that is said and nothing fails: the answer would rest on the network, not on this tree. It ends with
status 1 for a vulnerability that a newer version mends; one that none mends yet is told.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

#: They come with Python's venv, and are no part of what the package needs.
NOT_OURS = {"pip", "setuptools", "wheel", "rig_identification", "rig-identification"}
#: The one package that is asked about first, to see whether there is a database at all.
FIRST = "numpy"
#: s for the installation, and for one run of pip-audit.
PATIENCE = 300.0


class Skipped(Exception):
    """There is no answer; the message says why."""


def pip_audit(folder: Path) -> str:
    """Command of pip-audit: $PIP_AUDIT, or one installed in an environment of its own."""
    if given := os.environ.get("PIP_AUDIT"):
        return given
    venv = folder / "audit"
    for command in (
        [sys.executable, "-m", "venv", str(venv)],
        [str(venv / "bin" / "pip"), "install", "--quiet", "--disable-pip-version-check", "pip-audit"],
    ):
        try:
            done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=False)
        except (OSError, subprocess.TimeoutExpired) as error:
            raise Skipped(f"pip-audit cannot be installed ({error})") from error
        if done.returncode:
            raise Skipped(f"pip-audit cannot be installed ({last_line(done.stderr)})")
    return str(venv / "bin" / "pip-audit")


def installed(venv: Path) -> dict[str, str]:
    """Name -> version of what the environment holds, in the order of the names."""
    command = [str(venv / "bin" / "python"), "-m", "pip", "list", "--format", "json"]
    listed = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=True)
    found = {str(one["name"]): str(one["version"]) for one in json.loads(listed.stdout)}
    return {name: found[name] for name in sorted(found) if name not in NOT_OURS}


def asked(command: str, versions: dict[str, str], folder: Path) -> list[dict[str, Any]]:
    """What pip-audit says of each package. Raises Skipped where it says nothing."""
    wanted, told = folder / "requirements.txt", folder / "told.json"
    wanted.write_text("".join(f"{name}=={version}\n" for name, version in versions.items()), encoding="utf-8")
    told.unlink(missing_ok=True)
    options = ["--requirement", str(wanted), "--no-deps", "--disable-pip", "--progress-spinner", "off"]
    options += ["--format", "json", "--output", str(told)]
    try:
        done = subprocess.run(
            [command, *options], capture_output=True, text=True, timeout=PATIENCE, check=False
        )
        # It ends with 1 for a vulnerability and for a database out of reach: only the file tells them apart
        return list(json.loads(told.read_text(encoding="utf-8"))["dependencies"])
    except FileNotFoundError as error:
        why = last_line(done.stderr) if error.filename == str(told) else str(error)
        raise Skipped(f"the database gave no answer ({why})") from error
    except (OSError, ValueError, KeyError, TypeError, subprocess.TimeoutExpired) as error:
        raise Skipped(f"the database gave no answer ({error})") from error


def last_line(text: str) -> str:
    """The last line that says something."""
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    return lines[-1][:300] if lines else "no word"


def audit(command: str, versions: dict[str, str], folder: Path) -> int:
    """Print what is known; returns the exit status. Raises Skipped."""
    first = {FIRST: versions[FIRST]} if FIRST in versions else dict(list(versions.items())[:1])
    if not any("vulns" in one for one in asked(command, first, folder)):
        raise Skipped(f"the database knows nothing of {', '.join(first)}: it cannot be reached from here")
    answers = asked(command, versions, folder)
    unknown = sorted(str(one["name"]) for one in answers if "vulns" not in one)
    status = 0
    for one in answers:
        for vulnerability in one.get("vulns", ()):
            mended = vulnerability.get("fix_versions") or []
            status = 1 if mended else status
            what = f"mended in {', '.join(mended)}: raise its version" if mended else "nothing mends it yet"
            print(f"audit: {one['name']} {one['version']}: {vulnerability['id']}, {what}")
    rest = f"; not on the index: {', '.join(unknown)}" if unknown else ""
    print(f"audit: {len(answers) - len(unknown)} packages were looked up{rest}")
    return status


def main(venv: str) -> int:
    """Audit an environment; what hinders it is told, and is no failure."""
    with tempfile.TemporaryDirectory(prefix="audit_") as folder:
        try:
            return audit(pip_audit(Path(folder)), installed(Path(venv)), Path(folder))
        except Skipped as why:
            print(f"audit: skipped: {why}")
            return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
