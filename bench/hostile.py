"""Inputs made to harm: none may crash a process, cost a gigabyte or ten seconds, or leave a file outside.

Each input is drawn from its number (hostile_inputs.py) and given to `check`, to `identify` or to the page, in
a process of its own: 10 s of processor time until the session is read and examined, 1 GiB of memory beyond
what the package itself takes. What counts against the package: an exit status of 1, a traceback, a time or a
memory beyond the limit, a process that hangs, a file anywhere but in the folder asked for, and a name that
stands in a page as it came. A session that turns out usable may be fitted for as long as that takes: the
clock of `identify` stops where its fit begins.

    nice python -m bench.hostile [--inputs 500] [--first 0]
    python -m bench.hostile --replay NUMBER
"""

from __future__ import annotations

import argparse
import asyncio
import json
import multiprocessing
import os
import resource
import signal
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Callable
from dataclasses import asdict, dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np

from bench.hostile_inputs import KINDS, MARK, honest, request, written
from rig_identification.recording import Session

HERE = Path(__file__).parent
#: s of one core, bytes, and s of waiting.
SECONDS, MEMORY, HANGS = 10.0, 1 << 30, 300.0
#: Which of the three is asked, in turn.
DOORS = ("check", "identify", "page")
TOKEN, PORT = "token-of-the-bench", 1
#: Endings that count against the package.
BAD = ("crash", "time", "memory", "hang", "outside", "unescaped")


@dataclass(frozen=True)
class Ended:
    """How one input ended."""

    number: int
    door: str
    kind: str
    status: str  # "answered", "refused", or one of BAD
    said: str
    seconds: float  # of its processor
    mebibytes: float  # beyond those at its beginning


def drawn(number: int) -> tuple[str, str]:
    """Door and kind of an input."""
    kinds = list(KINDS)
    return DOORS[number % len(DOORS)], kinds[number // len(DOORS) % len(kinds)]


def attempt(number: int, session: Session) -> Ended:
    """One input, made in a folder that goes."""
    door, kind = drawn(number)
    with tempfile.TemporaryDirectory(prefix="hostile_") as name:
        root = Path(name)
        for folder in ("outside", "home", "tmp", "here", "folder"):
            (root / folder).mkdir()
        (root / "outside" / "secret.yaml").write_text("secret: of somebody else\n")
        written(session, root / "folder" / "session", np.random.default_rng([1, number]))
        KINDS[kind](root / "folder" / "session", np.random.default_rng([2, number]), session)
        (root / "folder" / "link").symlink_to(root / "outside")
        before = _tree(root)
        work = {"check": _check, "identify": _identify, "page": _page}[door]
        status, said, seconds, memory = _in_a_child(lambda: work(root, number), root)
        left = sorted(path for path, size in _tree(root).items() if before.get(path) != size)
        if status in ("answered", "refused"):
            inside = "folder/" if door == "page" else "folder/out"
            outside = [p for p in left if not p.startswith(inside) or p.startswith("folder/session")]
            pages = [
                p for p in (root / "folder" / "out").rglob("*.html") if MARK in p.read_text(encoding="utf-8")
            ]
            if outside:
                status, said = "outside", ", ".join(outside[:5])
            elif pages:
                status, said = "unescaped", pages[0].name
    return Ended(number, door, kind, status, said[-1200:], round(seconds, 2), round(memory / 2**20, 1))


def _tree(root: Path) -> dict[str, int]:
    """Every file and folder below, with its size; links are not followed."""
    out = {}
    for top, folders, files in os.walk(root):
        for name in (*folders, *files):
            path = Path(top) / name
            out[str(path.relative_to(root))] = -1 if name in folders else path.lstat().st_size
    return out


def _in_a_child(work: Callable[[], tuple[str, str]], root: Path) -> tuple[str, str, float, float]:
    """Status, what was said, s and bytes of ``work`` in a process of its own."""
    mine, theirs = multiprocessing.Pipe(duplex=False)
    process = multiprocessing.get_context("fork").Process(target=_child, args=(work, root, theirs))
    process.start()
    theirs.close()
    try:
        if not mine.poll(HANGS):
            process.kill()
            return "hang", f"no end within {HANGS:g} s", HANGS, 0.0
        status, said, seconds, memory = mine.recv()
    except EOFError:
        process.join()
        late = process.exitcode in (-signal.SIGXCPU, -signal.SIGKILL)
        return "time" if late else "crash", f"process ended {process.exitcode}", SECONDS, 0.0
    finally:
        mine.close()
    process.join()
    if status in ("answered", "refused") and memory > MEMORY:
        status = "memory"
    return str(status), str(said), float(seconds), float(memory)


def _child(work: Callable[[], tuple[str, str]], root: Path, pipe: Connection) -> None:
    os.environ.update(HOME=str(root / "home"), TMPDIR=str(root / "tmp"))
    tempfile.tempdir = None
    os.chdir(root / "here")
    with (root.parent / f"{root.name}.txt").open("w+", encoding="utf-8", errors="replace") as printed:
        os.unlink(printed.name)
        for stream in (1, 2):
            os.dup2(printed.fileno(), stream)
        begun, base = time.process_time(), _resident()
        virtual = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_AS, (virtual + 2 * MEMORY, resource.RLIM_INFINITY))
        _allow(SECONDS)
        try:
            status, said = work()
        except TimeoutError as error:
            status, said = "time", str(error)
        except MemoryError:
            status, said = "memory", traceback.format_exc(limit=-3)
        except BaseException:
            status, said = "crash", traceback.format_exc(limit=-4)
        _allow(None)
        printed.seek(0)
        text = printed.read()
        if status == "refused" and not said:
            said = text[-300:]
        if "Traceback" in text or "defect:" in text:
            status, said = "memory" if "MemoryError" in text else "crash", text[-1200:]
        pipe.send((status, said, time.process_time() - begun, _resident() - base))
        pipe.close()


