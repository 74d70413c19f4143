"""Fonts, colours and lines of all figures."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

__all__ = ["Print", "for_print", "print_size", "style", "text_size"]

_STYLE = MappingProxyType(
    {
        "axes.axisbelow": True,
        "axes.edgecolor": "#404040",
        "axes.grid": True,
        "axes.labelcolor": "#111111",
        "axes.labelsize": 9.5,
        "axes.linewidth": 0.7,
        "axes.spines.right": False,
        "axes.spines.top": False,
        "axes.titlesize": 9.5,
        "axes.unicode_minus": True,
        "figure.facecolor": "white",
        "font.family": "sans-serif",
        "font.sans-serif": ["DejaVu Sans"],  # comes with matplotlib
        "font.size": 9.5,
        "grid.color": "#E3E6EA",
        "grid.linewidth": 0.6,
        "legend.borderaxespad": 0.2,
        "legend.columnspacing": 1.4,
        "legend.fontsize": 9.0,
        "legend.frameon": False,
        "legend.handlelength": 1.7,
        "lines.solid_capstyle": "round",
        "path.simplify": True,
        "savefig.facecolor": "white",
        "svg.fonttype": "none",
        "svg.hashsalt": "dearig",
        "text.color": "#111111",
        "text.parse_math": False,  # file names may contain a dollar sign
        "xtick.color": "#404040",
        "xtick.labelcolor": "#111111",
        "xtick.labelsize": 9.0,
        "ytick.color": "#404040",
        "ytick.labelcolor": "#111111",
        "ytick.labelsize": 9.0,
    }
)


#: Widths in inches of figures over 1 and 2 columns: 89 mm and 183 mm, as Nature asks for; IEEE's
#: and Elsevier's columns differ from them by less than 4 %.
_WIDTHS = MappingProxyType({1: 89.0 / 25.4, 2: 183.0 / 25.4})
#: Sizes of text in points: most journals ask for 6 to 8 in the printed figure.
_TEXT, _SMALL = 8.0, 7.0
_PRINT_STYLE = MappingProxyType(
    {
        "axes.labelsize": _TEXT,
        "axes.titlesize": _TEXT,
        "font.size": _TEXT,
        "legend.columnspacing": 1.0,
        "legend.fontsize": _SMALL,
        "legend.handlelength": 1.4,
        "pdf.fonttype": 42,  # TrueType: journals refuse Type 3, and the text can be edited
        "savefig.dpi": 600,  # lines, as most journals ask for
        "xtick.labelsize": _SMALL,
        "ytick.labelsize": _SMALL,
    }
)


@dataclass(frozen=True)
class Print:
    """Figures for print: ``width`` in inches, and the ``scale`` of text and heights."""

    width: float
    scale: float


_PRINT: ContextVar[Print | None] = ContextVar("print", default=None)


def print_size() -> Print | None:
    """Return the size of figures for print, None where they are for a page or a screen."""
    return _PRINT.get()


def text_size(points: float) -> float:
    """Return the size of a text that has ``points`` on a page, in print by its smaller scale."""
    size = print_size()
    return points if size is None else max(points * size.scale, _SMALL)


@contextmanager
def for_print(columns: int) -> Iterator[None]:
    """Draw all figures as wide as 1 or 2 ``columns`` of a journal, with its sizes of text."""
    token = _PRINT.set(Print(_WIDTHS[columns], _TEXT / float(str(_STYLE["font.size"]))))
    try:
        yield
    finally:
        _PRINT.reset(token)


@contextmanager
def style() -> Iterator[None]:
    """Use the fonts, colours and lines of all figures while one is drawn or saved."""
    from matplotlib import rc_context

    # matplotlib types its keys only in some versions
    settings: Any = {**_STYLE, **(_PRINT_STYLE if print_size() else {})}
    with rc_context(settings):
        yield
