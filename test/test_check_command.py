"""``check`` at the keyboard and on a page: first what is wrong and what to do, in every form the same."""

from __future__ import annotations

import io
import json
import re
import subprocess
import sys
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import StoragePlugin, Writer
from session_samples import make_recording, make_rig, make_session

from rig_identification import identification
from rig_identification.check.examine import Examined
from rig_identification.check.inventory import inventory
from rig_identification.check.left_aside import left_aside
from rig_identification.cli.checked import print_examination, setup_lines
from rig_identification.cli.main import main
from rig_identification.errors import InputError
from rig_identification.examination import Examination, RestReading, SetupFault, TopicAccount
from rig_identification.raw import RawSession
from rig_identification.recording import Session
from rig_identification.report import examination_to_dict, render_check
from rig_identification.report.rig_drawing import rig_svgs
from rig_identification.report.rig_scene import described_scene
from rig_identification.report.setup import faulty_parts, headline, rest_views, topic_views
from rig_identification.rig import Rig
from rig_identification.session import read_raw, write_session
from rig_identification.session.messages import TYPESTORE

KEYS = ["session", "faults", "warnings", "rest", "topics", "notes"]


def make_fault(**changes: object) -> SetupFault:
    fault = SetupFault(
        effect="unit",
        where={"channel": "cable_2", "axis": None, "recordings": ["run_1", "run_2"]},
        parameters={"factor": {"value": np.float64(0.101972), "std": 0.0, "unit": "1"}},
        statement="The load cell of cable_2 writes kilogram-force where newtons are due.",
        advice="Set its amplifier to newtons.",
        correction="cable_2:\n  scale: 9.80665",
        corrected=True,
        gain=812.5,
        alternatives=(
            {
                "effect": "load_cell_gain",
                "where": {"channel": "cable_2"},
                "statement": "Its gain is wrong.",
                "log_likelihood_gap": 2.5,
            },
        ),
    )
    return replace(fault, **changes)  # type: ignore[arg-type]


def make_topic(**changes: object) -> TopicAccount:
    topic = TopicAccount(
        "run_1", "/rig/imu/data_raw", "sensor_msgs/msg/Imu", "imu", True,
        2400, 200.0, 0.0, 12.0, 0, 0.0, 0.0021,
    )  # fmt: skip
    return replace(topic, **changes)  # type: ignore[arg-type]


def make_examination(**changes: object) -> Examination:
    examination = Examination(
        session="van",
        topics=(make_topic(), make_topic(topic="/rosout", device=None, used=False, note="no topic of it")),
        rest=(
            RestReading("bare", "cable_1", "tension", None, "N", 2401.2, 2399.8, 2.0),
            RestReading("bare", "cable_2", "tension", None, "N", 241.3, 2366.4, 2.0),
        ),
        faults=(make_fault(),),
        warnings=("imu: a word of warning.",),
        notes=("the index was missing",),
    )
    return replace(examination, **changes)  # type: ignore[arg-type]


def printed(examination: Examination) -> str:
    stream = io.StringIO()
    print_examination(examination, stream)
    return stream.getvalue()


# --- the terminal ----------------------------------------------------------------------------------------


def test_what_is_wrong_comes_before_what_was_measured() -> None:
    text = printed(make_examination())
    order = (
        "van: 1 fault of the set-up was found, 1 warning.",
        "1. Unit. The load cell of cable_2 writes kilogram-force",
        "What to do: Set its amplifier to newtons.",
        "  scale: 9.80665",
        "Or else, 2.50 nats less likely: Its gain is wrong.",
        "warning: imu: a word of warning.",
        "Readings at rest",
        "-1062.5",
        "Topics",
        "2.1 ms",
        "not used: /rosout (run_1): no topic of it",
        "note: the index was missing",
    )
    places = [text.index(part) for part in order]
    assert places == sorted(places)


def test_corrected_lines_are_printed_to_be_copied() -> None:
    """Never wrapped, however long, and with the indentation that YAML needs."""
    long = "cable_2:\n  positions: [" + ", ".join(f"{i}.0" for i in range(80)) + "]"
    text = printed(make_examination(faults=(make_fault(correction=long),)))
    lines = [line.strip("\n") for line in text.splitlines()]
    first = next(line for line in lines if line.endswith("cable_2:"))
    margin = len(first) - len("cable_2:")
    place = lines.index(first)
    assert [line[margin:] for line in lines[place : place + 2]] == long.splitlines()


def test_names_are_printed_as_they_are() -> None:
    """Square brackets are markup to the printer of tables, and names of files and topics may hold them."""
    odd = "[red]/rig[0]/:smile:"
    warned = make_examination(warnings=(odd,), topics=(make_topic(topic=odd),), notes=(odd,))
    assert printed(warned).count(odd) == 3


