"""What each of several recordings has of its own: a walk of the reading, which no other shares.

Recordings of one rig share its numbers, but not the room: each wanders in its own way. A walk is
linear in its sizes, so that, whatever the other numbers are, the best sizes in each record follow
by linear least squares and need not be sought (variable projection; Golub and Pereyra, SIAM J.
Numer. Anal. 10, 413 (1973)).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dearig.model.effects import EFFECTS, EffectValues
from dearig.model.records import ActuatorRecord, Record

__all__ = ["Walking", "Walks", "walks_of"]

_SEEN = 1e-12  # of what the best seen walk does: less, as in a short record, is not sought


@dataclass(frozen=True)
class Walking:
    """Sizes (K, n) in m of the walk of each record, and of the one walk (n,) nearest to all.

    ``residuals_in_common`` (N,) over the noise are what that one leaves.
    """

    sizes: np.ndarray
    in_common: np.ndarray
    residuals_in_common: np.ndarray


class Walks:
    """The walks that ``names`` of effects allow each of the ``records`` (K).

    ``names`` (n,) are those of the sizes, as a layout has them. ``ways`` (N, K n) is what each of
    them does to all readings, in m: the first n are of the first record, and so on.
    """

    def __init__(self, records: Sequence[ActuatorRecord], effects: Sequence[str]) -> None:
        self.names = tuple(
            f"{name}: {p.name}" for name in effects for p in EFFECTS[name].parameters
        )
        self._edges = np.cumsum([0, *(r.measured.size for r in records)])
        self._ways = [_ways_in(r, effects) for r in records]
        self._solved: list[tuple[np.ndarray, np.ndarray]] = []
        for record, ways in zip(records, self._ways, strict=True):
            # a reading that must not be used says nothing of the walk
            used = ways if record.valid is None else np.where(record.valid[:, None], ways, 0.0)
            scale = np.maximum(np.linalg.norm(used, axis=0), 1e-300)
            q, r = np.linalg.qr(used / scale)
            self._solved.append((q, (np.linalg.pinv(r, rcond=_SEEN) / scale[:, None]).T))

    @property
    def more(self) -> int:
        """How many numbers there are beyond one set for all records."""
        return (len(self._ways) - 1) * len(self.names)

    @property
    def ways(self) -> np.ndarray:
        """(N, K n), as said above."""
        n = len(self.names)
        found = np.zeros((self._edges[-1], len(self._ways) * n))
        for i, ways in enumerate(self._ways):
            found[self._edges[i] : self._edges[i + 1], i * n : (i + 1) * n] = ways
        return found

    def sizes(self, missing: np.ndarray) -> np.ndarray:
        """Sizes (..., K, n) that come nearest to what is ``missing`` (..., N) m of the readings."""
        found = []
        for i, (q, inverse) in enumerate(self._solved):
            part = missing[..., self._edges[i] : self._edges[i + 1]]
            found.append((part @ q) @ inverse)
        return np.stack(found, axis=-2)

    def moved(self, sizes: np.ndarray) -> np.ndarray:
        """What walks of ``sizes`` (..., K, n) add to the readings, (..., N) m."""
        parts = [sizes[..., i, :] @ ways.T for i, ways in enumerate(self._ways)]
        return np.concatenate(parts, axis=-1)

    def nearest(self, missing: np.ndarray) -> np.ndarray:
        """What walks add that comes nearest to what is ``missing`` (..., N) m."""
        return self.moved(self.sizes(missing))

    def walking(self, missing: np.ndarray, sigma: np.ndarray) -> Walking:
        """The walks that come nearest to what is ``missing`` (N,) m of the readings.

        ``sigma`` (N,) m is the noise of each reading, infinite where it must not be used.
        """
        rows = np.concatenate(self._ways) / sigma[:, None]
        scale = np.linalg.norm(rows, axis=0)
        common, *_ = np.linalg.lstsq(rows / scale, missing / sigma, rcond=None)
        left = (rows / scale) @ common - missing / sigma
        return Walking(self.sizes(missing), common / scale, left)


def walks_of(records: Sequence[Record], effects: EffectValues) -> Walks | None:
    """The walks of several ``records`` that ``effects`` allow each for itself; None of one record.

    Of a single record a walk's sizes are numbers of the model like any other.
    """
    walking = [name for name, _ in effects if EFFECTS[name].drift_basis is not None]
    rigs = [r for r in records if isinstance(r, ActuatorRecord)]
    return Walks(rigs, walking) if walking and len(rigs) > 1 else None


def _ways_in(record: ActuatorRecord, effects: Sequence[str]) -> np.ndarray:
    """What each size of ``effects`` does to the readings of ``record``: (N, n), m."""
    ways = [EFFECTS[name].drift_basis for name in effects]
    columns = np.concatenate([way(record.time) for way in ways if way is not None], axis=1)
    return record.seen(columns.T).T
