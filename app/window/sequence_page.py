"""Page Sequence: write a sequence, see what it does, and what the limits refuse."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import Qt, Signal, Slot
from PySide6.QtGui import QDragEnterEvent, QDropEvent, QKeySequence
from PySide6.QtWidgets import QFileDialog, QHBoxLayout, QMenu, QSplitter, QVBoxLayout, QWidget

from dearig.config.presets import PRESETS
from dearig.config.toml_input import read_text
from dearig.errors import InputError
from dearig.recording.files import check_output, replaced_when_done
from dearig.window.background import Background
from dearig.window.draft import Draft, Place, has_comments, place_of, relative_csv
from dearig.window.layout_state import remember
from dearig.window.preview_panel import PreviewPanel
from dearig.window.sequence_editor import SequenceEditor
from dearig.window.session import Session
from dearig.window.theme import SPACE
from dearig.window.widgets import Message, button, label, menu_button, plain_tip

__all__ = ["SequencePage"]

_ENDINGS = (".toml", ".csv")


class SequencePage(QWidget):
    """Shows and changes the sequence of the session: ``editor`` at the left, ``preview`` right."""

    title = "Sequence"
    shortcut = "Ctrl+2"

    show_run = Signal()

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.session = session
        self.editor = SequenceEditor(session.sequence_toml)
        self.preview = PreviewPanel(session)
        self._sent = session.sequence_toml  # the text that this page gave to the session last
        self._warned: tuple[Path, str] | None = None
        self._files = Background(self)
        self._files.done.connect(self._file_done)
        self._files.failed.connect(lambda sentence: self.trouble.show_text(sentence))
        self.setAcceptDrops(True)
        self._build()
        self.editor.edited.connect(self._edited)
        self.editor.row_chosen.connect(self._highlight)
        self.editor.file_wanted.connect(self._ask_csv)
        session.sequence_changed.connect(self._sequence_changed)
        session.rig_changed.connect(self.preview.show_planning)
        session.preview_changed.connect(self._preview_changed)
        session.recent_changed.connect(self._recent_changed)
        self._recent_changed()
        self.editor.fill(0)
        self._enable_undo()
        if session.preview is not None:
            self._preview_changed()

    @property
    def draft(self) -> Draft:
        """The sequence as it is written."""
        return self.editor.draft

    # files

    def open_file(self, path: Path) -> None:
        """Read a sequence (.toml), or add a waveform (.csv) as a segment."""
        if path.suffix.lower() == ".csv":
            self.add_csv(path)
            return
        self._files.start(lambda: (path, read_text(path, "sequence")))

    def save_file(self, path: Path) -> None:
        """Write the sequence to ``path``; an existing file is replaced.

        A changed sequence has no comments. A file that has some is replaced only when asked twice.
        """
        text = self.session.sequence_toml

        def write() -> tuple[Path, None]:
            out = check_output(path, overwrite=True)
            if self._warned != (path, text) and not has_comments(text) and out.is_file():
                there = out.read_text(encoding="utf-8", errors="replace")
                if has_comments(there):
                    self._warned = path, text
                    raise InputError(
                        f"{out.name} has comments (#), which the changed sequence cannot keep; "
                        f"nothing was written: save again to replace it, or choose another name"
                    )
            with replaced_when_done(out, overwrite=True) as partial:
                partial.write_text(text, encoding="utf-8")
            return out, None

        self._files.start(write)

    def add_csv(self, path: Path) -> None:
        """Add a waveform (columns time_s and voltage_kV) as a segment."""
        session = self.session
        if session.sequence_path is None and 'kind = "csv"' not in session.sequence_toml:
            session.sequence_folder = path.parent  # a sequence in no file belongs to its waveform
        self.editor.add("csv", file=relative_csv(path, session.sequence_folder))

    def preset(self, name: str) -> None:
        """Replace the sequence by the preset ``name``."""
        self._take(PRESETS[name], Path(), None)

    @Slot()
    def save(self) -> None:
        """Write the sequence to its file, or ask for one."""
        if self.session.sequence_path is None:
            self._ask_save()
        else:
            self.save_file(self.session.sequence_path)

    def reset_layout(self) -> None:
        """Give every part its default size."""
        self.split.setSizes([400, 600])

    def close_work(self) -> None:
        """Wait for the thread."""
        self._files.close()

    @Slot(object)
    def _file_done(self, answer: tuple[Path, str | None]) -> None:
        path, text = answer
        self._warned = None
        if text is None:
            self.session.sequence_path = path
            self.session.message.emit(f"Saved {path}")
            self.trouble.show_text("")
        elif not self._take(text, path.parent, path):
            return
        self.session.add_recent(path)
        self._show_file_name()

    def _take(self, toml: str, folder: Path, path: Path | None) -> bool:
        """Replace the sequence; return False, with a message, where ``toml`` is none."""
        try:
            self.editor.replace(toml)
        except InputError as error:
            self.trouble.show_text(str(error))
            return False
        self.trouble.show_text("")
        self._sent = toml
        self.session.set_sequence(toml, folder, path)
        self._enable_undo()
        self._show_file_name()
        return True

    def dragEnterEvent(self, event: QDragEnterEvent) -> None:  # noqa: N802
        if any(_can_open(url.toLocalFile()) for url in event.mimeData().urls()):
            event.acceptProposedAction()

    def dropEvent(self, event: QDropEvent) -> None:  # noqa: N802
        for url in event.mimeData().urls():
            if _can_open(url.toLocalFile()):
                self.open_file(Path(url.toLocalFile()))
        event.acceptProposedAction()

    # changes

    @Slot()
    def _edited(self) -> None:
        session = self.session
        self._sent = self.draft.toml
        self._enable_undo()
        session.set_sequence(self._sent, session.sequence_folder, session.sequence_path)

    def _enable_undo(self) -> None:
        self.undo_button.setEnabled(self.draft.can_undo)
        self.redo_button.setEnabled(self.draft.can_redo)

    @Slot()
    def _sequence_changed(self) -> None:
        session = self.session
        if session.sequence_toml != self._sent:  # it came from another page
            self._take(session.sequence_toml, session.sequence_folder, session.sequence_path)
        self.preview.show_planning()

    # display

    @Slot()
    def _preview_changed(self) -> None:
        preview = self.session.preview
        if preview is None or preview.toml != self.session.sequence_toml:
            return
        self.preview.show_preview(preview)
        place = place_of(preview.sentence) if preview.plan is None else Place()
        self.editor.show_fault(place, _after_key(preview.sentence))
        if preview.loaded is None:
            self.editor.clear_duration(place.row)
        else:
            self.editor.show_durations(s.duration for s in preview.loaded.sequence.segments)
        self._highlight()

    @Slot()
    def _highlight(self) -> None:
        preview = self.session.preview
        if preview is None or preview.loaded is None or not preview.segments:
            self.preview.plots.choose(None)
            return
        played = preview.segments[1:-1][self.editor.chosen_segments()]  # without the rests
        self.preview.plots.choose((played[0][1], played[-1][2]) if played else None)

    def _show_file_name(self) -> None:
        path = self.session.sequence_path
        self.file_name.setText(path.name if path is not None else "not saved")
        self.file_name.setToolTip("" if path is None else plain_tip(str(path)))

    @Slot()
    def _recent_changed(self) -> None:
        self.recent.clear()
        for path in self.session.recent:
            action = self.recent.addAction(str(path))
            action.triggered.connect(lambda _=False, path=path: self.open_file(path))
        self.recent_button.setEnabled(bool(self.session.recent))

    # layout

    def _build(self) -> None:
        outer = QVBoxLayout(self)
        outer.setContentsMargins(SPACE, SPACE, SPACE, SPACE)
        outer.setSpacing(SPACE)
        outer.addLayout(self._tool_bar())
        self.trouble = Message()
        outer.addWidget(self.trouble)
        self.split = QSplitter(Qt.Orientation.Horizontal)
        self.split.setChildrenCollapsible(False)
        self.split.addWidget(self.editor)
        self.split.addWidget(self.preview)
        self.reset_layout()
        remember(self.split, self.session.settings, "sequence/columns")
        outer.addWidget(self.split, 1)

    def _tool_bar(self) -> QHBoxLayout:
        row = QHBoxLayout()
        presets = QMenu(self)
        for name in PRESETS:
            action = presets.addAction(name)
            action.triggered.connect(lambda _=False, name=name: self.preset(name))
        row.addWidget(menu_button("&Presets", "Sequences of the thesis and others", presets))
        self.recent = QMenu(self)
        self.recent_button = menu_button("&Recent", "Sequence files used lately", self.recent)
        for words, tip, key, done in (
            ("&Open …", "Read a sequence or a CSV waveform; files can be dropped here", "Ctrl+O",
             self._ask_open),
            ("&Save", "Write the sequence to its file", "Ctrl+S", self.save),
            ("Save &as …", "Write the sequence to another file", "Ctrl+Shift+S", self._ask_save),
            ("Import &CSV …", "Add a waveform (columns time_s and voltage_kV) as a segment",
             "Ctrl+I", self._ask_csv),
        ):  # fmt: skip
            made = button(words, f"{tip} ({key})")
            made.setShortcut(QKeySequence(key))
            made.clicked.connect(done)
            row.addWidget(made)
            if words.startswith("&Open"):
                row.addWidget(self.recent_button)
        self.undo_button = button("↶ Undo", "Undo the last change (Ctrl+Z)")
        self.undo_button.setShortcut(QKeySequence("Ctrl+Z"))
        self.undo_button.clicked.connect(self.editor.undo)
        self.redo_button = button("↷ Redo", "Redo the change (Ctrl+Shift+Z)")
        self.redo_button.setShortcut(QKeySequence("Ctrl+Shift+Z"))
        self.redo_button.clicked.connect(self.editor.redo)
        row.addWidget(self.undo_button)
        row.addWidget(self.redo_button)
        row.addStretch(1)
        self.file_name = label("not saved", "muted")
        row.addWidget(self.file_name)
        run = button("Go to R&un", "Go to the Run page, to arm and start it", primary=True)
        run.clicked.connect(self.show_run)
        row.addWidget(run)
        return row

    @Slot()
    def _ask_open(self) -> None:
        name, _ = QFileDialog.getOpenFileName(
            self, "Open a sequence", str(self.session.sequence_folder),
            "Sequences (*.toml);;CSV (*.csv)",
        )  # fmt: skip
        if name:
            self.open_file(Path(name))

    @Slot()
    def _ask_csv(self) -> None:
        name, _ = QFileDialog.getOpenFileName(
            self, "Waveform with the columns time_s and voltage_kV",
            str(self.session.sequence_folder), "Waveforms (*.csv)",
        )  # fmt: skip
        if name:
            self.add_csv(Path(name))

    @Slot()
    def _ask_save(self) -> None:
        name, _ = QFileDialog.getSaveFileName(
            self, "Save the sequence", str(self.session.sequence_folder), "Sequences (*.toml)"
        )
        if name:
            path = Path(name)
            self.save_file(path if path.suffix else path.with_suffix(".toml"))


def _can_open(name: str) -> bool:
    return Path(name).suffix.lower() in _ENDINGS


def _after_key(sentence: str) -> str:
    """Return the part of a sentence that follows the name of the key, which stands beside it."""
    found = sentence.split(" is not allowed: ", 1)
    return found[1] if len(found) == 2 else sentence.rpartition(": ")[2]