def _resident() -> float:
    return 1024.0 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def _allow(seconds: float | None) -> None:
    """So many s of processor time from now on; None: no limit any more."""

    def late(*_: object) -> None:
        raise TimeoutError(f"more than {SECONDS:g} s")

    signal.signal(signal.SIGPROF, late)
    signal.setitimer(signal.ITIMER_PROF, seconds or 0.0)


def _command(*arguments: str) -> tuple[str, str]:
    from rig_identification.cli.main import main

    try:
        status = main([*arguments, "--debug"])
    except SystemExit as left:  # its own arguments are at fault
        return "crash", f"left with status {left.code}"
    return {0: "answered", 2: "refused"}.get(status, "crash"), ""


def _check(root: Path, number: int) -> tuple[str, str]:
    folder = root / "folder"
    return _command("check", str(folder / "session"), "--out", str(folder / "out"))


def _identify(root: Path, number: int) -> tuple[str, str]:
    from rig_identification.search import identify as room

    fitted = room.identify

    def identify(*arguments: Any, **named: Any) -> Any:
        _allow(None)
        return fitted(*arguments, **named)

    room.identify = identify
    folder = root / "folder"
    return _command(
        "identify", str(folder / "session"), "--out", str(folder / "out"), "--work", "1e-3", "--quiet"
    )


def _page(root: Path, number: int) -> tuple[str, str]:
    """The overview and one drawn request, over the folder that holds the session."""
    from rig_identification.ui.app import application

    app = application(root / "folder", TOKEN, "127.0.0.1", PORT)
    rng = np.random.default_rng([3, number])
    said = []
    for method, path, body in (
        ("GET", "/", b""),
        request(rng, root / "folder"),
        request(rng, root / "folder"),
    ):
        status, text = asyncio.run(_asked(app, method, path, body))
        said.append(f"{method} {path[:60]} {status}")
        if status >= 500:
            return "crash", said[-1]
        if MARK in text:
            return "unescaped", said[-1]
    return "answered", "; ".join(said)


