"""Hostile sessions and requests, drawn from a seed: damaged, made to cost much, or leading out of a folder.

A kind is a function that is given a folder with an honest session and spoils it. What it does comes from its
generator alone, so that a number is enough to make an input again.
"""

from __future__ import annotations

import bz2
import json
import os
import struct
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np

from bench.monte_carlo import specification
from rig_identification.recording import Series, Session
from rig_identification.session import write_session
from rig_identification.session.unpacking import zstd
from rig_identification.simulate import RunSpec, SampleRates, simulate_session
from rig_identification.simulate.exciter import Multisine
from rig_identification.simulate.start import Pulled

sys.path.append(str(Path(__file__).parents[1] / "test"))
from hostile_files import chunk, laughs, mcap, merges, message, record, topic

Rng = np.random.Generator
#: What no page may hold as it stands here.
MARK = '<img src=x onerror="alert(1)">'
NAMES = (
    MARK, "</script><script>alert(1)</script>", "../../outside/file", "/etc/passwd", "..", ".", "~", "a/b",
    "a b", "$(touch pwned)", "`touch pwned`", "%s%n", "{{7*7}}", "CON", "\u202eevil", "\u0000", "é" * 300,
    "x" * 5000, "-rf", "'; DROP TABLE topics; --", "\ud7ff", "\n\n", "__class__", "null", "0", "*",
)  # fmt: skip
VALUES = (
    ".nan", ".inf", "-.inf", "1e999", "-1", "0", "1e-320", "1e308", "9" * 400, "0x7fffffffffffffff", "[]",
    "{}", "[[[[]]]]", "null", "~", "true", "''", "'text'", "2026-01-01", "1:30:00", "!!binary aGk=", "[1, 2]",
    "!!python/object/apply:os.system [touch pwned]", "&a [*a]", "{a: {b: {c: 1}}}", "/dev/zero", "/dev/stdin",
    "../../outside/secret.yaml", "[.nan, .nan, .nan]", "[1e200, 1e200, 1e200]", "[0, 0, 0, 0]", "'1,5'",
    "? x",
)  # fmt: skip
NUMBERS = (0, 1, 255, 1 << 16, (1 << 31) - 1, 1 << 31, (1 << 32) - 1, 1 << 40, (1 << 63) - 1, (1 << 64) - 1)
READINGS = (np.nan, np.inf, -np.inf, 1e308, -1e308, 5e-324, 0.0, 1e20, -1.0)
#: Storage and compression of the honest sessions.
STORED = (
    ("mcap", "none"),
    ("mcap", "storage"),
    ("mcap", "file"),
    ("sqlite3", "none"),
    ("sqlite3", "message"),
)


def honest() -> Session:
    """Three cables, a run of four seconds and some rest."""
    spec = specification("three_cables")
    weight = float(spec.elements[0]) * spec.rig.gravity
    force = Multisine(0.03 * weight, (0.5, 0.9, 1.3), ramp=1.0)
    run = RunSpec("run_1", 4.0, Pulled(0.04 * weight * np.array([0.6, 0.8, 0.0]), spec.elements[1:4]), force)
    rates = SampleRates(tension=50.0, exciter=50.0, shaft=0.0, imu=50.0, inclinometer=25.0, ground_truth=0.0)
    return simulate_session(replace(spec, runs=(run,), rates=rates), np.random.default_rng(1))[0]


def written(session: Session, folder: Path, rng: Rng) -> None:
    """The session as any of the storages holds it."""
    storage, compression = STORED[rng.integers(len(STORED))]
    write_session(session, folder, storage=storage, compression=compression)


def _bag(folder: Path, rng: Rng) -> Path:
    """One of the files with messages."""
    files = sorted(f for f in folder.rglob("*") if f.is_file() and f.suffix not in (".yaml", ".json"))
    return files[rng.integers(len(files))]


def flipped(folder: Path, rng: Rng, session: Session) -> None:
    """Some bytes are others."""
    file = _bag(folder, rng)
    data = bytearray(file.read_bytes())
    for at in rng.integers(len(data), size=int(10 ** rng.uniform(0.0, 2.5))):
        data[at] = rng.integers(256)
    file.write_bytes(data)


