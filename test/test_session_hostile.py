"""What is made to cost much costs little: an error, or what could be read, within seconds and a gigabyte."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest
from hostile_files import IDLE, RIG, TEXTS, WANTED, chunk, mcap, message, topic, write_session

from rig_identification.errors import InputError, MissingDescription
from rig_identification.session.bag import read_bag
from rig_identification.session.bag_metadata import read_bag_metadata
from rig_identification.session.contents import MOST_TOPICS
from rig_identification.session.fields import load_fields
from rig_identification.session.read import read_raw
from rig_identification.session.rig_description import read_rig
from rig_identification.session.session_description import read_session_description
from rig_identification.session.yaml_text import DEEPEST, MOST_NODES, TooMuch, load_yaml

#: s of one core, and MiB, that reading any of them may take.
SECONDS, MEMORY = 10.0, 1024
HERE = Path(__file__).parent

READ_ALL = """
import json, resource, sys, time
from pathlib import Path
import hostile_files
from rig_identification.errors import InputError, MissingDescription
from rig_identification.session.read import read_raw

out = {}
for folder in sorted(Path(sys.argv[1]).iterdir()):
    begun = time.process_time()
    try:
        told = [note for run in read_raw(folder).recordings for note in run.notes]
    except InputError as error:
        told = [str(error)]
    out[folder.name] = {"told": told, "seconds": time.process_time() - begun}
status = Path("/proc/self/status")
if status.exists():
    # Its own peak: what getrusage says is at least what the process that started this one has
    (peak,) = [line for line in status.read_text().splitlines() if line.startswith("VmHWM")]
    memory = int(peak.split()[1])
else:
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
memory /= 1024.0
print(json.dumps({"sessions": out, "memory": memory}))
"""
WRITE_ALL = """
import sys
from pathlib import Path
import hostile_files

for name, (file, made) in hostile_files.BAGS.items():
    hostile_files.write_session(Path(sys.argv[1]) / name, file, made())
