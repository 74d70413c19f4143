"""Style, axes and legends that all figures of a report share."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from dearig.analysis.decimate import decimate
from dearig.report.figures.defaults import print_size
from dearig.report.text.numbers import power_of_ten

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure

__all__ = [
    "BAND",
    "COLUMNS",
    "DRIVE",
    "ERROR",
    "MARK",
    "MEASURED",
    "MODEL",
    "NOISE",
    "THESIS",
    "UNSURE",
    "WIDTH",
    "blank",
    "decimated_log",
    "drawable",
    "envelope",
    "few_ticks",
    "legend",
    "log_axis",
    "log_ticks",
    "shade",
]


#: Colours of Okabe and Ito: distinct for every kind of colour vision, and in grey.
MEASURED = "#0072B2"
MODEL = "#D55E00"
ERROR = "#667085"
MARK = "#1A1A1A"
DRIVE = "#4D4D4D"
NOISE = "#C9CED6"
BAND = "#F6D9C3"  # of a prediction: the colour of the model, pale
THESIS = "#009E73"
UNSURE = "#8A8A8A"

#: Width of a figure in inches; on a phone it shrinks to three quarters and stays legible.
WIDTH = 4.8
#: Columns along a time axis; a phone or a sheet of paper shows no more.
COLUMNS = 600


def blank(width: float, height: float) -> Figure:
    """Make an empty figure of ``width`` and ``height`` in inches, or as wide as in print."""
    from dearig.report.figures.notebook_figure import NotebookFigure

    if (size := print_size()) is not None:
        width, height = size.width, size.scale * height
    return NotebookFigure(figsize=(width, height), layout="constrained")


def legend(ax: Axes, columns: int = 2) -> None:
    """Put a legend above the axes, clear of the curves."""
    ax.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=columns)


def few_ticks(ax: Axes, x: int | None = None, y: int | None = None) -> None:
    """Set at most about ``x`` and ``y`` ticks."""
    from matplotlib.ticker import MaxNLocator

    if x is not None:
        ax.xaxis.set_major_locator(MaxNLocator(x))
    if y is not None:
        ax.yaxis.set_major_locator(MaxNLocator(y, min_n_ticks=3))


def log_axis(ax: Axes, which: str, low: float, high: float) -> None:
    """Make an axis logarithmic from ``low`` to ``high`` > 0, with two to about six labels."""
    from matplotlib.ticker import LogLocator, NullFormatter

    low, high = float(low), max(float(high), 1.1 * float(low))
    axis = ax.xaxis if which == "x" else ax.yaxis
    (ax.set_xscale if which == "x" else ax.set_yscale)("log")
    (ax.set_xlim if which == "x" else ax.set_ylim)(low, high)
    decades = math.floor(math.log10(high)) - math.ceil(math.log10(low)) + 1
    axis.set_major_locator(LogLocator(subs=(1.0,) if decades > 1 else (1.0, 2.0, 5.0), numticks=6))
    axis.set_minor_locator(LogLocator(subs=range(2, 10), numticks=12))
    axis.set_minor_formatter(NullFormatter())
    log_ticks(axis)


def log_ticks(axis: Axis) -> None:
    """Label an axis with 0.1, 1, 10 if its range allows, otherwise with powers of ten."""
    from matplotlib.ticker import FuncFormatter

    def label(value: float, _: int | None) -> str:
        low, high = axis.get_view_interval()
        if value == 0.0 or (abs(high) < 3e4 and (low <= 0.0 or low > 3e-4)):
            return f"{value:g}"
        exponent = math.floor(math.log10(abs(value)) + 1e-9)
        mantissa = value / 10.0**exponent
        power = power_of_ten(exponent)
        return power if abs(mantissa - 1.0) < 1e-6 else f"{mantissa:.3g}\N{MIDDLE DOT}{power}"

    axis.set_major_formatter(FuncFormatter(label))


def decimated_log(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Decimate a curve for a logarithmic axis of ``x`` (N,) > 0."""
    log_x, kept = decimate(np.log(x), y, COLUMNS // 2)
    return np.exp(log_x), kept


def envelope(
    x: np.ndarray, low: np.ndarray, high: np.ndarray, columns: int = COLUMNS
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return a band from ``low`` to ``high`` (N,) over ``x`` in at most ``columns`` columns.

    Each has the lowest and the highest end of its samples. NaN is not a sample.
    """
    starts = np.unique(np.linspace(0, x.size, columns, endpoint=False).astype(int))
    return x[starts], np.fmin.reduceat(low, starts), np.fmax.reduceat(high, starts)


def shade(ax: Axes, x: np.ndarray, low: np.ndarray, high: np.ndarray, label: str = "") -> None:
    """Shade the 95 % band from ``low`` to ``high`` (N,) of a prediction behind the curves."""
    ax.fill_between(
        *envelope(x, low, high), step="post", color=BAND, linewidth=0, zorder=0.4,
        label=label or None,
    )  # fmt: skip


def drawable(text: str, longest: int) -> str:
    """Return ``text`` with characters of the font only, and at most ``longest`` characters.

    The page around the figure shows the full name, in any script.
    """
    kept = "".join(
        c if c.isprintable() and (ord(c) < 0x530 or 0x2000 <= ord(c) < 0x2100) else "?"
        for c in text
    )
    if len(kept) <= longest:
        return kept
    half = (longest - 1) // 2
    return f"{kept[:half]}\N{HORIZONTAL ELLIPSIS}{kept[len(kept) - (longest - 1 - half) :]}"
