"""Tools of the plots: mouse, keys, crosshair, cursors, pictures and data."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Callable
from datetime import datetime
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from PySide6.QtCore import QEvent, QPoint, QPointF, Qt
from PySide6.QtGui import QColor, QImage, QMouseEvent, QWheelEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QMenu

from dearig.window.kit.theme import DARK, LIGHT
from dearig.window.plots.area import PlotArea
from dearig.window.plots.canvas import GAP
from dearig.window.plots.curve import PlotCurve, cut_lines
from dearig.window.plots.plot import AxisText, Plot
from dearig.window.session.state import Session

RATE = 1000.0
TIME = np.arange(0.0, 20.0, 1.0 / RATE)
VOLTAGE = 6.0 * np.abs((TIME / 4.0) % 1.0 * 2.0 - 1.0)  # kV, a triangle


class Shown:
    """An area with two plots of time, one of frequency, and a simulated mouse."""

    def __init__(self, session: Session, live: bool = False) -> None:
        self.area = PlotArea(session, "test", live=live)
        self.voltage = self.area.add_plot(0, left="Voltage (kV)", weight=2)
        self.residual = self.area.add_plot(1, left="Residual (\N{MICRO SIGN}m)")
        self.density = self.area.add_plot(
            2, left="Density (V)", bottom="Frequency (Hz)", group="f", log=(True, True)
        )
        self.curve = self.voltage.add_curve("commanded", LIGHT.command)
        self.curve.set_points(TIME, VOLTAGE)
        left = self.residual.add_curve("model <b>", LIGHT.models[0])
        left.set_points(TIME[::7], np.sin(TIME[::7]))
        self.density.add_curve("all", LIGHT.models[1]).set_points(
            np.array([1.0, 10.0, 100.0]), np.array([2.0, 0.2, 0.02])
        )
        self.area.resize(900, 600)

    def place(self, plot: Plot, x: float, y: float) -> QPoint:
        return self.area.canvas.place_of(plot, x, y)

    def move(self, plot: Plot, x: float, y: float, held: bool = False) -> None:
        self._send(QEvent.Type.MouseMove, self.place(plot, x, y), held)

    def drag(self, plot: Plot, start: tuple[float, float], end: tuple[float, float]) -> None:
        first, last = self.place(plot, *start), self.place(plot, *end)
        self._send(QEvent.Type.MouseButtonPress, first, held=True)
        self._send(QEvent.Type.MouseMove, (first + last) / 2, held=True)
        self._send(QEvent.Type.MouseMove, last, held=True)
        self._send(QEvent.Type.MouseButtonRelease, last, held=False)

    def wheel(self, plot: Plot, x: float, y: float, steps: int, ctrl: bool = False) -> None:
        place = QPointF(self.place(plot, x, y))
        viewport = self.area.canvas.viewport()
        modifiers = Qt.KeyboardModifier.ControlModifier if ctrl else Qt.KeyboardModifier.NoModifier
        QApplication.sendEvent(viewport, QWheelEvent(
            place, QPointF(viewport.mapToGlobal(place.toPoint())), QPoint(), QPoint(0, 120 * steps),
            Qt.MouseButton.NoButton, modifiers, Qt.ScrollPhase.NoScrollPhase, False))  # fmt: skip

    def _send(self, kind: QEvent.Type, place: QPoint, held: bool) -> None:
        viewport = self.area.canvas.viewport()
        left, none = Qt.MouseButton.LeftButton, Qt.MouseButton.NoButton
        button = none if kind is QEvent.Type.MouseMove else left
        event = QMouseEvent(
            kind, QPointF(place), QPointF(viewport.mapToGlobal(place)), button,
            left if held else none, Qt.KeyboardModifier.NoModifier,
        )  # fmt: skip
        QApplication.sendEvent(viewport, event)

    def x(self, plot: Plot) -> list[float]:
        return list(plot.vb.viewRange()[0])

    def y(self, plot: Plot) -> list[float]:
        QApplication.processEvents()
        plot.vb.prepareForPaint()
        return list(plot.vb.viewRange()[1])


@pytest.fixture
def show(session, qtbot) -> Callable[..., Shown]:
    def make(live: bool = False) -> Shown:
        shown = Shown(session, live)
        qtbot.addWidget(shown.area)
        shown.area.show()
        if live:
            shown.area.roll(0.0, 10.0)
        shown.area.auto_range()
        QApplication.processEvents()
        return shown

    return make


@pytest.fixture
def shown(show) -> Shown:
    return show()


# crosshair and cursors


def test_crosshair_reads_all_curves_at_the_same_time(shown: Shown) -> None:
    shown.move(shown.voltage, 5.0, 3.0)
    x = shown.area.group().hair
    assert x == pytest.approx(5.0, abs=0.03)  # one pixel
    at = round(x * RATE)
    assert shown.voltage.key.texts == [f"commanded  {VOLTAGE[at]:.3f} kV"]
    assert shown.residual.key.texts[0].startswith("model <b>  \N{MINUS SIGN}0.9")
    assert shown.area.readout.startswith("Time 5.0")
    assert " s   Voltage " in shown.area.readout
    assert shown.area.readout.endswith(" kV")
    assert shown.density.key.texts == ["all"]  # its axis is another quantity


def test_crosshair_of_a_logarithmic_plot_reads_the_quantities(shown: Shown) -> None:
    shown.move(shown.density, 1.0, -0.7)
    assert shown.area.readout.startswith("Frequency 10")
    assert shown.density.key.texts == ["all  0.2 V"]
    shown.area.tools.crosshair.setChecked(False)
    assert shown.density.key.texts == ["all"]


def test_crosshair_goes_with_the_pointer(shown: Shown) -> None:
    shown.move(shown.voltage, 5.0, 3.0)
    QApplication.sendEvent(shown.area.canvas, QEvent(QEvent.Type.Leave))
    assert shown.area.readout == ""
    assert shown.voltage.key.texts == ["commanded"]


def test_cursors_are_dragged_and_give_differences_with_units(shown: Shown) -> None:
    shown.area.tools.cursors.setChecked(True)
    a, b = shown.area.group().cursors
    shown.drag(shown.voltage, (a, 2.0), (5.0, 2.0))
    shown.drag(shown.residual, (b, 0.0), (7.5, 0.0))  # in whichever plot it is taken
    a, b = shown.area.group().cursors
    assert (a, b) == (pytest.approx(5.0, abs=0.03), pytest.approx(7.5, abs=0.03))
    assert shown.area.readout == (
        f"A {a:.3f} s   B {b:.3f} s   B\N{MINUS SIGN}A {b - a:.3f} s   "
        f"1/(B\N{MINUS SIGN}A) {1.0 / (b - a):.4g} Hz"
    )
    first, second = (VOLTAGE[np.argmin(np.abs(TIME - x))] for x in (a, b))
    assert shown.voltage.key.texts == [
        f"commanded  A {first:.3f} kV  B {second:.3f} kV  B\N{MINUS SIGN}A "
        f"{second - first:.3f} kV".replace("-", "\N{MINUS SIGN}")
    ]
    shown.area.tools.cursors.setChecked(False)
    assert shown.voltage.key.texts == ["commanded"]


@pytest.mark.parametrize(
    ("label", "value", "pixel", "text"),
    [
        ("Voltage (kV)", -0.0001, 0.01, "0.000 kV"),
        ("Voltage (kV)", -1.5, 0.01, "\N{MINUS SIGN}1.500 kV"),
        ("Stretch", 1.23456, 0.001, "1.2346"),
        ("Density (m/Hz)", 1.5e-9, math.inf, "1.5e\N{MINUS SIGN}09 m/Hz"),
        ("Current (mA)", math.nan, 1.0, "\N{EM DASH}"),
        ("Load cell (2) (N)", 20.0, 1.0, "20.0 N"),
    ],
)
def test_numbers_have_units_and_no_negative_zero(
    label: str, value: float, pixel: float, text: str
) -> None:
    assert AxisText.of(label).number(value, pixel) == text
    assert str(AxisText.of(label)) == label


def test_axis_of_dates_reads_local_time_and_days(session: Session, qtbot) -> None:
    area = PlotArea(session, "dates")
    qtbot.addWidget(area)
    plot = area.add_plot(0, left="Peak (kV)", bottom="Start", group="start", dates=True)
    start = datetime(2026, 11, 20, 9, 30).astimezone().timestamp()
    plot.add_curve("runs").set_points(start + 86_400.0 * np.arange(4), np.arange(4.0))
    area.auto_range()
    area.tools.cursors.setChecked(True)
    area.group("start").move_cursor(0, start)
    area.group("start").move_cursor(1, start + 86_400.0 * 2.5)
    area.tools.crosshair.toggled.emit(False)  # renews the readout
    assert area.readout == ("A 2026-11-20 09:30   B 2026-11-22 21:30   B\N{MINUS SIGN}A 2.5 days")
    _, rows = table(area.csv_text())
    assert datetime.fromisoformat(rows[0][0]).timestamp() == start


# zoom


def test_box_zoom_zooms_both_axes_of_its_plot_and_the_time_of_the_others(shown: Shown) -> None:
    other = shown.y(shown.residual)
    shown.area.tools.box.setChecked(True)
    shown.drag(shown.voltage, (4.0, 5.0), (8.0, 2.0))
    assert shown.x(shown.voltage) == pytest.approx([4.0, 8.0], abs=0.05)
    assert shown.y(shown.voltage) == pytest.approx([2.0, 5.0], abs=0.05)
    assert shown.x(shown.residual) == pytest.approx(shown.x(shown.voltage))
    assert shown.y(shown.residual)[1] <= other[1]
    assert shown.x(shown.density) == pytest.approx([-0.04, 2.04], abs=0.01)
    shown.area.tools.back.trigger()
    assert shown.x(shown.voltage) == [0.0, pytest.approx(19.999)]
    assert shown.voltage.auto_y


def test_time_zoom_leaves_the_vertical_axis_to_what_is_visible(shown: Shown) -> None:
    shown.area.tools.box.setChecked(True)
    shown.area.tools.time.setChecked(True)
    assert not shown.area.tools.box.isChecked()  # one kind of zoom at a time
    shown.drag(shown.voltage, (1.9, 0.1), (2.1, 0.1))
    assert shown.x(shown.voltage) == pytest.approx([1.9, 2.1], abs=0.05)
    low, high = shown.y(shown.voltage)
    assert high < 0.5  # the triangle is at its lowest there
    assert low < 0.0


def test_wheel_zooms_about_the_pointer_and_is_taken_back_at_once(shown: Shown) -> None:
    shown.wheel(shown.voltage, 5.0, 3.0, 1)
    shown.wheel(shown.voltage, 5.0, 3.0, 1)
    first, last = shown.x(shown.voltage)
    assert last - first == pytest.approx(19.999 / 1.25**2, rel=1e-3)
    assert (5.0 - first) / (last - first) == pytest.approx(0.25, abs=0.01)
    shown.wheel(shown.voltage, 5.0, 3.0, 1, ctrl=True)
    assert not shown.voltage.auto_y
    shown.area.tools.back.trigger()
    assert shown.x(shown.voltage) == [0.0, pytest.approx(19.999)]


def test_drag_moves_the_time_and_a_double_click_shows_everything(shown: Shown) -> None:
    shown.drag(shown.voltage, (10.0, 3.0), (5.0, 1.0))
    assert shown.x(shown.voltage) == pytest.approx([5.0, 25.0], abs=0.1)
    assert shown.voltage.auto_y  # the vertical axis stays with what is visible
    place = shown.place(shown.voltage, 10.0, 3.0)
    QTest.mouseDClick(shown.area.canvas.viewport(), Qt.MouseButton.LeftButton, pos=place)
    assert shown.x(shown.residual) == [0.0, pytest.approx(19.999)]


@pytest.mark.parametrize(
    ("key", "first", "last"),
    [("Right", 5.0, 25.0), ("Left", -5.0, 15.0), ("Plus", 2.0, 18.0), ("Minus", -2.5, 22.5)],
)
def test_keys_move_and_zoom(shown: Shown, qtbot, key: str, first: float, last: float) -> None:
    with qtbot.waitActive(shown.area):
        shown.area.activateWindow()
    shown.area.canvas.setFocus()
    QTest.keyClick(shown.area.canvas, getattr(Qt.Key, f"Key_{key}"))
    assert shown.x(shown.voltage) == pytest.approx([first, last], abs=0.01)


def test_menu_names_every_tool_with_its_key_and_none_of_pyqtgraph(
    shown: Shown, monkeypatch: pytest.MonkeyPatch
) -> None:
    menu, opened = shown.area.tools.menu, []
    monkeypatch.setattr(menu, "popup", opened.append)
    shown.area.canvas.customContextMenuRequested.emit(shown.place(shown.voltage, 5.0, 3.0))
    assert len(opened) == 1
    texts = [action.text() for action in menu.actions() if action.text()]
    assert texts[:4] == ["Crosshair", "Cursors", "Box zoom", "Time zoom"]
    assert all(action.toolTip() for action in menu.actions() if action.text())
    keys = [a.shortcut().toString() for a in menu.actions() if not a.shortcut().isEmpty()]
    assert len(keys) == len(set(keys))
    assert {"Space", "Esc"}.isdisjoint(keys)  # they stop a run
    assert not shown.voltage.vb.menuEnabled()
    others = [w for w in QApplication.allWidgets() if isinstance(w, QMenu) and w is not menu]
    assert others == []  # a menu of pyqtgraph with its fields would be styled with every window


def test_narrow_bar_keeps_the_menu(shown: Shown) -> None:
    tools = shown.area.tools
    assert all(b.isVisible() for a, b in tools.buttons.items() if a is not tools.follow)
    shown.area.resize(260, 500)
    QApplication.processEvents()
    assert tools.opener.isVisible()
    assert not tools.buttons[tools.crosshair].isVisible()


# a run


def test_live_area_follows_until_the_operator_looks_back(show) -> None:
    shown = show(live=True)
    area = shown.area
    area.roll(3.0, 13.0)
    assert area.span() == (3.0, 13.0)
    assert not area.tools.buttons[area.tools.follow].isVisible()
    shown.drag(shown.voltage, (5.0, 3.0), (7.0, 3.0))
    back = area.span()
    assert back == pytest.approx((1.0, 11.0), abs=0.1)
    area.roll(4.0, 14.0)
    assert area.span() == back  # it stays where the operator looks
    assert area.tools.buttons[area.tools.follow].isVisible()
    area.tools.follow.trigger()
    area.roll(4.0, 14.0)
    assert area.span() == (4.0, 14.0)
    assert area.following


def test_area_that_shows_no_run_any_more_offers_no_following(show) -> None:
    area = show(live=True).area
    area.set_live(live=False)
    area.canvas.zoomed.emit(area.plots[0], (2.0, 3.0), None)
    assert not area.following
    assert not area.tools.buttons[area.tools.follow].isVisible()
    area.tools.auto.trigger()
    assert area.span() == (0.0, pytest.approx(19.999))
    area.set_live(live=True)
    assert area.following


def test_zoom_of_another_axis_does_not_end_following(show) -> None:
    shown = show(live=True)
    shown.wheel(shown.density, 1.0, -0.7, 1)
    shown.wheel(shown.voltage, 5.0, 3.0, 1, ctrl=True)
    assert shown.area.following


# curves


def drawn(curve: PlotCurve) -> tuple[np.ndarray, np.ndarray]:
    return curve.getData()


@pytest.mark.parametrize("seed", range(6))
def test_drawn_points_are_samples_in_order_at_every_zoom(shown: Shown, seed: int) -> None:
    rng = np.random.default_rng(seed)
    first, last = np.sort(rng.uniform(0.0, 20.0, 2))
    shown.voltage.vb.setXRange(first, last, padding=0.0)
    x, y = drawn(shown.curve)
    assert (np.diff(x) > 0.0).all()
    np.testing.assert_array_equal(y, VOLTAGE[np.round(x * RATE).astype(int)])
    assert x.size <= 4 * shown.voltage.vb.width() + 4
    inside = (first <= TIME) & (last >= TIME)
    assert y.max() >= VOLTAGE[inside].max()  # no peak is lost
    assert x[0] <= first + 1.0 / RATE
    assert x[-1] >= last - 1.0 / RATE


def test_slopes_of_a_triangle_are_drawn_alike(shown: Shown) -> None:
    x, y = drawn(shown.curve)
    assert x.size < TIME.size / 4
    between = 0.5 * (x[1:] + x[:-1])
    off = np.abs(0.5 * (y[1:] + y[:-1]) - np.interp(between, TIME, VOLTAGE)) > 1e-9
    assert np.count_nonzero(off) <= 2 * 10  # at the ten corners only


def test_points_stay_where_they_are_while_a_curve_is_moved(shown: Shown) -> None:
    shown.voltage.vb.setXRange(2.0, 12.0, padding=0.0)
    before = set(drawn(shown.curve)[0])
    shown.voltage.vb.setXRange(2.1, 12.1, padding=0.0)
    after = drawn(shown.curve)[0]
    common = after[(after > 2.2) & (after < 11.9)]
    assert before.issuperset(common)


def test_gaps_are_gaps(shown: Shown) -> None:
    values = VOLTAGE.copy()
    values[4000:8000] = np.nan
    shown.curve.set_points(TIME, values)
    x, y = drawn(shown.curve)
    assert np.isnan(y[(x > 4.1) & (x < 7.9)]).all()
    assert math.isnan(shown.curve.value_at(5.0))


def test_key_stands_above_the_curves_and_names_are_not_html(shown: Shown) -> None:
    for plot in (shown.voltage, shown.residual):
        key, view = plot.key.sceneBoundingRect(), plot.vb.sceneBoundingRect()
        assert key.bottom() <= view.top() + 1.0
        assert key.height() > 8.0
    assert shown.residual.key.texts == ["model <b>"]


def test_low_plot_has_its_label_in_two_lines(shown: Shown) -> None:
    label = shown.residual.axis("left").label
    assert label.toPlainText().strip() == "Residual (\N{MICRO SIGN}m)"
    shown.residual.restyle(DARK)
    shown.area.resize(900, 310)
    QApplication.processEvents()
    assert label.toPlainText().strip() == "Residual\n(\N{MICRO SIGN}m)"
    assert f"color:{DARK.text}" in label.toHtml()


def test_note_follows_the_entries_of_the_key(shown: Shown) -> None:
    shown.voltage.set_note("no prediction")
    assert shown.voltage.key.texts == ["commanded", "no prediction"]
    shown.move(shown.voltage, 5.0, 3.0)
    assert shown.voltage.key.texts[1] == "no prediction"
    shown.voltage.set_note("")
    assert len(shown.voltage.key.texts) == 1


def test_hidden_plot_leaves_its_height_to_the_others(shown: Shown) -> None:
    before = shown.voltage.vb.height()
    least = shown.area.canvas.minimumHeight()
    shown.area.show_plot(shown.residual, shown=False)
    QApplication.processEvents()
    assert shown.area.canvas.minimumHeight() == least - 54 - GAP
    assert shown.voltage.vb.height() > before + 60.0
    assert shown.voltage.axis("bottom").style["showValues"]  # the lowest over time now
    shown.area.show_plot(shown.residual, shown=True)
    QApplication.processEvents()
    assert shown.voltage.vb.height() == pytest.approx(before, abs=2.0)
    shown.area.show_plot(shown.residual, shown=False)
    shown.area.remove_plot(shown.residual)
    assert shown.residual not in shown.area.plots


def test_long_names_break_into_rows(shown: Shown) -> None:
    before = shown.voltage.vb.height()
    for i in range(8):
        shown.voltage.add_curve(f"a recording with a long name {i}", LIGHT.command)
    QApplication.processEvents()
    assert len(shown.voltage.key.texts) == 9
    assert shown.voltage.vb.height() < before
    assert shown.voltage.key.sceneBoundingRect().bottom() <= (
        shown.voltage.vb.sceneBoundingRect().top() + 1.0
    )


# pictures and data


def table(text: str) -> tuple[list[str], list[list[str]]]:
    rows = list(csv.reader(io.StringIO(text)))
    return rows[0], rows[1:]


def test_csv_has_all_points_with_units_and_all_digits(shown: Shown) -> None:
    names, rows = table(shown.area.csv_text())
    assert names == [
        "Time (s)", "Voltage, commanded (kV)", "Residual, model <b> (\N{MICRO SIGN}m)",
    ]  # fmt: skip
    assert [float(row[0]) for row in rows] == TIME.tolist()
    assert [float(row[1]) for row in rows] == VOLTAGE.tolist()
    assert [float(row[2]) for row in rows[::7]] == np.sin(TIME[::7]).tolist()
    assert rows[1][2] == ""


def test_csv_of_what_is_visible(shown: Shown) -> None:
    shown.voltage.vb.setXRange(4.0, 5.0, padding=0.0)
    _, rows = table(shown.area.csv_text(visible=True))
    assert [float(row[0]) for row in rows] == TIME[4000:5001].tolist()
    names, rows = table(shown.area.csv_text(group="f", visible=True))
    assert names == ["Frequency (Hz)", "Density, all (V)"]
    assert [row[0] for row in rows] == ["1.0", "10.0", "100.0"]


def test_csv_of_a_loop_keeps_the_order_of_its_points(shown: Shown) -> None:
    loop = shown.area.add_plot(3, left="Displacement (mm)", bottom="Voltage (kV)", group="loop")
    loop.add_curve("up and down").set_points(np.array([0.0, 1.0, 0.0]), np.array([0.0, 2.0, 1.0]))
    _, rows = table(shown.area.csv_text(group="loop"))
    assert rows == [["0.0", "0.0"], ["1.0", "2.0"], ["0.0", "1.0"]]


def colours(picture: QImage) -> set[str]:
    step = max(1, picture.height() // 300)
    return {
        picture.pixelColor(x, y).name()
        for x in range(0, picture.width(), 2)
        for y in range(0, picture.height(), step)
    }


@pytest.mark.parametrize("theme", [LIGHT, DARK], ids=["light", "dark"])
def test_picture_has_ground_axes_and_curves(show, session: Session, theme) -> None:
    session.set_theme(theme)
    shown = show()
    shown.curve.set_colour(theme.command)
    picture = shown.area.image()
    assert picture.width() == 2 * shown.area.canvas.viewport().width()
    assert picture.pixelColor(picture.width() - 2, 4) == QColor(theme.surface)
    assert {theme.command, theme.text, theme.muted} <= colours(picture)


def test_svg_holds_curves_inside_their_plots_and_the_words(shown: Shown) -> None:
    shown.voltage.set_auto_y(False)
    shown.voltage.vb.setYRange(1.0, 5.0, padding=0.0)
    root = ElementTree.fromstring(shown.area.svg())  # noqa: S314  # the window wrote it
    texts = "".join("".join(e.itertext()) for e in root.iter() if e.tag.endswith("text"))
    for words in ("Voltage (kV)", "Time (s)", "commanded", "model <b>", "Frequency (Hz)"):
        assert words in texts
    assert LIGHT.command in {e.get("stroke") for e in root.iter()}
    # what the screen draws is as it was
    assert drawn(shown.curve)[1].max() == 6.0
    assert b"clip-path" not in shown.area.svg()


def test_lines_are_cut_at_the_edges() -> None:
    x = np.array([0.0, 1.0, 2.0, 3.0, 4.0, np.nan, 5.0])
    y = np.array([0.0, 2.0, 0.5, 0.5, 3.0, 0.0, 0.0])
    cut_x, cut_y = cut_lines(x, y, (0.0, 5.0), (0.0, 1.0))
    np.testing.assert_allclose(
        cut_x[1:], [0.0, 0.5, np.nan, 1.0 + 1.0 / 1.5, 2.0, 3.0, 3.2], rtol=1e-12
    )
    np.testing.assert_allclose(cut_y[1:], [0.0, 1.0, np.nan, 1.0, 0.5, 0.5, 1.0], rtol=1e-12)


def test_files_are_written_and_a_failure_is_said(
    shown: Shown, session: Session, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    said: list[str] = []
    session.message.connect(said.append)
    asked: list[tuple[str, Path]] = []

    def choose(parent, session, title: str, start: Path, kinds: str, ending: str) -> Path:
        asked.append((title, start))
        return tmp_path / f"plot{ending}"

    monkeypatch.setattr("dearig.window.plots.area.save_as", choose)
    tools = shown.area.tools
    for action in (tools.png, tools.svg, tools.csv_all):
        action.trigger()
    assert QImage(str(tmp_path / "plot.png")).size() == shown.area.image().size()
    assert (tmp_path / "plot.svg").read_bytes().startswith(b"<?xml")
    saved = (tmp_path / "plot.csv").read_text(encoding="utf-8-sig")
    assert saved == shown.area.csv_text()
    assert said[-1] == f"Saved as {tmp_path / 'plot.csv'}"
    assert asked[0][1] == session.folder / "test.png"
    shown.area.write(tmp_path / "no" / "plot.csv", b"")
    assert said[-1].startswith(f"{tmp_path / 'no' / 'plot.csv'} cannot be written: ")


def test_copies_are_a_picture_and_a_table(shown: Shown) -> None:
    clipboard = QApplication.clipboard()
    shown.area.tools.copy.trigger()
    assert clipboard.mimeData().hasImage()
    assert clipboard.mimeData().hasFormat("image/svg+xml")
    shown.area.tools.copy_data.trigger()
    assert clipboard.text().splitlines()[0].split("\t")[:2] == [
        "Time (s)", "Voltage, commanded (kV)",
    ]  # fmt: skip


@pytest.mark.parametrize("height", [700, 400, 300, 220])
def test_labels_of_low_plots_do_not_run_into_each_other(shown: Shown, height: int) -> None:
    shown.area.resize(900, height)
    QApplication.processEvents()
    axes = [plot.axis("left") for plot in (shown.voltage, shown.residual)]
    labels = [axis.label for axis in axes]
    for axis, label in zip(axes, labels, strict=True):  # also after it has got other words
        middle = label.mapRectToScene(label.boundingRect()).center().y()
        assert middle == pytest.approx(axis.sceneBoundingRect().center().y(), abs=3.0)
    above, below = (label.mapRectToScene(label.boundingRect()) for label in labels)
    assert above.bottom() <= below.top() + 8.0  # the margin of a document, above and below