"""


def run(code: str, folder: Path) -> str:
    done = subprocess.run(
        [sys.executable, "-c", code, str(folder)], cwd=HERE, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.skipif(sys.platform == "win32", reason="memory is measured by getrusage")
def test_hostile_bags_are_read_within_seconds_and_a_gigabyte(tmp_path: Path) -> None:
    run(WRITE_ALL, tmp_path)  # a process of its own, whose memory is not counted
    told = json.loads(run(READ_ALL, tmp_path))
    assert len(told["sessions"]) >= 14
    assert {name: s["seconds"] for name, s in told["sessions"].items() if s["seconds"] > SECONDS} == {}
    assert told["memory"] < MEMORY
    assert [name for name, s in told["sessions"].items() if not s["told"]] == []
    assert all(len(line) < 2000 for s in told["sessions"].values() for line in s["told"])


@pytest.mark.parametrize("text", TEXTS.values(), ids=TEXTS)
@pytest.mark.parametrize("read", [read_rig, read_session_description], ids=["rig", "session"])
def test_a_hostile_description_is_one_short_line(text: str, read: object, tmp_path: Path) -> None:
    import time

    (tmp_path / "session.yaml").write_text(text, encoding="utf-8")
    begun = time.process_time()
    with pytest.raises(InputError) as told:
        read(tmp_path / "session.yaml")  # type: ignore[operator]
    assert time.process_time() - begun < SECONDS
    assert "\n" not in str(told.value)
    assert len(str(told.value)) < 1000
    assert sorted(path.name for path in tmp_path.iterdir()) == ["session.yaml"]


@pytest.mark.parametrize("text", TEXTS.values(), ids=TEXTS)
def test_hostile_metadata_is_a_note(text: str, tmp_path: Path) -> None:
    (tmp_path / "metadata.yaml").write_text(text, encoding="utf-8")
    (note,) = read_bag_metadata(tmp_path).notes
    assert "the bag's files were read as they are" in note
    assert len(note) < 1000


def test_a_pipe_is_no_description(tmp_path: Path) -> None:
    """Reading one waits for ever."""
    import os

    os.mkfifo(tmp_path / "rig.yaml")
    with pytest.raises(InputError, match="device or a pipe"):
        load_fields(tmp_path / "rig.yaml", "rig description")


def test_what_is_no_file_beside_bags_is_passed_over(tmp_path: Path) -> None:
    """A proposal looks for the rig description among all that may be one."""
    import os

    folder = write_session(tmp_path / "s", "run.mcap", mcap(chunk(topic(1, WANTED))))
    (folder / "session.yaml").unlink()
    os.mkfifo(folder / "a.yaml")
    (folder / "b.yaml").symlink_to("b.yaml")
    (folder / "c.yml").symlink_to("/dev/zero")
    (folder / "d.yaml").mkdir()
    with pytest.raises(MissingDescription) as told:
        read_raw(folder)
    assert "rig: rig.yaml\n" in told.value.proposal


def test_what_people_write_is_within_the_limits() -> None:
    """Aliases by hand, and far more cables and recordings than a lab has."""
    level = "a: &level [0, 0, 0, 1]\nimu: {orientation: *level}\nexciter: {orientation: *level}\n"
    assert load_yaml(level) == {
        "a": [0, 0, 0, 1], "imu": {"orientation": [0, 0, 0, 1]}, "exciter": {"orientation": [0, 0, 0, 1]}
    }  # fmt: skip
    recordings = "".join(f"  - {{bag: run_{i}, kind: dynamic, holdout: false}}\n" for i in range(1000))
    assert len(load_yaml(f"recordings:\n{recordings}")["recordings"]) == 1000  # type: ignore[index]


def test_the_limits_are_where_they_are_said_to_be() -> None:
    load_yaml("[" * DEEPEST + "]" * DEEPEST)
    with pytest.raises(TooMuch, match=f"deeper than {DEEPEST}"):
        load_yaml("[" * (DEEPEST + 1) + "]" * (DEEPEST + 1))
    half = "a: &a [" + "1, " * (MOST_NODES // 2 - 10) + "]\n"
    load_yaml(half)
    with pytest.raises(TooMuch, match=f"more than {MOST_NODES}"):
        load_yaml(half + "b: [*a, *a]\n")


def test_an_honest_bag_is_read_whole_beside_the_limits(tmp_path: Path) -> None:
    """Chunks as recorders write them, packed as well as zeros let them, and many other topics."""
    other = b"".join(topic(10 + i, f"/camera/{i}") for i in range(2000))
    records = (
        topic(1, WANTED)
        + other
        + b"".join(message(1, bytes([0, 1, 0, 0]) + bytes(92)) for _ in range(20_000))
    )
    folder = write_session(tmp_path / "s", "run.mcap", mcap(*[chunk(records)] * 20))
    bag = read_bag(folder / "run", {WANTED})
    assert bag.topics[WANTED].count == 20 * 20_000
    assert len(bag.listed) == 2001
    assert not [note for note in bag.notes if "damaged" in note]


def test_more_topics_than_a_bag_has_are_refused(tmp_path: Path) -> None:
    records = b"".join(topic(1 + i, f"/t{i}") for i in range(MOST_TOPICS + 1))
    folder = write_session(tmp_path / "s", "run.mcap", mcap(chunk(records)))
    with pytest.raises(InputError, match=f"more than {MOST_TOPICS} topics"):
        read_bag(folder / "run", {WANTED})


def test_an_empty_chunk_of_the_largest_size_is_told_by_its_size(tmp_path: Path) -> None:
    sound = chunk(topic(1, WANTED) + message(1, bytes([0, 1, 0, 0]) + bytes(92)))
    folder = write_session(tmp_path / "s", "run.mcap", mcap(sound, chunk(bytes(10), claimed=IDLE + 1)))
    bag = read_bag(folder / "run", {WANTED})
    assert bag.topics[WANTED].count == 1
    assert any("1 of 2 chunks are left out (" in note and str(IDLE + 1) in note for note in bag.notes)


def test_the_rig_beside_them_is_one(tmp_path: Path) -> None:
    """Else every session here would be refused for its rig alone."""
    (tmp_path / "rig.yaml").write_text(RIG)
    assert len(read_rig(tmp_path / "rig.yaml").cables) == 2
