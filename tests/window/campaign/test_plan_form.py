"""A plan as a form: its fields and its grid, with the text behind them that both edit."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QComboBox, QLineEdit
from pytestqt.qtbot import QtBot

from dearig.config.campaignfile import parse_campaign
from dearig.errors import InputError
from dearig.window.campaign.plan import PlanEditor
from dearig.window.campaign.plan_form import key_text, read_values, values_text
from dearig.window.session.state import Session
from dearig.window.session.text_file import EditedFile

LEFT = Qt.MouseButton.LeftButton
PLAN = """\
# of the third film
name = "few"
sequence = "lobe.toml"   # ours
repeat = 2

[grid]
"segment.0.amplitude_kV" = [3.0, 4.0]
"""
LOBE = """\
name = "lobe"
lead_in_s = 0.3
[[segment]]
kind = "half_sine"
amplitude_kV = 3.0
frequency_Hz = 5.0
"""


@pytest.fixture
def editor(session: Session, qtbot: QtBot, tmp_path: Path) -> PlanEditor:
    (tmp_path / "lobe.toml").write_text(LOBE)
    made = PlanEditor(session)
    qtbot.addWidget(made)
    made.restore(PLAN, EditedFile("plan", PLAN, None, tmp_path))
    made.show()
    return made


def plan(editor: PlanEditor) -> dict[str, object]:
    return tomllib.loads(editor.toml)


def test_the_form_shows_the_plan(editor: PlanEditor) -> None:
    form = editor.form
    name, repeat = form.form.field("name"), form.form.field("repeat")
    assert isinstance(name, QLineEdit)
    assert isinstance(repeat, QLineEdit)
    assert (name.text(), repeat.text()) == ("few", "2")
    assert form.grid.item(0, 0).text() == "segment 1: amplitude (kV)"
    assert form.grid.item(0, 1).text() == "3.0, 4.0"
    keys = [form.keys.itemText(i) for i in range(form.keys.count())]
    assert keys == ["lead in (s)", "segment 1: frequency (Hz)"]


def test_a_field_edits_the_text_and_keeps_its_comments(qtbot: QtBot, editor: PlanEditor) -> None:
    rest, order = editor.form.form.field("rest_s"), editor.form.form.field("order")
    assert isinstance(rest, QLineEdit)
    assert isinstance(order, QComboBox)
    qtbot.keyClicks(rest, "7.5")
    order.setCurrentText("random")
    order.textActivated.emit("random")
    assert (plan(editor)["rest_s"], plan(editor)["order"]) == (7.5, "random")
    assert editor.toml.startswith("# of the third film\n")
    assert 'sequence = "lobe.toml"   # ours\n' in editor.toml
    editor.edit.undo()
    assert "order" not in plan(editor)
    assert order.currentText() == "as_written"


def test_keys_are_varied_with_their_values_and_left_alone_again(
    qtbot: QtBot, editor: PlanEditor, tmp_path: Path
) -> None:
    form = editor.form
    form.keys.setCurrentIndex(1)
    qtbot.mouseClick(form.add_button, LEFT)
    assert plan(editor)["grid"] == {
        "segment.0.amplitude_kV": [3.0, 4.0], "segment.0.frequency_Hz": [5.0],
    }  # fmt: skip
    form.grid.item(1, 1).setText("5, 2.5, 1")
    assert form.grid.item(1, 1).text() == "5, 2.5, 1"  # as it was typed
    campaign = parse_campaign(editor.toml, "the plan", tmp_path)
    assert len(campaign.runs) == 2 * 3 * 2
    form.grid.selectRow(0)
    qtbot.mouseClick(form.remove_button, LEFT)
    assert plan(editor)["grid"] == {"segment.0.frequency_Hz": [5, 2.5, 1]}
    assert form.grid.rowCount() == 1


def test_what_is_no_list_is_said_and_changes_nothing(editor: PlanEditor) -> None:
    form, before = editor.form, editor.toml
    form.grid.item(0, 1).setText("3.0, vier")
    assert "is not a list of values" in form.trouble.text()
    assert editor.toml == before
    form.grid.item(0, 1).setText("3.0")
    assert form.trouble.text() == ""
    assert plan(editor)["grid"] == {"segment.0.amplitude_kV": [3.0]}


def test_a_text_that_is_no_toml_is_corrected_in_the_text(editor: PlanEditor) -> None:
    editor.edit.setPlainText("name = ")
    assert "correct it there" in editor.form.trouble.text()
    assert not editor.form.form.isEnabled()
    editor.edit.setPlainText(PLAN)
    assert editor.form.form.isEnabled()


def test_a_plan_that_was_begun_is_fixed(editor: PlanEditor) -> None:
    editor.set_fixed(True)
    assert not editor.form.form.isEnabled()
    assert editor.edit.isReadOnly()


@pytest.mark.parametrize(
    ("values", "text"),
    [
        ([6.0, 7.0], "6.0, 7.0"),
        ([[6.0, 6.0], [7.0, 7.0]], "[6.0, 6.0], [7.0, 7.0]"),
        (["a b", "c, ]"], '"a b", "c, ]"'),
        ([True, 1], "true, 1"),
    ],
)
def test_values_are_read_as_they_are_shown(values: list[object], text: str) -> None:
    assert values_text(values) == text
    assert read_values(text) == values


@pytest.mark.parametrize("text", ["", " ", "1,, 2", "[1", "six", "1] \nx = [2"])
def test_other_texts_are_no_values(text: str) -> None:
    with pytest.raises(InputError):
        read_values(text)


def test_a_key_is_named_by_its_segment() -> None:
    assert key_text("segment.1.amplitudes_kV") == "segment 2: amplitudes (kV)"
    assert key_text("lead_in_s") == "lead in (s)"
