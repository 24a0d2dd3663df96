"""Score a tool's results on concealed sessions, after it ran: opens the sealed truths."""

from __future__ import annotations

import argparse
import hashlib
import json
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bench.concealed.answer import read_answer
from bench.concealed.marks import SessionMarks, mark
from bench.concealed.score_page import document, page
from rig_identification.errors import InputError

DIGESTS = Path(__file__).with_name("digests.txt")


@dataclass(frozen=True)
class Truth:
    """What is true of one session."""

    session: str  # name of its folder
    size: float | None  # None: not known
    truth: dict[str, Any]


def committed_text(path: Path) -> str:
    """A file as it is in the last commit, whatever lies in the working tree.

    Raises
    ------
    InputError
        The file is not committed.
    """
    command = ["git", "-C", str(path.parent), "show", f"HEAD:./{path.name}"]
    shown = subprocess.run(command, capture_output=True, text=True, check=False)
    if shown.returncode != 0:
        raise InputError(f"{path} is not in the last commit: commit the digest before scoring")
    return shown.stdout


def open_sealed(path: Path, digests: Path = DIGESTS) -> tuple[str, list[Truth]]:
    """SHA-256 of the sealed file and its truths.

    Raises
    ------
    InputError
        The digest is not among those committed: this is not the file that was sealed.
    """
    content = path.read_bytes()
    digest = hashlib.sha256(content).hexdigest()
    if digest not in committed_text(digests):
        raise InputError(
            f"{path}: SHA-256 {digest} is not in the committed {digests.name}: use the file as it was sealed"
        )
    entries = json.loads(content)["sessions"]
    # An entry without a truth is a session that the engine could not make.
    return digest, [Truth(e["truth"]["case"], e["size"], e["truth"]) for e in entries if e["truth"]]


def open_folder(path: Path) -> list[Truth]:
    """Truths that lie beside the sessions: development."""
    files = sorted(path.glob("*/truth.json"))
    return [Truth(f.parent.name, None, json.loads(f.read_text(encoding="utf-8"))) for f in files]


def score(
    truths: Sequence[Truth], sessions: Path, results: Path, reasons: dict[str, str], sealed: bool
) -> list[SessionMarks]:
    """Marks of every session, in the order of the truths.

    Raises
    ------
    InputError
        A session is missing, or its truth lay open beside it in a sealed run.
    """
    out = []
    for entry in truths:
        folder = sessions / entry.session
        if not (folder / "session.yaml").is_file():
            raise InputError(f"{folder} holds no session.yaml: give the folder that the truths belong to")
        if sealed and (folder / "truth.json").exists():
            raise InputError(f"{folder}/truth.json lies open: this was no sealed run")
        result = results / entry.session / "result.json"
        answer = read_answer(result) if result.is_file() else None
        seconds = result.with_name("seconds.txt")
        took = float(seconds.read_text()) if seconds.is_file() else None
        reason = reasons.get(entry.session)
        out.append(mark(entry.session, entry.truth, answer, entry.size, took, reason))
    return out


def _write(marks: Sequence[SessionMarks], digest: str | None, out: Path) -> None:
    out.mkdir(parents=True, exist_ok=True)
    text = json.dumps(document(marks, digest), indent=1, allow_nan=False)
    (out / "concealed.json").write_text(text + "\n", encoding="utf-8")
    (out / "concealed.md").write_text(page(marks, digest), encoding="utf-8")


def main(arguments: Sequence[str] | None = None) -> int:
    """Command line: 0, or 2 with one line on standard error."""
    parser = argparse.ArgumentParser(prog="python -m bench.concealed.score", description=__doc__)
    parser.add_argument("--sessions", type=Path, required=True, help="folder of the sessions")
    parser.add_argument("--results", type=Path, required=True, help="folder of the results, by session")
    parser.add_argument(
        "--truths", type=Path, required=True, help="the sealed file; a folder of NAME/truth.json: development"
    )
    parser.add_argument(
        "--digests", type=Path, default=DIGESTS, help="committed file with the sealed file's SHA-256"
    )
    parser.add_argument("--reasons", type=Path, default=None, help="JSON of session: reason of its miss")
    parser.add_argument(
        "--first",
        type=int,
        default=None,
        help="score so many, by seed: where time ended the examination",
    )
    parser.add_argument(
        "--skip", type=int, default=0, help="leave out so many first: sessions that were opened before"
    )
    parser.add_argument("--out", type=Path, required=True, help="folder for concealed.json and concealed.md")
    options = parser.parse_args(arguments)
    try:
        if options.truths.is_dir():
            digest, truths = None, open_folder(options.truths)
        else:
            digest, truths = open_sealed(options.truths, options.digests)
        reasons = json.loads(options.reasons.read_text(encoding="utf-8")) if options.reasons else {}
        truths = truths[options.skip :][: options.first]
        marks = score(truths, options.sessions, options.results, reasons, sealed=digest is not None)
    except (InputError, OSError) as error:
        print(f"score: {error}", file=sys.stderr)
        return 2
    _write(marks, digest, options.out)
    print(f"{len(marks)} sessions scored: {options.out / 'concealed.md'}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
