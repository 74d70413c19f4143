"""The import of measured data in the window as its user meets it."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import QMimeData, QObject, QPointF, Qt, QTimer, QUrl, Signal
from PySide6.QtGui import QDropEvent
from PySide6.QtWidgets import QComboBox, QDialog
from pytestqt.qtbot import QtBot

from dearig.errors import DearigError, noted
from dearig.progress import quiet
from dearig.recording import Recording, open_recording
from dearig.window.imports import queue as imports
from dearig.window.imports.dialog import ImportDialog
from dearig.window.imports.memory import KEPT_MAX, ImportMemory, Remembered
from dearig.window.recordings.page import RecordingsPage
from dearig.window.session.state import Session
from tests.tools.imports import MOVED, ROWS, TIME, VOLTAGE

PATIENCE = 120_000  # ms, on a machine that may be busy
SAYS_ALL = "Time [s],Voltage [kV],Displacement [mm]"
UNSURE = "time (s),TREK monitor (V),Laser out (V),other"


class Job(QObject):
    """A job as the worker's, which is done in this process."""

    progressed = Signal(str, float, float)
    finished = Signal(object)
    failed = Signal(str)
    cancelled = Signal()
    asked_to_stop = False
    failure = ""
    whole = True

    def cancel(self) -> None:
        self.asked_to_stop = True


class Here(QObject):
    """A worker in this process; what it gets and returns can be sent to another."""

    def __init__(self) -> None:
        super().__init__()
        self.held = False  # jobs wait
        self.jobs: list[Job] = []

    def submit(self, function: Callable[..., object], *given: object, **_: object) -> Job:
        job = Job(self)
        self.jobs.append(job)
        pickle.dumps((function, given))
        if not self.held:
            QTimer.singleShot(0, job, lambda: self.do(job, function, given))
        return job

    def do(self, job: Job, function: Callable[..., object], given: tuple[object, ...]) -> None:
        if job.asked_to_stop:
            job.cancelled.emit()
            return
        try:
            found = function(*given, progress=quiet)
        except DearigError as error:
            job.failure = pickle.loads(pickle.dumps(noted(error)))  # noqa: S301  (made here)
            job.failed.emit(str(error))
        else:
            pickle.dumps(found)
            job.finished.emit(found)

    def close(self) -> None:
        self.held = True


@pytest.fixture
def worker() -> Here:
    return Here()


@pytest.fixture
def opened(session: Session, worker: Here, qtbot: QtBot) -> Callable[[Path], ImportDialog]:
    def show(path: Path) -> ImportDialog:
        dialog = ImportDialog(session, worker, path)  # type: ignore[arg-type]
        qtbot.addWidget(dialog)
        dialog.show()
        settled(dialog, qtbot)
        return dialog

    return show


def settled(dialog: ImportDialog, qtbot: QtBot) -> None:
    """Wait until the dialog has read what it was given."""
    dialog._later.setInterval(0)
    qtbot.waitUntil(
        lambda: dialog.job.job is None and not dialog._later.isActive(),
        timeout=PATIENCE,
    )


def write(folder: Path, name: str, names: str, *scales: float, decimal: str = ".") -> Path:
    columns = [TIME, VOLTAGE, MOVED, np.arange(ROWS)]
    table = np.column_stack([c * s for c, s in zip(columns, scales, strict=False)])
    path = folder / name
    rows = "\n".join(",".join(f"{v:.12g}" for v in row) for row in table)
    path.write_text(f"{names}\n{rows}\n", "utf-8")
    return path


def choose(box: QComboBox, data: str) -> None:
    assert box.findData(data) >= 0
    box.setCurrentIndex(box.findData(data))


def imported(dialog: ImportDialog, qtbot: QtBot) -> Recording:
    assert dialog.start.isEnabled()
    qtbot.mouseClick(dialog.start, Qt.MouseButton.LeftButton)
    qtbot.waitUntil(lambda: dialog.written is not None, timeout=PATIENCE)
    assert dialog.written is not None
    return open_recording(dialog.written)


