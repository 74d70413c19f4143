"""Page Sequence: write a sequence, see what it does, and what the limits refuse."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import Qt, Slot
from PySide6.QtGui import QDragEnterEvent, QDropEvent, QKeySequence
from PySide6.QtWidgets import QMenu, QSplitter, QVBoxLayout, QWidget

from dearig.config.presets import PRESETS
from dearig.errors import InputError
from dearig.window.documents.dialogs import choose_file
from dearig.window.documents.draft import Draft, relative_csv
from dearig.window.documents.file_actions import FileActions
from dearig.window.documents.segment_editor import SequenceEditor
from dearig.window.kit.fields import as_labelled
from dearig.window.kit.flow import Flow
from dearig.window.kit.theme import SPACE
from dearig.window.kit.widgets import button, menu_button
from dearig.window.sequence.preview_panel import PreviewPanel
from dearig.window.session.layout_state import remember
from dearig.window.session.page import Page
from dearig.window.session.state import Preview, Session
from dearig.window.session.text_file import EditedFile, Saved

__all__ = ["SequencePage"]

_ENDINGS = (".toml", ".csv")
_BLOCK = "sequence"  # key of what blocks arming


class SequencePage(Page):
    """Shows and changes the sequence of the session: ``editor`` at the left, ``preview`` right."""

    title = "Sequence"
    at_start = True
    edits = "sequence"

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(session, parent)
        self.session = session
        toml, folder = session.sequence_toml, session.sequence_folder
        # what an earlier session had without a file is in no file yet
        kept = session.sequence_path is None and toml not in PRESETS.values()
        file = EditedFile("sequence", "" if kept else toml, session.sequence_path, folder)
        self.editor = SequenceEditor(toml, file)
        self.preview = PreviewPanel(session)
        self._sent = session.sequence_toml  # the text that this page gave to the session last
        self.files = FileActions(
            self, session, "sequence", lambda: (self.draft.toml, self.draft.file),
            "Sequences (*.toml);;CSV (*.csv)",
        )  # fmt: skip
        self.files.chosen.connect(self.open_file)
        self.files.opened.connect(self._opened)
        self.files.saved.connect(self._saved)
        self.setAcceptDrops(True)
        self._build()
        self.editor.edited.connect(self._edited)
        self.editor.row_chosen.connect(self._highlight)
        self.editor.file_wanted.connect(self._ask_csv)
        session.sequence_changed.connect(self._sequence_changed)
        session.rig_changed.connect(self.preview.show_planning)
        session.preview_changed.connect(self._preview_changed)
        session.outline_changed.connect(self._outline_changed)
        session.recent_changed.connect(self._recent_changed)
        session.theme_changed.connect(self._theme_changed)
        self._theme_changed()
        self._recent_changed()
        self.editor.fill(0)
        self._enable_undo()
        self.files.note()
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
        else:
            self.files.open(path)

    def take(self, toml: str, path: Path | None = None) -> bool:
        """Replace the sequence by ``toml`` of another page; False where the operator refuses.

        ``path`` is the file that holds it, None where no file does.
        """
        folder = Path() if path is None else path.parent
        return self.files.confirm_discard() and self._take(
            toml, EditedFile("sequence", toml, path, folder)
        )

    def restore(self, toml: str, file: EditedFile) -> None:
        """Replace the sequence by the unsaved one of an earlier window."""
        self._take(toml, file)

    def add_csv(self, path: Path) -> None:
        """Add a waveform (columns time_s and voltage_kV) as a segment."""
        file = self.draft.file
        if file.path is None and all(s.get("kind") != "csv" for s in self.draft.segments):
            file.folder = path.parent  # a sequence in no file belongs to its waveform
        self.editor.add("csv", file=relative_csv(path, file.folder))

    def preset(self, name: str) -> None:
        """Replace the sequence by the preset ``name``."""
        self.take(PRESETS[name])

    def reset_layout(self) -> None:
        """Give every part its default size."""
        self.split.setSizes([400, 600])

    def close_work(self) -> None:
        """Wait for the thread."""
        self.files.close()

    @Slot(str, EditedFile)
    def _opened(self, toml: str, file: EditedFile) -> None:
        if self._take(toml, file) and file.path is not None:
            self.session.add_recent(file.path)

    @Slot(Saved)
    def _saved(self, done: Saved) -> None:
        if all(segment.get("kind") != "csv" for segment in self.draft.segments):
            done.file.folder = done.path.parent
        self._edited()  # the path may be another one
        self.session.add_recent(done.path)

    def _take(self, toml: str, file: EditedFile) -> bool:
        """Replace the sequence; return False, with a message, where ``toml`` is none."""
        try:
            self.editor.replace(toml, file)
        except InputError as error:
            self.files.trouble.show_text(f"{error}. The previous sequence stays in use.")
            return False
        self.files.trouble.show_text("")
        self._edited()
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
        session, file = self.session, self.draft.file
        self._sent = self.draft.toml
        self._enable_undo()
        session.set_sequence(self._sent, file.folder, file.path)
        self.files.note()

    def _enable_undo(self) -> None:
        self.undo_button.setEnabled(self.draft.can_undo)
        self.redo_button.setEnabled(self.draft.can_redo)

    @Slot()
    def _sequence_changed(self) -> None:
        session = self.session
        if session.sequence_toml != self._sent:  # it came from another page
            toml, folder = session.sequence_toml, session.sequence_folder
            self._take(toml, EditedFile("sequence", toml, session.sequence_path, folder))
        self.preview.show_planning()

    # display

    @Slot()
    def _preview_changed(self) -> None:
        preview = self.session.preview
        if preview is None or preview.toml != self.session.sequence_toml:
            return
        self.preview.show_preview(preview)
        self._block_arming(preview)
        self.editor.show_faults(preview.faults)
        if preview.loaded is None:
            for row in {fault.row for fault in preview.faults}:
                self.editor.clear_duration(row)
        else:
            self.editor.show_durations(s.duration for s in preview.loaded.sequence.segments)
        self._highlight()

    @Slot()
    def _outline_changed(self) -> None:
        if self.session.outline is not None:
            self.preview.show_outline(self.session.outline)

    def _block_arming(self, preview: Preview) -> None:
        """Block arming while the sequence cannot be played, and say where and why."""
        if preview.playable:
            self.session.unblock(_BLOCK)
            return
        said = [
            *(f.sentence for f in preview.faults),
            *(preview.plan.reasons if preview.plan else ()),
        ]
        more = f" ({len(said) - 1} more on the page Sequence)" if len(said) > 1 else ""
        self.session.block(_BLOCK, f"sequence: {as_labelled(said[0])}{more}", self.title)

    @Slot()
    def _highlight(self) -> None:
        preview = self.session.preview
        if preview is None or preview.loaded is None or not preview.segments:
            self.preview.plots.choose(None)
            return
        played = preview.segments[1:-1][self.editor.chosen_segments()]  # without the rests
        self.preview.plots.choose((played[0][1], played[-1][2]) if played else None)

    @Slot()
    def _theme_changed(self) -> None:
        self.editor.set_fault_colour(self.session.theme.bad)

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
        outer.addWidget(self.files.trouble)
        self.split = QSplitter(Qt.Orientation.Horizontal)
        self.split.setChildrenCollapsible(False)
        self.split.addWidget(self.editor)
        self.split.addWidget(self.preview)
        self.reset_layout()
        remember(self.split, self.session.settings, "sequence/columns")
        outer.addWidget(self.split, 1)

    def _tool_bar(self) -> Flow:
        row = Flow()
        presets = QMenu(self)
        for name in PRESETS:
            action = presets.addAction(name)
            action.triggered.connect(lambda _=False, name=name: self.preset(name))
        row.add(menu_button("&Presets", "Sequences of the thesis and others", presets))
        self.recent = QMenu(self)
        self.recent_button = menu_button("&Recent", "Sequence files used lately", self.recent)
        for words, tip, key, done in (
            ("&Open …", "Read a sequence or a CSV waveform; files can be dropped here", "Ctrl+O",
             self.files.ask_open),
            ("&Save", "Write the sequence to its file", "Ctrl+S", self.files.save),
            ("Save &as …", "Write the sequence to another file", "Ctrl+Shift+S",
             self.files.ask_save),
            ("Import &CSV …", "Add a waveform (columns of time and voltage) as a segment",
             "Ctrl+I", self._ask_csv),
        ):  # fmt: skip
            made = button(words, f"{tip} ({key})")
            made.setShortcut(QKeySequence(key))
            made.clicked.connect(done)
            row.add(made)
            if words.startswith("&Open"):
                row.add(self.recent_button)
        self.undo_button = button("↶ Undo", "Undo the last change (Ctrl+Z)")
        self.undo_button.setShortcut(QKeySequence("Ctrl+Z"))
        self.undo_button.clicked.connect(self.editor.undo)
        self.redo_button = button("↷ Redo", "Redo the change (Ctrl+Shift+Z)")
        self.redo_button.setShortcut(QKeySequence("Ctrl+Shift+Z"))
        self.redo_button.clicked.connect(self.editor.redo)
        row.add(self.undo_button)
        row.add(self.redo_button)
        row.add(self.files.name, share=1)
        run = button("Go to R&un", "Go to the Run page, to arm and start it", primary=True)
        run.clicked.connect(lambda: self.go_to.emit("Run"))
        row.add(run)
        return row

    @Slot()
    def _ask_csv(self) -> None:
        path = choose_file(
            self, self.session, "Waveform with columns of time and voltage",
            self.draft.file.folder, "Waveforms (*.csv)",
        )  # fmt: skip
        if path is not None:
            self.add_csv(path)


def _can_open(name: str) -> bool:
    return Path(name).suffix.lower() in _ENDINGS
