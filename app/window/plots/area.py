"""Plots with their tools: every plot of the window is in a ``PlotArea``.

The tools are the same everywhere: crosshair and cursors, zoom, auto range, pictures and data. The
operator finds them in the bar above the plots and in their context menu, with words and keys.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from PySide6.QtCore import QPoint, QPointF, QTimer, Signal, Slot
from PySide6.QtGui import QGuiApplication, QImage, QShowEvent
from PySide6.QtWidgets import QVBoxLayout, QWidget

from dearig.recording.files import system_text
from dearig.window.documents.dialogs import save_as
from dearig.window.kit.turns import Turns
from dearig.window.plots import export as plot_export
from dearig.window.plots.canvas import GAP, Canvas, Drag
from dearig.window.plots.cursors import CursorGroup
from dearig.window.plots.plot import Plot
from dearig.window.plots.tools import PlotTools
from dearig.window.session.state import Session

__all__ = ["PlotArea"]

_READOUT = 100  # ms between two readouts of a curve that changes: faster ones cannot be read
_STEP = 0.25  # of the visible range, moved by an arrow key
_ZOOM_KEY = 0.8  # of the range, for one press
_HISTORY_MAX = 50
_PADDING = 0.02  # of the range, next to curves that are not over time


@dataclass(frozen=True)
class _View:
    """Ranges of a plot."""

    x: tuple[float, float]
    y: tuple[float, float]
    auto_y: bool


@dataclass(frozen=True)
class _Past:
    """What was visible before a change: ``how`` it was made, and whether the run was followed."""

    how: str
    following: bool
    views: dict[Plot, _View]


class PlotArea(QWidget):
    """Bar of tools above plots in rows and columns.

    Plots with the same name of ``group`` share their horizontal axis, crosshair and cursors. A
    ``live`` area follows a run: its owner calls ``roll`` with the span of time that is to be
    visible. When the operator moves or zooms the time axis, the area stops following, ``roll`` has
    no effect, and the button *Follow the run* appears; the owner draws what ``span`` says.
    """

    view_changed = Signal()  #: the operator has changed a range

    def __init__(
        self, session: Session, name: str, live: bool = False, parent: QWidget | None = None
    ) -> None:
        super().__init__(parent)
        self._session = session
        self._live = live
        self.file_stem = name  #: proposed name of saved files, without an ending
        self.canvas = Canvas()
        self.canvas.setAccessibleName(name)
        self._rows: dict[int, tuple[int, int]] = {}  # weight and least height in px
        self._rows_of: dict[Plot, range] = {}
        self._groups: dict[str, CursorGroup] = {}
        self._group_of: dict[Plot, CursorGroup] = {}
        self._active: CursorGroup | None = None  # the pointer was on it last
        self._history: list[_Past] = []
        self._following = live
        self._range_chosen = False  # the operator has chosen a range
        self._turns = Turns(lambda: session.busy, self)
        self._stale = QTimer(self, singleShot=True, interval=_READOUT)
        self._stale.timeout.connect(self._renew_readouts)
        self.tools = PlotTools(self)
        outer = QVBoxLayout(self)
        outer.setContentsMargins(0, 0, 0, 0)
        outer.setSpacing(2)
        outer.addWidget(self.tools)
        outer.addWidget(self.canvas, 1)
        self._connect()
        self._restyle()

    def _connect(self) -> None:
        canvas, tools = self.canvas, self.tools
        canvas.pointed.connect(self._pointed)
        canvas.begun.connect(self._begun)
        canvas.panned.connect(self._panned)
        canvas.zoomed.connect(self._zoomed)
        canvas.cursor_moved.connect(self._cursor_moved)
        canvas.double_clicked.connect(self._auto)
        canvas.customContextMenuRequested.connect(self._show_menu)
        tools.crosshair.toggled.connect(self._crosshair_toggled)
        tools.cursors.toggled.connect(self._show_cursors)
        tools.box.toggled.connect(self._box_chosen)
        tools.time.toggled.connect(self._time_chosen)
        tools.auto.triggered.connect(self._auto)
        tools.back.triggered.connect(self._back)
        tools.follow.triggered.connect(self.follow)
        tools.left.triggered.connect(lambda: self._scale_x(-_STEP, 1.0))
        tools.right.triggered.connect(lambda: self._scale_x(_STEP, 1.0))
        tools.closer.triggered.connect(lambda: self._scale_x(0.0, _ZOOM_KEY))
        tools.wider.triggered.connect(lambda: self._scale_x(0.0, 1.0 / _ZOOM_KEY))
        tools.copy.triggered.connect(self.copy_picture)
        tools.copy_data.triggered.connect(self.copy_data)
        tools.png.triggered.connect(self._save_png)
        tools.svg.triggered.connect(self._save_svg)
        tools.csv_visible.triggered.connect(lambda: self._save_csv(visible=True))
        tools.csv_all.triggered.connect(lambda: self._save_csv(visible=False))
        self._session.theme_changed.connect(self._restyle)

    @Slot()
    def _restyle(self) -> None:
        theme = self._session.theme
        self.canvas.setBackground(theme.surface)
        for plot in self.plots:
            plot.restyle(theme)
        for group in self._groups.values():
            group.restyle(theme)

    def showEvent(self, event: QShowEvent) -> None:  # noqa: N802
        """Show; while the rig is busy, one plot after another."""
        super().showEvent(event)
        # the first picture of several plots takes longer than STOP may wait
        self._turns.clear()
        for plot in self.plots:
            plot.setOpacity(0.0)
        self._turns.add([partial(plot.setOpacity, 1.0) for plot in self.plots])

    # plots

    @property
    def plots(self) -> tuple[Plot, ...]:
        """All plots, in the order in which they were added."""
        return tuple(self.canvas.area_plots)

    def add_plot(
        self,
        row: int,
        column: int = 0,
        *,
        left: str,
        bottom: str = "Time (s)",
        group: str = "time",
        weight: int = 1,
        least: int = 54,
        rows: int = 1,
        own_range: bool = False,
        dates: bool = False,
        log: tuple[bool, bool] = (False, False),
    ) -> Plot:
        """Add a plot with the labels ``left`` and ``bottom``, at least ``least`` px high.

        ``rows`` is the number of rows that it takes, ``weight`` the share of each in the height.
        Below another plot of its group in the same column, only the lower one has numbers on the
        horizontal axis. With ``own_range`` the owner sets the vertical range. With ``dates`` the
        horizontal axis is Unix time in s, shown as local time.
        """
        plot = Plot(left, bottom, log, own_range, dates)
        self.canvas.addItem(plot, row, column, rowspan=rows)
        for taken in range(row, row + rows):
            self._rows[taken] = (weight, least)
        self._rows_of[plot] = range(row, row + rows)
        self.canvas.area_plots.append(plot)
        theme = self._session.theme
        chosen = self._groups.setdefault(group, CursorGroup(group, theme))
        chosen.add(plot)
        if len(chosen.plots) > 1:
            plot.vb.setXRange(*chosen.plots[0].vb.viewRange()[0], padding=0.0)
        self._group_of[plot] = chosen
        plot.vb.sigXRangeChanged.connect(self._x_changed)
        plot.restyle(theme)
        self.arrange()
        return plot

    def share_y(self, *plots: Plot) -> None:
        """Give ``plots`` one vertical range, so that their curves can be compared."""
        for plot in plots:
            plot.share_y(plots)

    def remove_plot(self, plot: Plot) -> None:
        """Remove ``plot``."""
        self.show_plot(plot, shown=True)  # only then is it in the layout
        self._group_of.pop(plot).remove(plot)
        self.canvas.area_plots.remove(plot)
        self.canvas.removeItem(plot)
        del self._rows_of[plot]
        self._history.clear()
        self.arrange()

    def show_plot(self, plot: Plot, shown: bool) -> None:
        """Show or hide ``plot``."""
        if plot.isVisible() != shown:
            plot.setVisible(shown)
            self.arrange()

    def arrange(self) -> None:
        """Give no height to rows without a plot, and number the lowest axis of each group."""
        lowest: dict[tuple[int, str], Plot] = {}
        shown: set[int] = set()
        for plot in self.plots:
            if not plot.isVisible():
                continue
            shown |= set(self._rows_of[plot])
            column = self.canvas.ci.items[plot][0][1]
            place = (column, self._group_of[plot].name)
            below = lowest.setdefault(place, plot)
            if self._rows_of[below][0] < self._rows_of[plot][0]:
                lowest[place] = plot
        for plot in self.plots:
            bottom = plot in lowest.values()
            plot.axis("bottom").setStyle(showValues=bottom)
            plot.axis("bottom").showLabel(bottom)
        layout = self.canvas.ci.layout
        for plot in self.plots:
            # a hidden item keeps its least height in a layout of Qt
            taken = plot.parentLayoutItem() is layout
            if plot.isVisible() and not taken:
                row, column = self.canvas.ci.items[plot][0]
                layout.addItem(plot, row, column, len(self._rows_of[plot]), 1)
            elif taken and not plot.isVisible():
                layout.removeItem(plot)
        # the numbers and the label of a horizontal axis are not a part of the plot's height
        axes = dict.fromkeys(self._rows, 0.0)
        for plot in lowest.values():
            row = self._rows_of[plot][-1]
            axes[row] = max(axes[row], plot.axis("bottom").minimumHeight())
        total = GAP * (len(shown) + 1.0)
        for row, (weight, least) in self._rows.items():
            height = least + axes[row] if row in shown else 0.0
            layout.setRowStretchFactor(row, weight if row in shown else 0)
            layout.setRowMinimumHeight(row, height)
            total += height
        self.canvas.setMinimumHeight(math.ceil(total))

    # ranges

    def auto_range(self) -> None:
        """Show the whole of all curves."""
        self._range_chosen = False
        for group in self._groups.values():
            bounds = [curve.dataBounds(0) for plot in group.shown for curve in plot.drawn]
            first = min((low for low, _ in bounds if low is not None), default=0.0)
            last = max((high for _, high in bounds if high is not None), default=0.0)
            is_time = group.name == "time"
            if last > first and not (self._live and is_time):
                padding = 0.0 if is_time else _PADDING
                group.plots[0].vb.setXRange(first, last, padding=padding)
            for plot in group.plots:
                plot.set_auto_y(auto=True)

    def fit(self) -> None:
        """Show the whole of all curves that have changed, unless the operator chose a range."""
        if not self._range_chosen:
            self.auto_range()

    def span(self, group: str = "time") -> tuple[float, float]:
        """Return the visible range of the horizontal axis of ``group``."""
        first, last = self._groups[group].plots[0].vb.viewRange()[0]
        return first, last

    def show_span(self, first: float, last: float, group: str = "time") -> None:
        """Show ``first`` to ``last`` on the horizontal axis of ``group``."""
        now = self.span(group)
        if last > first and (abs(now[0] - first) > 1e-9 or abs(now[1] - last) > 1e-9):
            self._groups[group].plots[0].vb.setXRange(first, last, padding=0.0)

    # a run

    @property
    def following(self) -> bool:
        """True while a live area shows what its owner rolls to."""
        return self._following

    def roll(self, first: float, last: float) -> None:
        """Show ``first`` to ``last`` s, unless the operator looks at another time."""
        if self._following:
            self.show_span(first, last)

    @Slot()
    def follow(self) -> None:
        """Follow the run again."""
        self._set_following(following=True)
        self.view_changed.emit()

    def set_live(self, live: bool) -> None:
        """Say whether the plots show a run, which is followed at first."""
        self._live = live
        self._history.clear()
        self.tools.back.setEnabled(False)
        self._following = live
        self.tools.show_follow(shown=False)

    def data_changed(self) -> None:
        """Renew the readouts soon; for an owner that has drawn a frame."""
        shown = any(g.hair is not None or g.cursors is not None for g in self._groups.values())
        if shown and not self._stale.isActive():
            self._stale.start()

    def _set_following(self, following: bool) -> None:
        following = following and self._live
        if following != self._following:
            self._following = following
            self.tools.show_follow(shown=self._live and not following)

    # readouts

    @property
    def readout(self) -> str:
        """Text of the place of the crosshair or the cursors."""
        return self.tools.readout.full_text

    def group(self, name: str = "time") -> CursorGroup:
        """Return the plots that share the horizontal axis ``name``."""
        return self._groups[name]

    @Slot()
    def _renew_readouts(self) -> None:
        for group in self._groups.values():
            group.renew_readout()
        active = self._active_group()
        self.tools.readout.show_text("" if active is None else active.readout())

    def _active_group(self) -> CursorGroup | None:
        if self._active is not None and self._active.shown:
            return self._active
        return next((g for g in self._groups.values() if g.shown), None)

    # what the operator does

    @Slot(object, QPointF)
    def _pointed(self, plot: Plot | None, place: QPointF) -> None:
        chosen = None if plot is None else self._group_of.get(plot)
        if chosen is not None:
            self._active = chosen
        shown = self.tools.crosshair.isChecked()
        for group in self._groups.values():
            here = plot if group is chosen and shown else None
            if here is not None or group.hair is not None:
                group.show_hair(here, place.x(), place.y())
        self._renew_readouts()

    @Slot(str)
    def _begun(self, how: str) -> None:
        if how == "wheel" and self._history and self._history[-1].how == "wheel":
            return  # all steps of the wheel are taken back at once
        views = {}
        for plot in self.plots:
            x, y = plot.vb.viewRange()
            views[plot] = _View((x[0], x[1]), (y[0], y[1]), plot.auto_y)
        past = _Past(how, self._following, views)
        self._history = [*self._history[1 - _HISTORY_MAX :], past]
        self.tools.back.setEnabled(True)

    @Slot(object, QPointF)
    def _panned(self, plot: Plot, shift: QPointF) -> None:
        x, y = plot.vb.viewRange()
        kept = None if plot.auto_y else (y[0] + shift.y(), y[1] + shift.y())
        self._zoomed(plot, (x[0] + shift.x(), x[1] + shift.x()), kept)

    @Slot(object, object, object)
    def _zoomed(
        self, plot: Plot, x: tuple[float, float] | None, y: tuple[float, float] | None
    ) -> None:
        self._range_chosen = True
        if x is not None and x[1] > x[0]:
            if self._group_of[plot].name == "time":
                self._set_following(following=False)
            plot.vb.setXRange(*x, padding=0.0)
        if y is not None and y[1] > y[0]:
            for same in plot.same_y:
                same.set_auto_y(auto=False)
                same.vb.setYRange(*y, padding=0.0)
        self.view_changed.emit()

    @Slot(object, int, float)
    def _cursor_moved(self, plot: Plot, which: int, x: float) -> None:
        self._group_of[plot].move_cursor(which, x)
        self._tell_canvas_cursors()
        self._renew_readouts()

    def _tell_canvas_cursors(self) -> None:
        self.canvas.cursors_of = {p: g.cursors for p, g in self._group_of.items()}

    @Slot(object, object)
    def _x_changed(self, view: object, limits: object) -> None:  # noqa: ARG002
        group = next((g for g in self._groups.values() if any(p.vb is view for p in g.plots)), None)
        if group is None or group.moving:
            return
        group.moving = True
        first, last = view.viewRange()[0]  # type: ignore[attr-defined]
        for plot in group.plots:
            if plot.vb is not view:
                plot.vb.setXRange(first, last, padding=0.0)
        group.moving = False

    @Slot()
    def _auto(self) -> None:
        self._begun("auto")
        self.auto_range()
        self.follow()

    @Slot()
    def _back(self) -> None:
        if not self._history:
            return
        past = self._history.pop()
        for plot, view in past.views.items():
            plot.set_auto_y(auto=view.auto_y)
            plot.vb.setXRange(*view.x, padding=0.0)
            if not view.auto_y:
                plot.vb.setYRange(*view.y, padding=0.0)
        self.tools.back.setEnabled(bool(self._history))
        self._set_following(past.following)
        self.view_changed.emit()

    def _scale_x(self, shift: float, factor: float) -> None:
        """Move the horizontal axis by ``shift`` of its range, and make the range ``factor``."""
        group = self._active_group()
        if group is not None:
            first, last = group.plots[0].vb.viewRange()[0]
            middle = 0.5 * (first + last) + shift * (last - first)
            half = 0.5 * factor * (last - first)
            self._begun("wheel")
            self._zoomed(group.plots[0], (middle - half, middle + half), None)

    @Slot(bool)
    def _crosshair_toggled(self, shown: bool) -> None:
        if not shown:
            self._pointed(None, QPointF())

    @Slot(bool)
    def _show_cursors(self, shown: bool) -> None:
        for group in self._groups.values():
            group.show_cursors(shown)
        self._tell_canvas_cursors()
        self._renew_readouts()

    @Slot(bool)
    def _box_chosen(self, chosen: bool) -> None:
        if chosen:
            self.tools.time.setChecked(False)
        self._set_drag()

    @Slot(bool)
    def _time_chosen(self, chosen: bool) -> None:
        if chosen:
            self.tools.box.setChecked(False)
        self._set_drag()

    def _set_drag(self) -> None:
        box, time = self.tools.box.isChecked(), self.tools.time.isChecked()
        self.canvas.drag = Drag.BOX if box else Drag.TIME if time else Drag.PAN

    @Slot(QPoint)
    def _show_menu(self, place: QPoint) -> None:
        plot = self.canvas.plot_at(QPointF(place), with_axes=True)
        if plot is not None:
            self._active = self._group_of[plot]
        self.tools.menu.popup(self.canvas.mapToGlobal(place))

    # pictures and data

    def image(self) -> QImage:
        """Return a picture of the plots, in twice the resolution of the screen."""
        with self._as_picture():
            return plot_export.image(self.canvas, self._session.theme.surface)

    def svg(self) -> bytes:
        """Return the plots as SVG."""
        with self._as_picture():
            return plot_export.svg(self.canvas, self._session.theme.surface)

    def csv_text(self, visible: bool = False, group: str = "", delimiter: str = ",") -> str:
        """Return the points of the curves of one group, by default of that last pointed at."""
        chosen = self._groups.get(group) or self._active_group()
        return "" if chosen is None else plot_export.csv_text(chosen.shown, visible, delimiter)

    @Slot()
    def copy_picture(self) -> None:
        """Copy the plots to the clipboard, as a picture and as SVG."""
        with self._as_picture():
            data = plot_export.clipboard_data(self.canvas, self._session.theme.surface)
        QGuiApplication.clipboard().setMimeData(data)
        self._session.message.emit("The plots are on the clipboard")

    @Slot()
    def copy_data(self) -> None:
        """Copy the visible points of the curves, with tabs between the columns."""
        QGuiApplication.clipboard().setText(self.csv_text(visible=True, delimiter="\t"))
        self._session.message.emit("The visible data of the plot are on the clipboard")

    def write(self, path: Path, content: bytes) -> None:
        """Write ``content`` to ``path``; the status bar says what happened."""
        try:
            path.write_bytes(content)
        except OSError as error:
            self._session.message.emit(f"{path} cannot be written: {system_text(error)}")
        else:
            self._session.message.emit(f"Saved as {path}")

    @Slot()
    def _save_png(self) -> None:
        path = self._ask("Save the plots as PNG", "Pictures (*.png)", ".png")
        if path is not None:
            self.write(path, plot_export.png_bytes(self.image()))

    @Slot()
    def _save_svg(self) -> None:
        path = self._ask("Save the plots as SVG", "Drawings (*.svg)", ".svg")
        if path is not None:
            self.write(path, self.svg())

    def _save_csv(self, visible: bool) -> None:
        text = self.csv_text(visible)  # before the dialog: a run may go on
        path = self._ask("Save the data of the plots as CSV", "Tables (*.csv)", ".csv")
        if path is not None:
            # the mark at the beginning tells spreadsheets that it is UTF-8
            self.write(path, text.encode("utf-8-sig"))

    def _ask(self, title: str, kinds: str, ending: str) -> Path | None:
        # names of recordings and sequences may hold what a name of a file must not
        stem = re.sub(r'[<>:"/\\\\|?*]|[^ -\uffff]', "_", self.file_stem)
        start = self._session.folder / f"{stem}{ending}"
        return save_as(self, self._session, title, start, kinds, ending)

    @contextmanager
    def _as_picture(self) -> Iterator[None]:
        """Show all plots, and no crosshair."""
        self._turns.finish()
        for group in self._groups.values():
            group.hide_hair_for_picture(hidden=True)
        try:
            yield
        finally:
            for group in self._groups.values():
                group.hide_hair_for_picture(hidden=False)
