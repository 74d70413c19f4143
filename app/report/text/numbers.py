"""Format of numbers: as many digits as the data support."""

from __future__ import annotations

import math
import re

from dearig.formulas import ASCII

__all__ = [
    "NO_VALUE",
    "interval",
    "interval_ends",
    "power_of_ten",
    "quoted",
    "seconds",
    "significant",
    "symbol",
    "to_ascii",
    "with_symbols",
]

#: Text in place of a missing number.
NO_VALUE = "\N{EN DASH}"

_TIMES = "\N{MULTIPLICATION SIGN}"
_RAISED = (
    "\N{SUPERSCRIPT MINUS}\N{SUPERSCRIPT ZERO}\N{SUPERSCRIPT ONE}\N{SUPERSCRIPT TWO}"
    "\N{SUPERSCRIPT THREE}\N{SUPERSCRIPT FOUR}\N{SUPERSCRIPT FIVE}\N{SUPERSCRIPT SIX}"
    "\N{SUPERSCRIPT SEVEN}\N{SUPERSCRIPT EIGHT}\N{SUPERSCRIPT NINE}"
)
_LOWERED = "".join(chr(ord("\N{SUBSCRIPT ZERO}") + i) for i in range(10))
_SUPERSCRIPT = str.maketrans("-0123456789", _RAISED)
_SUBSCRIPT = str.maketrans("0123456789", _LOWERED)
_PLAIN = str.maketrans(
    {
        **ASCII,
        "\N{MICRO SIGN}": "u",
        "\N{GREEK SMALL LETTER MU}": "mu",
        _TIMES: "x",
        NO_VALUE: "-",
        "\N{INFINITY}": "inf",
        "\N{HORIZONTAL ELLIPSIS}": "...",
        "\N{NO-BREAK SPACE}": " ",
        "\N{PLUS-MINUS SIGN}": "+-",
    }
)
_NAMED = re.compile(r"(mu|alpha|beta|share|c2|c3|J|T)_(\d+)")
# not a key such as mu_1_kPa, and not a part of a file's name
_NAME_IN_TEXT = re.compile(r"(?<![\w./-])(mu|alpha|beta|J|T)_(\d+)(?![\w-]|\.\w)")
_DIGITS_MAX = 12  # significant digits of a value: a fit in double precision supports no more
_PLAIN_FROM, _PLAIN_TO = 1e-4, 1e6  # numbers outside are written with a power of ten
_WIDE = 5.0  # ratio of its ends above which an interval gives no digits


def power_of_ten(exponent: int) -> str:
    """Return 10 with a raised ``exponent``, without markup."""
    return "10" + str(exponent).translate(_SUPERSCRIPT)


def _fixed(value: float, decimals: int) -> str:
    """Round ``value`` to ``decimals``; negative ones mean tens, hundreds, ..."""
    text = f"{round(value, decimals):.{max(decimals, 0)}f}"
    return text.removeprefix("-") if float(text) == 0.0 else text


def significant(value: float, digits: int = 3) -> str:
    """Return ``value`` with ``digits`` significant digits; extreme values as powers of ten."""
    if math.isnan(value):
        return NO_VALUE
    if math.isinf(value):
        return "\N{INFINITY}" if value > 0.0 else "-\N{INFINITY}"
    if value == 0.0:
        return "0"
    mantissa, _, power = f"{value:.{digits - 1}e}".partition("e")
    exponent = int(power)
    if -4 < exponent < 6:
        return _fixed(float(f"{mantissa}e{power}"), digits - 1 - exponent)
    return f"{mantissa} {_TIMES} {power_of_ten(exponent)}"


def _decimals(value: float, width: float) -> int:
    """Return the decimals that show two digits of an uncertainty ``width`` of ``value``."""
    decimals = 1 - math.floor(math.log10(width))
    if value != 0.0:
        decimals = min(decimals, _DIGITS_MAX - 1 - math.floor(math.log10(abs(value))))
    return decimals


def _rounded(value: float, decimals: int, scale: float) -> str:
    """Round ``value`` to ``decimals``, as a power of ten where ``scale`` is far from 1."""
    if _PLAIN_FROM < abs(scale) < _PLAIN_TO:
        return _fixed(value, decimals)
    exponent = math.floor(math.log10(abs(scale)))
    mantissa = _fixed(value / 10.0**exponent, max(decimals + exponent, 0))
    return f"{mantissa} {_TIMES} {power_of_ten(exponent)}"


def _tolerance(low: float, high: float) -> float | None:
    """Return half the width of an interval; None if it is open, wide, or a point."""
    if not (math.isfinite(low) and math.isfinite(high)) or high <= low:
        return None
    if low <= 0.0 <= high or (low > 0.0 and high / low > _WIDE):
        return None
    return 0.5 * (high - low)


def quoted(value: float, low: float, high: float) -> str:
    """Return ``value`` with the digits that its 95 % interval ``low`` .. ``high`` supports."""
    width = _tolerance(low, high)
    if width is None or not math.isfinite(value) or value == 0.0:
        return significant(value, 5 if low == high else 2)
    return _rounded(value, _decimals(value, width), value)


def interval_ends(low: float, high: float) -> tuple[str, str]:
    """Return both ends of an interval with the digits that it supports."""
    width = _tolerance(low, high)
    if width is None:
        digits = 5 if low == high else 2
        return significant(low, digits), significant(high, digits)
    scale = max(abs(low), abs(high))
    decimals = _decimals(scale, width)
    return _rounded(low, decimals, scale), _rounded(high, decimals, scale)


def interval(low: float, high: float) -> str:
    """Return an interval in words; an end that is 0 or infinite is open."""
    if low == 0.0 and math.isinf(high):
        return "open"
    if math.isinf(high):
        return f"above {significant(low, 2)}"
    if low == 0.0:
        return f"below {significant(high, 2)}"
    return " to ".join(interval_ends(low, high))


def seconds(duration: float) -> str:
    """Return a duration in s, or in min or h if it is long."""
    if duration < 120.0:
        return f"{significant(duration)} s"
    if duration < 7200.0:
        return f"{significant(duration / 60.0)} min"
    return f"{significant(duration / 3600.0)} h"


def symbol(name: str) -> str:
    """Return the symbol of a parameter, or of a sum: mu_0 becomes a letter with a subscript."""
    if "+ " in name:  # of a sum, with those in brackets that belong to it in other fits
        return _NAMED.sub(_symbol, name)
    match = _NAMED.fullmatch(name)
    return name if match is None else _symbol(match)


def with_symbols(text: str) -> str:
    """Return a ``text`` in which names of parameters are their symbols, as tables have them."""
    return _NAME_IN_TEXT.sub(_symbol, text)


def _symbol(match: re.Match[str]) -> str:
    letter = "\N{GREEK SMALL LETTER MU}" if match[1] == "mu" else match[1]
    return letter + match[2].translate(_SUBSCRIPT)


def to_ascii(text: str) -> str:
    """Return ``text`` in ASCII, with ``um`` and ``mu_0`` for symbols and escapes for the rest."""
    for shape, sign in ((_RAISED, "^"), (_LOWERED, "_")):
        back = str.maketrans(shape, "-0123456789"[-len(shape) :])
        text = re.sub(f"[{shape}]+", lambda m, s=sign, b=back: s + m[0].translate(b), text)  # type: ignore[misc]
    return text.translate(_PLAIN).encode("ascii", "backslashreplace").decode("ascii")
