"""The table of recordings for training and validation."""

from __future__ import annotations

from pathlib import Path

import pytest
from PySide6.QtCore import QObject, Qt, Signal
from pytestqt.qtbot import QtBot

from dearig.analysis.summary import RecordingSummary
from dearig.window.study.training_table import TrainingPanel, TrainingTable


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
    assert table.item(row, 2).flags() == Qt.ItemFlag.NoItemFlags


def test_all_check_marks_together_are_one_change(library: FakeLibrary, qtbot: QtBot) -> None:
    table = TrainingTable(library)  # type: ignore[arg-type]
    qtbot.addWidget(table)
    seen: list[tuple[int, int]] = []
    table.changed.connect(lambda: seen.append((len(table.train), len(table.validation))))
    paths = sorted(library.files)
    table.check(paths, paths[:2])  # one in both is for validation
    assert seen == [(4, 2)]
    table.check([], [])
    assert seen == [(4, 2), (0, 0)]


def test_only_what_is_read_of_a_checked_recording_is_a_change(
    library: FakeLibrary, qtbot: QtBot
) -> None:
    table = TrainingTable(library)  # type: ignore[arg-type]
    qtbot.addWidget(table)
    checked, other = Path("run-1.h5"), Path("run-2.h5")
    table.check([checked], [])
    seen: list[int] = []
    table.changed.connect(lambda: seen.append(1))
    library.summarised.emit(other)
    assert seen == []
    library.summarised.emit(checked)
    assert seen == [1]


@pytest.fixture
def many() -> FakeLibrary:
    """Two hundred recordings of ten films, in folders."""
    made = FakeLibrary()
    for number in range(200):
        path = Path(f"film-{number % 10}/validation-b-with-a-long-name-{number:03d}.h5")
        made.files[path] = (float(number), 1000)
        film, day = number % 10, 1 + number // 10
        made.summaries[path] = RecordingSummary(
            path, name=f"film-{film}/{path.stem}", title="lobes", duration=2.0,
            started=f"2026-11-{day:02d}T12:00:00", texts={"film_id": f"no. {film}"},
        )  # fmt: skip
    return made


def names(table: TrainingTable) -> list[str]:
    rows = range(table.rowCount())
    return [table.item(row, 0).text()[-3:] for row in rows if not table.isRowHidden(row)]


def test_two_hundred_recordings_are_searched_by_name_folder_film_and_date(
    many: FakeLibrary, qtbot: QtBot
) -> None:
    table = TrainingTable(many)  # type: ignore[arg-type]
    panel = TrainingPanel(table)
    qtbot.addWidget(panel)
    panel.show()
    assert panel.count.full_text == "200"
    for text, found in (
        ("042", ["042"]),
        ("film-3/", [f"{n:03d}" for n in range(193, 0, -10)]),
        ("no. 3 2026-11-05", ["043"]),
        ("2026-11-20", [f"{n:03d}" for n in range(199, 189, -1)]),
        ("none of them", []),
    ):
        panel.search.clear()
        qtbot.keyClicks(panel.search, text)
        assert names(table) == found, text
        assert panel.count.full_text == f"{len(found)} of 200"
    # a recording that is new while the search stands is searched too
    panel.search.setText("042")
    many.files[Path("other.h5")] = (1000.0, 10)
    many.listed.emit()
    assert names(table) == ["042"]


def test_several_are_chosen_at_once_for_training_and_for_validation(
    many: FakeLibrary, qtbot: QtBot
) -> None:
    table = TrainingTable(many)  # type: ignore[arg-type]
    panel = TrainingPanel(table)
    qtbot.addWidget(panel)
    panel.resize(420, 500)
    panel.show()
    panel.search.setText("film-3/")
    assert not panel.train_button.isEnabled()
    shift, left = Qt.KeyboardModifier.ShiftModifier, Qt.MouseButton.LeftButton

    def click(row: int, modifier: Qt.KeyboardModifier = Qt.KeyboardModifier.NoModifier) -> None:
        table.scrollToItem(table.item(row, 0))
        centre = table.visualItemRect(table.item(row, 0)).center()
        qtbot.mouseClick(table.viewport(), left, modifier, centre)

    shown = [row for row in range(table.rowCount()) if not table.isRowHidden(row)]
    click(shown[0])
    click(shown[4], shift)
    qtbot.mouseClick(panel.train_button, left)
    assert [path.stem[-3:] for path in table.train] == ["193", "183", "173", "163", "153"]
    click(shown[4])
    click(shown[6], Qt.KeyboardModifier.ControlModifier)
    qtbot.mouseClick(panel.validate_button, left)
    assert [path.stem[-3:] for path in table.train] == ["193", "183", "173", "163"]
    assert [path.stem[-3:] for path in table.validation] == ["153", "133"]
    panel.search.clear()  # what is hidden meanwhile keeps its marks
    assert len(table.train) == 4
    table.selectAll()
    qtbot.mouseClick(panel.neither_button, left)
    assert (table.train, table.validation) == ((), ())


def test_long_names_are_cut_in_their_middle(many: FakeLibrary, qtbot: QtBot) -> None:
    table = TrainingTable(many)  # type: ignore[arg-type]
    qtbot.addWidget(table)
    assert table.textElideMode() is Qt.TextElideMode.ElideMiddle
    assert table.item(0, 0).text() == "film-9/validation-b-with-a-long-name-199"
    assert table.item(0, 1).text() == "2026-11-20T12:00"


def test_what_is_still_being_read_says_so(library: FakeLibrary, qtbot: QtBot) -> None:
    path = Path("run-6.h5")
    library.files[path] = (100.0, 1000)
    table = TrainingTable(library)  # type: ignore[arg-type]
    qtbot.addWidget(table)
    assert table.item(0, 1).text() == "reading …"
    library.summaries[path] = RecordingSummary(path, started="2026-11-05T12:00:00")
    library.summarised.emit(path)
    assert table.item(0, 1).text() == "2026-11-05T12:00"
