"""The table of recordings for training and validation."""

from __future__ import annotations

from pathlib import Path

import pytest
from PySide6.QtCore import QObject, Qt, Signal
from pytestqt.qtbot import QtBot

from dearig.analysis.summary import RecordingSummary
from dearig.window.study.training_table import TrainingTable


class FakeLibrary(QObject):
    """A library whose files are given, without a folder."""

    listed = Signal()
    summarised = Signal(Path)

    def __init__(self) -> None:
        super().__init__()
        self.files: dict[Path, tuple[float, int]] = {}
        self.summaries: dict[Path, RecordingSummary] = {}


@pytest.fixture
def library() -> FakeLibrary:
    made = FakeLibrary()
    for number in range(6):
        path = Path(f"run-{number}.h5")
        made.files[path] = (float(number), 1000)
        made.summaries[path] = RecordingSummary(path, title="lobes", duration=2.0)
    return made


def test_an_unreadable_file_lets_no_signal_through_while_the_table_is_filled(
    library: FakeLibrary, qtbot: QtBot
) -> None:
    # rows are sorted by time, newest first: others are filled after the unreadable one
    broken = Path("run-5.h5")
    library.summaries[broken] = RecordingSummary(broken, trouble="it is not an HDF5 file")
    table = TrainingTable(library)  # type: ignore[arg-type]
    qtbot.addWidget(table)
    seen: list[int] = []
    items: list[int] = []
    table.changed.connect(lambda: seen.append(table.rowCount()))
    table.itemChanged.connect(lambda _: items.append(1))
    library.files[Path("run-6.h5")] = (0.5, 1000)  # a new recording, as after each run
    library.listed.emit()  # an exception in a slot fails the test
    assert seen == [7]
    assert items == []
    assert not table.signalsBlocked()


def test_check_marks_stay_and_a_file_that_became_unreadable_loses_them(
    library: FakeLibrary, qtbot: QtBot
) -> None:
    table = TrainingTable(library)  # type: ignore[arg-type]
    qtbot.addWidget(table)
    train, validate = Path("run-1.h5"), Path("run-2.h5")
    table.check([train], [validate])
    assert (table.train, table.validation) == ((train,), (validate,))
    library.summaries[train] = RecordingSummary(train, trouble="it is damaged")
    library.listed.emit()
    assert (table.train, table.validation) == ((), (validate,))
    row = [table.item(row, 0).text() for row in range(table.rowCount())].index("run-1")
    assert table.item(row, 0).toolTip() == "it is damaged"
    assert table.item(row, 1).flags() == Qt.ItemFlag.NoItemFlags