def test_a_sound_session_says_so_in_one_line() -> None:
    sound = make_examination(faults=(), warnings=())
    assert printed(sound).splitlines()[0] == "van: No fault of the set-up was found."
    assert list(setup_lines(sound)) == []


def test_identify_prints_what_to_change() -> None:
    assert list(setup_lines(make_examination())) == [
        f"set-up: {make_fault().statement} Set its amplifier to newtons.",
        "    cable_2:",
        "      scale: 9.80665",
        "warning: imu: a word of warning.",
    ]


@pytest.mark.parametrize(
    ("faults", "warnings", "words"),
    [(0, 1, "No fault of the set-up was found, 1 warning."), (2, 0, "2 faults of the set-up were found.")],
)
def test_the_headline_counts(faults: int, warnings: int, words: str) -> None:
    found = make_examination(faults=(make_fault(),) * faults, warnings=("w",) * warnings)
    assert headline(found) == words


# --- views -----------------------------------------------------------------------------------------------


def test_readings_at_rest_are_off_in_their_own_standard_deviations() -> None:
    near, far = rest_views(make_examination())
    assert (near.reading, near.measured, near.off, near.is_far) == (
        "cable_1 tension",
        "2\u202f401.2",
        "0.7",
        False,
    )
    assert (far.off, far.is_far) == ("−1\u202f062.5", True)


@pytest.mark.parametrize(
    ("clock", "text"), [(None, "–"), (0.0021, "2.1 ms"), (-37.0, "−37.0 s"), (1.7e9, "1.70×10⁹ s")]
)
def test_a_clock_is_written_in_the_unit_that_it_needs(clock: float | None, text: str) -> None:
    ((_, (view,)),) = topic_views(make_examination(topics=(make_topic(clock=clock),)))
    assert view.clock == text


def test_parts_at_fault_are_found_wherever_the_fault_names_them() -> None:
    """Two swapped cells name the second one in a list or among the parameters."""
    swapped = make_fault(where={"channel": "cable_1", "channels": ["cable_1", "cable_3"]}, parameters={})
    mount = make_fault(where={"channel": "imu"}, parameters={"like": {"value": "exciter", "std": 0.0}})
    assert faulty_parts((swapped, mount), make_rig()) == {
        "cable_1", "cable_3", "imu", "exciter",
    }  # fmt: skip
    assert faulty_parts(make_examination().faults, make_rig()) == {"cable_2"}


@pytest.mark.parametrize(
    ("channel", "parts"),
    [
        ("cable_1, cable_3", {"cable_1", "cable_3"}),
        ("cables", {"cable_1", "cable_2", "cable_3"}),
        ("all", {"cable_1", "cable_2", "cable_3", "imu", "inclinometer", "exciter", "mocap"}),
        ("ceiling", set()),
    ],
)
def test_one_channel_may_stand_for_several_devices(channel: str, parts: set[str]) -> None:
    fault = make_fault(where={"channel": channel}, parameters={})
    assert faulty_parts((fault,), make_rig()) == parts


def test_what_is_at_fault_is_red_in_every_view() -> None:
    rig = make_rig()
    for faulty in ({"cable_2"}, {"imu"}, {"mocap", "cable_1"}, set()):
        views = rig_svgs(described_scene(rig, frozenset(faulty)))
        assert len(views) == 4
        for _, svg in views:
            groups = ElementTree.fromstring(svg).findall(".//g[@class='faulty']")
            names = {text.text for group in groups for text in group.iter("text")}
            assert names == {{"imu": "IMU", "mocap": "markers"}.get(name, name) for name in faulty}


# --- JSON and the page -----------------------------------------------------------------------------------


def test_json_holds_every_field_and_no_number_that_is_none() -> None:
    wild = make_examination(faults=(make_fault(gain=float("inf")),), topics=(make_topic(clock=None),))
    document = examination_to_dict(wild)
    assert list(document) == KEYS
    back = json.loads(json.dumps(document, allow_nan=False))
    assert back["faults"][0]["gain"] is None
    assert back["faults"][0]["parameters"]["factor"]["value"] == 0.101972
    assert back["faults"][0]["alternatives"][0]["log_likelihood_gap"] == 2.5
    assert back["topics"][0]["clock"] is None
    assert back["rest"][1]["measured"] == 241.3


