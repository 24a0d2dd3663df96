"""What ``init`` asks a person, and what it makes of the answers."""

from __future__ import annotations

import argparse
import math
import os
import shutil
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rig_identification.errors import InputError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from rig_identification.session.start import Answers, CableAnswer, Held

    Vector = NDArray[np.float64]

_UNITS = {"m": 1.0, "mm": 1e-3}
GRAVITY = 9.80665  # m/s^2, standard
#: Devices whose place on the body matters, and one that is estimated where nobody knows it.
_PLACED, _ESTIMATED = ("imu", "exciter", "mocap"), "mocap"


def import_logs(folder: Path, *, certain: bool) -> None:
    """Make bags of the logs in a folder that holds none. Raises InputError where there are no logs either."""
    from rig_identification.logs.formats import reader_of
    from rig_identification.logs.importing import recordings, understand, write_recordings

    files = [file for file in sorted(folder.iterdir()) if file.is_file() and reader_of(file) is not None]
    if not files:
        raise InputError(f"{folder}: holds neither a bag nor a log that can be imported")
    understood = understand(files)
    print(understood.text, end="", flush=True)
    if not certain and input("Import so? [y/N] ").strip().lower() not in ("y", "yes"):
        raise InputError(f"{folder}: nothing is written; import with a columns.yaml of your own first")
    write_recordings(recordings(understood), folder)
    (folder / "columns.yaml").write_text(understood.text, encoding="utf-8")


def write_start(arguments: argparse.Namespace, bags: Sequence[Path], held: Held) -> None:
    """Ask, write both files and their schemas aside, read them back, and move them into the folder.

    Raises
    ------
    InputError
        An answer is missing or makes no rig; the folder is as it was.
    """
    from rig_identification.session.not_a_session import FILE
    from rig_identification.session.read import read_run
    from rig_identification.session.start import RIG_FILE, SCHEMA_FOLDER, rig_text, schema_files, session_text

    folder: Path = arguments.folder
    text = rig_text(_answers(arguments, held))
    reader = read_run(arguments.namespace, dict(arguments.topic))
    aside = Path(tempfile.mkdtemp(prefix=".init-", dir=folder))
    try:
        (aside / RIG_FILE).write_text(text, encoding="utf-8")
        try:
            described = session_text(folder, bags, aside / RIG_FILE, reader, arguments.namespace)
        except InputError as error:  # the file is not there yet; what is wrong with it is an answer
            raise InputError(str(error).replace(f"{aside / RIG_FILE}: ", "")) from error
        (aside / FILE).write_text(described, encoding="utf-8")
        (folder / SCHEMA_FOLDER).mkdir(exist_ok=True)
        for name, schema in schema_files().items():
            (folder / SCHEMA_FOLDER / name).write_text(schema, encoding="utf-8")
        for name in (RIG_FILE, FILE):
            os.replace(aside / name, folder / name)
            print(f"written: {folder / name}")
    except OSError as error:
        raise InputError(f"{folder}: {error.strerror or error}; free it or name another folder") from error
    finally:
        shutil.rmtree(aside, ignore_errors=True)
    print(described, end="")


def _answers(arguments: argparse.Namespace, held: Held) -> Answers:
    from rig_identification.session.start import Answers

    ask = not arguments.yes
    if ask and arguments.unit is None and not arguments.cable:
        arguments.unit = _ask_word("Unit of every length, m or mm", "m", tuple(_UNITS))
    scale = _UNITS[arguments.unit or "m"]
    gravity = arguments.gravity
    if gravity is None:
        gravity = _ask_number("Gravity, m/s^2", GRAVITY) if ask else GRAVITY
    mass, mass_std = arguments.mass, arguments.mass_std
    if ask and mass is None:
        mass = _ask_number("Mass of body and carrying frame on a scale, kg (empty: not weighed)", None)
    if ask and mass is not None and mass_std is None:
        mass_std = _ask_number("How well the scale reads, kg, one standard deviation (empty: default)", None)
    cables = [_cable_of(given, scale) for given in arguments.cable]
    if not cables:
        cables = _ask_cables(held, scale) if ask else []
    if not cables:
        example = " ".join(held.cables[:1] or ("left",))
        raise InputError(
            f"--cable: missing; no bag says where the cables are hinged: give --cable {example} and the "
            "ceiling's x y z, the body's x y z and the length, once a cable"
        )
    return Answers(gravity, mass, mass_std, tuple(cables), _positions(arguments.at, held, scale, ask=ask))


