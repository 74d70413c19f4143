"""Pictures and data of plots: PNG, SVG and CSV."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Sequence
from datetime import UTC, datetime

import numpy as np
from PySide6.QtCore import QBuffer, QMimeData, QRectF
from PySide6.QtGui import QColor, QImage, QPainter
from PySide6.QtSvg import QSvgGenerator

from dearig.printable import no_formula
from dearig.window.plots.canvas import Canvas
from dearig.window.plots.plot import AxisText, Plot

__all__ = ["clipboard_data", "csv_text", "image", "png_bytes", "svg"]

_FONT = re.compile(rb'font-family="([^"]*)"')
_SHARP = 2  # pixels of a saved picture for each pixel of the screen


def image(canvas: Canvas, background: str) -> QImage:
    """Return a picture of all plots on ``background``, in twice the resolution of the screen."""
    area = QRectF(canvas.viewport().rect())
    made = QImage(area.size().toSize() * _SHARP, QImage.Format.Format_RGB32)
    made.setDevicePixelRatio(_SHARP)
    made.fill(QColor(background))
    painter = QPainter(made)
    painter.setRenderHint(QPainter.RenderHint.TextAntialiasing)
    canvas.scene().render(painter, area, area)
    painter.end()
    return made


def png_bytes(picture: QImage) -> bytes:
    """Return ``picture`` as PNG."""
    buffer = QBuffer()
    buffer.open(QBuffer.OpenModeFlag.WriteOnly)
    picture.save(buffer, "PNG")  # type: ignore[call-overload]
    return bytes(buffer.data().data())


def svg(canvas: Canvas, background: str) -> bytes:
    """Return the plots as a drawing in SVG on ``background``.

    Curves are cut at the edges of their plots, because Qt writes clip paths that other programs
    read differently, or none. pyqtgraph's own writer fails on some of Qt's output.
    """
    area = QRectF(canvas.viewport().rect())
    buffer = QBuffer()
    buffer.open(QBuffer.OpenModeFlag.WriteOnly)
    generator = QSvgGenerator()
    generator.setOutputDevice(buffer)
    generator.setSize(area.size().toSize())
    generator.setViewBox(area)
    generator.setResolution(canvas.logicalDpiX())
    generator.setTitle(canvas.accessibleName())
    curves = [curve for plot in canvas.area_plots for curve in plot.drawn]
    for curve in curves:
        curve.cut_at_edges(cut=True)
    painter = QPainter(generator)
    painter.fillRect(area, QColor(background))
    canvas.scene().render(painter, area, area)
    painter.end()
    for curve in curves:
        curve.cut_at_edges(cut=False)
    # a computer that does not have the font takes another one without serifs
    return _FONT.sub(rb'font-family="\1, sans-serif"', bytes(buffer.data().data()))


def clipboard_data(canvas: Canvas, background: str) -> QMimeData:
    """Return the plots as a picture and as SVG: programs take the kind that they know."""
    data = QMimeData()
    data.setImageData(image(canvas, background))
    data.setData("image/svg+xml", svg(canvas, background))
    return data


def csv_text(plots: Sequence[Plot], visible: bool, delimiter: str = ",") -> str:
    """Return the points of the curves in ``plots``, which share their horizontal axis, as CSV.

    The first row names the columns with their units. Numbers have all their digits. Curves with
    increasing x share one column of x, with empty cells where a curve has no point; others have a
    column of x each. Dates are local time in ISO 8601. ``visible``: only points in the range of x
    that is shown.
    """
    columns: list[tuple[str, np.ndarray, np.ndarray]] = []
    for plot in plots:
        for curve in plot.drawn:
            x, y = curve.points
            if not curve.title or not x.size:
                continue
            if visible:
                first, last = plot.vb.viewRange()[0]
                if plot.log[0]:
                    first, last = 10.0**first, 10.0**last
                inside = (x >= first) & (x <= last)
                x, y = x[inside], y[inside]
            columns.append((_heading(plot.axis_texts["left"], curve.title), x, y))
    if not columns:
        return ""
    head_x = str(plots[0].axis_texts["bottom"])
    if all((np.diff(x) > 0.0).all() for _, x, _ in columns):
        table = _joined(head_x, columns)
    else:
        table = [part for name, x, y in columns for part in ((head_x, x), (name, y))]
    dates = plots[0].dates
    text = io.StringIO()
    writer = csv.writer(text, delimiter=delimiter, lineterminator="\n")
    writer.writerow(no_formula(name) for name, _ in table)
    for row in range(max(values.size for _, values in table)):
        writer.writerow(_cell(values, row, dates and name == head_x) for name, values in table)
    return text.getvalue()


def _heading(axis: AxisText, name: str) -> str:
    return str(AxisText(f"{axis.name}, {name}", axis.unit))


def _joined(
    head_x: str, columns: list[tuple[str, np.ndarray, np.ndarray]]
) -> list[tuple[str, np.ndarray]]:
    """Return one column of x and one for each curve, NaN where it has no point."""
    all_x = np.unique(np.concatenate([x for _, x, _ in columns]))
    table = [(head_x, all_x)]
    for name, x, y in columns:
        values = np.full(all_x.size, np.nan)
        values[np.searchsorted(all_x, x)] = y
        table.append((name, values))
    return table


def _cell(values: np.ndarray, row: int, date: bool) -> str:
    if row >= values.size or np.isnan(values[row]):
        return ""
    if date:
        return datetime.fromtimestamp(float(values[row]), UTC).astimezone().isoformat()
    return repr(float(values[row]))
