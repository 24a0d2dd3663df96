"""Which runs to make, in which order: greedily, for the inertia that would be known worst.

Information adds up, so that each choice is a sum of matrices and an inverse. The greedy choice of experiments
comes near the best one (Shamaiah, Banerjee and Vikalo, IEEE CDC 2010, show it for the determinant). The worst
element is compared first; the mean of all breaks ties.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.observability import elements_covariance
from rig_identification.plan.information import Laboratory
from rig_identification.plan.menu import Item
from rig_identification.result import ELEMENTS, natural_size

Array = NDArray[np.float64]

#: Share of the volume's gain beside that of the worst element: enough to break ties, and no more.
VOLUME = 0.1
INERTIA = slice(4, 10)


@dataclass(frozen=True)
class Choice:
    """An item of the menu with what it tells."""

    item: Item
    information: Array  # (p, p) of one block, or of one recording at rest


@dataclass(frozen=True)
class Step:
    """One choice, and what is known after it."""

    choice: Choice
    seconds: float  # recorded so far
    relative: Array  # (10,) std of each element as a share of its natural size


@dataclass(frozen=True)
class Chosen:
    """What to record, in the order in which it was chosen."""

    steps: tuple[Step, ...]
    information: Array  # (p, p) of all of it, priors included
    determined: tuple[str, ...]  # elements that the whole menu could determine

    def blocks(self) -> dict[str, int]:
        """How often each item was chosen, by name, in the order of the first time."""
        out: dict[str, int] = {}
        for step in self.steps:
            out[step.choice.item.name] = out.get(step.choice.item.name, 0) + 1
        return out


def relative_std(lab: Laboratory, information: Array) -> Array:
    """(10,) std of each element as a share of what an error of it is to be held against."""
    covariance = elements_covariance(lab.problem, lab.evaluation(information))
    return np.asarray(np.sqrt(np.diag(covariance)) / natural_size(lab.spec.elements))


def determinable(lab: Laboratory, choices: Sequence[Choice]) -> tuple[str, ...]:
    """Elements that all of the menu together would determine."""
    everything = lab.before + np.sum([c.information for c in choices], axis=0)
    lost = lab.expected(np.asarray(everything)).unobservable
    return tuple(name for name in ELEMENTS if name not in lost)


def worst(relative: Array, determined: Sequence[str]) -> float:
    """Largest relative std of the determinable elements of inertia; of all elements where none of it is."""
    known = [i for i, name in enumerate(ELEMENTS) if name in determined]
    asked = [i for i in known if name_of_inertia(i)] or known or list(range(len(ELEMENTS)))
    return float(np.max(relative[asked]))


def name_of_inertia(i: int) -> bool:
    """Whether an element is one of the tensor's."""
    return i >= INERTIA.start


def merit(relative: Array, determined: Sequence[str]) -> float:
    """What a choice lowers: logarithm of the worst element, and a little of the mean of all."""
    known = [i for i, name in enumerate(ELEMENTS) if name in determined] or list(range(len(ELEMENTS)))
    return float(np.log(worst(relative, determined)) + VOLUME * np.mean(np.log(relative[known])))


def choose(
    lab: Laboratory,
    choices: Sequence[Choice],
    seconds: float,
    most: float,
    first: Sequence[Choice],
    changeover: float = 0.0,
) -> Chosen:
    """The best use of ``seconds``. most: s that runs may take, beyond which a fit looks at no more of them.

    first: what is recorded anyhow, in its order. changeover: s before each recording; another block of a run
    needs none. A recording at rest is made once.
    """
    determined = determinable(lab, choices)
    information, spent, moving = lab.before, 0.0, 0.0
    steps: list[Step] = []
    taken: set[str] = set()

    def cost(choice: Choice) -> float:
        return choice.item.seconds + (0.0 if choice.item.name in taken else changeover)

    def take(choice: Choice) -> None:
        nonlocal information, spent, moving
        information = information + choice.information
        spent += cost(choice)
        taken.add(choice.item.name)
        moving += choice.item.seconds if choice.item.run is not None else 0.0
        steps.append(Step(choice, spent, relative_std(lab, information)))

    for choice in first:
        take(choice)
    while True:
        open_ = [
            c
            for c in choices
            if spent + cost(c) <= seconds + 1e-6
            and (
                moving + c.item.seconds <= most + 1e-6 if c.item.run is not None else c.item.name not in taken
            )
        ]
        if not open_:
            break
        now = merit(relative_std(lab, information), determined)
        gains = [
            (now - merit(relative_std(lab, information + c.information), determined)) / cost(c) for c in open_
        ]
        take(open_[int(np.argmax(gains))])
    return Chosen(tuple(steps), information, determined)