def _cable_of(given: Sequence[str], scale: float) -> CableAnswer:
    """A cable of the option ``--cable``. Raises InputError."""
    from rig_identification.session.start import CableAnswer

    numbers = scale * _numbers(f"--cable {given[0]}", given[1:])
    return CableAnswer(given[0], numbers[:3], numbers[3:6], float(numbers[6]))


def _positions(
    given: Sequence[Sequence[str]], held: Held, scale: float, *, ask: bool
) -> Mapping[str, Vector]:
    """Device -> where it sits; of what is not told the body's origin, and of motion capture nothing."""
    import numpy as np

    found: dict[str, Vector] = {}
    for device, *numbers in given:
        if device not in _PLACED:
            raise InputError(f"--at {device}: is no device with a place; give {', '.join(_PLACED)}")
        found[device] = scale * _numbers(f"--at {device}", numbers)
    for device in held.devices:
        if device == _ESTIMATED:
            continue
        if device not in found:
            found[device] = np.zeros(3)
            if device in _PLACED and ask:
                found[device] = scale * _ask_vector(
                    f"Where the {device} sits on the body, x y z", np.zeros(3)
                )
            elif device in _PLACED:
                origin = f"{device}: taken to sit at the body's origin; give --at {device} X Y Z, or edit it"
                print(f"note: {origin}")
        print(f"note: {device}: taken to be level with the body's axes; if it is not, edit its orientation")
    return found


def _ask_cables(held: Held, scale: float) -> list[CableAnswer]:
    from rig_identification.session.start import CableAnswer

    names = list(held.cables)
    if not names:
        count = int(_ask_number("How many cables carry the body", 2) or 0)
        names = [f"cable_{number}" for number in range(1, count + 1)]
    cables = []
    for name in names:
        ceiling = _ask_vector(f"{name}: hinge on the ceiling, x y z in world")
        body = _ask_vector(f"{name}: hinge on the body, x y z in body")
        length = _ask_number(f"{name}: length between the hinges", None) or math.nan
        cables.append(CableAnswer(name, scale * ceiling, scale * body, scale * length))
    return cables


def _numbers(where: str, texts: Sequence[str]) -> Vector:
    import numpy as np

    try:
        return np.array([float(text) for text in texts])
    except ValueError as error:
        raise InputError(f"{where}: {' '.join(texts)}: give numbers, with a point for decimals") from error


def _ask_word(question: str, default: str, words: tuple[str, ...]) -> str:
    while True:
        answer = input(f"{question} [{default}]: ").strip() or default
        if answer in words:
            return answer
        print(f"  give {' or '.join(words)}")


def _ask_number(question: str, default: float | None) -> float | None:
    """A number; the default, or None without one, for an empty answer."""
    shown = "" if default is None else f" [{default:g}]"
    while True:
        answer = input(f"{question}{shown}: ").strip()
        if not answer:
            return default
        try:
            return float(answer)
        except ValueError:
            print("  give a number, with a point for decimals")


def _ask_vector(question: str, default: Vector | None = None) -> Vector:
    import numpy as np

    shown = "" if default is None else f" [{' '.join(f'{value:g}' for value in default)}]"
    while True:
        answer = input(f"{question}{shown}: ").replace(",", " ").split()
        if not answer and default is not None:
            return default
        try:
            vector = np.array([float(text) for text in answer])
        except ValueError:
            vector = np.zeros(0)
        if vector.shape == (3,):
            return vector
        print("  give three numbers, as 0.25 0 2")
