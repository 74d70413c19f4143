"""A folder with years of work: columns, sorting, search, subfolders, tags, trends."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QWidget
from pytestqt.qtbot import QtBot

from dearig.analysis.summary import Difference, RecordingSummary
from dearig.drivers.rig import Block
from dearig.model.readings.measures import Errors
from dearig.recording.reading.recording import RecordedEvent
from dearig.recording.reading.tags import TAGS_FILE
from dearig.window.recordings.conditions_table import ConditionsTable
from dearig.window.recordings.folder_model import COLUMNS, FolderModel
from dearig.window.recordings.library import Library
from dearig.window.recordings.page import RecordingsPage
from dearig.window.recordings.table import RecordingsTable
from dearig.window.recordings.trend_plot import TrendPlot
from dearig.window.session.state import Session
from tests.tools.recordings import run_counts, write_run, writer
from tests.window.made_recordings import killed

_PATIENCE = 120_000
Keep = Callable[[QWidget], None]
DAY = 86_400.0


def entry(folder: Path, number: int, **said: object) -> RecordingSummary:
    """The summary of a run on day ``number``, with made-up numbers."""
    errors = Errors(rms=number * 1e-6, nrmse_pct=1.0, max=1e-5, peak_pct=1.0,
                    e_rms_thesis_pct=1.0, e_m_thesis_pct=1.0, samples=100)  # fmt: skip
    facts: dict[str, object] = {
        "name": f"run-{number:04d}",
        "kind": "actuator",
        "title": "lobes",
        "texts": {"film_id": f"film {number % 3}", "operator": ("Ada", "Grace")[number % 2]},
        "started": f"2025-{1 + number // 28 % 12:02d}-{1 + number % 28:02d}T09:00:00+00:00",
        "duration": 2.0 + number % 7,
        "outcome": "finished",
        "peaks": {"voltage_command": 1e3 * (1 + number % 12), "displacement": 1e-3},
        "errors": errors,
        "noise": 1e-6,
    }
    return RecordingSummary(folder / f"run-{number:04d}.h5", **{**facts, **said})  # type: ignore[arg-type]


def listed(session: Session, count: int) -> FolderModel:
    model = FolderModel(session)
    summaries = [entry(session.folder, n) for n in range(count)]
    model.set_files({s.path: (n * DAY, 1000) for n, s in enumerate(summaries)},
                    {s.path: s for s in summaries})  # fmt: skip
    return model


def column(model: FolderModel, head: str) -> list[str]:
    at = [c.head for c in COLUMNS].index(head)
    return [model.index(row, at).data() for row in range(model.rowCount())]


def sort(model: FolderModel, head: str, order: Qt.SortOrder) -> None:
    model.sort([c.head for c in COLUMNS].index(head), order)


def test_numbers_are_sorted_as_numbers_and_what_has_none_comes_last(session: Session) -> None:
    model = listed(session, 30)
    without = replace(entry(session.folder, 3), peaks={})
    model.set_summary(without)
    for order, expected in (
        (Qt.SortOrder.AscendingOrder, "1.00"),
        (Qt.SortOrder.DescendingOrder, "12.0"),
    ):
        sort(model, "Peak kV", order)
        shown = column(model, "Peak kV")
        assert shown[0] == expected
        values = [float(text) for text in shown[:-1]]
        assert values == sorted(values, reverse=order == Qt.SortOrder.DescendingOrder)
        assert shown[-1] == ""


def test_a_search_looks_through_every_column_also_hidden_ones_and_notes(session: Session) -> None:
    model = listed(session, 203)
    hidden = entry(session.folder, 7, texts={"notes": "new GREASE on the rail"}, tags=("kept",))
    ended = replace(entry(session.folder, 8), outcome="stopped by an interlock: over current")
    for summary in (hidden, ended):
        model.set_summary(summary)
    for text, expected in (
        ("grease", 1), ("kept", 1), ("interlock", 1), ("grace film 2 12.0", 16), ("nowhere", 0),
        ("run-0007", 1), ("", 203),
    ):  # fmt: skip
        model.find(text)
        assert (model.rowCount(), model.total) == (expected, 203), text


def test_thousands_are_sorted_and_searched_with_one_key_for_each_file(
    session: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The cost grows with the number of files, not with that of the comparisons."""
    model = listed(session, 2000)
    asked: list[object] = []
    real = FolderModel._key
    monkeypatch.setattr(
        FolderModel, "_key", lambda self, path: (asked.append(1), real(self, path))[1]
    )
    sort(model, "RMS error", Qt.SortOrder.AscendingOrder)
    assert len(asked) == 2000
    resets: list[object] = []
    model.modelReset.connect(lambda: resets.append(1))
    model.find("grace 12.0")
    assert 0 < model.rowCount() < 2000
    assert len(resets) == 1
    # a summary that changes no order moves no row
    model.set_summary(entry(session.folder, 11))
    model._arrange()
    assert len(resets) == 1


