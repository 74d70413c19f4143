"""Main window: the list of pages, the pages, and the state of the high voltage."""

from __future__ import annotations

from functools import cached_property
from pathlib import Path
from typing import Any, Protocol, TypeVar, cast

from PySide6.QtCore import QPoint, QSize, Qt, QTimer, Slot
from PySide6.QtGui import QAction, QCloseEvent, QGuiApplication, QKeySequence, QShowEvent
from PySide6.QtWidgets import (
    QApplication,
    QFrame,
    QHBoxLayout,
    QListWidget,
    QMainWindow,
    QMenu,
    QMessageBox,
    QScrollArea,
    QStackedWidget,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from dearig.analysis.hold import HoldPlan
from dearig.config.toml_input import read_text
from dearig.errors import InputError
from dearig.window import NO_SCREEN
from dearig.window.campaign.page import CampaignPage
from dearig.window.documents.dialogs import run_dialog
from dearig.window.documents.questions import may_close, offer_unsaved
from dearig.window.follow.page import FollowPage
from dearig.window.high_voltage.bar import HighVoltageBar
from dearig.window.high_voltage.stop_keys import StopKeys
from dearig.window.kit.theme import DARK, LIGHT, SPACE, apply, system_theme
from dearig.window.kit.wheel_guard import WheelGuard
from dearig.window.kit.widgets import label, plain_tip
from dearig.window.recordings.library import shared_library
from dearig.window.recordings.page import RecordingsPage
from dearig.window.rig.page import RigPage
from dearig.window.run.page import RunPage
from dearig.window.run.runner import Play
from dearig.window.sequence.page import SequencePage
from dearig.window.sequence.planner import Planner
from dearig.window.session.layout_state import GROUP
from dearig.window.session.settings import kept_bytes, kept_number, kept_text
from dearig.window.session.state import Session
from dearig.window.shell.banners import Banners
from dearig.window.shell.compilation import Compilation, CompilationBar
from dearig.window.shell.error_panel import ErrorPanel
from dearig.window.shell.guide import Guide
from dearig.window.study.page import StudyPage

__all__ = ["MainWindow"]

_COLOUR_SCHEMES = {"system": "Same as the system", "light": "Light", "dark": "Dark"}


class Page(Protocol):
    """Attributes of every page."""

    title: str
    shortcut: str


#: Attributes of ``MainWindow`` that are pages, and their classes, in the order of the list.
_PAGES: dict[str, type[Page]] = {
    "rig_page": RigPage,
    "sequence_page": SequencePage,
    "run_page": RunPage,
    "recordings_page": RecordingsPage,
    "study_page": StudyPage,
    "follow_page": FollowPage,
    "campaign_page": CampaignPage,
}
_AnyPage = TypeVar("_AnyPage", bound=QWidget)


class MainWindow(QMainWindow):
    """Holds the pages; it closes only when the rig is safe."""

    def __init__(self, session: Session) -> None:
        super().__init__()
        self.session = session
        self.setWindowTitle("dearig[*]")  # Qt shows a mark there while something is not saved
        self.wheel_guard = WheelGuard(self)  # before any field is shown
        self.planner = Planner(session, self)
        self.compilation = Compilation(self)
        self.library = shared_library(session)  # lists the folder while the window is made
        self.rig_page = RigPage(session)
        self.sequence_page = SequencePage(session)
        self.run_page = RunPage(session)
        self.campaign_page = CampaignPage(session, self.run_page.runner)
        self.stop_keys = StopKeys(self._stop_by_key, lambda: session.busy, self)
        self._guide: Guide | None = None
        self._closing = False
        self._by_signal = False  # closed by a signal: nobody is there to be asked
        self._build()
        self._connect()
        self._apply_colour_scheme()
        self._restore_state()
        if not self.compilation.start():
            self.planner.renew()

    # pages

    @property
    def pages(self) -> tuple[QWidget, ...]:
        """All pages in the order of the list; those that nobody has needed yet are made."""
        return tuple(self._page(row) for row in range(len(_PAGES)))

    @cached_property
    def recordings_page(self) -> RecordingsPage:
        """The page Recordings, made when it is first needed, as are Study and Follow.

        These three take half the time of a start.
        """
        page = RecordingsPage(self.session)
        page.open_sequence.connect(self._read_sequence)
        return self._put("recordings_page", page)

    @cached_property
    def study_page(self) -> StudyPage:
        """The page Study; see ``recordings_page``."""
        page = StudyPage(self.session)
        page.open_sequence.connect(self._play_sequence)
        page.show_model.connect(self._show_model)
        page.study_finished.connect(self._study_finished)
        return self._put("study_page", page)

    @cached_property
    def follow_page(self) -> FollowPage:
        """The page Follow; see ``recordings_page``."""
        page, run = FollowPage(self.session), self.run_page
        page.play_sequence.connect(self._play_file)
        page.use_model.connect(run.show_model)
        page.hold.play_hold.connect(self._play_hold)
        run.started.connect(page.hold.watch)
        run.runner.ended.connect(page.hold.run_ended)
        page.waits.connect(run.follow_button.setVisible)
        return self._put("follow_page", page)

    def _put(self, name: str, page: _AnyPage) -> _AnyPage:
        """Put the page ``name`` into its place, which is empty and not shown."""
        row = list(_PAGES).index(name)
        place = cast(QWidget, self.stack.widget(row))
        self.stack.insertWidget(row, page)
        self.stack.removeWidget(place)
        place.deleteLater()
        return page

    def _page(self, row: int) -> QWidget:
        page: QWidget = getattr(self, list(_PAGES)[row])
        return page

    def _made(self, *names: str) -> list[Any]:
        """Return those of the pages with these attributes' ``names`` that have been made."""
        return [vars(self)[name] for name in names if name in vars(self)]

    # commands

    def show_page(self, page: QWidget) -> None:
        """Bring ``page`` to the front."""
        self.list.setCurrentRow(self.stack.indexOf(page))

    def _show_page_titled(self, title: str) -> None:
        titles = [page.title for page in _PAGES.values()]
        if title in titles:
            self.list.setCurrentRow(titles.index(title))

    @Slot()
    def show_guide(self) -> None:
        """Open the guide in a window of its own."""
        if self._guide is None:
            self._guide = Guide(self)
        self._guide.show()
        self._guide.raise_()

    @Slot()
    def reset_layout(self) -> None:
        """Give all parts the sizes and places of the first start."""
        for key in ("geometry", "page", GROUP):
            self.session.settings.remove(key)
        for page in self._made(
            "sequence_page", "recordings_page", "study_page", "follow_page", "campaign_page"
        ):
            page.reset_layout()
        self._default_geometry()
        self.show_page(self.run_page)

    def leave(self) -> None:
        """Close without a question once the rig is safe; for a program that gets a signal.

        Unsaved texts are kept for the next start.
        """
        self._closing = self._by_signal = True
        self.close()

    def showEvent(self, event: QShowEvent) -> None:  # noqa: N802
        """Fit the window, with its frame, into the screen: the bar with STOP must be visible."""
        super().showEvent(event)
        # the frame of the window manager is known only after the window is shown
        QTimer.singleShot(0, self._fit_screen)

    def closeEvent(self, event: QCloseEvent) -> None:  # noqa: N802
        """Ask during a run, and make the rig safe whatever the answer."""
        runner = self.run_page.runner
        if runner.running and not self._closing and not self._ask_to_close():
            event.ignore()
            return
        self._closing = True
        if runner.running:
            # the window shows the ramp, and closes when the run has ended
            runner.stop("the end of the window")
            event.ignore()
            return
        if not self._by_signal and not may_close(self, self.session):
            self._closing = False
            event.ignore()
            return
        self.session.recovery.close(keep=self._by_signal)
        self._save_state()
        self.stop_keys.watch(False)
        self.run_page.close_work()
        self.compilation.close()
        self.bar.close_work()
        self.planner.close()
        for page in self._made(
            "rig_page", "sequence_page", "recordings_page", "study_page", "follow_page",
            "campaign_page",
        ):  # fmt: skip
            page.close_work()
        self.library.close()
        event.accept()

    @Slot()
    def _unsaved_changed(self) -> None:
        self.setWindowModified(bool(self.session.recovery.unsaved))

    @Slot()
    def _run_ended(self) -> None:
        if self._closing:
            self.close()

    def offer_unsaved(self) -> None:
        """Offer the unsaved texts of a window that ended without a question."""
        offer_unsaved(
            self,
            self.session,
            {
                "sequence": self.sequence_page.restore,
                "rig file": self.rig_page.restore,
                "target": lambda text, file: self.follow_page.target.restore(text, file),
                "plan": self.campaign_page.plan.restore,
            },
        )

    def _ask_to_close(self) -> bool:
        """Stop the run and return True if the window is to close afterwards."""
        runner = self.run_page.runner
        runner.stop("closing the window")
        asked = QMessageBox(self)
        campaign = runner.playing is Play.CAMPAIGN
        what = "campaign" if campaign else "run"
        asked.setWindowTitle(f"A {what} is in progress")
        asked.setIcon(QMessageBox.Icon.Warning)
        asked.setText(f"The {what} is being stopped: the voltage is ramped down to 0 V.")
        kept = (
            "The recordings are kept, and the campaign can be continued."
            if campaign
            else "The recording is kept."
        )
        asked.setInformativeText(f"{kept} Close the window at 0 V?")
        close = asked.addButton("Close", QMessageBox.ButtonRole.AcceptRole)
        asked.addButton("Keep open", QMessageBox.ButtonRole.RejectRole)
        run_dialog(asked, self.session)
        return asked.clickedButton() is close

    # layout

    def _build(self) -> None:
        self.list = QListWidget()
        self.list.setObjectName("pages")
        self.list.setFixedWidth(132)
        self.list.setAccessibleName("Pages")
        self.stack = QStackedWidget()
        for place, (name, known) in enumerate(_PAGES.items()):
            self.list.addItem(known.title)
            self.list.item(place).setToolTip(f"{known.title} ({known.shortcut})")
            self.stack.addWidget(vars(self).get(name) or QWidget())
            key = QAction(self)
            key.setShortcut(QKeySequence(known.shortcut))
            key.triggered.connect(lambda _=False, row=place: self.list.setCurrentRow(row))
            self.addAction(key)
        self.list.currentRowChanged.connect(self._page_changed)
        side = QVBoxLayout()
        side.setContentsMargins(0, 0, 0, 0)
        side.setSpacing(0)
        side.addWidget(self.list, 1)
        side.addWidget(self._menu_button())
        column = QWidget()
        column.setLayout(side)
        row = QHBoxLayout()
        row.setContentsMargins(0, 0, 0, 0)
        row.setSpacing(0)
        row.addWidget(column)
        row.addWidget(_scrollable(self.stack), 1)
        self.banners = Banners(self._show_page_titled)
        self._top = QVBoxLayout()
        self._top.setContentsMargins(0, 0, 0, 0)
        self._top.setSpacing(SPACE // 2)
        self.bar = HighVoltageBar(self.run_page.runner.status, self.session)
        self._top.addWidget(self.bar)
        self._top.addWidget(self.banners)
        self._top.addWidget(CompilationBar(self.compilation))
        self.error_panel = ErrorPanel(self.session.program_errors)
        self._top.addWidget(self.error_panel)
        self._top.addLayout(row, 1)
        middle = QWidget()
        middle.setLayout(self._top)
        self.setCentralWidget(middle)
        bar = self.statusBar()
        bar.setSizeGripEnabled(False)
        self.status = label("")
        bar.addWidget(self.status, 1)
        self.rig_and_folder = label("", "muted")
        bar.addPermanentWidget(self.rig_and_folder)

    def _menu_button(self) -> QToolButton:
        menu = QMenu(self)
        guide = QAction("&Guide", self)
        guide.setShortcut(QKeySequence(Qt.Key.Key_F1))
        guide.triggered.connect(self.show_guide)
        menu.addAction(guide)
        self.addAction(guide)
        schemes = menu.addMenu("&Colour scheme")
        self._scheme_actions: dict[str, QAction] = {}
        for name, words in _COLOUR_SCHEMES.items():
            action = QAction(words, self)
            action.setCheckable(True)
            action.triggered.connect(lambda _=False, name=name: self.set_colour_scheme(name))
            schemes.addAction(action)
            self._scheme_actions[name] = action
        reset = QAction("&Reset layout", self)
        reset.triggered.connect(self.reset_layout)
        menu.addAction(reset)
        errors = QAction("Program &errors", self)
        errors.triggered.connect(lambda: self.error_panel.show_errors())
        menu.addAction(errors)
        made = QToolButton()
        made.setText("≡  Window")
        made.setToolTip("Guide (F1), colour scheme, layout, errors of the program")
        made.setPopupMode(QToolButton.ToolButtonPopupMode.InstantPopup)
        made.setMenu(menu)
        made.setFixedWidth(132)
        made.setMinimumHeight(32)
        return made

    def _connect(self) -> None:
        session, run = self.session, self.run_page
        self.bar.stop_pressed.connect(lambda: run.runner.stop(f"STOP on {self._title()}"))
        run.runner.state_changed.connect(self._watch_keys)
        run.runner.ended.connect(self._run_ended, Qt.ConnectionType.QueuedConnection)
        session.recovery.changed.connect(self._unsaved_changed)
        self._unsaved_changed()
        run.show_sequence.connect(lambda: self.show_page(self.sequence_page))
        run.show_recording.connect(self._show_recording)
        session.rig_changed.connect(self._rig_or_folder_changed)
        session.folder_changed.connect(self._rig_or_folder_changed)
        self.rig_page.output_read.connect(run.runner.status.set_read_at_rest)
        session.message.connect(self.status.setText)
        self.compilation.running_changed.connect(self.planner.hold)
        self.compilation.failed.connect(lambda words: run.alarms.add("warning", words))
        self.planner.progressed.connect(self.sequence_page.preview.show_progress)
        self.sequence_page.show_run.connect(lambda: self.show_page(run))
        self.campaign_page.show_recording.connect(self._show_recording)
        run.show_follow.connect(lambda: self.show_page(self.follow_page))
        QGuiApplication.styleHints().colorSchemeChanged.connect(self._apply_colour_scheme)
        session.running_changed.connect(self._watch_keys)
        self.addActions(run.display.mark_bar.actions())  # the key M on every page
        session.blocks_changed.connect(lambda: self.banners.show_blocks(session.blocks))
        self.banners.show_blocks(session.blocks)
        self._rig_or_folder_changed()

    def _stop_by_key(self, key: str) -> None:
        self.run_page.runner.stop(f"key {key} on {self._title()}")

    def _title(self) -> str:
        """Return the title of the page that is shown."""
        return list(_PAGES.values())[self.list.currentRow()].title

    @Slot()
    def _watch_keys(self) -> None:
        self.stop_keys.watch(self.session.busy)

    @Slot()
    def _rig_or_folder_changed(self) -> None:
        folder = self.session.folder
        session = self.session
        self.rig_and_folder.setText(
            f"rig {session.address}, {session.rig_name}   ·   {folder.name or folder}  "
        )
        self.rig_and_folder.setToolTip(plain_tip(f"Folder of the recordings: {folder}"))

    @Slot(int)
    def _page_changed(self, row: int) -> None:
        self.stack.setCurrentWidget(self._page(row))
        self.session.settings.setValue("page", row)

    @Slot(object)
    def _study_finished(self, _finished: object) -> None:
        for page in self._made("follow_page"):
            page.model.find_studies()
            page.hold.model.find_studies()

    @Slot(Path)
    def _show_recording(self, path: Path) -> None:
        self.recordings_page.choose([path])
        self.show_page(self.recordings_page)

    @Slot(str)
    def _read_sequence(self, toml: str) -> None:
        if self.sequence_page.take(toml):
            self.show_page(self.sequence_page)

    @Slot(str)
    def _play_sequence(self, toml: str) -> None:
        """Show a proposed experiment on the Run page; the operator arms it as usual."""
        if self.sequence_page.take(toml):
            self.show_page(self.run_page)

    @Slot(Path)
    def _play_file(self, path: Path) -> None:
        """Show the sequence in the file ``path`` on the Run page; the operator arms it as usual."""
        if not self.sequence_page.may_replace():
            return
        try:
            toml = read_text(path, "sequence")
        except InputError as error:
            self.follow_page.message.show_text(str(error))
            return
        self.session.set_sequence(toml, path.parent, path)
        self.show_page(self.run_page)

    @Slot(object)
    def _play_hold(self, hold: HoldPlan) -> None:
        """Show a hold with its feedback on the Run page; the operator arms it as usual."""
        if self.sequence_page.take(hold.sequence.toml):
            self.session.set_hold(hold)
            self.show_page(self.run_page)

    @Slot(Path)
    def _show_model(self, path: Path) -> None:
        self.run_page.show_model(path)
        self.show_page(self.run_page)

    def set_colour_scheme(self, name: str) -> None:
        """Use the colour scheme ``system``, ``light`` or ``dark``."""
        self.session.settings.setValue("colour_scheme", name)
        self._apply_colour_scheme()

    @Slot()
    def _apply_colour_scheme(self) -> None:
        name = kept_text(self.session.settings, "colour_scheme", "system")
        theme = {"light": LIGHT, "dark": DARK}.get(name) or system_theme()
        application = QApplication.instance()
        if isinstance(application, QApplication):
            apply(application, theme)
        for key, action in self._scheme_actions.items():
            action.setChecked(key == name)
        self.session.set_theme(theme)

    def _save_state(self) -> None:
        self.session.settings.setValue("geometry", self.saveGeometry())

    def _restore_state(self) -> None:
        settings = self.session.settings
        if not self.restoreGeometry(kept_bytes(settings, "geometry")):
            self._default_geometry()
        # the first start shows the Run page: a simulated rig is ready to be armed
        row = kept_number(settings, "page", self.stack.indexOf(self.run_page))
        self.list.setCurrentRow(min(max(row, 0), len(_PAGES) - 1))

    def _default_geometry(self) -> None:
        available = QGuiApplication.primaryScreen().availableSize()
        self.resize(available.boundedTo(QSize(1600, 980)))

    @Slot()
    def _fit_screen(self) -> None:
        if self.isMaximized() or self.isFullScreen():
            return
        if QGuiApplication.platformName() in NO_SCREEN:
            return
        available = self.screen().availableGeometry()
        frame = self.frameGeometry()
        borders = frame.size() - self.size()
        self.resize(self.size().boundedTo(available.size() - borders))
        frame = self.frameGeometry()
        left = max(available.left(), min(frame.left(), available.right() + 1 - frame.width()))
        top = max(available.top(), min(frame.top(), available.bottom() + 1 - frame.height()))
        if (left, top) != (frame.left(), frame.top()):
            self.move(QPoint(left, top))


def _scrollable(pages: QWidget) -> QScrollArea:
    """Return ``pages`` in an area that scrolls them where the window is smaller than they are."""
    area = QScrollArea()
    area.setFrameShape(QFrame.Shape.NoFrame)
    area.setWidgetResizable(True)
    area.setFocusPolicy(Qt.FocusPolicy.NoFocus)
    area.setWidget(pages)
    return area
