"""Figures that a notebook shows when a cell ends with one."""

from __future__ import annotations

import io

from matplotlib.figure import Figure

from dearig.report.figures.defaults import style

__all__ = ["NotebookFigure"]

_DPI = 192  # two pixels of the picture for each of the page's: sharp on fine screens
_PAGE_DPI = 96


class NotebookFigure(Figure):
    """A figure with a picture of its own: Matplotlib has one only for those made by pyplot."""

    def _repr_png_(self) -> tuple[bytes, dict[str, int]]:
        picture = io.BytesIO()
        with style():
            self.savefig(picture, format="png", dpi=_DPI)
        width, height = self.get_size_inches()
        size = {"width": round(width * _PAGE_DPI), "height": round(height * _PAGE_DPI)}
        return picture.getvalue(), size
