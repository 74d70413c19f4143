"""Data of a figure as CSV: the points of its curves and the lengths of its bars, as drawn."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from itertools import zip_longest
from typing import TYPE_CHECKING
from urllib.parse import quote

import numpy as np

from dearig.printable import no_formula, printable

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.collections import Collection
    from matplotlib.figure import Figure

__all__ = ["Column", "csv_url", "figure_columns", "to_csv"]

#: Name and values (texts or numbers) of a column.
Column = tuple[str, Sequence[object]]

#: Digits of numbers: more than a figure shows, and a time of days to the millisecond.
_NUMBER = "%.9g"


def figure_columns(figure: Figure) -> tuple[Column, ...]:
    """Return the curves, bars and named bands of ``figure``, two columns for each.

    A column is named by the label of its axis, and by the name of its curve. Curves with the same
    first column share it. Long curves have the points that are drawn: the lowest and the highest
    sample of each of the columns of the figure.
    """
    found: list[Column] = []
    for ax in figure.axes:
        before: np.ndarray | None = None
        for name, x, y in _curves(ax):
            across, along = _named(_x_label(ax), ""), _named(_y_label(ax), name)
            if before is None or not np.array_equal(before, x, equal_nan=True):
                found.append((across, x.tolist()))
            found.append((along, y.tolist()))
            before = x
        found += _bars(ax)
    return tuple(found)


def to_csv(columns: Iterable[Column]) -> str:
    """Return ``columns`` as CSV; shorter ones end in empty cells.

    Text that a spreadsheet would take for a formula is marked as text.
    """
    columns = tuple(columns)
    rows = zip_longest(*(values for _, values in columns), fillvalue=math.nan)
    lines = [[name for name, _ in columns], *rows]
    return "".join(",".join(map(_cell, line)) + "\r\n" for line in lines)


def csv_url(text: str) -> str:
    """Return the CSV file ``text`` as an address that holds it: a link to it needs no other file.

    The file begins with a byte order mark, by which spreadsheets know its encoding.
    """
    # line by line: one that has numbers only is taken as it is, and not byte by byte
    lines = (quote(line, safe=",.-+:()/") for line in f"\N{BYTE ORDER MARK}{text}".split("\r\n"))
    return "data:text/csv;charset=utf-8," + "%0D%0A".join(lines)


def _cell(value: object) -> str:
    if isinstance(value, float | int):
        return "" if math.isnan(value) else _NUMBER % value
    # all text is in quotes: a semicolon in it divides cells where the comma is the decimal sign
    text = no_formula(printable(str(value))).replace('"', '""')
    return f'"{text}"'


def _curves(ax: Axes) -> Iterator[tuple[str, np.ndarray, np.ndarray]]:
    """Yield the name, ``x`` and ``y`` of each curve; a line across the axes has one value."""
    for line in ax.get_lines():
        name = _public(line.get_label())
        x, y = (np.asarray(v, dtype=np.float64) for v in line.get_data(orig=False))
        if line.get_transform() == ax.transData:
            yield name, x, y
        elif name and y.size and y[0] == y[-1] and line.get_transform() == ax.get_yaxis_transform():
            yield name, np.full(1, np.nan), y[:1]
        elif name and x.size and x[0] == x[-1]:
            yield name, x[:1], np.full(1, np.nan)
    for band in ax.collections:
        if name := _public(band.get_label()):
            yield from _outline(name, band)


def _outline(name: str, band: Collection) -> Iterator[tuple[str, np.ndarray, np.ndarray]]:
    for path in band.get_paths():
        points = np.asarray(path.vertices, dtype=np.float64)
        yield f"outline of {name}", points[:, 0], points[:, 1]


def _bars(ax: Axes) -> Iterator[Column]:
    """Yield two columns for each group of bars: their places or names, and their lengths."""
    from matplotlib.container import BarContainer

    for group in ax.containers:
        if not isinstance(group, BarContainer):
            continue
        bars = group.patches
        name = _public(group.get_label())
        if group.orientation == "horizontal":
            yield "", _names_at(ax, [bar.get_y() + bar.get_height() / 2.0 for bar in bars])
            yield _named(_x_label(ax), name), [bar.get_width() for bar in bars]
        else:
            yield _named(_x_label(ax), "from"), [bar.get_x() for bar in bars]
            yield _named(_x_label(ax), "to"), [bar.get_x() + bar.get_width() for bar in bars]
            yield _named(_y_label(ax), name), [bar.get_height() for bar in bars]


def _names_at(ax: Axes, places: Sequence[float]) -> list[str]:
    """Return the label of the tick of the y axis that is nearest to each of ``places``."""
    ticks = [float(tick) for tick in ax.get_yticks()]
    names = [label.get_text() for label in ax.get_yticklabels()]
    nearest = [min(range(len(ticks)), key=lambda i: abs(ticks[i] - place)) for place in places]
    return [names[i] for i in nearest]


def _public(label: object) -> str:
    """Return the name of a curve; "" for one that matplotlib has named."""
    text = str(label)
    return "" if text.startswith("_") else text


def _named(label: str, name: str) -> str:
    text = " ".join(label.split())
    return f"{text}: {name}" if name and text else name or text


def _x_label(ax: Axes) -> str:
    """Return the label of the x axis, which one of several axes with the same x has."""
    shared = ax.get_shared_x_axes().get_siblings(ax)
    return next((other.get_xlabel() for other in (ax, *shared) if other.get_xlabel()), "x")


def _y_label(ax: Axes) -> str:
    return " ".join(part for part in (ax.get_ylabel(), _title(ax)) if part) or "y"


def _title(ax: Axes) -> str:
    title = ax.get_title(loc="left")
    return f"({title})" if title else ""