def cut(folder: Path, rng: Rng, session: Session) -> None:
    """The file ends early, or its beginning is gone."""
    file = _bag(folder, rng)
    data = file.read_bytes()
    at = int(rng.integers(len(data)))
    file.write_bytes((data[:at], data[at:], b"")[rng.choice(3, p=(0.7, 0.25, 0.05))])


def spliced(folder: Path, rng: Rng, session: Session) -> None:
    """A piece stands twice, is gone, or is zeros."""
    file = _bag(folder, rng)
    data = file.read_bytes()
    first, last = sorted(rng.integers(len(data), size=2))
    piece = data[first:last]
    middle = (piece * 2, b"", bytes(len(piece)), piece[::-1])[rng.integers(4)]
    file.write_bytes(data[:first] + middle + data[last:])


def sized(folder: Path, rng: Rng, session: Session) -> None:
    """Numbers that may be lengths, counts or offsets are others."""
    file = _bag(folder, rng)
    data = bytearray(file.read_bytes())
    for _ in range(rng.integers(1, 20)):
        width, letter = ((2, "H"), (4, "I"), (8, "Q"))[rng.integers(3)]
        at = int(rng.integers(max(1, len(data) - width)))
        number = NUMBERS[rng.integers(len(NUMBERS))] & ((1 << 8 * width) - 1)
        data[at : at + width] = struct.pack(("<", ">")[rng.integers(2)] + letter, number)
    file.write_bytes(data)


def read(folder: Path, rng: Rng, session: Session) -> None:
    """Devices measure what no device does, at times that are none."""

    def spoilt(series: Series | None) -> Series | None:
        if series is None or rng.random() < 0.5:
            return series
        values, time = series.values.copy(), series.time.copy()
        some = rng.random(values.shape) < 10 ** rng.uniform(-3.0, 0.0)
        values[some] = READINGS[rng.integers(len(READINGS))]
        if rng.random() < 0.3:
            time[rng.integers(len(time)) :] += (1e9, -1.0, 1e-9, 4e9)[rng.integers(4)]
        return Series(time, values)

    runs = tuple(
        replace(
            run,
            start_ns=int((0, 1, run.start_ns, 2**62)[rng.integers(4)]),
            tension={name: spoilt(series) or series for name, series in run.tension.items()},
            exciter_force=spoilt(run.exciter_force), imu=spoilt(run.imu), inclination=spoilt(run.inclination),
        )
        for run in session.recordings
    )  # fmt: skip
    _again(replace(session, recordings=runs), folder, rng)


def named(folder: Path, rng: Rng, session: Session) -> None:
    """A cable or a recording bears a name that is more than a name."""
    name = NAMES[rng.integers(len(NAMES))]
    if rng.random() < 0.5:
        old = session.rig.cables[0].name
        cables = (replace(session.rig.cables[0], name=name), *session.rig.cables[1:])
        runs = tuple(
            replace(run, tension={name if c == old else c: s for c, s in run.tension.items()})
            for run in session.recordings
        )
        _again(replace(session, rig=replace(session.rig, cables=cables), recordings=runs), folder, rng)
        return
    file = folder / ("session.yaml", "rig.yaml")[rng.integers(2)]
    text = file.read_text(encoding="utf-8")
    words = sorted({w.strip("[]{},:") for w in text.split() if w.strip("[]{},:").isidentifier()})
    file.write_text(
        text.replace(words[rng.integers(len(words))], json.dumps(name)), encoding="utf-8", errors="replace"
    )