def matches(run: Recording) -> None:
    np.testing.assert_allclose(run.time, TIME, atol=1e-9)
    np.testing.assert_allclose(run.voltage_command, VOLTAGE, rtol=1e-9)
    np.testing.assert_allclose(run.displacement, MOVED, rtol=1e-9, atol=1e-12)


def test_names_that_say_all_are_taken_shown_and_imported(session, opened, qtbot, tmp_path):
    dialog = opened(write(tmp_path, "run.csv", SAYS_ALL, 1.0, 1e-3, 1e3))
    assert "displacement in mm from 'Displacement [mm]'" in dialog.said.text()
    assert "the thesis" in dialog.said.text()  # what is assumed is said before the import
    assert dialog.columns.item(4, 1).text() == "0 to 1.16"  # range of the file's own values
    drawn = dialog.plot.shown
    assert drawn.samples == ROWS
    np.testing.assert_allclose(drawn.curves["displacement"][1], MOVED, rtol=1e-9, atol=1e-12)
    run = imported(dialog, qtbot)
    matches(run)
    assert run.path == session.folder / "run.h5"


def test_what_is_not_sure_is_left_open_and_nothing_can_be_imported(opened, qtbot, tmp_path):
    dialog = opened(write(tmp_path, "raw.csv", UNSURE, 1.0, 1e-3, 250.0, 1.0))
    monitor, laser = dialog.columns.boxes(2), dialog.columns.boxes(3)
    assert not dialog.start.isEnabled()
    assert monitor.unit.currentData() == laser.unit.currentData() == ""
    assert "'Laser out (V)', which is in V, and enter its scale" in dialog.to_do.text()
    choose(monitor.unit, "kV")
    choose(laser.unit, "mm")
    # a unit alone is not enough: volts are not kilovolts, and not mm
    assert "enter its scale in kV per V" in dialog.to_do.text()
    assert "enter its scale in mm per V" in dialog.to_do.text()
    for typed, line in (("1", monitor.scale), ("4", laser.scale), ("0,5", laser.offset)):
        qtbot.keyClicks(line, typed)
    settled(dialog, qtbot)
    assert "displacement in mm from 'Laser out (V)', scaled *4+0.5" in dialog.said.text()
    assert dialog.to_do.text() == ""
    run = imported(dialog, qtbot)
    matches(run)
    assert run.rest_reading == pytest.approx(0.5e-3)


def test_choices_are_remembered_for_files_alike_and_can_be_forgotten(
    session, opened, qtbot, tmp_path
):
    dialog = opened(write(tmp_path, "first.csv", "t,HV,gap,n", 1.0, 1e-3, 1e3, 1.0))
    for number, quantity, unit in ((1, "time", "s"), (2, "voltage", "kV"), (3, "displacement",
                                                                            "mm")):  # fmt: skip
        boxes = dialog.columns.boxes(number)
        choose(boxes.quantity, quantity)
        choose(boxes.unit, unit)
    settled(dialog, qtbot)
    matches(imported(dialog, qtbot))
    assert not dialog.remembered.text()

    other = opened(write(tmp_path, "other.csv", "t,HV,gap", 1.0, 1e-3, 1e3))
    assert not other.remembered.text()  # another layout
    alike = opened(write(tmp_path, "second.csv", "t,HV,gap,n", 1.0, 2e-3, 1e3, 1.0))
    assert alike.remembered.text().startswith("Remembered from the import of first.csv of ")
    assert "voltage in kV from 'HV'" in alike.said.text()
    assert alike.start.isEnabled()
    qtbot.mouseClick(alike.forget, Qt.MouseButton.LeftButton)
    settled(alike, qtbot)
    assert not alike.remembered.text()
    assert not alike.start.isEnabled()
    assert not opened(tmp_path / "second.csv").remembered.text()


