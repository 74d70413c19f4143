"""Import of files of measured data, one dialog after the other."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from PySide6.QtCore import QObject, Signal, Slot
from PySide6.QtWidgets import QWidget

from dearig.recording.importers import IMPORTERS, Imported
from dearig.window.documents.dialogs import choose_files, run_dialog
from dearig.window.imports.choice import with_labels
from dearig.window.imports.dialog import ImportDialog
from dearig.window.jobs.worker import Worker
from dearig.window.session.state import Session

__all__ = ["Imports"]


class Imports(QObject):
    """Imports files into the session's folder.

    ``written`` carries the recordings; ``said`` a sentence on the last one and its role.
    """

    written = Signal(list)
    said = Signal(str, str)

    def __init__(self, session: Session, page: QWidget) -> None:
        super().__init__(page)
        self._session, self._page = session, page
        self._worker = Worker(self)

    @Slot()
    def ask(self) -> None:
        """Ask for files, and import them."""
        if self._refused():
            return
        endings = " ".join(f"*{s}" for importer in IMPORTERS.values() for s in importer.suffixes)
        kinds = f"Measured data ({endings});;All files (*)"
        found = choose_files(
            self._page, self._session, "Import measured data", self._session.folder, kinds
        )
        self.import_files(found)

    def import_files(self, paths: Sequence[Path]) -> None:
        """Show the dialog for each file; cancelling one leaves out those behind it."""
        if not paths or self._refused():
            return
        found: list[Path] = []
        for number, path in enumerate(paths, 1):
            place = f"{number} of {len(paths)}" if len(paths) > 1 else ""
            dialog = ImportDialog(self._session, self._worker, path, place, self._page.window())
            dialog.imported.connect(self._say)
            accepted = run_dialog(dialog, self._session)
            dialog.deleteLater()
            if not accepted or dialog.written is None:
                break
            found.append(dialog.written)
        if found:
            self.written.emit(found)

    def close(self) -> None:
        """End the process; what it was writing is left out."""
        self._worker.close()

    def _refused(self) -> bool:
        """Say so and return True while the rig is armed or a run goes on: it needs the computer."""
        if self._session.busy:
            self.said.emit("Files are imported when the run has ended and the rig is disarmed",
                           "warn")  # fmt: skip
        return self._session.busy

    @Slot(Path, object)
    def _say(self, out: Path, said: Imported) -> None:
        text = f"Imported {out.name}: {'; '.join(said.columns)}"
        if said.warnings:
            text += f". Check: {'; '.join(map(with_labels, said.warnings))}"
        self.said.emit(text, "warn" if said.warnings else "good")