def typed(folder: Path, rng: Rng, session: Session) -> None:
    """Values of a description are of another kind, lines are gone, stand twice or deeper."""
    files = sorted(folder.rglob("*.yaml"))
    file = files[rng.integers(len(files))]
    lines = file.read_text(encoding="utf-8").splitlines()
    for _ in range(rng.integers(1, 4)):
        at = int(rng.integers(len(lines)))
        key, colon, _value = lines[at].partition(":")
        how = rng.integers(5)
        if how <= 1 and colon:
            lines[at] = f"{key}: {VALUES[rng.integers(len(VALUES))]}"
        elif how == 2:
            lines.insert(int(rng.integers(len(lines))), lines[at])
        elif how == 3 and len(lines) > 1:
            del lines[at]
        else:
            lines[at] = " " * int(rng.integers(1, 8)) + lines[at]
    file.write_text("\n".join(lines) + "\n", encoding="utf-8")


def scrambled(folder: Path, rng: Rng, session: Session) -> None:
    """Letters of a description are others."""
    files = sorted(folder.rglob("*.yaml"))
    file = files[rng.integers(len(files))]
    text = bytearray(file.read_bytes())
    for _ in range(int(10 ** rng.uniform(0.0, 2.0))):
        at = int(rng.integers(len(text)))
        text[at : at + int(rng.integers(3))] = bytes(
            rng.choice(list(b"[]{}:,&*!|>?-#'\"%@` \t\n\xff\x00a0")) for _ in "a"
        )
    file.write_bytes(text)


def nested(folder: Path, rng: Rng, session: Session) -> None:
    """A description that is deep, or stands for much more than it is."""
    deep = int(10 ** rng.uniform(1.0, 4.7))
    texts = (
        "rig: " + "[" * deep, "rig: " + "{a: " * deep, "- " * deep, laughs(int(rng.integers(3, 30))),
        merges(int(rng.integers(3, 40))),
        "recordings: [" + "{bag: run_1, kind: dynamic}, " * min(deep, 4000) + "]",
        "cables: [" + ", ".join(f"c{i}" for i in range(min(deep, 9000))) + "]",
        "".join(f"{'  ' * i}a:\n" for i in range(min(deep, 300))),
    )  # fmt: skip
    name = ("rig.yaml", "session.yaml", "run_1/metadata.yaml")[rng.integers(3)]
    text = texts[rng.integers(len(texts))]
    if rng.random() < 0.5:
        text = (folder / name).read_text(encoding="utf-8") + text
    (folder / name).write_text(text, encoding="utf-8")


def packed(folder: Path, rng: Rng, session: Session) -> None:
    """Few bytes that stand for very many."""
    size = int(2 ** rng.uniform(10.0, 28.5))
    claims = (None, *NUMBERS)
    claimed = claims[rng.integers(len(claims))]
    zeros = chunk(bytes(size), claimed=claimed)
    many = chunk(message(1, bytes(int(rng.integers(0, 2000)))) * max(1, size >> 12))
    name, data = (
        ("run_1.mcap", mcap(*[zeros] * int(rng.integers(1, 20)))),
        ("run_1.mcap", mcap(topic(1, "/rig/cable_1/wrench"), *[many] * int(rng.integers(1, 5)))),
        ("run_1.mcap", mcap(chunk(record(int(rng.integers(256)), b"") * min(size >> 4, 2_000_000)))),
        ("run_1.mcap.zstd", zstd.compress(bytes(size), 1) * int(rng.integers(1, 8))),
        ("run_1.db3.zstd", zstd.compress(zstd.compress(bytes(size), 1), 1)),
        (
            "run_1.bag",
            b"#ROSBAG V2.0\n" + struct.pack("<I", 8) + b"\x04\0\0\0op=\x05" + bz2.compress(bytes(size >> 4)),
        ),
    )[rng.integers(6)]
    _instead(folder / "run_1", name, data)


def topics(folder: Path, rng: Rng, session: Session) -> None:
    """Thousands of topics, of any names."""
    count = int(10 ** rng.uniform(0.0, 4.6))
    odd = [NAMES[k] for k in rng.integers(len(NAMES), size=5)]
    names = [f"/rig/{odd[i % 5][:200]}{i}" if rng.random() < 0.1 else f"/t{i}/wrench" for i in range(count)]
    records = b"".join(topic(1 + i % 65_000, name) for i, name in enumerate(names))
    body = bytes([0, 1, 0, 0]) + bytes(rng.integers(256, size=92, dtype=np.uint8))
    said = b"".join(message(1 + int(k), body) for k in rng.integers(count, size=200))
    _instead(folder / "run_1", "run_1.mcap", mcap(chunk(topic(1, "/rig/cable_1/wrench") + records + said)))


