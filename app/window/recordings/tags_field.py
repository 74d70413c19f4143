"""Field for the tags of the selected recordings."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from PySide6.QtCore import Signal, Slot
from PySide6.QtWidgets import QLineEdit, QWidget

from dearig.errors import InputError
from dearig.recording.reading.tags import clean_tags
from dearig.window.recordings.library import Library

__all__ = ["TagsField"]


class TagsField(QLineEdit):
    """Shows the tags that all selected recordings have; ``trouble``: why they cannot be kept."""

    trouble = Signal(str)

    def __init__(self, library: Library, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._library = library
        self._chosen: tuple[Path, ...] = ()
        self.setPlaceholderText("good, new grease")
        self.setToolTip(
            "Tags of the selected recordings, separated by commas; of several, those that all have "
            "(Ctrl+T). They are kept in dearig-tags.json next to the recordings, which stay as "
            "they are"
        )
        self.editingFinished.connect(self._typed)

    def show_recordings(self, chosen: Sequence[Path]) -> None:
        """Show the tags of ``chosen``; what was typed for the recordings before is kept first."""
        if self.isModified() and tuple(chosen) != self._chosen:
            self._typed()
        self._chosen = tuple(chosen)
        self.setEnabled(bool(chosen))
        if not (self.hasFocus() and self.isModified()):
            self.setText(", ".join(self._common()))

    def _common(self) -> tuple[str, ...]:
        known = [s.tags for path in self._chosen if (s := self._library.summaries.get(path))]
        return tuple(t for t in known[0] if all(t in tags for tags in known)) if known else ()

    @Slot()
    def _typed(self) -> None:
        """Give the typed tags to the selected recordings; tags that only some have stay."""
        common = self._common()
        self.setModified(False)
        try:
            typed = clean_tags(self.text())
            if typed == common or not self._chosen:
                return
            fresh = {}
            for path in self._chosen:
                summary = self._library.summaries.get(path)
                before = () if summary is None else summary.tags
                own = tuple(tag for tag in before if tag not in common and tag not in typed)
                fresh[path] = (*typed, *own)
            self._library.set_tags(fresh)
        except InputError as error:
            self.trouble.emit(str(error))
