"""Sessions drawn at random, sensible and odd, through the whole of ``identify``: none may end in a defect.

Rig, body, devices, rates, lengths, faults of the recording: everything is drawn from a seed. Motion comes
from the project's own simulator, or from smooth numbers where no simulator makes one. Each session is
examined, cleaned, identified and written as ``rig-identification identify`` does, in a process of its own
with a limit on its processor time, and ends as 0 (answered), 2 (refused in a line), 1 (a defect) or "limit".

    nice python -m bench.fuzz --sessions 2000 [--first 0] [--workers 2] [--work UNITS] [--out FILE]
    python -m bench.fuzz --replay SEED [--shrink]
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import multiprocessing
import os
import re
import resource
import signal
import tempfile
import time
import traceback
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from multiprocessing.connection import Connection
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

from bench.fuzz_sessions import Recipe, recipe_of, session_of, simpler
from rig_identification.errors import InputError
from rig_identification.model.work import WORK

#: What stands in a page beside its texts.
UNREAD = re.compile(r"<(style|script|svg).*?</\1>", flags=re.DOTALL)
NAN = re.compile(r"(?<![A-Za-z])nan(?![A-Za-z])")


def answered(recipe: Recipe, work: float) -> str:
    """Everything that ``identify`` does, into a folder that goes; the verdict. Raises what it raises.

    work: units of work after which the search for left-out physics begins nothing new.
    """
    from rig_identification.identification import prepare, with_examination
    from rig_identification.report import write_report, write_result
    from rig_identification.search.identify import identify

    raw = session_of(recipe)
    if not raw.recordings:
        raise InputError("nothing is recorded")
    prepared = prepare(raw)
    found = with_examination(identify(prepared.session, work=work), prepared.examination)
    with tempfile.TemporaryDirectory() as folder:
        result, page = Path(folder) / "result.json", Path(folder) / "report.html"
        write_result(found, result)
        write_report(found, prepared.session, page)
        texts = result.read_text(encoding="utf-8") + UNREAD.sub("", page.read_text(encoding="utf-8"))
    if NAN.search(texts):
        raise AssertionError("an answer says nan")
    return found.mismatch.verdict


@dataclass(frozen=True)
class Ended:
    """How one session ended."""

    seed: int
    status: str  # "0", "2", "1" or "limit"
    said: str  # verdict, refusal or defect
    seconds: float  # of its processor
    where: str = ""  # of a defect


def _child(recipe: Recipe, work: float, limit: int, pipe: Connection) -> None:
    resource.setrlimit(resource.RLIMIT_CPU, (limit, limit + 5))

    def late(*_: object) -> None:
        raise TimeoutError("processor time is over")

    signal.signal(signal.SIGXCPU, late)
    try:
        ended = ("0", answered(recipe, work), "")
    except InputError as error:
        ended = ("2", str(error), "")
    except TimeoutError:
        ended = ("limit", "", traceback.format_exc(limit=-6))
    except BaseException as error:
        ended = ("1", f"{type(error).__name__}: {error}", traceback.format_exc(limit=-6))
    pipe.send((*ended, time.process_time()))
    pipe.close()


def attempt(recipe: Recipe, work: float, limit: int) -> Ended:
    """One session in a process of its own. limit: s of its processor."""
    context = multiprocessing.get_context("fork")
    mine, theirs = context.Pipe(duplex=False)
    process = context.Process(target=_child, args=(recipe, work, limit, theirs))
    process.start()
    theirs.close()
    try:
        status, said, where, spent = mine.recv()
    except EOFError:
        process.join()
        killed = process.exitcode in (-signal.SIGXCPU, -signal.SIGKILL)
        status, said, where, spent = (
            "limit" if killed else "1",
            f"process ended {process.exitcode}",
            "",
            limit,
        )
    process.join()
    return Ended(recipe.seed, status, said, round(float(spent), 1), where)


def simplest(recipe: Recipe, work: float, limit: int) -> Recipe:
    """The simplest recipe found that ends in the same defect."""
    said = attempt(recipe, work, limit).said.partition(":")[0]
    going = True
    while going:
        going = False
        for other in simpler(recipe):
            ended = attempt(other, work, limit)
            if ended.status == "1" and ended.said.partition(":")[0] == said:
                recipe, going = other, True
                break
    return recipe


def main() -> None:
    """Run the sessions and count how they end."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sessions", type=int, default=2000)
    parser.add_argument("--first", type=int, default=0, help="seed of the first session")
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument(
        "--limit", type=int, default=600, help="s of processor time that one session may take"
    )
    parser.add_argument("--work", type=float, default=WORK, help="units, for the search of left-out physics")
    parser.add_argument("--longest", type=float, default=1800.0, help="s; longer runs are drawn to last this")
    parser.add_argument("--out", type=Path, help="file of one JSON line a session")
    parser.add_argument("--replay", type=int, help="one seed, with what it is made of")
    parser.add_argument("--shrink", action="store_true", help="and its simplest relative that fails alike")
    arguments = parser.parse_args()

    def recipe(seed: int) -> Recipe:
        drawn = recipe_of(seed)
        return replace(drawn, seconds=min(drawn.seconds, arguments.longest))

    if arguments.replay is not None:
        one = recipe(arguments.replay)
        if arguments.shrink:
            one = simplest(one, arguments.work, arguments.limit)
        print(one)
        ended = attempt(one, arguments.work, arguments.limit)
        print(ended.status, ended.said, f"{ended.seconds} s")
        print(ended.where)
        return
    counts: Counter[str] = Counter()
    with ThreadPoolExecutor(arguments.workers) as pool:
        seeds = range(arguments.first, arguments.first + arguments.sessions)
        for ended in pool.map(lambda seed: attempt(recipe(seed), arguments.work, arguments.limit), seeds):
            counts[ended.status] += 1
            if arguments.out is not None:
                with arguments.out.open("a", encoding="utf-8") as stream:
                    stream.write(json.dumps(dataclasses.asdict(ended)) + "\n")
            if ended.status not in ("0", "2"):
                print(
                    f"seed {ended.seed}: {ended.status} {ended.said} ({ended.seconds} s)\n{ended.where}",
                    flush=True,
                )
    print(", ".join(f"{status}: {count}" for status, count in sorted(counts.items())))


if __name__ == "__main__":
    main()
