"""A sequence is written, read, saved, imported; with the mouse, and with keys alone."""

from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PySide6.QtCore import QMimeData, QPoint, QPointF, Qt, QUrl
from PySide6.QtGui import QDragEnterEvent, QDropEvent
from PySide6.QtWidgets import QWidget
from pytestqt.qtbot import QtBot

import dearig.window.sequence.planner as planner_module
from dearig.acquisition.plan import Plan
from dearig.config.presets import PRESETS
from dearig.progress import Progress
from dearig.window.sequence.page import SequencePage
from dearig.window.sequence.planner import Planner
from dearig.window.session.state import Preview, Session
from tests.tools.plugins import run_with_distribution
from tests.window.conftest import Answers

WAIT = 60_000

TOO_HIGH = """\
name = "too high"
[[segment]]
kind = "half_sine"
amplitude_kV = 14.0
frequency_Hz = 0.5
"""


@pytest.fixture
def page(session: Session, keep: Callable[[QWidget], None], qtbot: QtBot):
    planner, made = Planner(session), SequencePage(session)
    made.resize(1200, 700)
    keep(made)
    planner.renew()
    settled(qtbot, session)
    yield made
    planner.close()


def settled(qtbot: QtBot, session: Session) -> None:
    qtbot.waitUntil(
        lambda: session.preview is not None and session.preview.toml == session.sequence_toml,
        timeout=WAIT,
    )


def kinds(page: SequencePage) -> list[str]:
    return [str(table["kind"]) for table in page.draft.segments]


def test_a_preset_is_taken_and_drawn(qtbot: QtBot, page: SequencePage) -> None:
    page.preset("rich")
    settled(qtbot, page.session)
    assert page.editor.table.rowCount() == 6
    assert page.editor.heads["name"].text() == "rich"
    assert "Within all limits: 40.92 s" in page.preview.state.text()
    assert page.editor.table.item(0, 3).text() == "11.4"
    voltage, bar = page.preview.margins[0]
    assert voltage.text() == "voltage: 8 of 8.5 kV"
    assert bar.value() == 94


def test_no_curve_of_another_sequence_stays(qtbot: QtBot, page: SequencePage) -> None:
    page.preset("rich")
    settled(qtbot, page.session)
    assert page.preview.plots.drawn == ("voltage", "displacement", "field")
    page.editor.choose(1)
    page.editor.set_value("repeats", 0)
    settled(qtbot, page.session)
    assert page.preview.state.text().startswith("✗ ")
    assert page.preview.plots.drawn == ()
    assert [bool(page.editor.table.item(row, 3).text()) for row in range(3)] == [True, False, True]
    page.editor.undo()
    settled(qtbot, page.session)
    assert page.preview.plots.drawn == ("voltage", "displacement", "field")
    page.session.set_sequence(TOO_HIGH, Path())  # the film has no equilibrium there
    settled(qtbot, page.session)
    assert page.preview.plots.drawn == ("voltage", "displacement", "field")
    # the prediction ends where the voltage leaves its limits
    assert page.session.preview is not None
    time, volts = page.session.preview.curves["voltage"]
    limit = page.session.rig_file.gate_limits().voltage_max
    beyond = time[np.argmax(volts > limit)]
    at, field = page.session.preview.curves["field"]
    assert at[np.isfinite(field)].max() == pytest.approx(beyond, abs=4.0 * time[1])


def test_what_is_long_in_planning_is_not_shown_as_planned(
    qtbot: QtBot, page: SequencePage, monkeypatch: pytest.MonkeyPatch
) -> None:
    resume = threading.Event()
    real = planner_module.make_preview

    def slow(*given: Any) -> Preview:
        assert resume.wait(60.0)
        return real(*given)

    monkeypatch.setattr(planner_module, "make_preview", slow)
    assert page.preview.plots.drawn
    page.preset("rich")
    qtbot.waitUntil(lambda: page.preview.plots.drawn == ())
    assert page.preview.state.text() == "Planning …"
    resume.set()
    settled(qtbot, page.session)
    assert page.preview.plots.drawn == ("voltage", "displacement", "field")


def test_a_plan_that_is_no_longer_wanted_ends(
    qtbot: QtBot, page: SequencePage, monkeypatch: pytest.MonkeyPatch
) -> None:
    real, begun = planner_module.plan, threading.Event()

    def endless(*given: Any, progress: Progress, **more: Any) -> Plan:
        if given[0].sequence.name != "too high":
            return real(*given, progress=progress, **more)
        while True:
            begun.set()
            progress("planning", 0.5)

    monkeypatch.setattr(planner_module, "plan", endless)
    page.session.set_sequence(TOO_HIGH, Path())
    assert begun.wait(60.0)
    page.preset("rich")
    settled(qtbot, page.session)
    assert page.preview.plots.drawn == ("voltage", "displacement", "field")


