"""What effects do to a step, of one film or of a pack of films side by side.

Effects are written for one film. In a pack their hooks are called for one film after the other, so
that every effect, also another distribution's, takes part as it is. The arguments are those of
``effect_forces``; for a pack ``c`` is ``Lanes`` and ``m`` has a row for each film.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from dearig.model.compiled.packs import WIDTH, lane, of_packs, with_lane
from dearig.model.kernel import effect_forces as of_one

__all__ = ["Lanes", "affected", "commit", "supplied", "supplied_at_start"]


class Lanes(NamedTuple):
    """The films of a pack as effects see them."""

    values: np.ndarray  # (WIDTH, C): coefficients
    acting: np.ndarray  # (WIDTH,): effects that are not neutral, in bits


def _affected(
    acting: int,
    c: Any,
    m: np.ndarray,
    lam: float,
    rate: float,
    warmth: float,
    lam0: float,
    since: float,
    t: float,
    field2: float,
    pull: float,
    held_back: float,
    over: float,
) -> float:
    found = pull
    for i in range(WIDTH):
        one = of_one.affected(
            c.acting[i], c.values[i], m[i], lane(lam, i), lane(rate, i), warmth, lane(lam0, i),
            since, t, lane(field2, i), lane(pull, i), lane(held_back, i), lane(over, i),
        )  # fmt: skip
        found = with_lane(found, i, one)
    return found


@of_packs(_affected)
def affected(
    acting: int,
    c: Any,
    m: np.ndarray,
    lam: float,
    rate: float,
    warmth: float,
    lam0: float,
    since: float,
    t: float,
    field2: float,
    pull: float,
    held_back: float,
    over: float,
) -> float:
    """Return the Maxwell stress less the network's, with effects in both."""
    return of_one.affected(
        acting, c, m, lam, rate, warmth, lam0, since, t, field2, pull, held_back, over
    )


def _supplied_at_start(
    acting: int, c: Any, m: np.ndarray, t: float, lam: float, speed: float, va: float
) -> tuple[float, float]:
    now = square = lam
    for i in range(WIDTH):
        one, two = of_one.supplied_at_start(
            c.acting[i], c.values[i], m[i], t, lane(lam, i), lane(speed, i), va
        )
        now, square = with_lane(now, i, one), with_lane(square, i, two)
    return now, square


@of_packs(_supplied_at_start)
def supplied_at_start(
    acting: int, c: Any, m: np.ndarray, t: float, lam: float, speed: float, va: float
) -> tuple[float, float]:
    """Return the voltage at the film when a step begins, and the voltage squared that pulls."""
    return of_one.supplied_at_start(acting, c, m, t, lam, speed, va)


def _supplied(
    acting: int,
    c: Any,
    m: np.ndarray,
    t: float,
    half: float,
    lam: float,
    speed: float,
    grown: float,
    gained: float,
    now: float,
    va: float,
    vm: float,
    vb: float,
) -> tuple[float, float]:
    middle = end = lam
    for i in range(WIDTH):
        one, two = of_one.supplied(
            c.acting[i], c.values[i], m[i], t, half, lane(lam, i), lane(speed, i),
            lane(grown, i), lane(gained, i), lane(now, i), va, vm, vb,
        )  # fmt: skip
        middle, end = with_lane(middle, i, one), with_lane(end, i, two)
    return middle, end


@of_packs(_supplied)
def supplied(
    acting: int,
    c: Any,
    m: np.ndarray,
    t: float,
    half: float,
    lam: float,
    speed: float,
    grown: float,
    gained: float,
    now: float,
    va: float,
    vm: float,
    vb: float,
) -> tuple[float, float]:
    """Return the voltage squared that pulls on the film amid and after a step of 2 ``half`` s."""
    return of_one.supplied(acting, c, m, t, half, lam, speed, grown, gained, now, va, vm, vb)


def _commit(
    acting: int,
    c: Any,
    m: np.ndarray,
    lam: float,
    rate: float,
    lam0: float,
    h: float,
    t: float,
) -> None:
    for i in range(WIDTH):
        of_one.commit(
            c.acting[i], c.values[i], m[i], lane(lam, i), lane(rate, i), lane(lam0, i), h, t
        )


@of_packs(_commit)
def commit(
    acting: int,
    c: Any,
    m: np.ndarray,
    lam: float,
    rate: float,
    lam0: float,
    h: float,
    t: float,
) -> None:
    """Carry the states of effects from the beginning of a step to its end."""
    of_one.commit(acting, c, m, lam, rate, lam0, h, t)
