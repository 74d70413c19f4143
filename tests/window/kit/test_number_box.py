"""What is typed into a field with arrows is the number that it shows, in every language."""

from __future__ import annotations

import pytest
from PySide6.QtCore import QLocale
from pytestqt.qtbot import QtBot

from dearig.window.kit.number_box import NumberBox, WholeBox

WAS = 2.0


@pytest.fixture(params=["C", "de_DE", "en_US", "fr_CH"])
def _language(request: pytest.FixtureRequest):
    before = QLocale()
    QLocale.setDefault(QLocale(request.param))
    yield
    QLocale.setDefault(before)


@pytest.mark.usefixtures("_language")
@pytest.mark.parametrize(
    ("typed", "value"),
    [
        ("0.5", 0.5), ("0,5", 0.5), (" 0.5 ", 0.5), ("12", 12.0), ("1.234", 1.234),
        ("1,234", WAS), ("1.234,5", WAS), ("0.5.5", WAS), ("5000", WAS), ("-1", WAS), ("", WAS),
    ],
)  # fmt: skip
def test_a_typed_number_is_that_or_the_one_before(qtbot: QtBot, typed: str, value: float) -> None:
    box = NumberBox(0.001, 1000.0, WAS, decimals=3, unit=" mm")
    qtbot.addWidget(box)
    box.show()
    box.lineEdit().clear()
    qtbot.keyClicks(box, typed)
    assert box.property("wrong") is (value == WAS)
    assert (box.value(), box.text()) == (value, f"{value:.3f} mm")
    assert not box.property("wrong")


@pytest.mark.usefixtures("_language")
@pytest.mark.parametrize(("typed", "value"), [("15", 15), ("1.5", 2), ("1,5", 2), ("1.500", 2)])
def test_a_whole_number_too(qtbot: QtBot, typed: str, value: int) -> None:
    box = WholeBox(1, 9999, 2)
    qtbot.addWidget(box)
    box.lineEdit().clear()
    qtbot.keyClicks(box, typed)
    assert box.value() == value