def test_a_table_and_the_size_of_the_specimen_are_asked_for(opened, qtbot, tmp_path):
    rows = "\n".join(f"{i / 10},{0.03 * i},{0.2 * i},{i / 10},{0.06 * i},{0.4 * i}"
                     for i in range(30))  # fmt: skip
    path = tmp_path / "tension.csv"
    path.write_text(
        "Gauge length,30,mm\nWidth,6,mm\nThickness,3,mm\nSpecimen 1,,,Specimen 2,,\n"
        f"Time (s),Travel (mm),Force (N),Time (s),Travel (mm),Force (N)\n{rows}\n"
    )
    dialog = opened(path)
    assert dialog.to_do.text() == "The file has several tables: choose one."
    dialog.table_box.setCurrentIndex(dialog.table_box.findData("Specimen 2"))
    dialog.table_box.activated.emit(dialog.table_box.currentIndex())
    settled(dialog, qtbot)
    assert dialog.to_do.text() == "Enter the gauge length.\nEnter the cross-section."
    # what the head of the file tells is offered, not taken
    qtbot.mouseClick(dialog.fields.use_stated, Qt.MouseButton.LeftButton)
    settled(dialog, qtbot)
    run = imported(dialog, qtbot)
    assert run.stretch[-1] == pytest.approx(1.0 + 0.06 * 29 / 30)
    assert run.nominal_stress[-1] == pytest.approx(0.4 * 29 / 18e-6)


def test_another_line_of_names_is_read_and_remembered(opened, qtbot, tmp_path):
    rows = "\n".join(f"{i / 100},{max(i - 30, 0) * 10},{max(i - 30, 0) / 100}" for i in range(60))
    text = f"time (s),voltage (V),displacement (mm)\ntime,voltage,displacement\n{rows}\n"
    (tmp_path / "one.csv").write_text(text)
    (tmp_path / "two.csv").write_text(text)
    dialog = opened(tmp_path / "one.csv")
    assert not dialog.start.isEnabled()  # the second line names no units
    dialog.fields.names_line.setValue(1)
    dialog.fields.names_line.editingFinished.emit()
    settled(dialog, qtbot)
    assert imported(dialog, qtbot).samples == 60
    alike = opened(tmp_path / "two.csv")
    assert alike.fields.names_line.value() == 1
    assert "Remembered from the import of one.csv" in alike.remembered.text()
    assert alike.start.isEnabled()


def test_bad_rows_are_refused_and_left_out_when_asked_for(opened, qtbot, tmp_path):
    path = write(tmp_path, "gap.csv", SAYS_ALL, 1.0, 1e-3, 1e3)
    path.write_text(path.read_text() + "End of test\n")
    dialog = opened(path)
    assert dialog.said.text().startswith("Line 62")
    assert "“Leave out bad rows”" in dialog.said.text()
    assert not dialog.start.isEnabled()
    dialog.fields.skip.click()
    settled(dialog, qtbot)
    assert "1 row was left out" in dialog.said.text()
    matches(imported(dialog, qtbot))


def test_the_scalings_of_the_rig_file_apply_to_volts_at_the_card(session, opened, qtbot, tmp_path):
    laser = session.rig_file.laser.mm_per_V
    dialog = opened(write(tmp_path, "raw.csv", UNSURE, 1.0, 1e-3, 1e3 / laser, 1.0))
    dialog.fields.film.setCurrentIndex(1)
    boxes = dialog.columns.boxes(3)
    choose(boxes.unit, "raw_V")
    choose(dialog.columns.boxes(2).unit, "kV")
    qtbot.keyClicks(dialog.columns.boxes(2).scale, "1")
    settled(dialog, qtbot)
    run = imported(dialog, qtbot)
    matches(run)
    assert run.film == session.rig_file.as_film()


