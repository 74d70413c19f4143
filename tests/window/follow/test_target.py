"""The form of a target: segments in millimetres, and the text of the file behind them."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from PySide6.QtWidgets import QLineEdit
from pytestqt.qtbot import QtBot

from dearig.config.segments import SEGMENT_KINDS
from dearig.config.targetfile import parse_target, target_kinds
from dearig.window.documents.segment_forms import target_forms
from dearig.window.follow.target import TargetEditor
from dearig.window.session.state import Session


@pytest.fixture
def target(session: Session, qtbot: QtBot) -> Iterator[TargetEditor]:
    shown = TargetEditor(session)
    qtbot.addWidget(shown)
    shown.show()
    yield shown
    shown.close_work()


def test_what_is_composed_in_the_form_is_in_the_text(qtbot: QtBot, target: TargetEditor) -> None:
    form = target.form
    assert "# A target: the displacement" in target.toml  # comments stay
    form.choose(1)
    assert form.form is not None
    field = form.form.field("amplitude_mm")
    assert isinstance(field, QLineEdit)
    field.clear()
    qtbot.keyClicks(field, "0,15")
    assert "amplitude_mm = 0.15" in target.toml
    assert "# A target: the displacement" in target.toml
    form.add("hold")
    assert parse_target(target.toml, "t", Path()).sequence.rows == (0, 1, 2, 3, 4)
    qtbot.waitUntil(lambda: (item := form.table.item(2, 3)) is not None and item.text() == "1")
    target.edit.undo()
    assert form.table.rowCount() == 4


def test_faults_stand_beside_their_fields_in_millimetres(
    qtbot: QtBot, target: TargetEditor
) -> None:
    form = target.form
    form.choose(0)
    assert form.form is not None
    form.set_value("to_mm", "much")
    qtbot.waitUntil(lambda: form.form is not None and bool(form.form.fault("to_mm")))
    assert "kV" not in form.form.fault("to_mm") + form.row_fault.text()
    target.edit.setPlainText("name = [")
    assert not form.isEnabled()
    assert "correct it there" in target.trouble.text()
    target.edit.setPlainText('name = "a"\n[[segment]]\nkind = "hold"\nvoltage_kV = 1.0\n')
    qtbot.waitUntil(lambda: "write displacement_mm" in target.trouble.text())
    target.edit.setPlainText('name = "a"\n[[segment]]\nkind = "hold"\nduration_s = 1.0\n')
    qtbot.waitUntil(lambda: target.trouble.text() == "")
    assert form.isEnabled()


@pytest.mark.parametrize("kind", [k for k in SEGMENT_KINDS if k != "csv"])
def test_every_kind_has_its_fields_in_millimetres_and_a_new_one_is_a_target(kind: str) -> None:
    forms = target_forms()
    said = " ".join(f"{f.key} {f.unit} {f.tip}" for f in forms.fields[kind]) + forms.tips[kind]
    assert "kV" not in said
    assert "voltage" not in said.casefold()
    assert set(forms.examples[kind]) <= {f.key for f in forms.fields[kind]}
    assert set(forms.fields) == set(target_kinds())
    keys = "\n".join(f"{k} = {v!r}" for k, v in forms.examples[kind].items())
    to_rest = "[[segment]]\nkind = 'ramp'\nto_mm = 0.0\nduration_s = 1.0\n"
    made = parse_target(
        f"name = 'a'\n[[segment]]\nkind = '{kind}'\n{keys}\n{to_rest}", kind, Path()
    )
    _, displacement, _, _ = made.sample(1000.0)
    assert 0.0 <= displacement.max() < 1e-3  # m, of a film that moves by less than 1 mm
