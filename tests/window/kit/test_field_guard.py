"""Neither the wheel nor what is dropped changes a field that does not have the focus."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from PySide6.QtCore import QCoreApplication, QMimeData, QPoint, QPointF, Qt
from PySide6.QtGui import QDragEnterEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import (
    QAbstractSlider,
    QAbstractSpinBox,
    QComboBox,
    QLineEdit,
    QScrollArea,
    QScrollBar,
    QSpinBox,
    QTabBar,
    QTabWidget,
    QWidget,
)
from pytestqt.qtbot import QtBot

from dearig.window.campaign.page import CampaignPage
from dearig.window.imports.dialog import ImportDialog
from dearig.window.kit.number_box import NumberBox, WholeBox
from dearig.window.rig.page import RigPage
from dearig.window.session.state import Session
from dearig.window.shell.frame import MainWindow
from tests.window.conftest import put_back
from tests.window.imports.test_dialog import Here, settled

FIELDS = (QAbstractSpinBox, QComboBox, QAbstractSlider, QTabBar)
DOWN = QPoint(0, -120)  # one notch of a wheel, in eighths of a degree


@pytest.fixture
def window(shared_window: MainWindow, qtbot: QtBot) -> MainWindow:
    """The window of this file: fields are as they were after each test."""
    return put_back(shared_window, qtbot)


@pytest.fixture
def session(window: MainWindow) -> Session:
    return window.session


def fields(place: QWidget) -> Iterator[QWidget]:
    """Fields of ``place`` that are shown and take part, so that a wheel could change them."""
    for kind in FIELDS:
        for field in place.findChildren(kind):
            if not isinstance(field, QScrollBar) and field.isVisible() and field.isEnabled():
                yield field


def value(field: QWidget) -> object:
    if isinstance(field, QAbstractSpinBox):
        return field.text()
    if isinstance(field, QAbstractSlider):
        return field.value()
    assert isinstance(field, QComboBox | QTabBar)
    return field.currentIndex()


def turn(field: QWidget, notch: QPoint = DOWN) -> None:
    """Turn the wheel over ``field``, by way of the window system."""
    window, parent = field.window(), field.parentWidget()
    while parent is not None:
        if isinstance(parent, QScrollArea):
            parent.ensureWidgetVisible(field)
        parent = parent.parentWidget()
    at = field.mapTo(window, field.rect().center())
    QTest.wheelEvent(window.windowHandle(), QPointF(at), notch)


def tab_widgets(place: QWidget) -> list[tuple[QTabWidget, int]]:
    return [(tabs, i) for tabs in place.findChildren(QTabWidget) for i in range(tabs.count())]


def changed_by_the_wheel(place: QWidget) -> tuple[int, list[str]]:
    """Turn the wheel both ways over each field of ``place``, in all of its tabs."""
    count, changed = 0, []
    for tabs, i in [*tab_widgets(place), (None, 0)]:
        if tabs is not None:
            tabs.setCurrentIndex(i)
        for field in fields(place):
            if field.hasFocus():
                field.clearFocus()
            before = value(field)
            for notch in (DOWN, -DOWN):
                turn(field, notch)
                count += 1
                if value(field) != before or field.hasFocus():
                    changed.append(f"{type(field).__name__} {field.toolTip()!r}")
                    before = value(field)
    return count, changed


def test_no_field_of_any_page_changes_by_the_wheel(qtbot: QtBot, window: MainWindow) -> None:
    for page in window.pages:
        window.show_page(page)
        qtbot.waitUntil(page.isVisible)
        if isinstance(page, CampaignPage):  # proposes its numbers once its plan is surveyed
            qtbot.waitUntil(lambda at=page: at._survey is not None, timeout=120_000)
        count, changed = changed_by_the_wheel(page)
        assert changed == [], page.title
        assert count or page.title in ("Sequence", "Campaign"), page.title
    assert window.session.rig_file == type(window.session.rig_file)()


def test_the_window_has_no_fields_with_arrows_of_another_class(window: MainWindow) -> None:
    others = [
        widget
        for page in window.pages
        for widget in page.findChildren(QWidget)
        if widget.inherits("QAbstractSpinBox") and not isinstance(widget, NumberBox | WholeBox)
    ]
    assert others == []


def test_no_field_of_the_import_dialog_changes_by_the_wheel(
    qtbot: QtBot, window: MainWindow, session: Session, tmp_path: Path
) -> None:
    table = tmp_path / "run.csv"
    rows = "\n".join(f"{i * 1e-3:.3f},{i % 7},0.{i % 10}" for i in range(200))
    table.write_text(f"time_s,voltage_kV,displacement_mm\n{rows}\n")
    worker = Here()
    dialog = ImportDialog(session, worker, table, "", window)  # type: ignore[arg-type]
    dialog.show()
    settled(dialog, qtbot)
    count, changed = changed_by_the_wheel(dialog)
    assert changed == []
    assert count
    dialog.reject()
    worker.close()


@pytest.mark.deep
def test_the_page_scrolls_under_the_pointer_instead(qtbot: QtBot, window: MainWindow) -> None:
    page = window.page(RigPage)
    window.show_page(page)
    page.show_table("interlocks")
    field = next(f for f in fields(page.form("interlocks")) if isinstance(f, QComboBox))
    bar = page._areas["interlocks"].verticalScrollBar()
    assert bar.maximum() > 0
    before = field.currentIndex()
    turn(field)  # brings it into view
    bar.setValue(bar.value() - 1)
    at = bar.value()
    turn(field, DOWN if at < bar.maximum() else -DOWN)
    assert bar.value() != at
    assert field.currentIndex() == before


def test_a_field_with_the_focus_answers_the_wheel(qtbot: QtBot, window: MainWindow) -> None:
    field = window.page(RigPage).seed
    window.show_page(window.page(RigPage))
    window.page(RigPage).kinds.button(1).click()
    field.setFocus(Qt.FocusReason.MouseFocusReason)
    before = field.value()
    turn(field, -DOWN)
    assert field.value() == before + 1


def test_a_field_around_a_field_is_kept_out_too(qtbot: QtBot, window: MainWindow) -> None:
    outer = QTabBar(window)
    for name in ("one", "two"):
        outer.addTab(name)
    inner = QSpinBox()
    outer.setTabButton(0, QTabBar.ButtonPosition.RightSide, inner)
    outer.setGeometry(200, 300, 400, 60)
    outer.show()
    outer.raise_()
    qtbot.waitUntil(inner.isVisible)
    for notch in (DOWN, -DOWN):
        turn(inner, notch)
    assert (inner.value(), outer.currentIndex()) == (0, 0)
    outer.deleteLater()


def test_nothing_is_dropped_on_a_field(window: MainWindow) -> None:
    dropped = QMimeData()
    dropped.setText("9")
    for page in window.pages:
        window.show_page(page)
    fields = window.findChildren(QLineEdit)
    assert any(field.acceptDrops() for field in fields)
    where, left = QPoint(9, 9), Qt.MouseButton.LeftButton
    none = Qt.KeyboardModifier.NoModifier
    enters = QDragEnterEvent(where, Qt.DropAction.CopyAction, dropped, left, none)
    QCoreApplication.sendEvent(window.windowHandle(), enters)
    assert len(fields) > 20
    assert not any(field.acceptDrops() for field in fields)
    assert window.page(RigPage).acceptDrops()  # what is dropped next to a field or on it is its