def test_a_number_that_is_none_and_a_name_that_is_taken_are_said(session, opened, qtbot, tmp_path):
    (session.folder / "run.h5").touch()
    dialog = opened(write(tmp_path, "run.csv", SAYS_ALL, 1.0, 1e-3, 1e3))
    assert dialog.out.text() == "run-2.h5"
    dialog.out.clear()
    qtbot.keyClicks(dialog.out, "run.h5")
    assert dialog.to_do.text().endswith("run.h5 exists already; choose another name")
    assert not dialog.start.isEnabled()
    dialog.out.setText("other")
    qtbot.keyClicks(dialog.columns.boxes(2).scale, "two")
    assert '"two" is not a number' in dialog.to_do.text()
    assert not dialog.start.isEnabled()


def test_cancel_ends_the_import_first_and_closes_the_dialog_then(
    session, opened, worker, qtbot, tmp_path
):
    dialog = opened(write(tmp_path, "run.csv", SAYS_ALL, 1.0, 1e-3, 1e3))
    worker.held = True
    qtbot.mouseClick(dialog.start, Qt.MouseButton.LeftButton)
    job = worker.jobs[-1]
    job.progressed.emit("reading", 0.25, 12.0)
    assert dialog.job.bar.value() == 250
    assert dialog.job.stage.text() == "Reading, about 12 s left"
    qtbot.mouseClick(dialog.job.cancel_button, Qt.MouseButton.LeftButton)
    assert job.asked_to_stop
    assert dialog.isVisible()
    job.cancelled.emit()
    assert dialog.said.text() == "Cancelled; nothing was written."
    assert dialog.start.isEnabled()
    qtbot.mouseClick(dialog.job.cancel_button, Qt.MouseButton.LeftButton)
    assert not dialog.isVisible()
    assert list(session.folder.iterdir()) == []


def test_files_that_are_dropped_are_imported_one_after_the_other(
    session, worker, keep, qtbot, tmp_path, monkeypatch
):
    paths = [write(tmp_path, f"run{i}.csv", SAYS_ALL, 1.0, 1e-3, 1e3) for i in range(2)]
    titles = []

    def answer(dialog: QDialog, _: Session) -> bool:
        assert isinstance(dialog, ImportDialog)
        titles.append(dialog.windowTitle())
        settled(dialog, qtbot)
        imported(dialog, qtbot)
        return True

    monkeypatch.setattr(imports, "run_dialog", answer)
    monkeypatch.setattr(imports, "Worker", lambda _: worker)
    page = RecordingsPage(session)
    keep(page)
    data = QMimeData()
    data.setUrls([QUrl.fromLocalFile(str(path)) for path in paths])

    def drop() -> None:
        event = QDropEvent(
            QPointF(50, 50), Qt.DropAction.CopyAction, data, Qt.MouseButton.LeftButton,
            Qt.KeyboardModifier.NoModifier,
        )  # fmt: skip
        page.dropEvent(event)

    session.set_armed(True)
    drop()
    qtbot.waitUntil(lambda: "disarmed" in page.message.text(), timeout=PATIENCE)
    session.set_armed(False)
    drop()
    qtbot.waitUntil(lambda: len(titles) == 2, timeout=PATIENCE)
    assert titles == [f"Import measured data ({n} of 2)" for n in (1, 2)]
    assert page.message.text().startswith("Imported run1.h5: time in s from")
    qtbot.waitUntil(
        lambda: {path.name for path in page._library.files} == {"run0.h5", "run1.h5"},
        timeout=PATIENCE,
    )


def test_the_oldest_choices_are_forgotten_and_damaged_ones_count_as_none(session):
    ages = iter(range(10**6))

    class Moment:
        def isoformat(self, timespec: str) -> str:  # noqa: ARG002
            return f"{next(ages):06d}"

    memory = ImportMemory(session.settings, now=Moment)  # type: ignore[arg-type]
    for number in range(KEPT_MAX + 2):
        memory.keep(f"layout{number}", Remembered("a.csv", {}))
    assert memory.recall("layout0") is memory.recall("layout1") is None
    assert memory.recall("layout2") == Remembered("a.csv", {}, at="000002")
    for text in ("nonsense", "[]", '{"columns": {"0": {"quantity": "time", "unit": "kV"}}}'):
        session.settings.setValue("imports/damaged", text)
        assert memory.recall("damaged") is None