def test_the_selection_stays_with_its_recordings_and_the_columns_with_the_user(
    session: Session, qtbot: QtBot
) -> None:
    model = listed(session, 20)
    table = RecordingsTable(model, session)
    qtbot.addWidget(table)
    table.resize(1200, 400)
    table.show()
    assert column(model, "Recording")[0] == "run-0019"  # the newest first
    chosen = [session.folder / f"run-{n:04d}.h5" for n in (3, 5)]
    table.choose(chosen)
    changes: list[object] = []
    table.chosen_changed.connect(lambda: changes.append(1))
    header = table.horizontalHeader()
    at = [c.head for c in COLUMNS].index("Peak kV")
    qtbot.mouseClick(
        header.viewport(), Qt.MouseButton.LeftButton,
        pos=header.viewport().rect().topLeft()
        + type(header.pos())(header.sectionViewportPosition(at) + 12, 8),
    )  # fmt: skip
    assert model.sorting[0] == "Peak kV"
    assert set(table.chosen) == set(chosen)
    assert changes == [] or set(table.chosen) == set(chosen)
    model.find("run-0003")
    assert table.chosen == chosen[:1]
    model.find("")

    actions = {action.text(): action for action in table.columns_menu.actions()}
    actions["Notes"].setChecked(True)
    actions["Film"].setChecked(False)
    heads = [c.head for c in COLUMNS]
    again = RecordingsTable(listed(session, 3), session)
    qtbot.addWidget(again)
    assert not again.isColumnHidden(heads.index("Notes"))
    assert again.isColumnHidden(heads.index("Film"))
    assert again.model().sorting == model.sorting
    again.reset_columns()
    assert again.isColumnHidden(heads.index("Notes"))
    assert again.model().sorting == ("Start", True)


@pytest.fixture
def shelf(session: Session) -> Path:
    """A folder with a good recording in a subfolder, and a bad file of each kind."""
    folder = session.folder
    (folder / "2025" / "march").mkdir(parents=True)
    write_run(folder / "2025" / "march" / "good.h5")
    killed(folder, "torn")
    (folder / "foreign.h5").write_text("dear reader")
    import h5py

    with h5py.File(folder / "other program.h5", "w") as file:
        file["x"] = np.arange(3.0)
    cut = folder / "cut.h5"
    cut.write_bytes((folder / "2025" / "march" / "good.h5").read_bytes()[:3000])
    return folder


def test_every_bad_file_has_one_row_with_words(
    session: Session, shelf: Path, keep: Keep, qtbot: QtBot
) -> None:
    running = writer(shelf / "running.h5")  # locked, as by another program
    running.append(Block(0, run_counts(500)))
    page = RecordingsPage(session)
    page.resize(1190, 690)
    keep(page)
    library = page._library
    qtbot.waitUntil(lambda: len(library.summaries) == 6, timeout=_PATIENCE)
    ended = dict(
        zip(column(page.files, "Recording"), column(page.files, "How it ended"), strict=True)
    )
    assert ended["2025/march/good"] == "! finished, 1 event"
    assert ended["torn"] == "! killed, or still running"
    assert ended["foreign"] == "✕ is not an HDF5 file"
    assert "it is not of format dearig-recording" in ended["other program"]
    assert "is truncated" in ended["cut"]
    assert ended["running"] != ""
    assert len(ended) == 6
    assert page.count.full_text.startswith("6 recordings")
    page.subfolders.click()
    qtbot.waitUntil(lambda: page.files.rowCount() == 5, timeout=_PATIENCE)
    running.discard()


@pytest.mark.deep
def test_an_interrupt_that_comes_too_late_does_not_stop_the_reading(
    session: Session, shelf: Path, qtbot: QtBot
) -> None:
    library = Library(session)
    qtbot.waitUntil(lambda: library._job is not None, timeout=_PATIENCE)
    job = library._job
    assert job is not None
    library._worker.cancel(job)
    library._worker.cancel(job)  # its process is gone
    qtbot.waitUntil(lambda: len(library.summaries) == 5, timeout=_PATIENCE)
    library.close()


