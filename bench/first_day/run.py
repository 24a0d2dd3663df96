"""One task of the bench: a session with a fault, without one, or recorded; examined, marked, timed."""

from __future__ import annotations

import hashlib
import signal
import time
import traceback
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

import rig_identification
from bench.concealed.answer import true_ten
from bench.first_day.faults import all_cases
from bench.first_day.faults.base import Case
from bench.first_day.judge import channels_of, marked, remains, told
from bench.first_day.sessions import kept
from rig_identification.check.examine import Examined, examine
from rig_identification.errors import InputError
from rig_identification.examination import Examination
from rig_identification.raw import RawSession
from rig_identification.result import ELEMENTS
from rig_identification.search.identify import identify
from rig_identification.session import clean, read_raw

LIMIT = 60  # s, for an examination
IDENTIFY_LIMIT = 900  # s


@dataclass(frozen=True)
class Task:
    """What to examine; ``kind``: "fault", "clean", "ordinary" or "recorded"."""

    kind: str
    cache: Path  # of the sessions; the session's own folder where it is recorded
    session: str  # name in the cache or of the folder
    rig: str = ""  # label of the base session
    case: str = ""  # name of the fault
    identify: bool = False

    @property
    def key(self) -> str:
        """Name of the task in the log."""
        return "|".join((self.kind, self.session, self.case, "J" if self.identify else ""))


def fingerprint() -> str:
    """Of the examination's own code, of what is put in and how it is marked: other code, other answers."""
    root = Path(rig_identification.__file__).parent
    files = [p for name in ("check", "session") for p in sorted((root / name).rglob("*.py"))]
    files += [root / "raw.py", root / "examination.py", Path(__file__).with_name("judge.py"), Path(__file__)]
    files += sorted((Path(__file__).parent / "faults").glob("*.py"))
    return hashlib.sha256(b"".join(p.read_bytes() for p in files)).hexdigest()[:12]


def done(task: Task) -> dict[str, Any]:
    """The task's line of the log."""
    entry: dict[str, Any] = {"key": task.key, "kind": task.kind, "session": task.session, "rig": task.rig}
    if task.kind == "recorded":
        return entry | _recorded(task)
    raw, truth = _session(task.cache, task.session)
    if task.kind in ("clean", "ordinary"):
        return entry | _without_fault(task, raw, truth)
    return entry | _with_fault(task, raw, truth)


@lru_cache(maxsize=4)
def _session(cache: Path, name: str) -> tuple[RawSession, dict[str, Any]]:
    kind, _, seed = name.rpartition("_")
    one = kept(cache, kind, int(seed))
    if one is None:
        raise InputError(f"{cache / name}: no such session; make it by python -m bench.first_day.generate")
    return one.read(), one.truth


@lru_cache(maxsize=4)
def _cases(cache: Path, name: str) -> dict[str, Case]:
    return {case.name: case for case in all_cases(_session(cache, name)[0])}


def _with_fault(task: Task, raw: RawSession, truth: dict[str, Any]) -> dict[str, Any]:
    case = _cases(task.cache, task.session)[task.case]
    entry: dict[str, Any] = {
        "case": case.name,
        "group": case.group,
        "effect": case.effect,
        "channels": list(case.channels),
        "untellable": case.untellable,
    }
    faulty = case.session(raw, zlib.crc32(raw.name.encode()))
    examined, more = _examined(faulty)
    entry |= more
    if examined is None:
        return entry
    entry |= asdict(marked(examined.examination, case))
    entry["remains"] = remains(examined.session, raw).as_json()
    if task.identify:
        entry["inertia"] = _inertia(examined.session, truth)
    return entry


def _without_fault(task: Task, raw: RawSession, truth: dict[str, Any]) -> dict[str, Any]:
    examined, entry = _examined(raw)
    if examined is None:
        return entry
    alarms = false_alarms(examined.examination, truth)
    entry |= {"outcome": "alarm" if alarms else "quiet", "said": alarms}
    entry["statement"] = examined.examination.faults[0].statement if alarms else ""
    entry["truth"] = [effect["effect"] for effect in truth["effects"]]
    return entry


