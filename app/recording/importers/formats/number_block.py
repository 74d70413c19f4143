"""A block of lines of plain numbers, parsed by compiled code: each number is the nearest double.

The method is that of D. Lemire, "Number parsing at a gigabyte per second", Software: Practice and
Experience 51 (2021) 1700: the digits as a 64-bit integer, times the power of ten in 128 bits. It
computes with integers only and makes the bits of the double.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from dearig.model.compiled.jit import inlined, jit

__all__ = ["numbers_of"]

#: 64 bits without a sign, and ``Any`` for those with one: to Python both are numbers.
Word = np.uint64
#: Powers of ten of the table: a double with 19 digits needs no others, but next to 0.
LEAST, MOST = -300, 280
_SPACE, _TAB, _LINE_FEED, _QUOTE, _HASH = (np.uint8(ord(c)) for c in ' \t\n"#')
_PLUS, _MINUS, _ZERO, _NINE, _SMALL_E, _LARGE_E = (np.uint8(ord(c)) for c in "+-09eE")
_DIGITS_MAX = 19  # of a number below 2**64
_ONE = np.uint64(1)
_SIGN = np.uint64(1) << np.uint64(63)  # of a double
_BYTES = np.uint64(0x0101010101010101)
_TENS = 10 ** np.arange(9, dtype=np.uint64)


def _powers() -> tuple[np.ndarray, np.ndarray]:
    """Return the upper and lower 64 bits of the first 128 bits of 5**q, by q - ``LEAST``."""
    found = []
    for q in range(LEAST, MOST + 1):
        five = 5 ** abs(q)
        if q >= 0:
            top = five << 128
        elif q >= -27:
            top = 2 ** (five.bit_length() + 127) // five + 1  # rounded up, for ties
        else:
            top = 2 ** (2 * five.bit_length() + 128) // five + 1
        found.append(top >> (top.bit_length() - 128))
    high = np.array([value >> 64 for value in found], dtype=np.uint64)
    low = np.array([value & (2**64 - 1) for value in found], dtype=np.uint64)
    return high, low


_HIGH, _LOW = _powers()


def numbers_of(
    block: bytes, delimiter: str | None, decimal: str, places: Sequence[int], cells: int,
    room: np.ndarray,
) -> tuple[int, np.ndarray] | None:  # fmt: skip
    """Write the numbers in the cells ``places`` of each line of ``block`` to ``room``.

    ``room`` (columns, n) has a place for every line. Returns the number of rows, and which columns
    (columns,) have a decimal sign or an exponent. Lines have ``cells`` cells, between spaces where
    ``delimiter`` is None. None for a block with anything else than plain numbers.
    """
    # the bytes behind the end let eight be read from each
    raw = np.frombuffer(block + b"\n" * 9, np.uint8)
    words = np.ndarray((len(block) + 1,), np.dtype("<u8"), raw, strides=(1,))
    column_of = np.full(cells, -1, dtype=np.int64)
    column_of[list(places)] = np.arange(len(places))
    pointed = np.zeros(len(places), dtype=np.bool_)
    rows = _parse(
        raw, words, np.uint8(ord(delimiter or " ")), delimiter is None, np.uint8(ord(decimal)),
        column_of, room.view(np.uint64), pointed,
    )  # fmt: skip
    return None if rows < 0 else (rows, pointed)


@inlined
def _product(a: Word, b: Word) -> tuple[Word, Word]:
    """Return the upper and lower 64 bits of the product of two numbers of 64 bits."""
    mask, half = np.uint64(0xFFFFFFFF), np.uint64(32)
    a0, a1, b0, b1 = a & mask, a >> half, b & mask, b >> half
    low, middle, other = a0 * b0, a1 * b0, a0 * b1
    carried = (low >> half) + (middle & mask) + other
    high = a1 * b1 + (middle >> half) + (carried >> half)
    return high, (carried << half) | (low & mask)


@inlined
def _double(digits: Word, power: Any) -> Word:
    """Return the bits of the double nearest to digits * 10**power; the sign bit for none."""
    if digits == np.uint64(0):
        return np.uint64(0)
    if power < LEAST or power > MOST:
        return _SIGN
    zeros: Any = 0
    w = digits
    for step in (32, 16, 8, 4, 2, 1):
        # without a branch, which would be taken at random
        small = np.int64(w >> np.uint64(64 - step) == np.uint64(0)) * step
        w = w << np.uint64(small)
        zeros += small
    upper, lower = _product(w, _HIGH[power - LEAST])
    mask = np.uint64(0x1FF)
    if upper & mask == mask:
        more, _ = _product(w, _LOW[power - LEAST])
        lower = lower + more
        if lower < more:
            upper = upper + _ONE
    top = upper >> np.uint64(63)
    shift = top + np.uint64(9)
    mantissa = upper >> shift
    exponent = ((217706 * power) >> 16) + 63 + np.int64(top) - zeros + 1023
    if exponent <= 0 or exponent >= 2046:
        return _SIGN
    tie = lower <= _ONE and -4 <= power <= 23 and mantissa & np.uint64(3) == _ONE
    if tie and mantissa << shift == upper:
        mantissa = mantissa - _ONE  # to the even one
    mantissa = (mantissa + (mantissa & _ONE)) >> _ONE
    if mantissa >> np.uint64(53):
        mantissa = mantissa >> _ONE
        exponent += 1
    return (np.uint64(exponent) << np.uint64(52)) | (mantissa & ((_ONE << np.uint64(52)) - _ONE))


@inlined
def _digits(words: np.ndarray, at: Any, digits: Word) -> tuple[Word, Any]:
    """Return ``digits`` with those from ``at`` on behind them, and where these end.

    Eight are read at once, without a branch for each. Too many overflow.
    """
    while True:
        word = words[at] ^ np.uint64(0x3030303030303030)
        # what is no digit sets a bit in the upper half of its byte; the first one counts
        others = ((word + np.uint64(0x0606060606060606)) | word) & np.uint64(0xF0F0F0F0F0F0F0F0)
        before = (others & (~others + _ONE)) - _ONE
        count = ((before & np.uint64(0x8080808080808080)) >> np.uint64(7)) * _BYTES >> np.uint64(56)
        if count == np.uint64(0):
            return digits, at
        word = word << (np.uint64(64) - (count << np.uint64(3)))
        word = (word * np.uint64(2561)) >> np.uint64(8)
        word = (word & np.uint64(0x00FF00FF00FF00FF)) * np.uint64(6553601) >> np.uint64(16)
        word = (word & np.uint64(0x0000FFFF0000FFFF)) * np.uint64(42949672960001) >> np.uint64(32)
        digits = digits * _TENS[count] + word
        at += np.int64(count)
        if count < np.uint64(8):
            return digits, at


@inlined
def _number(
    block: np.ndarray, words: np.ndarray, at: Any, decimal: np.uint8, column: int, row: int,
    bits: np.ndarray, pointed: np.ndarray,
) -> Any:  # fmt: skip
    """Write the bits of the number at ``at``; return its end, or -1 for what is no plain number."""
    negative = block[at] == _MINUS
    if negative or block[at] == _PLUS:
        at += 1
    digits, end = _digits(words, at, np.uint64(0))
    seen, power = end - at, 0
    if block[end] == decimal:
        pointed[column] = True
        whole = end + 1
        digits, end = _digits(words, whole, digits)
        power = whole - end
        seen -= power
    if seen == 0:
        return -1
    if seen > _DIGITS_MAX:
        # only zeros in front take no place in the digits
        while at < end and (block[at] == _ZERO or block[at] == decimal):
            seen -= block[at] == _ZERO
            at += 1
        if seen > _DIGITS_MAX:
            return -1
    if block[end] == _SMALL_E or block[end] == _LARGE_E:
        pointed[column] = True
        power, end = _exponent(block, end + 1, power)
    if end < 0:
        return -1
    found = _double(digits, power)
    if found == _SIGN:
        return -1
    bits[column, row] = found | _SIGN if negative else found
    return end


@inlined
def _exponent(block: np.ndarray, at: int, power: int) -> tuple[int, int]:
    """Return ``power`` with the exponent at ``at``, and where that ends; -1 for none."""
    down = block[at] == _MINUS
    if down or block[at] == _PLUS:
        at += 1
    exponent: Any = 0
    first = at
    while at < first + 5 and _ZERO <= block[at] <= _NINE:
        exponent = 10 * exponent + np.int64(block[at] - _ZERO)
        at += 1
    return power - exponent if down else power + exponent, at if at > first else -1


@jit
def _parse(
    block: np.ndarray, words: np.ndarray, delimiter: np.uint8, spaced: bool, decimal: np.uint8,
    column_of: np.ndarray, bits: np.ndarray, pointed: np.ndarray,
) -> int:  # fmt: skip
    """Write the bits of the numbers to ``bits`` (columns, rows); return the rows, or -1."""
    size, rows, at, last = words.size - 1, 0, 0, column_of.size - 1
    while at < size:
        if block[at] == _LINE_FEED:
            at += 1
            continue
        for cell in range(last + 1):
            while at < size and _is_blank(block[at], delimiter, spaced):
                at += 1
            first, column = at, column_of[cell]
            if column < 0:
                while at < size and not _ends_cell(block[at], delimiter, spaced):
                    if block[at] == _QUOTE or block[at] == _HASH:
                        return -1
                    at += 1
            else:
                at = _number(block, words, at, decimal, column, rows, bits, pointed)
                if at < 0:
                    return -1
            after = at
            while at < size and _is_blank(block[at], delimiter, spaced):
                at += 1
            if cell == last:
                if after == first or (at < size and block[at] != _LINE_FEED):
                    return -1
                at += 1
            elif spaced:
                if after == first or at == after:
                    return -1
            elif at >= size or block[at] != delimiter:
                return -1
            else:
                at += 1
        rows += 1
    return rows


@inlined
def _is_blank(byte: np.uint8, delimiter: np.uint8, spaced: bool) -> bool:
    return byte in (_SPACE, _TAB) and (spaced or byte != delimiter)


@inlined
def _ends_cell(byte: np.uint8, delimiter: np.uint8, spaced: bool) -> bool:
    return byte in (_LINE_FEED, delimiter) or (spaced and byte == _TAB)