@pytest.mark.deep
def test_tags_are_given_to_several_and_kept_beside_the_recordings(
    session: Session, shelf: Path, keep: Keep, qtbot: QtBot
) -> None:
    page = RecordingsPage(session)
    keep(page)
    library = page._library
    qtbot.waitUntil(lambda: len(library.summaries) == 5, timeout=_PATIENCE)
    good, torn = shelf / "2025" / "march" / "good.h5", shelf / "torn.h5"
    before = good.read_bytes(), good.stat().st_mtime_ns

    def tag(paths: list[Path], text: str) -> None:
        page.choose(paths)
        page._show_chosen()
        page.tags.setFocus()
        page.tags.setText(text)
        qtbot.keyClick(page.tags, Qt.Key.Key_Return)
        page.table.setFocus()

    tag([good], "film 3, best")
    tag([good, torn], "seen")
    assert library.summaries[good].tags == ("seen", "film 3", "best")
    assert library.summaries[torn].tags == ("seen",)
    tag([good, torn], "")
    assert library.summaries[good].tags == ("film 3", "best")
    assert library.summaries[torn].tags == ()
    assert (good.read_bytes(), good.stat().st_mtime_ns) == before
    kept = json.loads((good.parent / TAGS_FILE).read_text())
    assert [row["tags"] for row in kept["recordings"]] == [["film 3", "best"]]
    page.filter.setText("best")
    assert page.count.full_text.startswith("1 of 5 recordings")
    page.filter.clear()

    # another window, and a folder whose file of tags is damaged
    library._entries.clear()
    library.refresh()
    qtbot.waitUntil(lambda: library.summaries.get(good) is not None, timeout=_PATIENCE)
    assert library.summaries[good].tags == ("film 3", "best")
    (good.parent / TAGS_FILE).write_text("{")
    library.refresh()
    qtbot.waitUntil(lambda: "is damaged" in page.folder_message.text(), timeout=_PATIENCE)
    tag([good], "new")
    assert "is damaged" in page.message.text()
    assert (good.parent / TAGS_FILE).read_text() == "{"


def test_a_trend_has_a_point_for_each_run_of_a_film_that_selects_it(
    session: Session, qtbot: QtBot
) -> None:
    plot = TrendPlot(session)
    qtbot.addWidget(plot)
    summaries = [entry(session.folder, n) for n in range(12)]
    fault = RecordedEvent(1, 1.0, "fault", "arc")
    summaries[3] = replace(summaries[3], events=(fault,), outcome="stopped by an interlock: arc")
    summaries[6] = replace(summaries[6], peaks={})
    plot.show_summaries([*summaries, RecordingSummary(session.folder / "x.h5", trouble="bad")])
    plot.film.setCurrentIndex(plot.film.findData("film 0"))
    plot.quantity.setCurrentIndex(plot.quantity.findData("peak_kV"))
    points = plot.points
    assert [path.stem for path, _, _ in points] == ["run-0000", "run-0003", "run-0009"]
    assert [value for *_, value in points] == [1.0, 4.0, 10.0]
    times = [time for _, time, _ in points]
    assert np.diff(times).tolist() == [3 * DAY, 6 * DAY]
    assert "3 runs; 1 without this number" in plot.words.full_text
    assert plot.plot.axis("left").labelText == "Peak voltage (kV)"
    # the faulty one is told apart without colours
    drawn = {curve.title: curve for curve in plot.plot.drawn}
    assert drawn["with a fault"].symbol == "x" != drawn["finished"].symbol
    assert drawn["with a fault"].points[0].tolist() == times[1:2]
    plot.resize(900, 400)
    with qtbot.waitExposed(plot):
        plot.show()
    plot.area.auto_range()
    qtbot.wait(1)  # the layout
    canvas = plot.area.canvas
    with qtbot.waitSignal(plot.picked) as told:
        place = canvas.place_of(plot.plot, points[1][1], points[1][2])
        qtbot.mouseClick(canvas.viewport(), Qt.MouseButton.LeftButton, pos=place)
    assert told.args == [summaries[3].path]
    assert plot.plot.text_of("bottom", times[0])[:4] == "2025"
    # the film of a selected recording is shown
    plot.show_chosen([summaries[4].path])
    assert plot.film.currentData() == "film 1"


def test_names_of_films_are_no_markup(session: Session, qtbot: QtBot) -> None:
    plot = TrendPlot(session)
    qtbot.addWidget(plot)
    plot.show_summaries([entry(session.folder, 1, texts={"film_id": "<b>x</b>"})])
    assert "<b>x</b>" in plot.film.itemText(1)


def test_conditions_are_grouped_and_copied_with_their_heads(qtbot: QtBot) -> None:
    table = ConditionsTable()
    qtbot.addWidget(table)
    table.show_differences(
        ["low", "high"],
        [
            Difference("Run", "operator", ("Ada", "Grace")),
            Difference("Run", "seed", ("1", "2")),
            Difference("Sequence", "segment 1: amplitude (kV)", ("4", "6")),
        ],
    )
    heads = [table.horizontalHeaderItem(place).text() for place in range(3)]
    assert heads == ["Run\noperator", "\nseed", "Sequence\nsegment 1: amplitude (kV)"]
    table.selectAll()
    qtbot.keyClick(table, Qt.Key.Key_C, Qt.KeyboardModifier.ControlModifier)
    from PySide6.QtGui import QGuiApplication

    assert QGuiApplication.clipboard().text() == (
        "\toperator\tseed\tsegment 1: amplitude (kV)\nlow\tAda\t1\t4\nhigh\tGrace\t2\t6"
    )
