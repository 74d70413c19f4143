"""The rig is chosen, looked at, and its file mended where it is wrong."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from PySide6.QtCore import QPoint, QRect, Qt
from PySide6.QtWidgets import QApplication, QLineEdit, QWidget
from pytestqt.qtbot import QtBot

from dearig.config.rigfile import write_default
from dearig.config.rigform import SECTIONS
from dearig.window.rig.page import RigPage
from dearig.window.session.state import Session
from tests.window.conftest import Answers


@pytest.fixture
def page(session: Session, keep: Callable[[QWidget], None]) -> RigPage:
    made = RigPage(session)
    made.resize(1200, 700)
    keep(made)
    return made


def line(page: RigPage, table: str, key: str) -> QLineEdit:
    page.show_table(table)
    field = page.form(table).field(key)
    assert isinstance(field, QLineEdit)
    return field


@pytest.mark.parametrize(
    ("kind", "address"),
    [(0, "sim"), (1, "sim:12"), (2, "daqmx:Dev3"), (3, "daqmx:Dev3@rig:31763")],
)
def test_a_rig_is_chosen(qtbot: QtBot, page: RigPage, kind: int, address: str) -> None:
    page.seed.setValue(12)
    page.device.setText("Dev3")
    page.server.setText("rig:31763")
    page.kinds.button(kind).click()
    assert page.session.address == address
    again = RigPage(page.session)
    qtbot.addWidget(again)
    assert again.kinds.checkedId() == kind
    assert page.session.address == address  # to show it is not to choose it
    again.close_work()


def test_a_look_at_the_instruments_is_told_in_words(qtbot: QtBot, page: RigPage) -> None:
    # a simulated rig is looked at without being asked
    qtbot.waitUntil(lambda: page.outcome is not None, timeout=60_000)
    assert page.outcome is not None
    assert page.findings.rowCount() == len(page.outcome.findings) > 3
    assert page.outcome.summary == page.summary.text()
    page.session.set_address("sim:3")  # what was found there says nothing of this one
    assert page.findings.rowCount() == 0
    assert "not checked yet" in page.summary.text()
    qtbot.mouseClick(page.check_button, Qt.MouseButton.LeftButton)
    qtbot.waitUntil(lambda: page.outcome is not None, timeout=60_000)
    assert page.outcome is not None
    assert page.outcome.rig == "sim:3"


def test_a_card_that_is_not_there_is_told(qtbot: QtBot, page: RigPage) -> None:
    qtbot.waitUntil(lambda: page.outcome is not None, timeout=60_000)  # of the simulated one
    page.session.set_address("daqmx:Dev1")
    qtbot.mouseClick(page.check_button, Qt.MouseButton.LeftButton)
    qtbot.waitUntil(lambda: page.outcome is not None, timeout=60_000)
    assert page.outcome is not None
    assert page.outcome.wrong
    assert "wrong" in page.summary.text()
    assert "✗ Wrong" in [page.findings.item(r, 0).text() for r in range(page.findings.rowCount())]


def test_every_table_of_the_rig_file_is_in_sight_in_a_narrow_window(page: RigPage) -> None:
    page.resize(780, 600)
    QApplication.processEvents()
    for place, table in enumerate(SECTIONS):
        tab = page.tabs.tab(place)
        tab.click()
        assert page.form(table).isVisible()
        seen = QRect(tab.mapTo(page, QPoint()), tab.size())
        assert page.rect().contains(seen), table


def test_a_wrong_value_is_said_beside_its_field_and_not_used(qtbot: QtBot, page: RigPage) -> None:
    field = line(page, "limits", "voltage_max_kV")
    qtbot.keyClicks(field, "12")
    assert "the amplifier's range" in page.form("limits").fault("voltage_max_kV")
    assert page.session.rig_file.limits.voltage_max_kV == 1.0  # after the first key
    assert not page.save_button.isEnabled()
    field.selectAll()
    qtbot.keyClicks(field, "7.5")
    assert page.form("limits").fault("voltage_max_kV") == ""
    assert page.session.rig_file.limits.voltage_max_kV == 7.5
    assert page.save_button.isEnabled()
    field.selectAll()
    qtbot.keyClick(field, Qt.Key.Key_Delete)  # left out: the default
    assert page.session.rig_file.limits.voltage_max_kV == 8.5


def test_a_limit_beside_a_wrong_field_is_not_ignored_but_blocks_arming(
    qtbot: QtBot, page: RigPage
) -> None:
    wrong = line(page, "film", "length_mm")
    wrong.selectAll()
    qtbot.keyClicks(wrong, "seventy")
    limit = line(page, "limits", "voltage_max_kV")
    limit.selectAll()
    qtbot.keyClicks(limit, "5")
    block = page.session.blocks["rig file"]
    assert block.page == "Rig"
    assert "film: length (mm)" in block.sentence
    assert "previous limits are in force: 0 to 8.5 kV" in block.sentence
    assert page.tabs.tab(0).text() == "✗ film"
    slew = line(page, "limits", "slew_max_kV_per_s")
    slew.selectAll()
    qtbot.keyClicks(slew, "950000")  # what is wrong with several keys is told next to it
    assert "amplifier's own slew rate" in page.form("limits").fault("slew_max_kV_per_s")
    assert "not a number" in page.form("film").fault("length_mm")
    slew.clear()
    qtbot.keyClicks(slew, "1,5e3")
    wrong = line(page, "film", "length_mm")
    wrong.selectAll()
    qtbot.keyClicks(wrong, "70,5")
    assert page.form("film").note("length_mm") == "= 70.5 mm"
    assert page.session.blocks == {}
    assert page.session.rig_file.limits.voltage_max_kV == 5.0
    assert page.session.rig_file.film.length_mm == 70.5


def test_an_address_that_is_typed_but_not_taken_blocks_arming(qtbot: QtBot, page: RigPage) -> None:
    page.kinds.button(2).click()
    page.device.setFocus()
    page.device.selectAll()
    qtbot.keyClicks(page.device, "Dev2")
    assert page.session.address == "daqmx:Dev1"
    assert "press Enter" in page.session.blocks["rig address"].sentence
    qtbot.keyClick(page.device, Qt.Key.Key_Return)
    assert page.session.address == "daqmx:Dev2"
    assert page.session.blocks == {}
    page.device.selectAll()
    qtbot.keyClicks(page.device, "2nd card")
    qtbot.keyClick(page.device, Qt.Key.Key_Return)
    assert "is not the address of a card" in page.session.blocks["rig address"].sentence
    page.kinds.button(0).click()
    assert page.session.blocks == {}


def test_unsaved_changes_of_the_rig_file_are_named_before_they_are_lost(
    qtbot: QtBot, page: RigPage, tmp_path: Path, answers: Answers
) -> None:
    write_default(tmp_path / "rig.toml")
    page.set_value("limits", "voltage_max_kV", 5.0)
    text = page.text
    answers.next = False
    page.files.open(tmp_path / "rig.toml")
    page._ask_defaults()
    assert page.text == text
    assert all("limits: voltage max (kV)" in question for question in answers.questions)
    assert len(answers.questions) == 2
    answers.next = True
    page._ask_defaults()
    assert page.text == ""
    assert page.session.recovery.unsaved == []


def test_a_file_with_faults_keeps_its_name_while_they_are_mended(
    qtbot: QtBot, page: RigPage, tmp_path: Path
) -> None:
    path = tmp_path / "rig.toml"
    path.write_text("# ours\n[film]\nlength_mm = -1.0  # wrong\n")
    page.files.open(path)
    qtbot.waitUntil(lambda: "rig file" in page.session.blocks)
    assert not page.save_button.isEnabled()
    page.set_value("film", "length_mm", 70.0)
    assert page.session.blocks == {}
    assert page.session.rig_path == path
    with qtbot.waitSignal(page.session.message):
        page.files.save()
    assert path.read_text() == "# ours\n[film]\nlength_mm = 70.0  # wrong\n"


def test_a_file_is_read_changed_and_saved(qtbot: QtBot, page: RigPage, tmp_path: Path) -> None:
    write_default(tmp_path / "rig.toml")
    with qtbot.waitSignal(page.session.rig_changed):
        page.files.open(tmp_path / "rig.toml")
    qtbot.waitUntil(lambda: "rig.toml" in page.files.name.text())
    field = line(page, "film", "length_mm")
    assert field.text() == "75"
    field.selectAll()
    qtbot.keyClicks(field, "80.5")
    assert "(not saved)" in page.files.name.text()
    with qtbot.waitSignal(page.session.message):
        page.files.write(tmp_path / "other.toml")
    text = (tmp_path / "other.toml").read_text(encoding="utf-8")
    assert text == (tmp_path / "rig.toml").read_text(encoding="utf-8").replace(
        "length_mm = 75.0", "length_mm = 80.5"
    )
    assert page.session.rig_path == tmp_path / "other.toml"
    assert page.session.rig_text == text  # what goes into the recordings


@pytest.mark.parametrize(
    ("text", "words"), [("[film", "line 1"), (None, "is not there"), ("x = 3\n", "x is not")]
)
def test_a_file_that_is_none_is_told(
    qtbot: QtBot, page: RigPage, tmp_path: Path, text: str | None, words: str
) -> None:
    if text is not None:
        (tmp_path / "rig.toml").write_text(text)
    before = page.session.rig_file
    page.files.open(tmp_path / "rig.toml")
    qtbot.waitUntil(lambda: words in page.files.trouble.text() + page.state.text())
    assert page.session.rig_file is before
