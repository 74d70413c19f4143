"""Every page at three sizes: nothing cut or covered, and nothing that comes or goes moves STOP."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence

import pytest
from PySide6.QtCore import QPoint, QRect
from PySide6.QtWidgets import QLabel, QWidget
from pytestqt.qtbot import QtBot

from dearig.units import name_and_unit
from dearig.window.campaign.page import CampaignPage
from dearig.window.documents.toml_editor import TomlEditor
from dearig.window.follow.page import FollowPage
from dearig.window.high_voltage.status import LatchedAlarm
from dearig.window.jobs.worker import Worker
from dearig.window.recordings.page import RecordingsPage
from dearig.window.rig.page import RigPage
from dearig.window.session.state import Session
from dearig.window.shell.frame import MainWindow
from dearig.window.study.page import StudyPage
from tests.deep import mostly_deep
from tests.window.conftest import SHORT, press
from tests.window.made_recordings import made
from tests.window.shown_text import (
    commands,
    cut_off,
    overlapping,
    sideways,
    squashed,
    stretched,
)

#: The screen of a small notebook, a large one, and the small one at a scale of 1.5 without the
#: frame of a window.
SIZES = ((1366, 768), (1920, 1080), (911, 484))
LONG = "the current monitor read 5.2 mA, more than 4.9 mA, for 3 ms: 0 V at once " * 3
PATIENCE = 120_000
LOOKS = 20


def wrong(
    window: MainWindow, qtbot: QtBot, state: str, sizes: Sequence[tuple[int, int]] = SIZES
) -> list[str]:
    """Return what is wrong at each size once what is computed and laid out later has arrived."""
    found = []
    for width, height in sizes:
        window.resize(width, height)
        for _ in range(LOOKS):
            qtbot.wait(20)
            seen = [
                f"{state} at {width}, {name}: {text}"
                for name, look in (
                    ("cut", cut_off),
                    ("covered", overlapping),
                    ("stretched", stretched),
                    ("scrolls", sideways),
                    ("squashed", squashed),
                )
                for text in look(window)
            ]
            if not seen:
                break
        found += seen
    # which texts there are does not depend on the size
    return found + [f"{state}, command: {text}" for text in commands(window)]


def test_nothing_is_cut_or_covered_on_any_page_at_three_sizes(
    qtbot: QtBot, window: MainWindow, plan_of: Callable[[str], None]
) -> None:
    found = []
    status = window.run_page.runner.status
    for page in window.pages:
        window.show_page(page)
        found += wrong(window, qtbot, page.title)
    rig = window.page(RigPage)
    window.show_page(rig)
    rig.instruments.setCurrentWidget(rig.live)
    rig.live.start()
    qtbot.waitUntil(lambda: rig.live.table.rowCount() > 0, timeout=PATIENCE)
    found += wrong(window, qtbot, "Rig, live values")
    follow = window.page(FollowPage)
    window.show_page(follow)
    follow.modes.setCurrentWidget(follow.hold)
    found += wrong(window, qtbot, "Follow, hold")
    window.session.block("test", f"rig file: {LONG}", "Rig")
    status.run_ended(LatchedAlarm("Stopped by an interlock", LONG, time.time(), "sim"))
    for page in window.pages:
        window.show_page(page)
        found += wrong(window, qtbot, f"{page.title} with an alarm", SIZES[-1:])
    status.run_ended(None)
    window.session.unblock("test")
    plan_of(SHORT)
    window.show_page(window.run_page)
    press(qtbot, window.run_page.arm_button)
    found += wrong(window, qtbot, "Run, armed")
    press(qtbot, window.run_page.start_button)
    qtbot.waitUntil(lambda: not window.run_page.runner.running, timeout=PATIENCE)
    found += wrong(window, qtbot, "Run, ended")
    window.session.set_address("daqmx:Dev1@127.0.0.1:1")  # says what its watchdog is
    qtbot.waitUntil(lambda: window.session.preview is not None, timeout=PATIENCE)
    found += wrong(window, qtbot, "Run, on a card")
    for editor in window.findChildren(TomlEditor):
        assert "dearig" not in editor.toml
    assert sorted(set(found)) == [], "\n" + "\n".join(sorted(set(found)))


@pytest.mark.deep
def test_nothing_is_cut_while_work_goes_on(
    qtbot: QtBot, window: MainWindow, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The states of background work are held: no process answers."""
    monkeypatch.setattr(Worker, "_send", lambda *_: None)
    session, run = window.session, window.run_page
    for name in ("first", "second"):
        made(session.folder, name)
    recordings, study = window.page(RecordingsPage), window.page(StudyPage)
    campaign = window.page(CampaignPage)
    session.set_folder(session.folder / "..")
    session.set_folder(session.folder / "recordings")
    found: set[str] = set()

    def look(state: str) -> None:
        found.update(f"{state}: {text}" for text in cut_off(window))

    for size in SIZES:
        window.resize(*size)
        window.show_page(recordings)
        recordings.filter.setText("first")
        qtbot.waitUntil(lambda: recordings.count.full_text.endswith("2 to read"), timeout=PATIENCE)
        look(f"recordings to read at {size[0]}")
        recordings.choose(recordings._library.files)
        qtbot.waitUntil(lambda: "curves" in recordings.count.full_text, timeout=PATIENCE)
        look(f"curves to read at {size[0]}")
        if size == SIZES[0]:  # there is room for all of it
            qtbot.waitUntil(lambda: recordings.count.text() == recordings.count.full_text)
        recordings.filter.clear()
        recordings.table.clearSelection()
        recordings.views.setCurrentWidget(recordings.trend)
        look(f"trend to read at {size[0]}")
        recordings.views.setCurrentIndex(0)
        window.show_page(study)
        study.choice.search.setText("first")
        look(f"searched at {size[0]}")
        study.choice.search.clear()
        window.show_page(run)
        run.controls._model_titles[0].show_text(LONG)
        run.controls.segment.show_text(f"playing: {LONG}")
        look(f"long names at {size[0]}")
        window.show_page(campaign)
        campaign.controls.present.show_text(LONG)
        campaign.controls.time_left.setText("12345.6 s left")
        session.message.emit(LONG)
        look(f"long message at {size[0]}")
    assert sorted(found) == []


