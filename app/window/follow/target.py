"""Editor of the target that the film shall follow: its text, and its file."""

from __future__ import annotations

from pathlib import Path

import tomli_w
from PySide6.QtWidgets import QWidget

from dearig.config.targetfile import EXAMPLE
from dearig.window.documents.toml_editor import EditorWords, TomlEditor
from dearig.window.session.state import Session
from dearig.window.session.text_file import TextFile

__all__ = ["TargetEditor"]

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
    """Text of a target file, from a file, a table or written in place."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(session, _WORDS, EXAMPLE, parent)

    def open_file(self, path: Path) -> None:
        """Read a target (.toml), or make one of a table (.csv)."""
        if path.suffix.lower() not in _TABLES:
            super().open_file(path)
        elif self.files.confirm_discard():
            segment = {"kind": "csv", "file": path.name}
            text = tomli_w.dumps({"name": path.stem, "segment": [segment]})
            self.restore(text, TextFile("target", text, None, path.parent))
