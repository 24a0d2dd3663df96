"""Fills docs/effects: what the catalogue itself says of each effect, and what a session shows of it.

A page's prose is written by hand. Between ``<!-- NAME -->`` and ``<!-- end -->`` stands what the package says
anyway, so that no text stands twice:

    told        the sentence of a finding and its advice, from the hypothesis
    experiment  what would tell the effect from its rivals (mismatch/experiments.py)
    laws        laws without a name of their own, with both (on the page of ``unknown``)
    picture     the channel that shows it most, and by how much
    rivals      which hypotheses would take how much of it away instead

The first three are filled within seconds, and a test holds them. The last two and the picture come from the
page's own command: the session is simulated, the ideal model fitted to it, and every hypothesis screened,
half a minute a page.

    python -m bench.effect_pages                        # what the catalogue says
    python -m bench.effect_pages --measure [NAME ...]   # pictures and rivals too, of some pages or of all
"""

from __future__ import annotations

import argparse
import re
import shlex
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

import rig_identification as ri
from bench.effect_pictures import Shown, drawn, shown
from rig_identification.cli.commands.simulate import OPTIONS
from rig_identification.cli.effects import effects_given
from rig_identification.cli.main import build_parser
from rig_identification.estimate.identify import ORDINARY, pose_problem
from rig_identification.mismatch.candidate import Candidate
from rig_identification.mismatch.experiments import experiment_for, kinds
from rig_identification.mismatch.findings import pushed
from rig_identification.mismatch.hypotheses import catalogue
from rig_identification.mismatch.left_out_physics import left_out_physics
from rig_identification.mismatch.riders import Swing, rider_candidate
from rig_identification.mismatch.slack import Spell, slack_finding
from rig_identification.mismatch.supports import cable_elasticity, ceiling_candidate
from rig_identification.model import layout
from rig_identification.model.effects import place

ROOT = Path(__file__).parents[1]
PAGES = ROOT / "docs" / "effects"
PICTURES = PAGES / "pictures"
#: What stands for a number that only a session tells.
SOME = "…"
#: Rivals that a page names, and the share of what the ideal model leaves below which one is none.
NAMED, LEAST = 6, 0.2
#: A command whose options have their defaults.
PLAIN = ("simulate", "--case", "14", "--out", "trial")
#: Nats from which a gain is none of chance, whichever hypothesis has it.
SURE = 15.0
#: Std of its mean from which a reading at rest is told of.
STANDS_OUT = 4.0


def effects() -> list[str]:
    """Every effect that a finding may name, in the contract's words, by the pages that there have to be."""
    return sorted({kind for kind in kinds() if not kind.startswith("unknown ")} | {"cable_slack"})


def command_of(page: str) -> str:
    """The command of a page that simulates its effect."""
    (line,) = re.findall(r"^rig-identification simulate (?:\\\n|.)*$", page, re.MULTILINE)
    return re.sub(r"\\\n\s*", "", line)


def simulated(command: str, *, effect: bool = True, **changes: Any) -> ri.Simulated:
    """The session that a command simulates, or the same one without its effect, or with other arguments."""
    asked = build_parser().parse_args(shlex.split(command)[1:])
    given = {option: getattr(asked, option) for option in OPTIONS} | changes
    if not effect and not asked.effect:
        given["pull"] = build_parser().parse_args(PLAIN).pull  # what is seen without a switch: pulled less
    return ri.simulate(effects=effects_given(asked.effect) if effect else {}, **given)


def filled(page: str, name: str, text: str) -> str:
    """A page with ``text`` between the marks of a part; the same page where it has no such part."""
    return re.sub(
        rf"(<!-- {name} -->\n).*?(<!-- end -->)", lambda m: f"{m[1]}{text}\n{m[2]}", page, flags=re.DOTALL
    )


def has(page: str, name: str) -> bool:
    """Whether a page has a part."""
    return f"<!-- {name} -->" in page


@cache
def hypotheses() -> tuple[Candidate, ...]:
    """All hypotheses of a car with every device, that of the thesis' equations among them."""
    made = ri.simulate(case=14, start="pulled", duration=1.0, rest=1.0)
    problem, _, _ = pose_problem(made.session)
    rig, parameters, mass = problem.bench.rig, problem.bench.parameters, float(made.values[0])
    model = parameters.model
    physics = model.physics.copy()
    physics[layout.effects_offset(model.cables) + place.GYROSCOPIC_SHARE] = 1.0
    lacking = replace(parameters, model=model.with_physics(physics))
    riders = [rider_candidate(problem, Swing(d, 1.0), mass, 0.0, np.zeros(3))[0] for d in ("xy", "x")]
    supports = (ceiling_candidate(rig, model, mass, 0), cable_elasticity(rig, model, mass))
    return (*catalogue(problem), *left_out_physics(rig, lacking, mass), *riders, *supports)