def test_a_long_plan_says_how_much_of_it_is_made(qtbot: QtBot, page: SequencePage) -> None:
    page.preview.show_planning()
    page.preview.show_progress(0.1)
    assert page.preview.state.text() == "Planning …"  # a short one ends before it is read
    qtbot.waitUntil(lambda: page.preview.plots.drawn == ())
    page.preview.show_progress(0.4)
    assert page.preview.state.text() == "Planning … 40%"


def test_segments_are_added_moved_and_taken_back_by_keys(qtbot: QtBot, page: SequencePage) -> None:
    page.preset("rich")
    before = kinds(page)
    page.editor.choose(1)
    page.editor.add("hold")
    assert kinds(page) == [*before[:2], "hold", *before[2:]]
    assert page.editor.table.currentRow() == 2
    alt, ctrl = Qt.KeyboardModifier.AltModifier, Qt.KeyboardModifier.ControlModifier

    def press(key: Qt.Key, with_: Qt.KeyboardModifier, then: list[str]) -> None:
        qtbot.keyClick(page, key, with_)  # the button is seen to go down before it acts
        qtbot.waitUntil(lambda: kinds(page) == then)

    lower = [*before[:3], "hold", *before[3:]]
    press(Qt.Key.Key_Down, alt, lower)
    press(Qt.Key.Key_D, ctrl, [*lower[:4], "hold", *lower[4:]])
    press(Qt.Key.Key_Delete, ctrl, lower)
    press(Qt.Key.Key_Up, alt, [*before[:2], "hold", *before[2:]])
    press(Qt.Key.Key_Z, ctrl, lower)
    page.editor.undo()
    page.editor.undo()
    page.editor.undo()
    press(Qt.Key.Key_Z, ctrl, before)
    press(
        Qt.Key.Key_Z, ctrl | Qt.KeyboardModifier.ShiftModifier, [*before[:2], "hold", *before[2:]]
    )
    settled(qtbot, page.session)
    assert page.session.preview is not None
    assert page.session.preview.playable


SAWTOOTH = """
from typing import Any, ClassVar, Literal
from pydantic import Field
from dearig.config.segments import Positive, SegmentTable, Voltage
from dearig.model.simulation.excitation import Segment, Steps


class Sawtooth(SegmentTable):
    "A slow rise and a fast fall."

    example: ClassVar[dict[str, Any]] = {"amplitude_kV": 3.0}
    kind: Literal["sawtooth"]
    amplitude_kV: Voltage = Field(description="top of the rise")
    rise_s: Positive = Field(default=0.5, description="time of the rise")

    def build(self, folder):
        top = self.amplitude_kV * 1e3
        return Steps((top, 0.0), self.rise_s, 0.5 * self.rise_s)
"""


def test_a_segment_kind_of_another_distribution_has_a_form(tmp_path: Path) -> None:
    found = run_with_distribution(
        tmp_path,
        {"sawtooth.py": SAWTOOTH},
        {"dearig.segments": {"sawtooth": "sawtooth:Sawtooth"}},
        """
        from pathlib import Path
        from PySide6.QtWidgets import QApplication, QLabel
        application = QApplication([])
        from dearig.config.sequencefile import parse_sequence
        from dearig.window.documents.segment_editor import SequenceEditor
        editor = SequenceEditor('name = "new"\\n')
        editor.fill(0)
        (added,) = [a for a in editor.add_button.menu().actions() if a.text() == "sawtooth"]
        print(added.toolTip())
        added.trigger()
        print(editor.table.item(0, 1).text(), "|", editor.table.item(0, 2).text())
        print(editor.form.field("rise_s").placeholderText(), editor.form.field("rise_s").toolTip())
        print(sorted(label.text() for label in editor.form.findChildren(QLabel) if label.text()))
        editor.form.changed.emit("rise_s", 0.25)
        (made,) = parse_sequence(editor.draft.toml, "new", Path()).sequence.segments
        print(made.duration)
        """,
    )
    first, row, field, labels, duration = found.splitlines()
    assert first == "A slow rise and a fast fall."
    assert row == "sawtooth | amplitude 3 kV"
    assert field.startswith("0.5 rise: time of the rise, in s")
    assert all(
        f"{text!r}" in labels for text in ("amplitude", "kV", "top of the rise", "rise", "s")
    )
    assert float(duration) == 0.5  # two steps of the rise that was typed


