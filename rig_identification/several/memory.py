"""What sessions of one rig taught of it, and a session's body with that as its prior.

The doubts that stay (ties.py), in units of their tolerances, are a random walk from session to session:
s' = s + w, w ~ N(0, new^2) each. A session's recordings, its own body and its new doubts integrated out, are
a quadratic form with information D and pull e on s. With the memory N(m, P), P = L L', before it

    M = 1 + L' D L,    P+ = L M^-1 L',    m+ = m + P+ (e - D m)

is the Kalman filter in the form that needs no inverse of D, which recordings leave singular (Anderson and
Moore, "Optimal Filtering", 1979, chapter 6). Before the update the session is asked whether it fits the
memory. The innovation and its covariance are, on the side of the recordings,

    r = (e - D m) - D L M^-1 L' (e - D m),    Cov(r) = A = D - D L M^-1 L' D.

A part of the rig that moved by d adds A d to r. With E the entries of that part, r_E' A_EE^-1 r_E is
chi-square distributed if it did not move, and A_EE^-1 r_E is by how much it did (score test: Rao, "Linear
statistical inference and its applications", 1973, section 6e).
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from rig_identification.estimate.without_frame import vehicle_alone
from rig_identification.joint import Doubt
from rig_identification.result import InertialEstimate
from rig_identification.several.compare import LEVEL
from rig_identification.several.fuse import Reduced, integrated, reduced, root_of_inverse, unobservable
from rig_identification.several.session_result import SessionResult
from rig_identification.several.ties import Sharing, ties

Array = NDArray[np.float64]

#: Information below which a session tells nothing of a direction: a shift of ten tolerances is one std.
NOTHING = 0.01
#: Parts of a rig that one session may find moved: with more it is another rig.
MOST_MOVED = 3


@dataclass(frozen=True)
class Moved:
    """A part of the rig that is not where the sessions before had it."""

    session: str
    part: str  # "cable_1.ceiling_point"
    shift: dict[str, tuple[float, float]]  # doubt -> by how much, and std, in its unit
    p: float


@dataclass(frozen=True)
class Memory:
    """What sessions of one rig taught of it."""

    keys: tuple[Hashable, ...]
    doubts: tuple[Doubt, ...]  # as described; ``at`` is the mean, in tolerances
    covariance: Array  # (n, n), in tolerances
    sessions: tuple[str, ...]
    moved: tuple[Moved, ...] = ()

    @property
    def std(self) -> Array:
        """(n,) in tolerances: 1 says that nothing was learned."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))


#: What is known of a rig before its first session.
NOTHING_YET = Memory((), (), np.zeros((0, 0)), ())


def learned(
    results: Sequence[SessionResult],
    sharing: Sharing | None = None,
    level: float = LEVEL,
    before: Memory = NOTHING_YET,
) -> Memory:
    """Memory of a rig after its sessions, in the order in which they were recorded.

    What moves in a session is told, and from there on believed where that session has it: its variance grows
    by the shift squared before the session is taken in. A session without joint information teaches nothing.
    before: what sessions taught that were recorded earlier.
    """
    said = replace(sharing or Sharing(), new=0.0)
    new = (sharing or Sharing()).new
    memory = before
    found = ties(results, said)
    for i, result in enumerate(results):
        if result.joint is not None:
            told = dict(zip(found.keys[i], result.joint.doubts, strict=True))
            part = reduced(result, found, i)
            memory = _taken_in(_grown(memory, part, told, new), part, result, level)
    return memory


def recalled(result: SessionResult, memory: Memory, sharing: Sharing | None = None) -> InertialEstimate:
    """A session's body with the memory of its rig as the prior of the rig's doubts."""
    if result.joint is None:
        return result.estimate
    found = ties([result], replace(sharing or Sharing(), new=0.0))
    part = reduced(result, found, 0)
    told = dict(zip(found.keys[0], result.joint.doubts, strict=True))
    rig = _grown(memory, part, told, (sharing or Sharing()).new)
    columns = [rig.keys.index(key) for key in part.keys]
    before = np.linalg.inv(rig.covariance[np.ix_(columns, columns)])
    mean = np.array([rig.doubts[c].at for c in columns])
    information, pull = part.information.copy(), part.pull.copy()
    _weighed(information, pull, result)
    data = information.copy()
    information[10:, 10:] += before
    data[10:, 10:] += before
    pull[10:] += before @ mean
    information[:10, :10] += result.joint.weak
    pull[:10] += result.joint.weak @ result.joint.elements - result.joint.weak_gradient
    root = root_of_inverse(information)
    covariance = root.T @ root
    return InertialEstimate((covariance @ pull)[:10], covariance[:10, :10], unobservable([result], data))


def without_frame(result: SessionResult, total: InertialEstimate) -> InertialEstimate | None:
    """The body of a recalled session without its carrying frame."""
    return None if result.joint is None else vehicle_alone(total, result.joint.frame)


