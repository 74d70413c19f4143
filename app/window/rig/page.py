"""Page Rig: choice of the rig, check of its instruments, and its rig file."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from PySide6.QtCore import QSignalBlocker, Qt, Slot
from PySide6.QtGui import QColor, QDragEnterEvent, QDropEvent, QKeySequence, QShowEvent
from PySide6.QtWidgets import (
    QAbstractItemView,
    QButtonGroup,
    QGridLayout,
    QHBoxLayout,
    QHeaderView,
    QLineEdit,
    QRadioButton,
    QScrollArea,
    QTableWidget,
    QTableWidgetItem,
    QTabWidget,
    QVBoxLayout,
    QWidget,
)

from dearig.acquisition.check import CheckOutcome, check_rig
from dearig.acquisition.rigs import is_simulated
from dearig.config.rigfile import RigFile
from dearig.config.rigform import SECTIONS, faults_of, parse_rig_file, section_values
from dearig.config.toml_edit import with_key
from dearig.drivers.daqmx.address import Address
from dearig.drivers.errors import AddressError
from dearig.errors import InputError
from dearig.units import readable
from dearig.window.documents.file_actions import FileActions
from dearig.window.jobs.background import Background
from dearig.window.kit.fields import as_labelled, form_fields
from dearig.window.kit.flow import Flow
from dearig.window.kit.form import Form
from dearig.window.kit.number_box import WholeBox
from dearig.window.kit.theme import SPACE
from dearig.window.kit.widgets import Message, button, card, label, plain_tip, set_wrong
from dearig.window.kit.wrapped_tabs import WrappedTabs
from dearig.window.rig.live_inputs import LiveInputs
from dearig.window.session.page import Page
from dearig.window.session.state import Session
from dearig.window.session.text_file import EditedFile

__all__ = ["RigPage"]

_SHAPES = {"ok": "●", "warning": "▲", "wrong": "✗", "not wired": "○"}
_WORDS = {"ok": "OK", "warning": "Check", "wrong": "Wrong", "not wired": "Not wired"}
_BLOCK, _ADDRESS_BLOCK = "rig file", "rig address"  # keys of what blocks arming
_KINDS = ("sim", "hidden", "local", "remote")


class RigPage(Page):
    """Chooses and checks the rig, and edits the rig file with faults next to their fields."""

    title = "Rig"
    edits = "rig file"

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(session, parent)
        self.session = session
        self.text = session.rig_text
        self._in_force = session.rig_text  # the last text without faults
        self._typing = False  # a name or server is typed, and not taken
        self._saved_meanwhile = False  # the file was saved during a run
        self.forms: dict[str, Form] = {}  # made when their tab is first shown
        self._areas: dict[str, QScrollArea] = {}
        self.file = EditedFile("rig file", session.rig_text, session.rig_path)
        self._checks = Background(self)
        self._checks.done.connect(self._checked)
        self._checks.failed.connect(lambda words: self.summary.show_text(words))
        self._checks.busy_changed.connect(self._checking)
        self.files = FileActions(self, session, "rig file", lambda: (self.text, self.file))
        self.files.chosen.connect(self.files.open)
        self.files.opened.connect(self._opened)
        self.files.saved.connect(self._saved)
        self.outcome: CheckOutcome | None = None
        self.setAcceptDrops(True)
        self._build()
        session.rig_changed.connect(self._rig_changed)
        session.theme_changed.connect(self._show_outcome)
        session.running_changed.connect(self._running_changed)
        self._show_address()
        self._show_outcome()
        self._show_all()

    @classmethod
    def needed(cls, session: Session) -> bool:
        """Return whether the address is that of a card: a wrong one blocks arming from the start.

        The rig file of a session has no faults.
        """
        return not is_simulated(session.address)

    # choice and check of the rig

    @Slot()
    def choose(self) -> None:
        """Use the rig of the fields."""
        kind = _KINDS[self.kinds.checkedId()]
        device = self.device.text().strip()
        address = {
            "sim": "sim",
            "hidden": f"sim:{self.seed.value()}",
            "local": f"daqmx:{device}",
            "remote": f"daqmx:{device}@{self.server.text().strip()}",
        }[kind]
        self._typing = False
        self.seed.setEnabled(kind == "hidden")
        self.device.setEnabled(kind in ("local", "remote"))
        self.server.setEnabled(kind == "remote")
        self.session.set_address(address)
        if self.session.address != address:  # a run goes on
            self._show_address()
        self._block_address()

    @Slot()
    def _address_typed(self) -> None:
        """Block arming until the typed name or server is taken: with Enter, or on leaving it."""
        self._typing = True
        self._block_address()

    def _block_address(self) -> None:
        fault, address = "", self.session.address
        if address.startswith("daqmx:"):
            try:
                Address.parse(address)
            except AddressError as error:
                fault = str(error)
        if self._typing:
            fault = "the name of the card or its server is typed, but not taken: press Enter"
        for field in (self.device, self.server):
            set_wrong(field, bool(fault) and field.isEnabled())
        self.address_fault.show_text(fault, "warn" if self._typing else "bad")
        if fault:
            self.session.block(_ADDRESS_BLOCK, f"rig: {fault}", self.title)
        else:
            self.session.unblock(_ADDRESS_BLOCK)

    @Slot()
    def check(self) -> None:
        """Check the instruments; the output stays at 0 V."""
        address, rig_file = self.session.address, self.session.rig_file
        self.live.stop()  # it has the inputs
        self.instruments.setCurrentIndex(0)

        def look() -> tuple[RigFile, CheckOutcome]:
            self.live.wait()
            return rig_file, check_rig(address, rig_file)

        self._checks.start(look)

    def showEvent(self, event: QShowEvent) -> None:  # noqa: N802
        """Check a simulated rig when the page is shown; a real one waits for the button."""
        super().showEvent(event)
        if self.outcome is None and not self._checks.busy and is_simulated(self.session.address):
            self.check()

    @Slot(object)
    def _checked(self, answer: tuple[RigFile, CheckOutcome]) -> None:
        (rig_file, outcome), session = answer, self.session
        is_present = outcome.rig == session.address and rig_file is session.rig_file
        self.outcome = outcome if is_present else None
        self._show_outcome()
        if is_present and outcome.output is not None:
            session.output_read.emit(outcome.output)

    @Slot(bool)
    def _checking(self, busy: bool) -> None:
        self.check_button.setEnabled(not busy and not self.session.running)
        if busy:
            self.summary.show_text(f"Checking {self.session.address} …", "muted")

    @Slot(bool)
    def _running_changed(self, running: bool) -> None:
        for part in (self.address_card, self.editor):
            part.setEnabled(not running)
        self.check_button.setEnabled(not running and not self._checks.busy)
        if self._saved_meanwhile:
            self._saved()

    @Slot()
    def _rig_changed(self) -> None:
        self.outcome = None
        self._show_outcome()
        self._show_address()
        session = self.session
        if session.rig_text not in (self.text, self._in_force):  # another page opened another file
            self.text = self._in_force = session.rig_text
            self.file = EditedFile("rig file", self.text, session.rig_path)
            self._show_all()

    # the rig file

    def set_value(self, table: str, key: str, value: Any) -> None:
        """Change one key; a rig file with faults shows them, is not used, and blocks arming."""
        self._take(with_key(self.text, table, key, value), self.file)

    def restore(self, text: str, file: EditedFile) -> None:
        """Replace the rig file by the unsaved one of an earlier window."""
        self._take(text, file)
        self._show_all()

    def close_work(self) -> None:
        """Wait for the threads."""
        self.live.close_work()
        self._checks.close()
        self.files.close()

    @Slot(str, EditedFile)
    def _opened(self, text: str, file: EditedFile) -> None:
        self._take(text, file)
        self._show_all()

    @Slot()
    def _saved(self) -> None:
        self._saved_meanwhile = self.session.running
        if not self._saved_meanwhile:
            self._take(self.text, self.file)  # the path may be another one

    def _take(self, text: str, file: EditedFile) -> None:
        if self.session.running:  # it was read meanwhile, or is dropped
            self.files.trouble.show_text(
                "A run goes on: the rig file in force stays. Open the other one after it."
            )
            self._show_all()
            return
        try:
            faults = faults_of(text)
        except InputError as error:
            self.files.trouble.show_text(f"{error}. The previous rig file stays in use.")
            return
        self.text, self.file = text, file
        if not faults:
            self._in_force = text
            folder = None if file.path is None else file.path.resolve().parent
            self.session.set_rig_file(file.path, text, parse_rig_file(text, folder))
        self._show_faults(faults)

    def _show_all(self) -> None:
        for table, form in self.forms.items():
            form.show_values(section_values(self.text, table))
        self._show_faults(faults_of(self.text))

    def _show_faults(self, faults: dict[tuple[str, str], str]) -> None:
        faults = {place: as_labelled(words) for place, words in faults.items()}
        said = set()
        for i, table in enumerate(SECTIONS):
            keys = {k: words for (t, k), words in faults.items() if t == table}
            if table in self.forms:
                self.forms[table].show_faults(keys)
            said |= {(table, k) for k in keys if k in SECTIONS[table].model_fields}
            mark = "✗ " if keys else ""
            self.tabs.tab(i).setText(f"{mark}{table}")
        rest = [words for place, words in faults.items() if place not in said]
        errors = f"{len(faults)} error{'s' if len(faults) > 1 else ''}"
        head = ""
        if faults:
            head = f"Fix {errors}; until then nothing can be armed. {self._limits_in_force()}"
        self.state.show_text("\n".join([head, *rest]).strip(), "bad")
        self.files.note()
        self.save_button.setEnabled(not faults)
        self.save_as_button.setEnabled(not faults)
        self._block_arming(faults)

    def _limits_in_force(self) -> str:
        limits = self.session.rig_file.limits
        return (
            f"The previous limits are in force: {limits.voltage_min_kV:g} to "
            f"{limits.voltage_max_kV:g} kV"
        )

    def _block_arming(self, faults: dict[tuple[str, str], str]) -> None:
        """Block arming while the rig file has faults: a limit typed then is not in force."""
        if not faults:
            self.session.unblock(_BLOCK)
            return
        (table, key), words = next(iter(faults.items()))
        place = as_labelled(".".join(filter(None, (table, key))))
        named = words if words.startswith(place) else f"{place}: {words}"
        more = f" ({len(faults) - 1} more on the page Rig)" if len(faults) > 1 else ""
        self.session.block(
            _BLOCK, f"rig file: {named}{more}. {self._limits_in_force()}", self.title
        )

    def dragEnterEvent(self, event: QDragEnterEvent) -> None:  # noqa: N802
        urls = event.mimeData().urls()
        if not self.session.running and any(u.toLocalFile().endswith(".toml") for u in urls):
            event.acceptProposedAction()

    def dropEvent(self, event: QDropEvent) -> None:  # noqa: N802
        names = [url.toLocalFile() for url in event.mimeData().urls()]
        if names and not self.session.running:
            self.files.open(Path(names[0]))
        event.acceptProposedAction()

    # display

    @Slot()
    def _show_outcome(self) -> None:
        outcome, theme = self.outcome, self.session.theme
        self.findings.setRowCount(0 if outcome is None else len(outcome.findings))
        if outcome is None:
            self.summary.show_text(
                f"{self.session.address} is not checked yet. Check reads every instrument; the "
                f"output stays at 0 V.",
                "muted",
            )
            return
        colours = {
            "ok": theme.good, "warning": theme.warn, "wrong": theme.bad, "not wired": theme.muted
        }  # fmt: skip
        for row, finding in enumerate(outcome.findings):
            verdict = f"{_SHAPES[finding.verdict]} {_WORDS[finding.verdict]}"
            found = finding.found
            if finding.verdict != "ok" and finding.wanted:
                found += f"; expected {finding.wanted}"
            if finding.advice:
                found += f"; {finding.advice}"
            for column, text in enumerate((verdict, finding.instrument, finding.item, found)):
                item = QTableWidgetItem(readable(as_labelled(text)))
                item.setToolTip(plain_tip(readable(as_labelled(finding.sentence))))
                item.setFlags(Qt.ItemFlag.ItemIsSelectable | Qt.ItemFlag.ItemIsEnabled)
                if column == 0:
                    item.setForeground(QColor(colours[finding.verdict]))
                self.findings.setItem(row, column, item)
        wrong = any(f.verdict == "wrong" for f in outcome.findings)
        self.summary.show_text(outcome.summary, "bad" if wrong else "good")

    def _show_address(self) -> None:
        address = self.session.address
        body = address.partition(":")[2]
        kind = "remote" if "@" in body else "local" if address.startswith("daqmx:") else "sim"
        if address.startswith("sim:"):
            kind = "hidden"
            seed = body.partition(":")[0]
            with QSignalBlocker(self.seed):  # shown, not chosen
                self.seed.setValue(int(seed) if seed.isdigit() else 0)
        if kind in ("local", "remote"):
            device, _, server = body.partition("@")
            self.device.setText(device)
            if server:
                self.server.setText(server)
        self.kinds.button(_KINDS.index(kind)).setChecked(True)
        self.seed.setEnabled(kind == "hidden")
        self.device.setEnabled(kind in ("local", "remote"))
        self.server.setEnabled(kind == "remote")
        self._typing = False
        self._block_address()

    # layout

    def _build(self) -> None:
        outer = QHBoxLayout(self)
        outer.setContentsMargins(SPACE, SPACE, SPACE, SPACE)
        outer.setSpacing(SPACE)
        left = QVBoxLayout()
        left.setSpacing(SPACE)
        self.address_card = self._make_address_card()
        left.addWidget(self.address_card)
        left.addWidget(self._make_check_card(), 1)
        outer.addLayout(left, 10)
        self.editor = self._make_editor_card()
        outer.addWidget(self.editor, 14)  # all its tabs are seen at 1366 px

    def _make_address_card(self) -> QWidget:
        grid = QGridLayout()
        grid.addWidget(label("Rig", "heading"), 0, 0, 1, 3)
        self.kinds = QButtonGroup(self)
        self.seed = WholeBox(0, 999_999, 7)
        self.seed.setMinimumHeight(24)  # as high as its neighbours
        self.seed.setToolTip("Each seed is another film: with another hidden effect, or with none")
        self.device = QLineEdit(self.session.rig_file.card.device)
        self.device.setToolTip("Name of the card in NI MAX, for example Dev1")
        self.server = QLineEdit("localhost:31763")
        self.server.setToolTip("HOST:PORT of NI's gRPC device server")
        for i, (words, tip, field) in enumerate(
            (
                ("&Simulated rig", "Simulated rig that follows the model exactly", None),
                ("Simulated rig with a &hidden effect",
                 "A film with an effect that the model lacks", self.seed),
                ("&Card in this computer", "Local card, through NI-DAQmx", self.device),
                ("Card on a &network server",
                 "Card of another computer, through NI's gRPC device server", self.server),
            )
        ):  # fmt: skip
            choice = QRadioButton(words)
            choice.setToolTip(tip)
            self.kinds.addButton(choice, i)
            grid.addWidget(choice, i + 1, 0)
            if field is not None:
                grid.addWidget(field, i + 1, 1)
        grid.setColumnStretch(1, 1)
        self.kinds.idClicked.connect(self.choose)
        self.seed.valueChanged.connect(self.choose)
        for typed in (self.device, self.server):
            typed.textEdited.connect(self._address_typed)
            typed.editingFinished.connect(self.choose)
        self.address_fault = Message()
        grid.addWidget(self.address_fault, grid.rowCount(), 0, 1, 3)
        return card(grid)

    def _make_check_card(self) -> QWidget:
        column = QVBoxLayout()
        row = QHBoxLayout()
        row.addWidget(label("Instruments", "heading"))
        row.addStretch(1)
        self.check_button = button(
            "Chec&k", "Check every instrument; the output stays at 0 V (F7)", primary=True
        )
        self.check_button.setShortcut("F7")
        self.check_button.clicked.connect(self.check)
        row.addWidget(self.check_button)
        column.addLayout(row)
        self.summary = Message()
        self.live = LiveInputs(self.session)
        checked = QWidget()
        results = QVBoxLayout(checked)
        results.setContentsMargins(0, SPACE // 2, 0, 0)
        results.addWidget(self.summary)
        self.instruments = QTabWidget()
        self.instruments.addTab(checked, "Check")
        self.instruments.addTab(self.live, "Live values")
        self.instruments.setTabToolTip(1, "Every input at rest, with its noise; nothing is output")
        column.addWidget(self.instruments, 1)
        self.findings = QTableWidget(0, 4)
        self.findings.setHorizontalHeaderLabels(("", "Instrument", "Item", "Result"))
        self.findings.verticalHeader().hide()
        self.findings.setShowGrid(False)
        self.findings.setWordWrap(True)
        self.findings.setSelectionBehavior(QAbstractItemView.SelectionBehavior.SelectRows)
        self.findings.setTabKeyNavigation(False)
        self.findings.setAccessibleName("Results of the check")
        header = self.findings.horizontalHeader()
        header.setSectionResizeMode(0, QHeaderView.ResizeMode.ResizeToContents)
        header.resizeSection(1, 120)  # px; a longer name wraps
        # the result, which says what to do, has as much room as what it is about
        header.setSectionResizeMode(2, QHeaderView.ResizeMode.Stretch)
        header.setSectionResizeMode(3, QHeaderView.ResizeMode.Stretch)
        self.findings.verticalHeader().setSectionResizeMode(QHeaderView.ResizeMode.ResizeToContents)
        results.addWidget(self.findings, 1)
        return card(column)

    def _make_editor_card(self) -> QWidget:
        column = QVBoxLayout()
        row = Flow()
        row.add(label("Rig file", "heading"), self.files.name, share=1)
        open_button = button("&Open …", "Read a rig file; files can be dropped here (Ctrl+Shift+O)")
        open_button.setShortcut(QKeySequence("Ctrl+Shift+O"))
        open_button.clicked.connect(self.files.ask_open)
        self.save_button = button("&Save", "Write the rig file to its file (Ctrl+S)")
        self.save_button.setShortcut(QKeySequence("Ctrl+S"))
        self.save_button.clicked.connect(self.files.save)
        self.save_as_button = button(
            "Save &as …", "Write the rig file to another file (Ctrl+Shift+S)"
        )
        self.save_as_button.setShortcut(QKeySequence("Ctrl+Shift+S"))
        self.save_as_button.clicked.connect(self.files.ask_save)
        defaults = button("&Thesis rig", "Use the rig file of the thesis")
        defaults.clicked.connect(self._ask_defaults)
        for made in (open_button, self.save_button, self.save_as_button, defaults):
            row.add(made)
        column.addLayout(row)
        column.addWidget(self.files.trouble)
        self.state = Message()
        column.addWidget(self.state)
        self.tabs = WrappedTabs()
        for table in SECTIONS:
            area = QScrollArea()
            area.setWidgetResizable(True)
            area.setFrameShape(QScrollArea.Shape.NoFrame)
            self.tabs.add(area, table)
            self._areas[table] = area
        self.tabs.current_changed.connect(self._tab_changed)
        self.form("film")
        column.addWidget(self.tabs, 1)
        return card(column)

    def form(self, table: str) -> Form:
        """Return the form of one table of the rig file."""
        if table not in self.forms:
            values = section_values(self.text, table)
            form = Form(form_fields(SECTIONS[table]), values, explain=True)
            form.changed.connect(lambda key, value: self.set_value(table, key, value))
            form.setContentsMargins(SPACE // 2, SPACE, SPACE // 2, SPACE)
            self._areas[table].setWidget(form)
            self.forms[table] = form
        return self.forms[table]

    def show_table(self, table: str) -> None:
        """Show the tab of one table of the rig file."""
        self.tabs.show_page(list(SECTIONS).index(table))

    @Slot(int)
    def _tab_changed(self, place: int) -> None:
        self.form(list(SECTIONS)[place])
        self._show_faults(faults_of(self.text))

    @Slot()
    def _ask_defaults(self) -> None:
        if self.files.confirm_discard():
            self._take("", EditedFile("rig file", ""))
            self._show_all()
