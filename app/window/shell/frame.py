"""Main window: the list of pages, the pages, and the state of the high voltage."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TypeVar, cast

from PySide6.QtCore import QEvent, QPoint, QRect, QSize, Qt, QTimer, Slot
from PySide6.QtGui import (
    QAction,
    QCloseEvent,
    QGuiApplication,
    QKeySequence,
    QMoveEvent,
    QResizeEvent,
    QScreen,
    QShowEvent,
)
from PySide6.QtWidgets import (
    QAbstractScrollArea,
    QApplication,
    QDialog,
    QFrame,
    QHBoxLayout,
    QListWidget,
    QMainWindow,
    QMenu,
    QMessageBox,
    QScrollArea,
    QStackedWidget,
    QStyle,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from dearig.analysis.hold import HoldPlan
from dearig.window import NO_SCREEN
from dearig.window.documents.dialogs import run_dialog
from dearig.window.documents.questions import may_close, offer_unsaved
from dearig.window.high_voltage.bar import HighVoltageBar
from dearig.window.high_voltage.stop_keys import StopKeys
from dearig.window.kit.field_guard import FieldGuard
from dearig.window.kit.theme import DARK, LIGHT, SPACE, apply, system_theme
from dearig.window.kit.turns import Turns
from dearig.window.kit.widgets import ElidedLabel
from dearig.window.recordings.library import shared_library
from dearig.window.recordings.page import RecordingsPage
from dearig.window.run.page import RunPage
from dearig.window.run.runner import Play
from dearig.window.sequence.page import SequencePage
from dearig.window.sequence.planner import Planner
from dearig.window.session.layout_state import GROUP
from dearig.window.session.page import Page
from dearig.window.session.settings import kept_bytes, kept_number, kept_text
from dearig.window.session.state import Session
from dearig.window.session.text_file import EditedFile
from dearig.window.shell.banners import Banners
from dearig.window.shell.compilation import Compilation, CompilationBar
from dearig.window.shell.error_panel import ErrorPanel
from dearig.window.shell.guide import Guide
from dearig.window.shell.idle_pages import IdlePages
from dearig.window.shell.pages import PAGES

__all__ = ["MainWindow"]

_COLOUR_SCHEMES = {"system": "Same as the system", "light": "Light", "dark": "Dark"}
_LIST = 116  # px, width of the list of pages
_SETTLING = 1000  # ms after the window is shown in which a window manager gives it its frame
P = TypeVar("P", bound=Page)


class MainWindow(QMainWindow):
    """Holds the pages; it closes only when the rig is safe."""

    def __init__(self, session: Session) -> None:
        super().__init__()
        self.session = session
        self.setWindowTitle("dearig[*]")  # Qt shows a mark there while something is not saved
        self.field_guard = FieldGuard(self)
        self.planner = Planner(session, self)
        self.compilation = Compilation(self)
        self.library = shared_library(session)  # lists the folder while the window is made
        self._pages: dict[type[Page], Page] = {}
        self._drawn: set[type[Page]] = set()
        self._turns, self._drawing = (Turns(lambda: session.busy, self) for _ in range(2))
        self._make_list()
        self.run_page = self.page(RunPage)
        self.sequence_page = self.page(SequencePage)
        for kind in PAGES:
            if kind.needed(session):
                self.page(kind)
        self.stop_keys = StopKeys(self._stop_by_key, lambda: session.busy, self)
        self._build()
        self._guide: Guide | None = None
        self._closing = self._settling = False
        # after the last of several moves, such as those of a drag
        self._moved = QTimer(self, singleShot=True, interval=_SETTLING)
        self._moved.timeout.connect(self._keep_stop_in_reach)
        self._by_signal = False  # closed by a signal: no one is there to be asked
        self._connect()
        self.idle_pages = IdlePages(session, self._make_next_page, self)
        self._apply_colour_scheme()
        self._restore_state()
        if not self.compilation.start():
            self.planner.renew()
        self.idle_pages.start()

    # pages

    @property
    def pages(self) -> tuple[Page, ...]:
        """All pages in the order of the list; those that no one has needed yet are made."""
        return tuple(map(self.page, PAGES))

    def page(self, kind: type[P]) -> P:
        """Return the page of the class ``kind``; makes it where it has not been needed yet."""
        if kind not in self._pages:
            self._put(kind.make(self.session, self))
        return cast(P, self._pages[kind])

    def _make_next_page(self) -> bool:
        """Make a page, or the guide, that was not shown yet; return False once all are.

        It is drawn too: Qt lays a page out, and applies the style sheet to each of its parts, when
        it is drawn for the first time.
        """
        kind = next((kind for kind in PAGES if kind not in self._drawn), None)
        if kind is not None:
            page = self.page(kind)
            self._drawn.add(kind)
            page.resize(self.stack.size())
            page.grab()
        elif self._guide is None:
            self._guide = Guide(self)
            self._guide.grab()
        else:
            return False
        return True

    def _put(self, page: Page) -> None:
        """Put a new page into its place, which is empty and not shown, and serve its signals."""
        kind = type(page)
        self._pages[kind] = page
        row = PAGES.index(kind)
        place = cast(QWidget, self.stack.widget(row))
        self.stack.insertWidget(row, page)
        self.stack.removeWidget(place)
        place.deleteLater()
        page.go_to.connect(self._show_page_titled)
        page.show_recording.connect(self._show_recording)
        page.edit_sequence.connect(self._edit_sequence)
        page.play_sequence.connect(self._play_sequence)
        page.play_hold.connect(self._play_hold)
        page.use_model.connect(lambda path: self.run_page.show_model(path))

    # commands

    def show_page(self, page: QWidget) -> None:
        """Bring ``page`` to the front."""
        self.list.setCurrentRow(self.stack.indexOf(page))

    @Slot(str)
    def _show_page_titled(self, title: str) -> None:
        self.list.setCurrentRow([page.title for page in PAGES].index(title))

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
        self._turns.add(
            (
                *(page.reset_layout for page in self._pages.values()),
                self._default_geometry,
                lambda: self.show_page(self.run_page),
            )
        )

    def leave(self) -> None:
        """Close without a question once the rig is safe; for a program that gets a signal.

        Unsaved texts are kept for the next start.
        """
        self._closing = self._by_signal = True
        for dialog in self.findChildren(QDialog):
            if dialog.isVisible():
                dialog.reject()  # no one is there to answer it
        self.close()  # does nothing while ``closeEvent`` asks: it closes when the question ends

    def showEvent(self, event: QShowEvent) -> None:  # noqa: N802
        """Fit the window, with its frame, into the screen: the bar with STOP must be visible."""
        super().showEvent(event)
        self._settling = True
        QTimer.singleShot(0, self._fit_screen)
        # a window manager adds its frame, and moves the window for it, soon after that
        QTimer.singleShot(_SETTLING, self._settled)

    def resizeEvent(self, event: QResizeEvent) -> None:  # noqa: N802
        with self._drawn_in_turns(self.stack):
            super().resizeEvent(event)

    def moveEvent(self, event: QMoveEvent) -> None:  # noqa: N802
        super().moveEvent(event)
        if self._settling:
            QTimer.singleShot(0, self._fit_screen)
        self._place_changed()

    def changeEvent(self, event: QEvent) -> None:  # noqa: N802
        """Come back at once while STOP must be within reach: an icon has none, and no keys."""
        super().changeEvent(event)
        minimised = event.type() == QEvent.Type.WindowStateChange and self.isMinimized()
        if minimised and self.session.busy:
            QTimer.singleShot(0, self._come_back)

    @Slot()
    def _come_back(self) -> None:
        if not (self.session.busy and self.isMinimized()):
            return
        self.setWindowState(self.windowState() & ~Qt.WindowState.WindowMinimized)
        self.activateWindow()
        self.session.message.emit("The window stays open while STOP may be needed")

    @Slot()
    def _keep_stop_in_reach(self) -> None:
        """Move the window into the screen where STOP is not on one while it may be needed."""
        stop = self.bar.stop_button
        place = QRect(stop.mapToGlobal(QPoint(0, 0)), stop.size())
        screens = QGuiApplication.screens()
        seen = any(screen.availableGeometry().contains(place) for screen in screens)
        if self.session.busy and not seen:
            self._fit_screen()

    @Slot(QScreen)
    def _watch_screen(self, screen: QScreen) -> None:
        screen.availableGeometryChanged.connect(self._place_changed)

    @Slot()
    def _place_changed(self) -> None:
        self._moved.start()

    @Slot()
    def _settled(self) -> None:
        self._fit_screen()
        self._settling = False

    def closeEvent(self, event: QCloseEvent) -> None:  # noqa: N802
        """Ask during a run, and make the rig safe whatever the answer."""
        runner = self.run_page.runner
        asks = runner.running and not self._closing
        if asks and not self._ask_to_close() and not self._by_signal:
            event.ignore()
            return
        self._closing = True
        if runner.running:
            # the window shows the ramp, and closes when the run has ended
            runner.stop("the end of the window")
            event.ignore()
            return
        closes = self._by_signal or may_close(self, self.session)
        if not closes and not self._by_signal:  # a signal may come while the question is open
            self._closing = False
            event.ignore()
            return
        self.session.recovery.close(keep=self._by_signal)
        self._save_state()
        self.run_page.close_work()  # first: the rig is made safe
        self.idle_pages.close()
        self.compilation.close()
        self.bar.close_work()
        self.planner.close()
        for page in self._pages.values():
            if page is not self.run_page:
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
        kinds = {kind.edits: kind for kind in PAGES if kind.edits}

        def restore(text: str, file: EditedFile) -> None:
            self.page(kinds[file.what]).restore(text, file)

        offer_unsaved(self, self.session, dict.fromkeys(kinds, restore))

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

    def _make_list(self) -> None:
        self.list = QListWidget()
        self.list.setObjectName("pages")
        self.list.setFixedWidth(_LIST)
        self.list.setAccessibleName("Pages")
        self.stack = _Stack()
        for place, kind in enumerate(PAGES):
            shortcut = f"Ctrl+{place + 1}"
            self.list.addItem(kind.title)
            self.list.item(place).setToolTip(f"{kind.title} ({shortcut})")
            self.stack.addWidget(QWidget())
            key = QAction(self)
            key.setShortcut(QKeySequence(shortcut))
            key.triggered.connect(lambda _=False, row=place: self.list.setCurrentRow(row))
            self.addAction(key)

    def _build(self) -> None:
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
        self.bar.add_notices(self.banners)
        self._top.addWidget(self.bar)
        self._top.addLayout(row, 1)
        # below the pages: what comes and goes must not move them
        self.error_panel = ErrorPanel(self.session.program_errors)
        self._top.addWidget(self.error_panel)
        middle = QWidget()
        middle.setLayout(self._top)
        self.setCentralWidget(middle)
        bar = self.statusBar()
        bar.setSizeGripEnabled(False)
        self.status = ElidedLabel()
        bar.addWidget(self.status, 1)
        bar.addPermanentWidget(CompilationBar(self.compilation))
        self.rig_and_folder = ElidedLabel("muted", hugging=True)
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
        made.setFixedWidth(_LIST)
        made.setMinimumHeight(32)
        return made

    def _connect(self) -> None:
        session, run = self.session, self.run_page
        self.bar.stop_pressed.connect(lambda: run.runner.stop(f"STOP on {self._title()}"))
        run.runner.state_changed.connect(self._apply_colour_scheme)  # one that was chosen meanwhile
        run.runner.ended.connect(self._run_ended, Qt.ConnectionType.QueuedConnection)
        session.recovery.changed.connect(self._unsaved_changed)
        self._unsaved_changed()
        session.rig_changed.connect(self._rig_or_folder_changed)
        session.folder_changed.connect(self._rig_or_folder_changed)
        session.message.connect(self.status.show_text)
        self.compilation.running_changed.connect(self.planner.hold)
        self.compilation.failed.connect(lambda words: run.alarms.add("warning", words))
        self.planner.progressed.connect(self.sequence_page.preview.show_progress)
        QGuiApplication.styleHints().colorSchemeChanged.connect(self._apply_colour_scheme)
        session.running_changed.connect(self._apply_colour_scheme)
        for screen in QGuiApplication.screens():
            self._watch_screen(screen)
        application = cast(QGuiApplication, QGuiApplication.instance())
        application.screenAdded.connect(self._watch_screen)
        application.screenRemoved.connect(self._place_changed)
        session.armed_changed.connect(self._place_changed)
        self.addActions(run.display.mark_bar.actions())  # the key M on every page
        session.blocks_changed.connect(lambda: self.banners.show_blocks(session.blocks))
        self.banners.show_blocks(session.blocks)
        self._rig_or_folder_changed()

    def _stop_by_key(self, key: str) -> None:
        self.run_page.runner.stop(f"key {key} on {self._title()}")

    def _title(self) -> str:
        """Return the title of the page that is shown."""
        return PAGES[self.list.currentRow()].title

    @Slot()
    def _rig_or_folder_changed(self) -> None:
        folder = self.session.folder
        session = self.session
        self.rig_and_folder.show_text(
            f"rig {session.address}, {session.rig_name}   ·   {folder.name or folder}  ",
            f"Folder of the recordings: {folder}",
        )

    @Slot(int)
    def _page_changed(self, row: int) -> None:
        page = self.page(PAGES[row])
        self._drawn.add(PAGES[row])
        with self._drawn_in_turns(page):
            self.stack.setCurrentWidget(page)
        self.session.settings.setValue("page", row)

    @contextmanager
    def _drawn_in_turns(self, page: QWidget) -> Iterator[None]:
        """Draw each part of ``page`` that takes long in a turn of its own while the rig is busy."""
        self._drawing.finish()
        parts = page.findChildren(QAbstractScrollArea)
        for part in (page, *parts) if self.session.busy else ():
            part.setUpdatesEnabled(False)
        yield
        # what is in view first: until it is drawn, there is what was there before
        self._drawing.add(
            partial(part.setUpdatesEnabled, True)
            for part in (page, *sorted(parts, key=lambda part: not part.isVisible()))
        )

    @Slot(Path)
    def _show_recording(self, path: Path) -> None:
        recordings = self.page(RecordingsPage)
        recordings.choose([path])
        self.show_page(recordings)

    @Slot(str)
    def _edit_sequence(self, toml: str) -> None:
        if self.sequence_page.take(toml):
            self.show_page(self.sequence_page)

    @Slot(str, object)
    def _play_sequence(self, toml: str, path: Path | None) -> None:
        """Show the sequence ``toml``, of the file ``path``, on the Run page, to arm it as usual."""
        if self.sequence_page.take(toml, path):
            self.show_page(self.run_page)

    @Slot(object)
    def _play_hold(self, hold: HoldPlan) -> None:
        """Show a hold with its feedback on the Run page; the operator arms it as usual."""
        if self.sequence_page.take(hold.sequence.toml):
            self.session.set_hold(hold)
            self.show_page(self.run_page)

    def set_colour_scheme(self, name: str) -> None:
        """Use the colour scheme ``system``, ``light`` or ``dark``; not before a run has ended."""
        self.session.settings.setValue("colour_scheme", name)
        if self.session.busy:
            self.session.message.emit("The colours change once the rig is disarmed")
        self._apply_colour_scheme()

    @Slot()
    def _apply_colour_scheme(self) -> None:
        name = kept_text(self.session.settings, "colour_scheme", "system")
        for key, action in self._scheme_actions.items():
            action.setChecked(key == name)
        if self.session.busy:
            return  # Qt restyles all widgets in one go, which takes seconds: STOP would wait
        theme = {"light": LIGHT, "dark": DARK}.get(name) or system_theme()
        application = QApplication.instance()
        if isinstance(application, QApplication):
            apply(application, theme)
        self.session.set_theme(theme)

    def _save_state(self) -> None:
        self.session.settings.setValue("geometry", self.saveGeometry())

    def _restore_state(self) -> None:
        settings = self.session.settings
        if not self.restoreGeometry(kept_bytes(settings, "geometry")):
            self._default_geometry()
        # the first start shows the Run page: a simulated rig is ready to be armed
        row = kept_number(settings, "page", self.stack.indexOf(self.run_page))
        self.list.setCurrentRow(min(max(row, 0), len(PAGES) - 1))

    def _default_geometry(self) -> None:
        available = QGuiApplication.primaryScreen().availableSize()
        # the frame, which is not known yet, has a title of some such height
        title = self.style().pixelMetric(QStyle.PixelMetric.PM_TitleBarHeight)
        self.resize((available - QSize(0, title)).boundedTo(QSize(1600, 980)))

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


class _Stack(QStackedWidget):
    """Pages of which each needs no more room than it has itself."""

    def __init__(self) -> None:
        super().__init__()
        self.currentChanged.connect(self.updateGeometry)

    def minimumSizeHint(self) -> QSize:  # noqa: N802
        shown = self.currentWidget()
        return super().minimumSizeHint() if shown is None else shown.minimumSizeHint()

    def heightForWidth(self, width: int) -> int:  # noqa: N802
        """Return what the page needs at least; Qt would return what it likes to have."""
        shown = self.currentWidget()
        layout = None if shown is None else shown.layout()
        if layout is None or not layout.hasHeightForWidth():
            return self.minimumSizeHint().height()
        return layout.totalMinimumHeightForWidth(width)


def _scrollable(pages: QWidget) -> QScrollArea:
    """Return ``pages`` in an area that scrolls them where the window is smaller than they are."""
    area = QScrollArea()
    area.setFrameShape(QFrame.Shape.NoFrame)
    area.setWidgetResizable(True)
    area.setFocusPolicy(Qt.FocusPolicy.NoFocus)
    area.setWidget(pages)
    return area
