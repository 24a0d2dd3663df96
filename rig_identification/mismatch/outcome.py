"""What a look comes to: hypotheses fitted in full, and what they lead to."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.solve import Evaluation, Problem
from rig_identification.mismatch.along_measured import Along
from rig_identification.mismatch.candidate import Candidate
from rig_identification.mismatch.explained import Explained
from rig_identification.mismatch.screen import Promise
from rig_identification.mismatch.trial import Trial

#: What explains the session with a law instead: of pieces, and what they leave, if it has more log evidence
#: than so much and whole runs do not refute it.
Law = Callable[[Problem, Evaluation, float], Explained | None]

#: Log evidence that an effect has to gain.
MEANT = 3.0


@dataclass(frozen=True)
class Alone:
    """What is known and asked only as long as nothing else is in the model."""

    law: Law | None = None  # what may explain all where nothing that first order tells of does
    #: (p,) The problem's parameters where the ideal model's fit began
    guess: NDArray[np.float64] | None = None
    #: What first order says of hypotheses about the motion that was measured
    measured: Callable[[list[Candidate]], Along] | None = None


#: Nothing is asked but what any search asks.
NOTHING = Alone()


@dataclass(frozen=True)
class Trials:
    """Hypotheses fitted in full, most likely first, and the device that contradicts all others."""

    done: list[Trial]
    liar: str | None = None
    beaten: tuple[Trial, ...] = ()  # settled, significant, and yet far less likely than the first
    unsure: tuple[Trial, ...] = ()  # significant, with an amount that may as well be none: never told first
    lawful: Explained | None = None  # what explains the session instead
    led: bool = False  # the first leads to another one, with which nothing is left
    chief: bool = True  # whether the first takes the larger part of what was left away
    beside: tuple[Trial, ...] = ()  # what it leads to, likeliest first, where that is fitted already
    asked: bool = False  # whether rivals of that were asked as well
    left: float = 0.0  # nats, without any of them
    waiting: tuple[Promise, ...] = ()  # what promised most of what was never fitted, one of a kind

    def rivals_of(self, chosen: Trial) -> list[tuple[float, Trial]]:
        """What is stated beside ``chosen``, and by how much (nats) it trails.

        What no data refuted before it; and what is as likely, be it that its amount may as well be none: two
        that the data cannot tell apart are both stated, and the body is as uncertain as they make it.
        """
        likely = [(chosen.evidence - t.evidence, t) for t in self.done if t is not chosen]
        tied = [
            (max(0.0, chosen.evidence - t.evidence), t)
            for t in self.unsure
            if t.candidate.kind != chosen.candidate.kind and chosen.evidence - t.evidence < MEANT
        ]
        return [(gap, t) for gap, t in likely if gap >= 0.0] + tied