class Page(HTMLParser):
    """Tags that are open, ids, links and words."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.ids: list[str] = []
        self.links: list[str] = []
        self.words = ""
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.ids += [value for key, value in attrs if key == "id" and value]
        self.links += [value for key, value in attrs if key in ("href", "src") and value]
        if tag != "meta":
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        pass

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.words += data


def test_the_page_says_what_the_terminal_says(rig: Rig) -> None:
    page = Page(render_check(make_examination(), rig))
    assert page.open == []
    assert all(link.startswith("#") for link in page.links), "the page may load nothing"
    assert {link[1:] for link in page.links} <= set(page.ids)
    words = re.sub(r"\s+", " ", page.words)
    for part in (
        "1 fault of the set-up was found, 1 warning.",
        "Set its amplifier to newtons.",
        "cable_2: scale: 9.80665",
        "Its gain is wrong.",
        "imu: a word of warning.",
        "Red: cable_2.",
        "−1 062.5",
        "no: no topic of it",
        "the index was missing",
    ):
        assert part in words


def test_names_from_outside_cannot_become_markup(rig: Rig) -> None:
    bad = "<script>alert(1)</script>&\"'"
    fault = make_fault(
        effect=bad, where={bad: bad, "channel": bad}, statement=bad, advice=bad, correction=bad,
        alternatives=({"statement": bad},),
    )  # fmt: skip
    topic = make_topic(recording=bad, topic=bad, message_type=bad, note=bad, used=False)
    reading = RestReading(bad, bad, bad, bad, bad, 1.0, 2.0, 0.0)
    hostile = Examination(bad, (topic,), (reading,), (fault,), (bad,), (bad,))
    cables = (replace(rig.cables[0], name=bad), *rig.cables[1:])
    text = render_check(hostile, replace(rig, cables=cables))
    assert "<script>alert" not in text
    assert Page(text).open == []


# --- the command -----------------------------------------------------------------------------------------


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Static, run and held-out run of a small rig."""
    return write_session(make_session(), tmp_path / "sample")


def install(monkeypatch: pytest.MonkeyPatch, *faults: SetupFault) -> None:
    """An examination that takes the inventory, finds ``faults`` and changes nothing."""

    def examine(raw: RawSession, progress: object = None) -> Examined:
        topics = inventory(raw, raw)
        warnings = left_aside(raw, raw, topics).warnings
        return Examined(Examination(raw.name, topics, (), faults, warnings), raw)

    monkeypatch.setattr("rig_identification.identification.examine", examine)