def test_a_file_is_saved_read_again_and_remembered(
    qtbot: QtBot, page: SequencePage, tmp_path: Path
) -> None:
    page.preset("rich")
    field = page.editor.heads["tail_s"]
    field.clear()
    qtbot.keyClicks(field, "4")
    text = page.session.sequence_toml
    with qtbot.waitSignal(page.session.message):
        page.files.write(tmp_path / "mine.toml")
    page.preset("thesis")
    page.open_file(tmp_path / "mine.toml")
    qtbot.waitUntil(lambda: page.session.sequence_path == tmp_path / "mine.toml")
    assert page.session.sequence_toml == text
    assert page.files.name.text() == "mine.toml"
    assert page.session.recent == [tmp_path / "mine.toml"]
    assert [action.text() for action in page.recent.actions()] == [str(tmp_path / "mine.toml")]


def test_a_second_save_keeps_comments_order_and_letters(
    qtbot: QtBot, page: SequencePage, tmp_path: Path
) -> None:
    path, noted = tmp_path / "noted.toml", "# slow, for film 7\n" + PRESETS["rich"]
    path.write_text(noted)
    page.open_file(path)
    qtbot.waitUntil(lambda: page.session.sequence_path == path)
    for duration in ("2", "2,5"):
        page.editor.choose(1)
        assert page.editor.form is not None
        field = page.editor.form.field("duration_s")
        field.clear()
        qtbot.keyClicks(field, duration)
        assert page.files.name.text() == "● noted.toml (not saved)"
        with qtbot.waitSignal(page.session.message):
            page.files.save()
        assert page.files.name.text() == "noted.toml"
    assert path.read_text() == noted.replace("duration_s = 1.0", "duration_s = 2.5", 1)


def test_a_file_that_another_program_has_changed_is_asked_about(
    qtbot: QtBot, page: SequencePage, tmp_path: Path, answers: Answers
) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(PRESETS["rich"])
    page.open_file(path)
    qtbot.waitUntil(lambda: page.session.sequence_path == path)
    other = PRESETS["rich"] + "# by another program\n"
    path.write_text(other)
    page.editor.set_value("repeats", 2)
    answers.next = False
    page.files.save()
    qtbot.waitUntil(lambda: "nothing was written" in page.files.trouble.text())
    assert "mine.toml was changed by another program" in answers.questions[0]
    assert path.read_text() == other
    answers.next = True
    with qtbot.waitSignal(page.session.message):
        page.files.save()
    assert path.read_text() == page.draft.toml
    assert page.files.trouble.text() == ""
    with qtbot.waitSignal(page.session.message):
        page.files.save()
    assert len(answers.questions) == 2


def test_unsaved_changes_are_named_before_another_sequence_is_taken(
    qtbot: QtBot, page: SequencePage, tmp_path: Path, answers: Answers
) -> None:
    page.preset("rich")  # nothing was changed: nothing is asked
    page.editor.choose(1)
    page.editor.set_value("duration_s", 2.0)
    changed = page.draft.toml
    (tmp_path / "other.toml").write_text(PRESETS["thesis"])
    answers.next = False
    page.preset("thesis")
    page.open_file(tmp_path / "other.toml")
    assert not page.take(PRESETS["thesis"])  # from another page
    assert page.draft.toml == changed
    assert [("segment 2 duration (s)" in question) for question in answers.questions] == [True] * 3
    answers.next = True
    page.preset("thesis")
    assert page.draft.toml == PRESETS["thesis"]
    segments = len(page.draft.segments)
    page.editor.show_durations([2000.0] * 100)
    shown = [page.editor.table.item(row, 3).text() for row in range(segments)]
    assert all(float(text) % 2000.0 == 0.0 and "e" not in text for text in shown)
    page.editor.undo()
    assert page.draft.toml == changed


def test_what_is_undone_belongs_to_its_own_file(
    qtbot: QtBot, page: SequencePage, tmp_path: Path
) -> None:
    for name in ("rich", "thesis"):
        (tmp_path / f"{name}.toml").write_text(PRESETS[name])
        page.open_file(tmp_path / f"{name}.toml")
        qtbot.waitUntil(lambda name=name: page.session.sequence_path == tmp_path / f"{name}.toml")
    page.editor.undo()
    assert page.session.sequence_path == tmp_path / "rich.toml"
    assert page.files.name.text() == "rich.toml"


