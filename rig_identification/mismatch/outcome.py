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
    lawful: Explained | None = None  # what explains the session instead
    led: bool = False  # the first leads to another one, with which nothing is left
    chief: bool = True  # whether the first takes the larger part of what was left away
    beside: tuple[Trial, ...] = ()  # what it leads to, likeliest first, where that is fitted already
    asked: bool = False  # whether rivals of that were asked as well
    left: float = 0.0  # nats, without any of them
