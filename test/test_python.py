"""``import rig_identification as ri``: quick to import, and the page about it runs as it stands."""

from __future__ import annotations

import inspect
import re
import subprocess
import sys
import types
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import rig_identification as ri
from rig_identification.examination import Examination
from rig_identification.identification import Prepared
from rig_identification.recording import Session
from rig_identification.result import ELEMENTS, Identification, Interrupted

PAGE = Path(__file__).parents[1] / "docs" / "how-to" / "python.md"


def _run(code: str) -> str:
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout


def test_importing_it_loads_neither_numpy_nor_the_compiler() -> None:
    code = "import sys, rig_identification as ri; ri.identify, ri.Result, ri.InputError; print(*sys.modules)"
    loaded = {name.partition(".")[0] for name in _run(code).split()}
    assert not loaded & {"numpy", "numba", "scipy", "pandas", "rosbags", "rclpy"}


@pytest.mark.parametrize(
    "first", ["", "import rig_identification.check.examine, rig_identification.simulate"]
)
def test_check_and_simulate_are_functions_and_rooms(first: str) -> None:
    """Whichever is asked for first: an import of the room must not take the function away."""
    code = f"""
{first}
import inspect, rig_identification as ri
print(callable(ri.check), callable(ri.simulate), *inspect.signature(ri.check).parameters)
from rig_identification.check import examine
from rig_identification.simulate import simulate_session
"""
    assert _run(code).split() == ["True", "True", "session", "namespace", "topics", "progress"]


def test_every_public_name_is_there_with_its_docstring() -> None:
    for name in ri.__all__:
        assert (inspect.getdoc(getattr(ri, name)) or "").strip(), name
    with pytest.raises(AttributeError, match="identfy"):
        ri.identfy  # noqa: B018


def test_the_page_runs_as_it_stands(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("pandas", reason="pip install '.[pandas]'")
    monkeypatch.chdir(tmp_path)
    blocks = re.findall(r"^```python\n(.*?)^```$", PAGE.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE)
    assert len(blocks) == 5
    names: dict[str, Any] = {}
    for block in blocks:
        exec(compile(block, str(PAGE), "exec"), names)
    assert sorted(p.name for p in (tmp_path / "answer").iterdir()) == ["report.html", "result.json"]
    result = names["result"]
    assert result.verdict == "none"
    assert np.isnan(result.values[[ELEMENTS.index(name) for name in result.unobservable]]).all()
    assert "run_1" in names["recorded"]._repr_html_()
    assert names["recorded"].frame("run_1", "/rig/mocap/pose").equals(names["pose"])
    assert names["pose"].index.name == "time"
    with pytest.raises(ri.InputError, match=r"run_3: is no recording.*did you mean run_"):
        names["recorded"].frame("run_3", "mocap/pose")
    with pytest.raises(ri.InputError, match="did you mean mocap/pose"):
        names["recorded"].frame("run_1", "mocap/pos")


def test_a_result_as_tables(explained: Identification, session: Session) -> None:
    pytest.importorskip("pandas", reason="pip install '.[pandas]'")
    result = ri.Result(explained, session)
    numbers = result.numbers
    assert list(numbers.index) == list(ELEMENTS)
    assert numbers.loc["m", "value"] == 1240.13
    assert numbers.loc["m", "high"] - numbers.loc["m", "low"] == pytest.approx(2 * 1.96 * 0.4, rel=1e-3)
    assert numbers.loc["Jzz"][["value", "std"]].isna().all()
    assert result.covariance.loc["Jzz"].isna().all()
    assert result.covariance.loc["m", "m"] == pytest.approx(0.4**2)
    assert result.inertia[0, 1] == result.inertia[1, 0] == numbers.loc["Jxy", "value"]
    assert result.findings.loc[0, "effect"] == "cable_elasticity"
    assert result.findings.loc[0, "holdout_error_after"] == 1.02
    assert result.alternatives.loc[0, "effect"] == "ceiling_compliance"
    named = result.channels.loc[0, ["recording", "channel", "quantity", "axis"]]
    fit = result.channel(*named)
    off = (fit["measured"] - fit["predicted"]) / result.channels.loc[0, "noise"]
    assert np.allclose(off, fit["residual"])
    assert np.sqrt(np.mean(off**2)) == pytest.approx(result.channels.loc[0, "rms"])
    with pytest.raises(ri.InputError, match="is no channel of this result"):
        result.channel("run_1", "imu", "angular_rate", "w")


def test_a_result_shows_itself(explained: Identification, session: Session) -> None:
    html = ri.Result(explained, session)._repr_html_()
    assert "verdict explained" in html
    assert "not determinable" in html
    assert "cable_3 is 2.3 mm longer" in html
    assert "m 1240.1 ± 0.4" in repr(ri.Result(explained, session))


def test_who_stops_it_gets_the_best_answer(
    monkeypatch: pytest.MonkeyPatch, session: Session, identification: Identification
) -> None:
    def stop(*_: object, **__: object) -> Identification:
        raise Interrupted(identification)

    module = types.ModuleType("rig_identification.search.identify")
    module.identify = stop  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "rig_identification.search.identify", module)
    with pytest.raises(ri.Stopped) as stopped:
        ri.identify(Prepared(session, Examination("van", (), (), ())))
    assert stopped.value.result.mass == 1240.13
    assert isinstance(stopped.value, KeyboardInterrupt)


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        ({}, "rig: give either a rig or a case"),
        ({"case": 14, "without": ["imo"]}, "without imo"),
        ({"case": 14, "start": "thrown"}, "start thrown"),
        ({"case": "14e"}, "case 14e"),
    ],
)
def test_an_argument_that_cannot_be_used_is_named(arguments: dict[str, Any], word: str) -> None:
    with pytest.raises(ri.InputError, match=word):
        ri.simulate(**arguments)


def test_without_pandas_it_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch, identification: Identification, session: Session
) -> None:
    monkeypatch.setitem(sys.modules, "pandas", None)
    result = ri.Result(identification, session)
    assert result.mass == 1240.13
    with pytest.raises(ri.InputError, match=r"pip install 'rig_identification\[pandas\]'"):
        _ = result.numbers