def test_decimal_commas_are_shown_as_they_are_read(qtbot: QtBot, page: SequencePage) -> None:
    page.preset("rich")
    page.editor.choose(4)
    assert page.editor.form is not None
    field = page.editor.form.field("levels_kV")
    field.clear()
    qtbot.keyClicks(field, "3,5")
    assert "may be 3.5 or 3; 5" in page.editor.form.note("levels_kV")
    settled(qtbot, page.session)
    assert "sequence" in page.session.blocks
    qtbot.keyClicks(field, "; 6,5; 0")
    assert page.editor.form.note("levels_kV") == "3.5, 6.5, 0 kV: 3 values"
    assert page.draft.segments[4]["levels_kV"] == [3.5, 6.5, 0.0]
    settled(qtbot, page.session)
    assert page.session.blocks == {}
    head = page.editor.heads["tail_s"]
    head.clear()
    qtbot.keyClicks(head, "1,5")
    assert page.draft.data["tail_s"] == 1.5
    assert page.editor.head_note.text() == "tail = 1.5 s"


def test_every_fault_is_marked_and_blocks_arming(qtbot: QtBot, page: SequencePage) -> None:
    page.preset("rich")
    page.editor.choose(4)
    page.editor.set_value("levels_kV", [3.0, 12.5, 0.0])
    page.editor.choose(2)
    page.editor.set_value("from_Hz", -1.0)
    page.editor.set_value("taper_s", "x")
    settled(qtbot, page.session)
    marks = [page.editor.table.item(row, 0).text() for row in range(6)]
    assert marks == ["1", "2", "✗ 3", "4", "✗ 5", "6"]
    assert page.editor.form is not None
    assert "a number above 0" in page.editor.form.fault("from_Hz")
    assert "a number above 0" in page.editor.form.fault("taper_s")
    page.editor.choose(4)
    assert "value 2 (12.5 kV) is above 8.5 kV" in page.editor.form.fault("levels_kV")
    assert page.preview.state.text().count("✗") == 3
    block = page.session.blocks["sequence"]
    assert block.page == "Sequence"
    assert "segment 3 (chirp): from (Hz)" in block.sentence
    assert "2 more" in block.sentence


@pytest.mark.parametrize(
    ("text", "words"), [(None, "is not there"), ("name = [", "line 1"), ("segment = 3", "[[seg")]
)
def test_a_file_that_is_none_is_told_and_nothing_is_lost(
    qtbot: QtBot, page: SequencePage, tmp_path: Path, text: str | None, words: str
) -> None:
    if text is not None:
        (tmp_path / "bad.toml").write_text(text)
    page.open_file(tmp_path / "bad.toml")
    qtbot.waitUntil(lambda: words in page.files.trouble.text())
    assert page.session.sequence_toml == PRESETS["thesis"]


def drop(page: SequencePage, path: Path) -> None:
    mime = QMimeData()
    mime.setUrls([QUrl.fromLocalFile(str(path))])
    buttons, keys = Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier
    enter = QDragEnterEvent(QPoint(50, 50), Qt.DropAction.CopyAction, mime, buttons, keys)
    page.dragEnterEvent(enter)
    assert enter.isAccepted()
    page.dropEvent(QDropEvent(QPointF(50, 50), Qt.DropAction.CopyAction, mime, buttons, keys))


def test_files_are_dropped(qtbot: QtBot, page: SequencePage, tmp_path: Path) -> None:
    (tmp_path / "rich.toml").write_text(PRESETS["rich"])
    drop(page, tmp_path / "rich.toml")
    qtbot.waitUntil(lambda: page.editor.table.rowCount() == 6)
    (tmp_path / "w.csv").write_text("time_s,voltage_kV\n0,0\n1,5\n2,0\n")
    page.editor.choose(5)
    drop(page, tmp_path / "w.csv")
    settled(qtbot, page.session)
    assert page.draft.segments[6] == {"kind": "csv", "file": "w.csv"}  # next to rich.toml
    assert page.session.preview is not None
    assert page.session.preview.playable


def test_a_csv_that_is_none_is_told_at_its_segment(
    qtbot: QtBot, page: SequencePage, tmp_path: Path
) -> None:
    (tmp_path / "w.csv").write_text("t,v\n0,0\n1,5\n")
    page.add_csv(tmp_path / "w.csv")
    settled(qtbot, page.session)
    assert "a waveform takes time_s" in page.preview.state.text()
    assert page.editor.table.item(1, 0).text() == "✗ 2"


def test_what_another_page_proposes_is_shown(qtbot: QtBot, page: SequencePage) -> None:
    page.session.set_sequence(PRESETS["rich"], Path())
    assert page.editor.table.rowCount() == 6
    page.editor.undo()
    assert page.session.sequence_toml == page.draft.toml
    assert kinds(page) == ["thesis"]
