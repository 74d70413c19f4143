"""Packs of numbers: the arithmetic of four films at once is that of each of them."""

import numpy as np
import pytest

from dearig.model.compiled.jit import jit
from dearig.model.compiled.packs import WIDTH, first, lane, of_packs, rows, spread, with_lane


@jit
def _formula(p: float, q: float, share: float) -> float:
    d = p - q
    d -= share * 0.5
    d += 1.0
    return (2.0 * d) * (p + q) / (p * q - share * d * d) + spread(3, d)


@jit
def _each(held: np.ndarray) -> None:
    packs = rows(held)
    packs[len(packs) - 1] = _formula(packs[0], packs[1], 0.25)


def test_a_formula_of_packs_is_the_formula_of_each_film():
    held = np.random.default_rng(0).uniform(1.0, 2.0, (3, WIDTH))
    each = [_formula(p, q, 0.25) for p, q in held[:2].T]
    _each(held)
    np.testing.assert_allclose(held[2], each, rtol=1e-14)


@jit
def _turned(held: np.ndarray) -> float:
    packs = rows(held)
    pack = packs[0]
    for i in range(WIDTH):
        packs[1] = with_lane(packs[1], i, lane(pack, WIDTH - 1 - i))
    return first(pack)


def test_numbers_of_single_films_are_taken_out_and_put_in():
    held = np.arange(2.0 * WIDTH).reshape(2, WIDTH)
    assert _turned(held) == 0.0
    np.testing.assert_array_equal(held[1], held[0, ::-1])


def _doubled_in_pack(number: float) -> float:
    return number + number


@of_packs(_doubled_in_pack)
def doubled(number: float) -> float:
    """Return a number of one film as it is, and those of a pack doubled."""
    return number


@jit
def _both(held: np.ndarray) -> float:
    packs = rows(held)
    packs[0] = doubled(packs[0])
    return doubled(held[1, 0])


def test_packs_get_their_own_function():
    held = np.ones((2, WIDTH))
    assert _both(held) == 1.0
    np.testing.assert_array_equal(held[0], np.full(WIDTH, 2.0))
    assert (doubled(3.0), first(3.0), spread(3.0, 1.0)) == (3.0, 3.0, 3.0)


def test_what_is_no_number_cannot_be_added_to_a_pack():
    @jit
    def wrong(held: np.ndarray) -> None:
        packs = rows(held)
        packs[0] = packs[0] + "1"

    with pytest.raises(Exception, match="Failed in nopython mode"):
        wrong(np.ones((1, WIDTH)))