def _grown(memory: Memory, part: Reduced, told: dict[Hashable, Doubt], new: float) -> Memory:
    """The memory one session later, with the doubts that it meets for the first time as described."""
    fresh = [key for key in part.keys if key not in memory.keys]
    size = len(memory.keys)
    covariance = np.eye(size + len(fresh))
    covariance[:size, :size] = memory.covariance + new**2 * np.eye(size)
    doubts = (*memory.doubts, *(replace(told[key], at=0.0) for key in fresh))
    return replace(memory, keys=(*memory.keys, *fresh), doubts=doubts, covariance=covariance)


def _taken_in(memory: Memory, part: Reduced, result: SessionResult, level: float) -> Memory:
    """The memory with one session taken in, and with what moved in it told."""
    information, pull = _on_rig(part, result, memory)
    for _ in range(MOST_MOVED):
        found = _most_moved(memory, information, pull, result.name, level)
        if found is None:
            break
        moved, variance = found
        memory = replace(
            memory, moved=(*memory.moved, moved), covariance=memory.covariance + np.diag(variance)
        )
    root = np.linalg.cholesky(memory.covariance)
    inner = np.linalg.inv(np.eye(len(root)) + root.T @ information @ root)
    after = root @ inner @ root.T
    mean = np.array([d.at for d in memory.doubts])
    mean = mean + after @ (pull - information @ mean)
    doubts = tuple(replace(d, at=float(at)) for d, at in zip(memory.doubts, mean, strict=True))
    return replace(memory, doubts=doubts, covariance=after, sessions=(*memory.sessions, result.name))


def _on_rig(part: Reduced, result: SessionResult, memory: Memory) -> tuple[Array, Array]:
    """(n, n) information and (n,) pull of a session on what the memory knows of, its body integrated out."""
    whole, pull = part.information.copy(), part.pull.copy()
    _weighed(whole, pull, result)
    joint = result.joint
    assert joint is not None
    whole[:10, :10] += joint.weak
    pull[:10] += joint.weak @ joint.elements - joint.weak_gradient
    order = [*range(10, len(whole)), *range(10)]
    own, own_pull = integrated(whole[np.ix_(order, order)], pull[order], len(part.keys))
    columns = [memory.keys.index(key) for key in part.keys]
    information, out = np.zeros((len(memory.keys),) * 2), np.zeros(len(memory.keys))
    information[np.ix_(columns, columns)] = own
    out[columns] = own_pull
    return information, out


def _weighed(information: Array, pull: Array, result: SessionResult) -> None:
    scale = None if result.joint is None else result.joint.weighing
    if scale is not None:
        information[0, 0] += scale.std**-2
        pull[0] += scale.std**-2 * scale.mass


def _most_moved(
    memory: Memory, information: Array, pull: Array, session: str, level: float
) -> tuple[Moved, Array] | None:
    """The part that a session most surely finds elsewhere, and by how much its variance is to grow.

    None where no part is, at the level shared by all parts (Bonferroni).
    """
    root = np.linalg.cholesky(memory.covariance)
    inner = np.linalg.inv(np.eye(len(root)) + root.T @ information @ root)
    taken = information @ root @ inner @ root.T
    off = pull - information @ np.array([d.at for d in memory.doubts])
    innovation, spread = off - taken @ off, information - taken @ information
    parts = _parts(memory)
    best: tuple[float, str, NDArray[np.int64]] | None = None
    for name, entries in parts.items():
        p, _, _ = _score(innovation[entries], spread[np.ix_(entries, entries)])
        if p < level / len(parts) and (best is None or p < best[0]):
            best = (p, name, entries)
    if best is None:
        return None
    p, name, entries = best
    _, shift, std = _score(innovation[entries], spread[np.ix_(entries, entries)])
    variance = np.zeros(len(memory.keys))
    variance[entries] = np.maximum(shift**2, 1.0)
    told = {
        memory.doubts[e].name: (float(s * memory.doubts[e].prior_std), float(t * memory.doubts[e].prior_std))
        for e, s, t in zip(entries.tolist(), shift, std, strict=True)
    }
    return Moved(session, name, told, p), variance


def _score(innovation: Array, spread: Array) -> tuple[float, Array, Array]:
    """p value of one part, its shift and the shift's std in tolerances, of what shows."""
    values, vectors = np.linalg.eigh(0.5 * (spread + spread.T))
    seen = values > NOTHING
    if not np.any(seen):
        return 1.0, np.zeros(len(innovation)), np.full(len(innovation), np.inf)
    along = vectors[:, seen]
    turned = along.T @ innovation
    chi_square = float(np.sum(turned**2 / values[seen]))
    shift = along @ (turned / values[seen])
    std = np.sqrt(np.sum(along**2 / values[seen], axis=1))
    return float(chi2.sf(chi_square, int(np.sum(seen)))), shift, std


def _parts(memory: Memory) -> dict[str, NDArray[np.int64]]:
    """Parts of the rig, each with its doubts: a hinge's three coordinates are one part."""
    out: dict[str, list[int]] = {}
    for entry, doubt in enumerate(memory.doubts):
        name, _, last = doubt.name.rpartition(".")
        out.setdefault(name if last in ("x", "y", "z") else doubt.name, []).append(entry)
    return {name: np.array(entries) for name, entries in out.items()}
