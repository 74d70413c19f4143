"""Editor of a target: the displacement that the film should follow."""

from __future__ import annotations

from pathlib import Path

import tomli_w
from PySide6.QtCore import Slot
from PySide6.QtWidgets import QScrollArea, QWidget

from dearig.config.sequencefile import SequenceFault
from dearig.config.targetfile import EXAMPLE, LoadedTarget, read_target
from dearig.errors import InputError
from dearig.window.documents.dialogs import choose_file
from dearig.window.documents.draft import relative_csv
from dearig.window.documents.segment_editor import SequenceEditor
from dearig.window.documents.segment_forms import target_forms
from dearig.window.documents.toml_editor import EditorWords, TomlEditor
from dearig.window.jobs.background import Background
from dearig.window.kit.widgets import Message
from dearig.window.session.state import Session
from dearig.window.session.text_file import EditedFile

__all__ = ["TargetEditor"]

_HEIGHT_MIN = 240  # px: some segments, and the fields of one
_TABLES = (".csv", ".txt", ".dat")
_WORDS = EditorWords(
    what="target",
    caption="&Target",
    tip="Displacement from the loaded rest state: the segments of a sequence, in mm",
    open_tip="Read a target, or a table (CSV) of time and displacement",
    example_tip="Replace the target by one that the rig of the thesis can follow",
    kinds="Targets (*.toml);;Tables (*.csv *.txt *.dat)",
)


class TargetEditor(TomlEditor):
    """Target as a form of its segments, and the text of its file, which both edit.

    It comes from a file, from a table, or is composed in place.
    """

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(session, _WORDS, EXAMPLE, parent)
        self.form = SequenceEditor(self.toml, forms=target_forms(), explain=False)
        self.form.setMinimumWidth(0)
        self.trouble = Message()
        area = QScrollArea()
        area.setWidgetResizable(True)
        area.setFrameShape(QScrollArea.Shape.NoFrame)
        area.setWidget(self.form)
        area.setMinimumHeight(_HEIGHT_MIN)
        self.tabs = self.put_form(area)
        column = self.layout()
        if column is not None:
            column.addWidget(self.trouble)
        self._checking = Background(self)  # a table that a segment names may be long
        self._checking.done.connect(self._checked)
        self._checking.failed.connect(self.trouble.show_text)
        self.form.edited.connect(lambda: self.take(self.form.draft.toml))
        self.form.file_wanted.connect(self._ask_table)
        self.changed.connect(self._show_form)
        session.theme_changed.connect(self._theme_changed)
        self._theme_changed()
        self.form.fill(0)
        self._check()

    def open_file(self, path: Path) -> None:
        """Read a target (.toml), or make one of a table (.csv)."""
        if path.suffix.lower() not in _TABLES:
            super().open_file(path)
        elif self.files.confirm_discard():
            segment = {"kind": "csv", "file": path.name}
            text = tomli_w.dumps({"name": path.stem, "segment": [segment]})
            self.restore(text, EditedFile("target", text, None, path.parent))

    def close_work(self) -> None:
        """Wait for the threads."""
        super().close_work()
        self._checking.close()

    @Slot()
    def _show_form(self) -> None:
        toml = self.toml
        if toml != self.form.draft.toml:
            row = self.form.table.currentRow()
            try:
                self.form.replace(toml, self._file)
            except InputError as error:
                self.form.setEnabled(False)
                self.trouble.show_text(f"The form cannot show the text, correct it there: {error}")
                return
            self.form.choose(min(row, self.form.table.rowCount() - 1))
        self.form.setEnabled(True)
        self._check()

    def _check(self) -> None:
        toml, folder = self.toml, self.folder
        self._checking.start(lambda: (toml, *read_target(toml, "the target", folder)))

    @Slot(object)
    def _checked(self, found: tuple[str, LoadedTarget | None, tuple[SequenceFault, ...]]) -> None:
        toml, loaded, faults = found
        if toml != self.toml:
            return
        head = [fault.sentence for fault in faults if fault.row is None and not fault.key]
        self.trouble.show_text("; ".join(head))
        self.form.show_faults(faults)
        if loaded is None:
            for row in {fault.row for fault in faults}:
                self.form.clear_duration(row)
        else:
            self.form.show_durations(s.duration for s in loaded.sequence.sequence.segments)

    @Slot()
    def _ask_table(self) -> None:
        path = choose_file(
            self, self.session, "Table with columns of time and displacement", self.folder,
            "Tables (*.csv *.txt *.dat)",
        )  # fmt: skip
        if path is not None:
            self.form.add("csv", file=relative_csv(path, self.folder))

    @Slot()
    def _theme_changed(self) -> None:
        self.form.set_fault_colour(self.session.theme.bad)