def places(window: MainWindow) -> list[QRect]:
    """Where STOP and the pages are."""
    run = window.run_page
    widgets: tuple[QWidget, ...] = (
        window.bar.stop_button, run.stop_button, run.start_button, window.list,
    )  # fmt: skip
    return [QRect(w.mapTo(window, QPoint(0, 0)), w.size()) for w in widgets[:3]] + [
        QRect(window.list.mapTo(window, QPoint(0, 0)), window.list.mapTo(window, QPoint(1, 1)))
    ]


@pytest.mark.parametrize("size", mostly_deep(SIZES, SIZES[:1]))
def test_what_comes_and_goes_does_not_move_stop(
    qtbot: QtBot, window: MainWindow, size: tuple[int, int]
) -> None:
    window.resize(*size)
    window.show_page(window.run_page)
    status, session = window.run_page.runner.status, window.session
    qtbot.wait(1)
    before = places(window)

    def look() -> None:
        qtbot.wait(1)
        assert places(window) == before

    session.block("test", LONG, "Rig")
    look()
    window.banners.show_text("restored", LONG)
    look()
    status.run_ended(LatchedAlarm("Stopped by an interlock", LONG, time.time(), "sim"))
    look()
    window.compilation.progressed.emit()
    look()
    window.error_panel.show_errors()
    look()
    window.run_page.result.show_text(LONG)
    look()
    status.run_ended(None)
    session.unblock("test")
    window.banners.hide_text("restored")
    look()


def test_every_notice_can_be_read_whole_and_leads_to_its_page(
    qtbot: QtBot, window: MainWindow
) -> None:
    window.session.block("test", LONG, "Study")
    window.banners.show_text("other", "The disk is slow")
    assert window.banners.all_button.text() == "All 2 …"
    window.banners.all_button.click()
    shown = next(w for w in window.banners.children() if isinstance(w, QWidget) and w.isWindow())
    texts = [label.text() for label in shown.findChildren(QLabel)]
    assert any(LONG in text for text in texts)
    assert cut_off(shown) == []
    next(b for b in shown.findChildren(type(window.banners.all_button)) if b.isVisible()).click()
    assert window.stack.currentWidget() is window.page(StudyPage)


def inside(window: MainWindow, widget: QWidget) -> bool:
    """Return whether all of ``widget`` is in view."""
    return widget.isVisible() and widget.visibleRegion().boundingRect() == widget.rect()


def test_what_a_page_is_for_is_above_the_fold_of_a_small_screen(
    qtbot: QtBot, window: MainWindow
) -> None:
    window.resize(1366, 768 - 60)  # with the frame of the window and the panel of a desktop
    run, study, follow = window.run_page, window.page(StudyPage), window.page(FollowPage)
    run.result.show_text(LONG[:150])
    run.show_button.show()
    campaign = window.page(CampaignPage)
    for page, widgets in (
        (run, (run.stop_button, run.arm_button, run.result, run.show_button)),
        (study, (study.overlay_button, study.start)),
        (follow, (follow.run_button, follow.compute_button)),
        (campaign, (campaign.controls.arm, campaign.controls.start)),
    ):
        window.show_page(page)
        qtbot.wait(1)
        for widget in widgets:
            assert inside(window, widget), (page.title, widget)


@pytest.mark.parametrize(
    ("key", "name", "unit"),
    [
        ("mm_per_V", "scale", "mm/V"),
        ("celsius_per_V", "scale", "°C/V"),
        ("mm_per_V_uncertainty", "scale uncertainty", "mm/V"),
        ("length_mm_uncertainty", "length uncertainty", "mm"),
        ("monitor_V_per_kV", "monitor", "V/kV"),
        ("unit_per_V", "unit per V", ""),
        ("rest_length_mm", "rest length", "mm"),
        ("voltage_max_kV", "voltage max", "kV"),
    ],
)
def test_a_label_names_a_quantity_and_a_unit(key: str, name: str, unit: str) -> None:
    assert name_and_unit(key) == (name, unit)


def test_the_first_start_fits_every_screen(session: Session, qtbot: QtBot) -> None:
    window = MainWindow(session)
    qtbot.addWidget(window)
    screen = window.screen().availableGeometry()
    assert window.height() < screen.height()  # its frame has a place
    assert screen.contains(QRect(QPoint(0, 0), window.size()))
    window.leave()


def test_a_window_that_is_minimised_comes_back_while_stop_may_be_needed(
    qtbot: QtBot, window: MainWindow
) -> None:
    window.session.set_armed(True)
    window.showMinimized()
    qtbot.waitUntil(lambda: not window.isMinimized())
    window.session.set_armed(False)
    window.showMinimized()
    qtbot.wait(50)  # longer than it takes to come back
    assert window.isMinimized()
