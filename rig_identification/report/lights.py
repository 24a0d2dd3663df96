"""Three lights that a reader sees first: the data, the model, and the run that was held out."""

from __future__ import annotations

from dataclasses import dataclass

from rig_identification.examination import Examination
from rig_identification.report.grades import grade
from rig_identification.report.setup import headline
from rig_identification.result import Identification


@dataclass(frozen=True)
class Light:
    """One light: green, amber or red by the page's classes, or grey where there is nothing to judge."""

    name: str
    state: str  # "good", "fair", "bad" or "muted"
    word: str
    sentence: str
    anchor: str  # the chapter that has the detail


def lights(identification: Identification) -> tuple[Light, Light, Light]:
    """Data, model and held-out run of an answer."""
    return _data(identification.examination), _model(identification), _held_out(identification)


def _data(examination: Examination | None) -> Light:
    if examination is None:
        return Light("Data", "muted", "not checked", "The set-up was not checked.", "quality")
    state, word = "good", "sound"
    if any(not fault.corrected for fault in examination.faults):
        state, word = "bad", "faults of the set-up"
    elif examination.faults:
        state, word = "fair", "faults, corrected"
    elif examination.warnings:
        state, word = "fair", "warnings"
    return Light("Data", state, word, headline(examination), "setup")


def _model(identification: Identification) -> Light:
    mismatch = identification.mismatch
    if not identification.converged:
        return Light(
            "Model", "bad", "not converged", "The fit did not settle: do not use the numbers.", "verdict"
        )
    count = len(mismatch.findings)
    found = f"With {count} finding{'s' if count != 1 else ''} the model explains every recording."
    state, word, sentence = {
        "none": ("good", "ideal model holds", "Every residual is its sensor's noise."),
        "explained": ("fair", "mismatch explained", found),
    }.get(
        mismatch.verdict, ("bad", "mismatch unexplained", "Something is left that no known effect explains.")
    )
    return Light("Model", state, word, sentence, "verdict")


def _held_out(identification: Identification) -> Light:
    error = identification.holdout_error
    if error is None:
        sentence = "No run was kept from the fit: nothing checks it. Mark one run with holdout: true."
        return Light("Held-out run", "muted", "none", sentence, "verdict")
    state = grade(error)
    word = "–" if state == "muted" else f"{error:.2f} σ" if error < 100.0 else f"{error:.0f} σ"
    sentence = {
        "good": "The model predicts a run that it was not fitted to.",
        "fair": "The model predicts a run that it was not fitted to less well than noise allows.",
        "bad": "The model does not predict a run that it was not fitted to.",
    }.get(state, "The held-out run could not be predicted.")
    return Light("Held-out run", state, word, f"{sentence} 1 σ is perfect.", "verdict")
