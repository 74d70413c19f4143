"""The main window: the pages at the left, the state of the high voltage always in sight."""

from __future__ import annotations

from pathlib import Path
from typing import Protocol, cast

from PySide6.QtCore import QEvent, QObject, QSize, Qt, Slot
from PySide6.QtGui import QAction, QCloseEvent, QGuiApplication, QKeyEvent, QKeySequence
from PySide6.QtWidgets import (
    QApplication,
    QComboBox,
    QHBoxLayout,
    QLabel,
    QLineEdit,
    QListWidget,
    QMainWindow,
    QMenu,
    QMessageBox,
    QPlainTextEdit,
    QStackedWidget,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from dearig.window.guide import Guide
from dearig.window.hv import HighVoltage, HighVoltageBadge
from dearig.window.layout_state import GROUP
from dearig.window.planner import Planner
from dearig.window.recordings_page import RecordingsPage
from dearig.window.rig_page import RigPage
from dearig.window.run_page import RunPage
from dearig.window.running import simulated
from dearig.window.sequence_page import SequencePage
from dearig.window.session import Session
from dearig.window.study_page import StudyPage
from dearig.window.theme import DARK, LIGHT, apply, system_theme

__all__ = ["MainWindow"]

_COLOUR_SCHEMES = {"system": "As the system has it", "light": "Light", "dark": "Dark"}


class Page(Protocol):
    """What the frame knows of a page."""

    title: str
    shortcut: str


class MainWindow(QMainWindow):
    """Holds the pages together, and lets nothing be closed before the rig is safe."""

    def __init__(self, session: Session) -> None:
        super().__init__()
        self.session = session
        self.setWindowTitle("dearig")
        self.setMinimumHeight(680)  # how wide it is at least the pages say, with their fonts
        self.planner = Planner(session, self)
        self.rig_page = RigPage(session)
        self.sequence_page = SequencePage(session)
        self.run_page = RunPage(session)
        self.recordings_page = RecordingsPage(session)
        self.study_page = StudyPage(session)
        self.pages: tuple[QWidget, ...] = (
            self.rig_page,
            self.sequence_page,
            self.run_page,
            self.recordings_page,
            self.study_page,
        )
        self._guide: Guide | None = None
        self._closing = False
        self._build()
        self._connect()
        self._apply_colour_scheme()
        self._restore()
        self.planner.renew()

    # asked by keys and pages

    def show_page(self, page: QWidget) -> None:
        """Bring ``page`` to the front."""
        self.list.setCurrentRow(self.pages.index(page))

    @Slot()
    def show_guide(self) -> None:
        """Open the guide, beside the window."""
        if self._guide is None:
            self._guide = Guide(self)
        self._guide.show()
        self._guide.raise_()

    @Slot()
    def reset_layout(self) -> None:
        """Put every part back to where it was at the first start."""
        for key in ("geometry", "page", GROUP):
            self.session.settings.remove(key)
        for page in (self.sequence_page, self.recordings_page, self.study_page):
            page.reset_layout()
        self._default_geometry()
        self.show_page(self.run_page)

    def leave(self) -> None:
        """Close without asking, once the rig is safe; for a program that is told to end."""
        self._closing = True
        self.close()

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:  # noqa: N802
        """STOP by a key, whatever has the focus; but a space may still be typed into a text."""
        if event.type() == QEvent.Type.KeyPress and self.run_page.runner.running:
            pressed = cast(QKeyEvent, event)
            key = pressed.key()
            typing = isinstance(QApplication.focusWidget(), QLineEdit | QPlainTextEdit | QComboBox)
            if key == Qt.Key.Key_Escape or (key == Qt.Key.Key_Space and not typing):
                if not pressed.isAutoRepeat():  # the second press means something else
                    self.run_page.stop()
                return True
        return super().eventFilter(watched, event)

    def closeEvent(self, event: QCloseEvent) -> None:  # noqa: N802
        """Ask where a run goes on, and make safe whatever the answer."""
        runner = self.run_page.runner
        if runner.running and not self._closing and not self._ask_to_close():
            event.ignore()
            return
        self._closing = True
        if runner.running:
            # the ramp takes its time; the window stays and shows it, and closes itself after
            runner.stop()
            runner.ended.connect(self.close, Qt.ConnectionType.QueuedConnection)
            event.ignore()
            return
        self._remember()
        self._listen(running=False)
        self.run_page.close_work()
        self.planner.close()
        for page in (
            self.rig_page, self.sequence_page, self.recordings_page, self.study_page
        ):  # fmt: skip
            page.close_work()
        event.accept()

    def _ask_to_close(self) -> bool:
        """True to close. Either way the voltage is ramped down first."""
        runner = self.run_page.runner
        runner.stop()
        asked = QMessageBox(self)
        asked.setWindowTitle("A run is going on")
        asked.setIcon(QMessageBox.Icon.Warning)
        asked.setText("The run is being stopped: the voltage is ramped down to 0 V.")
        asked.setInformativeText("What was recorded is kept. Close the window then?")
        close = asked.addButton("Close", QMessageBox.ButtonRole.AcceptRole)
        asked.addButton("Stay", QMessageBox.ButtonRole.RejectRole)
        asked.exec()
        return asked.clickedButton() is close

    # how it is laid out

    def _build(self) -> None:
        self.list = QListWidget()
        self.list.setObjectName("pages")
        self.list.setFixedWidth(132)
        self.list.setAccessibleName("Pages")
        self.stack = QStackedWidget()
        for number, page in enumerate(self.pages, 1):
            known = cast(Page, page)
            self.list.addItem(known.title)
            self.list.item(number - 1).setToolTip(f"{known.title} ({known.shortcut})")
            self.stack.addWidget(page)
            key = QAction(self)
            key.setShortcut(QKeySequence(known.shortcut))
            key.triggered.connect(lambda _=False, page=page: self.show_page(page))
            self.addAction(key)
        self.list.currentRowChanged.connect(self.stack.setCurrentIndex)
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
        row.addWidget(self.stack, 1)
        middle = QWidget()
        middle.setLayout(row)
        self.setCentralWidget(middle)
        bar = self.statusBar()
        bar.setSizeGripEnabled(False)
        self.badge = HighVoltageBadge(self.session, large=False)
        self.badge.setFixedWidth(270)
        bar.addWidget(self.badge)
        self.status = QLabel()
        bar.addWidget(self.status, 1)
        self.where = QLabel()
        self.where.setProperty("role", "muted")
        bar.addPermanentWidget(self.where)

    def _menu_button(self) -> QToolButton:
        menu = QMenu(self)
        guide = QAction("&Guide", self)
        guide.setShortcut(QKeySequence(Qt.Key.Key_F1))
        guide.triggered.connect(self.show_guide)
        menu.addAction(guide)
        self.addAction(guide)
        looks = menu.addMenu("&Colours")
        self._scheme_actions: dict[str, QAction] = {}
        for name, words in _COLOUR_SCHEMES.items():
            look = QAction(words, self)
            look.setCheckable(True)
            look.triggered.connect(lambda _=False, name=name: self.set_colour_scheme(name))
            looks.addAction(look)
            self._scheme_actions[name] = look
        reset = QAction("&Reset the layout", self)
        reset.triggered.connect(self.reset_layout)
        menu.addAction(reset)
        made = QToolButton()
        made.setText("≡  Window")
        made.setToolTip("Guide (F1), colours, layout")
        made.setPopupMode(QToolButton.ToolButtonPopupMode.InstantPopup)
        made.setMenu(menu)
        made.setFixedWidth(132)
        made.setMinimumHeight(32)
        return made

    def _connect(self) -> None:
        session, run = self.session, self.run_page
        run.runner.state_changed.connect(self._state_changed)
        run.show_sequence.connect(lambda: self.show_page(self.sequence_page))
        run.show_recording.connect(self._show_recording)
        session.rig_changed.connect(self._where_changed)
        session.folder_changed.connect(self._where_changed)
        session.message.connect(self.status.setText)
        self.sequence_page.show_run.connect(lambda: self.show_page(run))
        self.recordings_page.open_sequence.connect(self._read_sequence)
        self.study_page.open_sequence.connect(self._play_sequence)
        self.study_page.show_model.connect(self._show_model)
        QGuiApplication.styleHints().colorSchemeChanged.connect(self._apply_colour_scheme)
        session.running_changed.connect(self._listen)
        self._where_changed()

    @Slot(bool)
    def _listen(self, running: bool) -> None:
        """Hear every key while a run goes on, and none else: all events pass through here."""
        application = QApplication.instance()
        if application is not None:
            application.removeEventFilter(self)
            if running:
                application.installEventFilter(self)

    @Slot(object)
    def _state_changed(self, state: HighVoltage) -> None:
        words = "simulated" if simulated(self.session.address) else ""
        self.badge.show_state(state, words)

    @Slot()
    def _where_changed(self) -> None:
        folder = self.session.folder
        self.where.setText(f"rig {self.session.address}   ·   {folder.name or folder}  ")
        self.where.setToolTip(f"Recordings go to {folder}")
        self._state_changed(self.run_page.runner.state)

    @Slot(int)
    def _page_changed(self, row: int) -> None:
        self.session.settings.setValue("page", row)

    @Slot(Path)
    def _show_recording(self, path: Path) -> None:
        self.recordings_page.choose([path])
        self.show_page(self.recordings_page)

    @Slot(str)
    def _read_sequence(self, toml: str) -> None:
        self.session.set_sequence(toml, Path())
        self.show_page(self.sequence_page)

    @Slot(str)
    def _play_sequence(self, toml: str) -> None:
        """Fill in a proposed experiment; it has to be armed like any other."""
        self.session.set_sequence(toml, Path())
        self.show_page(self.run_page)

    @Slot(Path)
    def _show_model(self, path: Path) -> None:
        self.run_page.show_model(path)
        self.show_page(self.run_page)

    def set_colour_scheme(self, name: str) -> None:
        """``system``, ``light`` or ``dark``."""
        self.session.settings.setValue("look", name)
        self._apply_colour_scheme()

    @Slot()
    def _apply_colour_scheme(self) -> None:
        name = str(self.session.settings.value("look", "system"))
        theme = {"light": LIGHT, "dark": DARK}.get(name) or system_theme()
        application = QApplication.instance()
        if isinstance(application, QApplication):
            apply(application, theme)
        for key, look in self._scheme_actions.items():
            look.setChecked(key == name)
        self.session.set_theme(theme)

    def _remember(self) -> None:
        self.session.settings.setValue("geometry", self.saveGeometry())

    def _restore(self) -> None:
        settings = self.session.settings
        geometry = settings.value("geometry")
        if geometry is None or not self.restoreGeometry(geometry):
            self._default_geometry()
        # a first start shows what is to be done first: a rig that is ready, and the way to run it
        row = int(str(settings.value("page", self.pages.index(self.run_page))))
        self.list.setCurrentRow(min(max(row, 0), len(self.pages) - 1))

    def _default_geometry(self) -> None:
        room = QGuiApplication.primaryScreen().availableSize()
        self.resize(room.boundedTo(QSize(1600, 980)))