def test_check_of_a_session_on_disk(folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "new" / "out"
    assert main(["check", str(folder), "--out", str(out)]) == 0
    assert sorted(path.name for path in out.iterdir()) == ["check.html", "check.json"]
    document = json.loads((out / "check.json").read_text(encoding="utf-8"), parse_constant=pytest.fail)
    assert list(document) == KEYS
    assert {topic["recording"] for topic in document["topics"]} == {"static_1", "dynamic_2", "dynamic_3"}
    assert len(document["topics"]) == 3 * 9
    said = capsys.readouterr()
    assert said.out.startswith("sample: ")
    assert said.out.rstrip().endswith(str(out / "check.html"))
    assert said.err == ""


def test_json_alone_on_standard_output(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    install(monkeypatch, make_fault())
    assert main(["check", str(folder), "--json"]) == 0
    said = capsys.readouterr()
    assert list(json.loads(said.out)) == KEYS
    assert said.err == ""


def test_faults_are_results(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    install(monkeypatch, make_fault())
    assert main(["check", str(folder)]) == 0
    assert "1. Unit. The load cell of cable_2" in capsys.readouterr().out


def test_a_mistyped_topic_is_a_warning_that_says_which_option_helps(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    install(monkeypatch)
    for bag in ("static_1", "dynamic_2", "dynamic_3"):
        rename(folder / bag, "/rig/imu/data_raw", "/rig/imu/data")
    assert main(["check", str(folder), "--json"]) == 0
    warnings = json.loads(capsys.readouterr().out)["warnings"]
    (imu,) = [warning for warning in warnings if warning.startswith("imu:")]
    assert "--topic imu/data_raw=/rig/imu/data " in imu
    assert main(["check", str(folder), "--json", "--topic", "imu/data_raw=/rig/imu/data"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert not any(warning.startswith("imu:") for warning in document["warnings"])
    assert any(topic["topic"] == "/rig/imu/data" and topic["used"] for topic in document["topics"])


@pytest.mark.parametrize("command", ["identify", "check"])
def test_a_topic_that_is_asked_for_and_not_there_is_an_error(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], command: str
) -> None:
    out = tmp_path / "out"
    mapped = "imu/data_raw=/rig/imu/data_rau"
    assert main([command, str(folder), "--out", str(out), "--topic", mapped]) == 2
    said = capsys.readouterr()
    assert (said.out, said.err.count("\n")) == ("", 1)
    assert f"--topic {mapped}: no bag holds /rig/imu/data_rau" in said.err
    assert "/rig/imu/data_raw" in said.err
    assert not out.exists()


def rename(bag: Path, old: str, new: str) -> None:
    """Publish a topic under another name."""
    original = bag.rename(bag.with_name("original"))
    with AnyReader([original]) as reader, Writer(bag, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        to = {
            one.topic: writer.add_connection(
                new if one.topic == old else one.topic, one.msgtype, typestore=TYPESTORE
            )
            for one in reader.connections
        }
        for connection, received, data in reader.messages():
            writer.write(to[connection.topic], received, data)
    for file in original.iterdir():
        file.unlink()
    original.rmdir()


def moving() -> Session:
    """A static recording that swings: identify refuses it."""
    session = make_session()
    swing = make_recording("static", seed=1, amplitude=0.2, dummy=session.recordings[0].dummy)
    return replace(session, recordings=(swing, *session.recordings[1:]))


def test_what_cannot_be_used_is_exit_2_unless_a_fault_says_why(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    folder, out = write_session(moving(), tmp_path / "moving"), tmp_path / "out"
    install(monkeypatch)
    assert main(["check", str(folder), "--out", str(out)]) == 2
    said = capsys.readouterr()
    assert (said.out, said.err.count("\n")) == ("", 1)
    assert "static recording moves" in said.err
    assert not out.exists()
    install(monkeypatch, make_fault())
    assert main(["check", str(folder), "--out", str(out)]) == 0
    assert "identify cannot use the session as it is: " in capsys.readouterr().out
    assert (out / "check.html").is_file()


def test_a_session_that_is_not_there(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", str(tmp_path / "nothing"), "--json"]) == 2
    said = capsys.readouterr()
    assert (said.out, said.err.count("\n")) == ("", 1)


def test_a_page_that_fails_leaves_no_document(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def full_disk(*_: object) -> None:
        raise OSError(28, "No space left on device")

    install(monkeypatch)
    monkeypatch.setattr("rig_identification.report.write_check", full_disk)
    out = tmp_path / "out"
    assert main(["check", str(folder), "--out", str(out)]) == 2
    assert "No space left on device" in capsys.readouterr().err
    assert not out.exists()


def test_an_output_folder_that_cannot_be_is_said_before_the_bags_are_read(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "file"
    file.write_text("")
    assert main(["check", str(tmp_path / "nothing"), "--out", str(file)]) == 2
    assert str(file) in capsys.readouterr().err


def test_identify_names_the_fault_where_it_refuses_the_session(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = write_session(moving(), tmp_path / "moving")

    def examine(raw: RawSession, progress: object = None) -> Examined:
        return Examined(make_examination(faults=(make_fault(),)), raw)

    monkeypatch.setattr(identification, "examine", examine)
    assert main(["identify", str(folder), "--out", str(tmp_path / "out")]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert "static recording moves" in error
    assert "The load cell of cable_2 writes kilogram-force" in error
    raw = read_raw(folder)
    monkeypatch.setattr(identification, "examine", lambda raw, _: Examined(make_examination(faults=()), raw))
    with pytest.raises(InputError, match=r"record again, or make it kind: dynamic$"):
        identification.prepare(raw)


def test_check_loads_nothing_that_only_fits_need() -> None:
    """The rooms of the fit, and the compiler, would take longer to load than the whole answer may."""
    code = (
        "import importlib, pkgutil, sys\n"
        "from rig_identification import check, session\n"
        "from rig_identification.cli import checked\n"
        "from rig_identification.cli.main import build_parser\n"
        "from rig_identification.report import check_page\n"
        "build_parser()\n"
        "for found in pkgutil.walk_packages(check.__path__, 'rig_identification.check.'):\n"
        "    importlib.import_module(found.name)\n"
        "rooms = {name.split('.')[1] for name in sys.modules if name.startswith('rig_identification.')}\n"
        "print(sorted(rooms & {'mismatch', 'estimate', 'live', 'simulate'}), 'numba' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.stdout == "[] False\n", done.stderr


@pytest.mark.parametrize("scale", [1e-2, 1.0, 1e3])
def test_a_description_in_any_unit_is_drawn_as_written(rig: Rig, scale: float) -> None:
    """A rig in millimetres is drawn too, with a bar that shows the thousandfold size."""
    cables = tuple(
        replace(
            cable,
            ceiling_point=scale * cable.ceiling_point,
            body_point=scale * cable.body_point,
            length=scale * cable.length,
        )
        for cable in rig.cables
    )
    wrong = replace(rig, cables=cables, imu=None, exciter=None, mocap=None)
    for _, svg in rig_svgs(described_scene(wrong)):
        assert "nan" not in svg
        (bar,) = (t.text for t in ElementTree.fromstring(svg).iter("text") if (t.text or "").endswith(" m"))
        assert scale <= float(str(bar).removesuffix(" m")) <= 5.0 * scale
