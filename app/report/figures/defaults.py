"""Fonts, colours and lines of all figures."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from types import MappingProxyType
from typing import Any

__all__ = ["style"]

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


@contextmanager
def style() -> Iterator[None]:
    """Use the fonts, colours and lines of all figures while one is drawn or saved."""
    from matplotlib import rc_context

    settings: Any = dict(_STYLE)  # matplotlib types its keys only in some versions
    with rc_context(settings):
        yield
