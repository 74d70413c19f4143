"""The page Recordings as its user meets it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import h5py
import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QStyleOptionViewItem, QWidget
from pytestqt.qtbot import QtBot

from dearig.config.modelfile import save_model
from dearig.model.film.material import TABLE_3, THESIS_FILM, THESIS_LOAD, Network
from dearig.model.simulation.actuator import Actuator
from dearig.window.kit.report_table import ReportTable
from dearig.window.kit.theme import DARK
from dearig.window.recordings.folder_model import COLUMNS
from dearig.window.recordings.page import RecordingsPage
from dearig.window.session.state import Session
from tests.window.made_recordings import killed, made

pytestmark = pytest.mark.usefixtures("kept_processes")

# a process has to start, on a machine that may be busy
_PATIENCE = 120_000

Keep = Callable[[QWidget], None]


def open_page(session: Session, keep: Keep, qtbot: QtBot) -> RecordingsPage:
    """The page, with all files of the folder looked at."""
    page = RecordingsPage(session)
    page.resize(1190, 690)
    keep(page)
    looked_at(page, qtbot)
    return page


def looked_at(page: RecordingsPage, qtbot: QtBot) -> None:
    library = page._library
    qtbot.waitUntil(
        lambda: (
            bool(library.files)
            and set(library.summaries) == set(library.files)
            and not library.left
        ),
        timeout=_PATIENCE,
    )


def drawn(page: RecordingsPage, qtbot: QtBot, *names: str) -> None:
    """Wait until just these are drawn."""
    qtbot.waitUntil(lambda: {c.name for c in page.plot.shown} == set(names), timeout=_PATIENCE)


def cells(page: RecordingsPage, column: str) -> dict[str, str]:
    """Name of every row to its text in ``column``."""
    at, model = [c.head for c in COLUMNS].index(column), page.table.model()
    return {
        model.index(row, 1).data(): model.index(row, at).data() for row in range(model.rowCount())
    }


def rows(table: ReportTable) -> dict[str, list[str]]:
    """First cell of every row to the others."""
    return {
        table.item(row, 0).text(): [
            table.item(row, column).text() for column in range(1, table.columnCount())
        ]
        for row in range(table.rowCount())
    }


def click(qtbot: QtBot, widget: QWidget) -> None:
    assert widget.isEnabled()
    qtbot.mouseClick(widget, Qt.MouseButton.LeftButton)


@pytest.fixture
def folder(session: Session) -> Path:
    made(session.folder, "low", 4.0, operator="Ada", film_id="film 1")
    made(session.folder, "high", 6.0, operator="Grace", film_id="film 2")
    return session.folder


def test_a_folder_is_looked_through(session, folder, keep, qtbot, tmp_path):
    page = open_page(session, keep, qtbot)
    # what is there, with something drawn at once
    assert cells(page, "Sequence") == {"low": "lobes of 4.0 kV", "high": "lobes of 6.0 kV"}
    assert cells(page, "Film") == {"low": "film 1", "high": "film 2"}
    assert cells(page, "Operator") == {"low": "Ada", "high": "Grace"}
    assert cells(page, "Peak kV") == {"low": "4.00", "high": "6.00"}
    noise = cells(page, "RMS error")
    for text in noise.values():
        number, unit = text.split()
        assert unit == "µm"
        assert float(number) == pytest.approx(1.0, abs=0.2)  # the simulated noise
    assert set(cells(page, "How it ended").values()) == {"✓ finished"}
    qtbot.waitUntil(lambda: len(page.plot.shown) == 1, timeout=_PATIENCE)
    assert rows(page.details)["outcome"] == ["finished"]

    # words find a recording
    qtbot.keyClicks(page.filter, "grace film")
    assert set(cells(page, "Sequence")) == {"high"}
    qtbot.waitUntil(lambda: page.count.full_text == "1 of 2 recordings", timeout=_PATIENCE)
    page.filter.clear()
    assert set(cells(page, "Sequence")) == {"low", "high"}

    # several on one plot, and their conditions set side by side
    page.choose([folder / "low.h5", folder / "high.h5"])
    drawn(page, qtbot, "low", "high")
    qtbot.waitUntil(lambda: page.differences.rowCount() > 0, timeout=_PATIENCE)
    # a row for each recording, a column for each condition, with its group above
    order = [page.differences.verticalHeaderItem(i).text() for i in (0, 1)]
    heads = [
        page.differences.horizontalHeaderItem(i).text().split("\n")
        for i in range(page.differences.columnCount())
    ]
    assert heads[0][0] == "Run"
    at = [what for _, what in heads].index("operator")
    operators = [page.differences.item(row, at).text() for row in (0, 1)]
    assert dict(zip(order, operators, strict=True)) == {"low": "Ada", "high": "Grace"}
    metrics = page.differences.fontMetrics()
    for place, head in enumerate(heads):
        wide = page.differences.columnWidth(place)
        assert wide >= min(260, max(map(metrics.horizontalAdvance, head)))  # nothing is cut
    assert page.side_tabs.currentWidget() is page.differences
    assert len(page.plot.plots[1].drawn) == 4
    key = page.plot.plots[1].key
    assert key.texts == [*order, "model of each recording"]
    click(qtbot, page.model_shown)
    assert key.texts == list(order)
    assert len(page.plot.plots[1].drawn) == 2
    assert not page.plot.plots[2].isVisible()
    click(qtbot, page.model_shown)

    # another model has other errors, and what was known of the first is not shown as its own
    stiff = save_model(
        tmp_path / "stiff.toml", "stiff",
        Actuator(THESIS_FILM, THESIS_LOAD, Network(TABLE_3.equilibrium)), {},
    )  # fmt: skip
    page.compare_with(stiff)
    assert set(cells(page, "RMS error").values()) == {""}
    qtbot.waitUntil(lambda: all(cells(page, "RMS error").values()), timeout=_PATIENCE)
    of_stiff = cells(page, "RMS error")
    assert all(float(of_stiff[n].split()[0]) > 10 * float(noise[n].split()[0]) for n in noise)
    assert page.model_box.currentText() == "stiff"

    # export, with a word where it went or why not
    page.export(folder / "low.h5", "csv", folder / "low.csv")
    qtbot.waitUntil(lambda: "Wrote " in page.message.text(), timeout=_PATIENCE)
    assert (folder / "low.csv").read_text().startswith("time_s,")
    page.export(folder / "low.h5", "csv", folder / "gone" / "low.csv")
    qtbot.waitUntil(lambda: "there is no folder" in page.message.text(), timeout=_PATIENCE)

    # the sequence of one of them, to be played again
    page.choose([folder / "low.h5"])
    drawn(page, qtbot, "low")
    with qtbot.waitSignal(page.edit_sequence) as told:
        click(qtbot, page.sequence_button)
    assert 'name = "lobes of 4.0 kV"' in told.args[0]

    # at night
    session.set_theme(DARK)
    measured = page.plot.plots[1].drawn[0]
    assert measured.opts["pen"].color().name() == DARK.measured


def test_what_is_broken_is_said_and_what_can_be_mended_is_mended(session, keep, qtbot):
    path = killed(session.folder, "torn")
    (session.folder / "letter.h5").write_text("dear reader")
    page = open_page(session, keep, qtbot)
    assert cells(page, "How it ended") == {
        "torn": "! killed, or still running", "letter": "✕ is not an HDF5 file",
    }  # fmt: skip
    for column, cut in (("How it ended", "Right"), ("Recording", "Middle")):  # sentences, and names
        index = page.table.model().index(0, [c.head for c in COLUMNS].index(column))
        option = QStyleOptionViewItem()
        page.table.initViewItemOption(option)
        page.table.itemDelegateForIndex(index).initStyleOption(option, index)
        assert option.textElideMode.name == f"Elide{cut}"
    page.choose([session.folder / "letter.h5"])
    qtbot.waitUntil(lambda: "is not an HDF5 file" in page.message.text(), timeout=_PATIENCE)
    assert page.plot.shown == ()
    assert not page.recover_button.isEnabled()
    page.choose([path])
    drawn(page, qtbot, "torn")
    assert page.message.text() == ""
    click(qtbot, page.recover_button)
    qtbot.waitUntil(lambda: "recovered" in page.message.text(), timeout=_PATIENCE)
    assert "2000 samples" in page.message.text()
    with h5py.File(path) as file:  # as any program opens it
        assert file["entry/data/time"].size == 2000


@pytest.mark.deep
def test_the_list_follows_the_folder(session, folder, keep, qtbot, tmp_path):
    page = open_page(session, keep, qtbot)
    qtbot.waitUntil(lambda: not page._library._worker.busy, timeout=_PATIENCE)
    # while a run goes on no file is opened: it may be the one that is being written
    session.set_running(True)
    path = made(folder, "new", 5.0)
    page.choose([path])
    page._library.refresh()
    assert not page._library._worker.busy
    assert not page._library._listing.busy
    session.set_running(False)
    session.recorded.emit(path)
    # it was asked for before it was listed
    drawn(page, qtbot, "new")
    assert page.chosen() == [path]

    path.unlink()
    page._library.refresh()
    qtbot.waitUntil(lambda: set(cells(page, "Sequence")) == {"low", "high"}, timeout=_PATIENCE)

    other = tmp_path / "other"
    other.mkdir()
    made(other, "elsewhere")
    session.set_folder(other)
    qtbot.waitUntil(lambda: set(cells(page, "Sequence")) == {"elsewhere"}, timeout=_PATIENCE)
    session.set_folder(tmp_path / "gone")
    qtbot.waitUntil(lambda: "gone is not there" in page.folder_message.text(), timeout=_PATIENCE)
    assert cells(page, "Sequence") == {}
    # what was wrong with one folder is not said of another
    fresh = tmp_path / "fresh"
    fresh.mkdir()
    session.set_folder(fresh)
    qtbot.waitUntil(lambda: not page.folder_message.isVisible(), timeout=_PATIENCE)
    assert page.count.full_text == "no recordings yet"


def test_nothing_of_one_folder_is_said_of_the_next(session, keep, qtbot, tmp_path):
    (session.folder / "letter.h5").write_text("dear reader")
    page = open_page(session, keep, qtbot)
    qtbot.waitUntil(lambda: "is not an HDF5 file" in page.message.text(), timeout=_PATIENCE)
    fresh = tmp_path / "fresh"
    fresh.mkdir()
    session.set_folder(fresh)
    qtbot.waitUntil(lambda: page.message.isHidden(), timeout=_PATIENCE)
    assert page.details.item(0, 1).text().startswith("Select a recording")


@pytest.mark.deep
def test_what_is_being_read_says_so(session: Session, keep: Keep, qtbot: QtBot) -> None:
    made(session.folder, "first")
    page = open_page(session, keep, qtbot)
    page.choose([session.folder / "first.h5"])
    qtbot.waitUntil(lambda: "reading curves …" in page.count.full_text, timeout=_PATIENCE)
    # an earlier choice of the page itself may have drawn it: this one is read too
    qtbot.waitUntil(lambda: "reading" not in page.count.full_text, timeout=_PATIENCE)
    drawn(page, qtbot, "first")
