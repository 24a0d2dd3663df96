"""An effect that is one file outside of the package: simulated, found, fitted and told as any other."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from rig_identification import own
from rig_identification.cli.main import main
from rig_identification.errors import InputError
from rig_identification.model import layout
from rig_identification.model.effects import place
from rig_identification.model.effects.own import add_own, code_of

PAGE = Path(__file__).parents[1] / "docs" / "how-to" / "own-effect.md"
MOMENTUM = 30.0  # N m s


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The example of the documentation, in a folder of its own."""
    code = PAGE.read_text(encoding="utf-8").partition("```python\n")[2].partition("```")[0]
    (tmp_path / "effects").mkdir()
    (tmp_path / "effects" / "spinning_wheel.py").write_text(code, encoding="utf-8")
    monkeypatch.setenv(own.VARIABLE, str(tmp_path / "effects"))
    return tmp_path / "effects"


@pytest.mark.usefixtures("folder")
def test_a_wheel_turns_its_momentum_with_the_body() -> None:
    """The moment is -w x h, for real numbers and as a derivative, and does no work."""
    (effect,) = own.own_effects()
    physics = np.zeros(place.EFFECTS_SIZE)
    physics[place.OWN : place.OWN + 2] = [code.address for code in code_of(effect)]
    physics[place.OWN + 2] = MOMENTUM
    x, r = np.zeros(layout.BODY_STATE), np.zeros(6)
    rate = np.array([0.2, -0.5, 0.7])
    x[layout.RATE : layout.RATE + 3] = rate
    add_own(physics, 0, x, np.eye(3), r)
    np.testing.assert_allclose(r[3:], -np.cross(rate, [0.0, 0.0, MOMENTUM]))
    assert rate @ r[3:] == pytest.approx(0.0)
    stepped, change = physics.astype(complex), np.zeros(6, dtype=complex)
    stepped[place.OWN + 2] += 1e-20j
    add_own(stepped, 0, x.astype(complex), np.eye(3, dtype=complex), change)
    np.testing.assert_allclose(change.imag / 1e-20, r / MOMENTUM)


def test_it_is_simulated_found_and_told(folder: Path, tmp_path: Path) -> None:
    session, out = tmp_path / "session", tmp_path / "out"
    switched = f"spinning_wheel.momentum={MOMENTUM}"
    made = ["simulate", "--case", "10", "--effect", switched, "--start", "pulled", "--duration", "16"]
    assert main([*made, "--seed", "3", "--effects", str(folder), "--out", str(session)]) == 0
    assert json.loads((session / "truth.json").read_text())["effects"][0]["effect"] == "spinning_wheel"
    assert main(["identify", str(session), "--effects", str(folder), "--out", str(out)]) == 0
    result = json.loads((out / "result.json").read_text())
    first = result["mismatch"]["findings"][0]
    assert result["mismatch"]["verdict"] == "explained"
    assert first["effect"] == "spinning_wheel"
    told = first["parameters"]["momentum"]
    assert abs(told["value"] - MOMENTUM) < 3.0 * told["std"] < 0.2 * MOMENTUM
    assert first["evidence"]["holdout_error_after"] < 1.02
    assert "A wheel spins in the body" in (out / "report.html").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("EFFECT = 3", "defines no EFFECT"),
        ("import nothing_of_the_kind", "cannot be read: ModuleNotFoundError"),
        (
            "from rig_identification.own import Number, OwnEffect\n"
            "EFFECT = OwnEffect('x', (Number('n', 'N', 1.0),) * 9, print, '', '')",
            "x has 9 numbers; 1 to 8 can be",
        ),
    ],
)
def test_a_file_that_is_no_effect_is_told_in_one_line(
    text: str, words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "odd.py").write_text(text)
    monkeypatch.setenv(own.VARIABLE, str(tmp_path))
    with pytest.raises(InputError, match=words):
        own.own_effects()


def test_a_missing_folder_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(own.VARIABLE, "/no/such/folder")
    with pytest.raises(InputError, match="is no folder"):
        own.own_effects()
