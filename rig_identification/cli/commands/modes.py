r"""Natural frequencies of a body on a rig, each with its shape in words.

Small swings about rest on rigid cables. The body is a case study's (--case), or one given in ten numbers
(--body), or the one that ``identify`` found (--result). Roll, pitch and yaw turn about the body's x, y and z
axis; the shares are those of the swing's kinetic energy.

  rig-identification modes --case 14
  rig-identification modes --rig session_a/rig.yaml --result out/result.json
  rig-identification modes --rig config/trifilar.yaml --body 42 0.3 0.18 -0.12 1.9 0.03 -0.05 2.4 0.02 3.6
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rig_identification.cli.cases import case_named
from rig_identification.cli.swings import swing_line, swings
from rig_identification.errors import InputError
from rig_identification.result import ELEMENTS

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from rig_identification.rig import Rig

    Array = NDArray[np.float64]


def configure(parser: argparse.ArgumentParser) -> None:
    """Take the rig and the body."""
    rig = parser.add_mutually_exclusive_group(required=True)
    rig.add_argument("--case", metavar="N", help="case study of the thesis: 1 to 17, or 18a to 18d")
    rig.add_argument("--rig", type=Path, metavar="FILE", help="rig description")
    body = parser.add_mutually_exclusive_group()
    body.add_argument(
        "--body", type=float, nargs=10, metavar=tuple(ELEMENTS), help="kg, m, kg m^2 about the centre of mass"
    )
    body.add_argument("--result", type=Path, metavar="FILE", help="result.json of identify")


def run(arguments: argparse.Namespace) -> None:
    """Print a line a mode, slowest first."""
    from rig_identification.model.modes import MOTIONS

    rig, elements = hung(arguments)
    for mode in swings(rig, elements):
        shares = ", ".join(
            f"{name} {100 * share:.0f} %"
            for name, share in zip(MOTIONS, mode.energy, strict=True)
            if share >= 0.005
        )
        print(f"{swing_line(mode)} ({shares})")


def hung(arguments: argparse.Namespace) -> tuple[Rig, Array]:
    """Rig, and m, c, J (10,) of the body on it. Raises InputError where the arguments do not name both."""
    import numpy as np

    from rig_identification.model.body import can_exist

    if arguments.case is not None:
        from rig_identification.simulate import case_spec

        if arguments.body is not None or arguments.result is not None:
            raise InputError("--case: has its own body; leave --body and --result out, or give --rig")
        spec = case_spec(case_named(arguments.case))
        return spec.rig, spec.elements
    from rig_identification.session import read_rig

    rig = read_rig(arguments.rig)
    if arguments.body is not None:
        elements = np.array(arguments.body, dtype=float)
    elif arguments.result is not None:
        elements = np.array(found_elements(arguments.result), dtype=float)
    else:
        raise InputError("--body, --result: a rig description says nothing of the inertia; give one of them")
    if not can_exist(elements):
        raise InputError("--body: no body has this mass and inertia; check the order " + " ".join(ELEMENTS))
    return rig, elements


def found_elements(path: Path, option: str = "--result") -> list[float]:
    """The ten numbers of a ``result.json``. option: names it in messages.

    Raises InputError where it has none.
    """
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
        mass, center, inertia = (document[name]["value"] for name in ("mass", "center_of_mass", "inertia"))
        upper: list[Any] = [inertia[i][j] for i in range(3) for j in range(i, 3)]
        values = [mass, *center, *upper]
    except OSError as error:
        raise InputError(f"{option} {path}: {error.strerror or error}") from error
    except (ValueError, KeyError, TypeError, IndexError) as error:
        raise InputError(f"{option} {path}: is no result.json of identify") from error
    missing = [name for name, value in zip(ELEMENTS, values, strict=False) if value is None]
    if missing:
        raise InputError(f"{option} {path}: {', '.join(missing)} not determined; give all ten with --body")
    return [float(value) for value in values]