async def _asked(app: Any, method: str, path: str, body: bytes) -> tuple[int, str]:
    """Status and text of one request, as a browser sends it that has the page's cookie."""
    from urllib.parse import unquote

    plain, _, query = path.partition("?")
    headers = {
        "host": f"127.0.0.1:{PORT}", "cookie": f"rig_identification_{PORT}={TOKEN}",
        "content-type": "application/json", "content-length": str(len(body)),
    }  # fmt: skip
    scope = {
        "type": "http", "asgi": {"version": "3.0"}, "http_version": "1.1", "method": method, "scheme": "http",
        "path": unquote(plain), "raw_path": plain.encode(), "query_string": query.encode(), "root_path": "",
        "headers": [(k.encode(), v.encode()) for k, v in headers.items()],
        "client": ("127.0.0.1", 2), "server": ("127.0.0.1", PORT),
    }  # fmt: skip
    waiting = [{"type": "http.request", "body": body, "more_body": False}]
    said: list[Any] = []

    async def receive() -> Any:
        return waiting.pop() if waiting else {"type": "http.disconnect"}

    async def send(answer: Any) -> None:
        said.append(answer)

    await app(scope, receive, send)
    text = b"".join(part.get("body", b"") for part in said[1:])
    return int(said[0]["status"]), text.decode("utf-8", "replace")


def report(ended: list[Ended]) -> str:
    """The table of what was run."""
    statuses = ("answered", "refused", *BAD)
    lines = [
        "# Hostile inputs",
        "",
        f"Made by `python -m bench.hostile`: {len(ended)} inputs, "
        f"numbers {ended[0].number} to {ended[-1].number}.",
        "",
        f"| given to | inputs | {' | '.join(statuses)} | most s | most MiB |",
        f"| --- | --- |{' --- |' * (len(statuses) + 2)}",
    ]
    for name, group in (
        *((door, [e for e in ended if e.door == door]) for door in DOORS),
        *((kind, [e for e in ended if e.kind == kind]) for kind in KINDS),
        ("all", ended),
    ):
        counts = Counter(e.status for e in group)
        row = [name, len(group), *(counts[s] for s in statuses)]
        if group:
            row += [f"{max(e.seconds for e in group):.1f}", f"{max(e.mebibytes for e in group):.0f}"]
        lines.append(f"| {' | '.join(map(str, row))} |")
    bad = [f"- {e.number} ({e.door}, {e.kind}): {e.status}, {e.said.splitlines()[-1] if e.said else ''}"
           for e in ended if e.status in BAD]  # fmt: skip
    seconds = "Seconds are of the processor, the fit of a usable session in `identify` included. "
    return "\n".join([*lines, "", seconds + "Mebibytes are beyond those of the package.", "", *bad, ""])


def _warm(session: Session) -> None:
    """Load and compile what all need, before the processes part."""
    with tempfile.TemporaryDirectory() as name:
        written(session, Path(name) / "session", np.random.default_rng(0))
        _command("identify", f"{name}/session", "--out", f"{name}/out", "--work", "1e-3", "--quiet")
    import rig_identification.ui.app  # noqa: F401


def main() -> None:
    """Run what is missing and write the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--inputs", type=int, default=500)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--replay", type=int, help="one input alone, and all that was said")
    parser.add_argument("--log", type=Path, help="a line of JSON an input; a second call goes on")
    chosen = parser.parse_args()
    session = honest()
    _warm(session)
    if chosen.replay is not None:
        print(json.dumps(asdict(attempt(chosen.replay, session)), indent=2))
        return
    done: dict[int, Ended] = {}
    if chosen.log is not None and chosen.log.exists():
        done = {e.number: e for e in (Ended(**json.loads(x)) for x in chosen.log.read_text().splitlines())}
    for number in range(chosen.first, chosen.first + chosen.inputs):
        if number in done:
            continue
        done[number] = attempt(number, session)
        if done[number].status in BAD:
            print(done[number], flush=True)
        if chosen.log is not None:
            with chosen.log.open("a", encoding="utf-8") as stream:
                stream.write(json.dumps(asdict(done[number])) + "\n")
    ended = sorted(done.values(), key=lambda e: e.number)
    (HERE / "hostile.md").write_text(report(ended), encoding="utf-8")


if __name__ == "__main__":
    main()