def false_alarms(examination: Examination, truth: dict[str, Any]) -> list[str]:
    """Faults told that are not true: what an ordinary effect does may be told in its own word and place."""
    found = []
    for fault in examination.faults:
        true = [e for e in truth["effects"] if e["effect"] == fault.effect]
        channels = {e["where"].get("channel") for e in true}
        if not true or not channels_of(fault.where) <= channels:
            found.append(told(fault))
    return found


def _recorded(task: Task) -> dict[str, Any]:
    """A session from elsewhere: what is told, for a person to judge; with a case, against that."""
    entry: dict[str, Any] = {"case": task.case}
    try:
        raw = read_raw(task.cache)
    except InputError as err:
        return entry | {"outcome": "refused", "statement": str(err)}
    examined, more = _examined(raw)
    entry |= more
    if examined is None:
        return entry
    if task.case:
        effect, _, channels = task.case.partition(" ")
        case = Case(task.case, effect, tuple(channels.split()), lambda raw, rng: raw)
        return entry | asdict(marked(examined.examination, case)) | {"effect": effect}
    faults = examined.examination.faults
    return entry | {
        "outcome": "alarm" if faults else "quiet",
        "said": [told(fault) for fault in faults],
        "statement": " ".join(fault.statement for fault in faults),
    }


def _examined(raw: RawSession) -> tuple[Examined | None, dict[str, Any]]:
    """The examination, and its time or why there is none."""
    begin = time.process_time()
    try:
        with _limited(LIMIT):
            examined = examine(raw)
    except InputError as err:
        return None, {"outcome": "refused", "statement": str(err)}
    except TimeoutError:
        return None, {"outcome": "too long", "seconds": float(LIMIT)}
    except Exception as err:  # a crash is a result of the bench, not its end
        place = traceback.extract_tb(err.__traceback__)[-1]
        at = f"{Path(place.filename).name}:{place.lineno}"
        own = [f for f in traceback.extract_tb(err.__traceback__) if "rig_identification" in f.filename]
        via = " < ".join(f"{Path(f.filename).stem}.{f.name}" for f in own[:-4:-1])
        return None, {"outcome": "crash", "statement": f"{type(err).__name__}: {err} ({at}; {via})"}
    return examined, {"seconds": time.process_time() - begin}


def _inertia(raw: RawSession, truth: dict[str, Any]) -> dict[str, Any]:
    """Largest error of J's determined elements in the std claimed, after a whole identification."""
    begin = time.process_time()
    try:
        with _limited(IDENTIFY_LIMIT):
            answer = identify(clean(raw))
    except (InputError, TimeoutError, ArithmeticError, ValueError, np.linalg.LinAlgError) as err:
        return {"sigma": None, "error": f"{type(err).__name__}: {err}"}
    total = answer.total
    std = np.sqrt(np.diag(total.covariance))
    judged = [k for k in range(4, 10) if ELEMENTS[k] not in total.unobservable and std[k] > 0.0]
    error = np.abs(total.values - true_ten(truth))[judged] / std[judged]
    return {
        "sigma": float(np.max(error)) if judged else None,
        "verdict": answer.mismatch.verdict,
        "findings": [f.effect for f in answer.mismatch.findings],
        "seconds": time.process_time() - begin,
    }


@contextmanager
def _limited(seconds: float) -> Iterator[None]:
    """Raise TimeoutError after so many seconds of the process' own time."""

    def stop(number: int, frame: object) -> None:
        raise TimeoutError(f"longer than {seconds:g} s")

    before = signal.signal(signal.SIGVTALRM, stop)
    signal.setitimer(signal.ITIMER_VIRTUAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0.0)
        signal.signal(signal.SIGVTALRM, before)
