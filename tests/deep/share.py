"""Which of the deep tests run: all, those of a day, or a sample drawn by a seed."""

from __future__ import annotations

import random
from collections.abc import Sequence

__all__ = ["DAYS", "VARIABLE", "share_of"]

#: The environment variable that names the share, for the processes of a distributed run.
VARIABLE = "DEARIG_DEEP_SHARE"
#: In so many days every deep test runs once: some 11 a day, for about one minute.
DAYS = 84


def share_of(names: Sequence[str], share: str) -> set[str]:
    """Return which of ``names`` belong to ``share``.

    Parameters
    ----------
    names : sequence of str
        All deep tests.
    share : str
        "" for all, ``day N`` for every 84th from the N-th on, ``seed N`` for so large a share drawn
        by that number.
    """
    kind, _, number = share.partition(" ")
    ordered = sorted(names)
    if not kind:
        return set(ordered)
    if kind == "day":
        # one after another: the cases of one parametrised test are spread over the days
        return set(ordered[int(number) % DAYS :: DAYS])
    if kind == "seed":
        return set(random.Random(int(number)).sample(ordered, -(-len(ordered) // DAYS)))  # noqa: S311
    raise ValueError(f"{VARIABLE} is 'day N' or 'seed N', not {share!r}")
