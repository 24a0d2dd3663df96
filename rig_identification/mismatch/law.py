"""What a missing wrench follows: a sparse law of position, velocity and their powers, where there is one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig_identification.mismatch.latent import MissingWrench

Array = NDArray[np.float64]

#: Share of a component's variance that a law has to explain to be told.
TELLING = 0.8
#: Terms that a law may have.
TERMS = 2
#: How much more of the variance a further term has to explain.
FURTHER = 0.05


@dataclass(frozen=True)
class Law:
    """One component of the missing wrench as a sum of few motions' powers."""

    component: str  # "force along y", "moment about z"
    terms: tuple[str, ...]
    share: float  # of its variance

    @property
    def words(self) -> str:
        """For a sentence."""
        return f"the {self.component} follows {' and '.join(self.terms)} ({100 * self.share:.0f} % of it)"


def features(missing: MissingWrench) -> dict[str, Array]:
    """Motions that a wrench can follow, (N,) each."""
    x = missing.states
    place = x[:, :3] - np.mean(x[:, :3], axis=0)
    turn = np.stack(
        [missing.R_world_body[:, 2, 1], missing.R_world_body[:, 0, 2], missing.R_world_body[:, 1, 0]]
    )
    turn = turn.T - np.mean(turn.T, axis=0)
    out: dict[str, Array] = {"time": missing.time - np.mean(missing.time)}
    for i, a in enumerate("xyz"):
        for name, values in (
            (f"displacement along {a}", place[:, i]),
            (f"turning about {a}", turn[:, i]),
            (f"velocity along {a}", x[:, 6 + i]),
            (f"rate about {a}", x[:, 9 + i]),
        ):
            out[name] = values
            out[f"the cube of {name}"] = values**3
            out[f"the signed square of {name}"] = values * np.abs(values)
            out[f"the sign of {name}"] = np.tanh(values / (0.1 * np.std(values) + 1e-12))
    return out


def law_of(missing: MissingWrench) -> Law | None:
    """The law of the wrench's strongest component; None where no sparse one tells most of it."""
    force = np.einsum("nij,nj->ni", missing.R_world_body, missing.wrench[:, :3])
    moment = np.einsum("nij,nj->ni", missing.R_world_body, missing.wrench[:, 3:])
    spread = np.concatenate([np.std(force, axis=0), np.std(moment, axis=0)])
    reach = max(float(np.max(spread[:3])), 1e-12), max(float(np.max(spread[3:])), 1e-12)
    strongest = int(np.argmax(spread[:3])) if reach[0] * 1.0 >= reach[1] else 3 + int(np.argmax(spread[3:]))
    target = np.concatenate([force, moment], axis=1)[:, strongest]
    target = target - np.mean(target)
    known = {n: (v - np.mean(v)) / (np.std(v) + 1e-12) for n, v in features(missing).items()}
    chosen: list[str] = []
    share = 0.0
    for _ in range(TERMS):
        best, gained = "", share
        for name in known:
            if name in chosen:
                continue
            columns = np.stack([known[n] for n in (*chosen, name)], axis=1)
            fit = columns @ np.linalg.lstsq(columns, target, rcond=1e-8)[0]
            explained = 1.0 - float(np.sum((target - fit) ** 2) / np.sum(target**2))
            if explained > gained:
                best, gained = name, explained
        if not best or gained < share + FURTHER:
            break
        chosen.append(best)
        share = gained
    if share < TELLING:
        return None
    axis = "xyz"[strongest % 3]
    component = f"force along {axis}" if strongest < 3 else f"moment about {axis}"
    return Law(component, tuple(chosen), share)