def placed(folder: Path, rng: Rng, session: Session) -> None:
    """What should be a file is something else, or leads out."""
    places = [
        folder / "rig.yaml",
        folder / "session.yaml",
        _bag(folder, rng),
        folder / "run_1" / "metadata.yaml",
    ]
    place = places[rng.integers(len(places))]
    place.unlink()
    how = rng.integers(7)
    if how == 0:
        place.symlink_to(place)
    elif how == 1:
        place.symlink_to(
            ("/dev/zero", "/proc/self/mem", "/nowhere", "../../outside/secret.yaml")[rng.integers(4)]
        )
    elif how == 2:
        os.mkfifo(place)
    elif how == 3:
        place.mkdir()
    elif how == 4:  # a hole of gigabytes
        with place.open("wb") as stream:
            stream.write(b"\x89MCAP0\r\n")
            stream.truncate(int(rng.integers(1, 1 << 33)))
    elif how == 5:
        for i in range(2000):
            (folder / "run_1" / f"run_1_{i}.mcap").write_bytes(b"")


KINDS: dict[str, Callable[[Path, Rng, Session], None]] = {
    kind.__name__: kind
    for kind in (flipped, cut, spliced, sized, read, named, typed, scrambled, nested, packed, topics, placed)
}


def _again(session: Session, folder: Path, rng: Rng) -> None:
    """The session in the place of the honest one; what the writer refuses leaves that one."""
    storage, compression = STORED[rng.integers(len(STORED))]
    try:
        write_session(session, folder, storage=storage, compression=compression, overwrite=True)
    except Exception:  # the writer is not what is tried here
        return


def _instead(bag: Path, name: str, data: bytes) -> None:
    for file in bag.iterdir():
        file.unlink()
    (bag / name).write_bytes(data)


def request(rng: Rng, folder: Path) -> tuple[str, str, bytes]:
    """Method, path with query, and body of a request to the page over ``folder``."""
    name = NAMES[rng.integers(len(NAMES))]
    how = int(rng.integers(5))
    if how == 0:
        paths = ("/rig?file=", "/check?session=", "/identify?session=", "/history?result=", "/files/",
                 "/history/compare?result=", "/jobs/", "/static/")  # fmt: skip
        out = ("", "../", "../../outside/", "link/", "./")[rng.integers(5)]
        return "GET", paths[rng.integers(len(paths))] + quote(out + name[:2000], errors="replace"), b""
    path = ("/rig/drawing", "/rig/save", "/balance/solve")[rng.integers(3)]
    if how == 1:
        deep = int(10 ** rng.uniform(1.0, 5.5))
        bodies = (
            "[" * deep,
            '{"a":' * deep,
            '{"cables": [' + '"c",' * deep,
            "9" * deep,
            '{"a": 1e999}',
            "\x00",
            "NaN",
        )
        return "POST", path, bodies[rng.integers(len(bodies))].encode()
    given: dict[str, Any] = {
        "gravity": 9.81, "cables": ["a", "b"], "file": f"own_{rng.integers(10**9)}.yaml",
        **{c: {"ceiling_point": [x, 0, 3], "body_point": [x, 0, 1], "length": 2} for x, c in enumerate("ab")},
    }  # fmt: skip
    odd: tuple[Any, ...] = (
        None,
        [],
        {},
        name,
        -1,
        0,
        1e300,
        10**400,
        True,
        [[]],
        [name] * 50,
        {name: name},
        "x" * 9000,
    )
    for key in rng.choice(list(given), size=int(rng.integers(1, 3))):
        given[str(key)] = odd[rng.integers(len(odd))]
    if rng.random() < 0.4:
        given = {
            "cables": [name, "b"],
            "gravity": 9.81,
            name: given["a"],
            "b": given["b"],
            "file": name + ".yaml",
        }
    return "POST", path, json.dumps(given).encode()