def told(effect: str) -> str:
    """What a finding says, with a mark in the place of each number, and the advice."""
    if effect == "cable_slack":
        return f"> {slack_finding([Spell('cable_2', 'run_1', 3.2, 3.4)]).statement}"
    if effect == "external_force":
        push = pushed("run_1", 3.2, 3.5, np.array([30.0, 8.0, 0.0]), np.ones(3), np.zeros(3))
        return f"> {push.statement}"
    candidate = next(c for c in hypotheses() if c.kind == effect)
    text = re.sub(r"\{(value|told\[\w+\])\}", SOME, candidate.sentence)
    text = text.replace("{channel}", str(candidate.where.get("channel")))
    return f"> {text} {candidate.advice}"


def experiment(effect: str) -> str:
    """The experiment as a sentence of its own."""
    text = experiment_for(effect).replace(" degrees", "°")
    return f"{text[:1].upper()}{text[1:]}."


def laws() -> str:
    """Laws without a word of their own: the finding's sentence, where a car has it, and the experiment."""
    lines = ["| `where.law` | a finding says | confirm |", "| --- | --- | --- |"]
    named = {c.kind for c in hypotheses()}
    for kind in sorted(k for k in kinds() if k.startswith("unknown ")):
        says = told(kind).removeprefix("> ") if kind in named else ""
        lines.append(f"| `{kind.removeprefix('unknown ')}` | {says} | {experiment(kind)} |")
    return "\n".join(lines)


def stated(effect: str, page: str) -> str:
    """A page with all that the package says anyway."""
    for name, text in (("told", told), ("experiment", experiment)):
        if has(page, name):
            page = filled(page, name, text(effect))
    return filled(page, "laws", laws()) if has(page, "laws") else page


def measured(effect: str, page: str) -> str:
    """A page with what its session shows; the picture is written beside it."""
    command = command_of(page)
    made, clean = simulated(command), simulated(command, noise=False)
    what = shown(made, clean, simulated(command, effect=False, noise=False), rivals=has(page, "rivals"))
    PICTURES.mkdir(exist_ok=True)
    (PICTURES / f"{effect}.svg").write_text(drawn(what, effect), encoding="utf-8")
    page = filled(page, "picture", caption(what))
    return filled(page, "rivals", rivals(effect, what.gains)) if has(page, "rivals") else page


def caption(what: Shown) -> str:
    """How large it is, and where it stands."""
    where = f"`{what.fit.recording}`, {what.name}"
    if what.taken_up:
        size, (doubt, moved) = float(np.sqrt(np.mean(what.difference**2))), what.doubt
        parts = [f"{where}: the effect changes it by {size:.1f} times the noise, in the root mean square."]
        if abs(moved) > ORDINARY:
            parts.append(
                f"No residual is left of that: the ideal model moves `{doubt}` by {abs(moved):.0f} of its "
                "tolerances, and beyond three that is a finding."
            )
        else:
            parts.append(
                "No residual is left of that: the ten numbers and several small doubts of the rig take it "
                "between them."
            )
    else:
        parts = [
            f"{where}: {what.fit.rms_in_sigma:.1f} times the noise is left by the ideal model, in the root "
            "mean square."
        ]
        if what.held_out is not None:
            parts.append(f"The held-out run's error is {what.held_out:.1f}.")
    still = what.at_rest
    if still is not None and still.rms_in_sigma > STANDS_OUT:
        parts.append(
            f"At rest `{still.channel}` is {still.rms_in_sigma:.0f} std of its mean off "
            f"in `{still.recording}`."
        )
    return " ".join(parts)


def rivals(effect: str, gains: dict[str, float]) -> str:
    """What else would take how much away, as shares of what takes most."""
    own, most = gains.get(effect, 0.0), max(gains.values(), default=0.0)
    if most < SURE:
        return "Nothing is left that any hypothesis could take away."
    if own < LEAST * most:
        return (
            "First order says little here: what the effect does is not in proportion to its amount. "
            "The search fits it instead."
        )
    others = {kind: g / own for kind, g in gains.items() if kind != effect and g > LEAST * own}
    if not others:
        return "To first order no other hypothesis takes as much as a fifth of it away."
    rows = [f"| {linked(kind)} | {100.0 * share:.0f} % |" for kind, share in list(others.items())[:NAMED]]
    return "\n".join(["| instead of it | of what it takes away, to first order |", "| --- | --- |", *rows])


def linked(kind: str) -> str:
    """A kind of effect, with a link to its page."""
    effect, _, law = kind.partition(" ")
    return f"[`{effect}`]({effect}.md)" + (f" ({law})" if law else "")


def main() -> None:
    """Fill the pages that are named, or all."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--measure", nargs="*", metavar="NAME", help="pictures and rivals too; default: all")
    asked = parser.parse_args()
    chosen = effects() if asked.measure == [] else asked.measure or []
    for effect in effects():
        path = PAGES / f"{effect}.md"
        page = stated(effect, path.read_text(encoding="utf-8"))
        if effect in chosen:
            page = measured(effect, page)
            print(effect, flush=True)
        path.write_text(page, encoding="utf-8")


if __name__ == "__main__":
    main()
