"""The recordings of the session's folder: listed at once, looked at in another process."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from PySide6.QtCore import QFileSystemWatcher, QObject, QTimer, Signal, Slot

from dearig.analysis.summary import RecordingSummary, recordings_in, summarise
from dearig.window.background import Background
from dearig.window.session import Session
from dearig.window.worker import Job, Worker

__all__ = ["Library", "shared_library"]

_SETTLE_MS = 300  # after which a folder that changes is looked at; several files come at once


class Library(QObject):
    """``files`` in the folder, and ``summaries`` of those that were looked at until now.

    ``listed``: other files; ``looked``: its summary is there; ``trouble``: the folder cannot be
    read; ``busy``: how many files are still to be looked at. All are compared with ``model``. While
    a run goes on no file is opened: it may be the one that is being written.
    """

    listed = Signal()
    looked = Signal(Path)
    trouble = Signal(str)
    busy = Signal(int)

    def __init__(self, session: Session) -> None:
        super().__init__(session)
        self._session = session
        self._worker = Worker(self)
        self._watcher = QFileSystemWatcher(self)
        self._settle = QTimer(self, singleShot=True, interval=_SETTLE_MS)
        self._listing = Background(self)  # a thread: it has to wait for no process
        self._listing.done.connect(self._took_list)
        self._listing.failed.connect(self.trouble)
        self._pending: set[Path] = set()
        self._round = 0  # of looks: a late answer of an earlier one is not shown
        self.model: Path | None = None
        self.files: dict[Path, tuple[float, int]] = {}
        self.summaries: dict[Path, RecordingSummary] = {}
        self._settle.timeout.connect(self.refresh)
        self._watcher.directoryChanged.connect(self._changed)
        session.folder_changed.connect(self._moved)
        session.recorded.connect(self._changed)
        session.running_changed.connect(self._changed)
        self._moved()

    @property
    def folder(self) -> Path:
        """Where they lie."""
        return self._session.folder

    def submit(self, function: Callable[..., Any], *given: Any) -> Job:
        """Have something else done with recordings, before the looks that still wait."""
        return self._worker.submit(function, *given, first=True)

    def set_model(self, path: Path | None) -> None:
        """Compare all with the model in ``path``; None is the thesis's."""
        if path != self.model:
            self.model = path
            self._worker.clear()
            self._pending.clear()
            self._round += 1
            self._look(sorted(self.files, key=lambda path: -self.files[path][0]))

    def close(self) -> None:
        """End the process."""
        self._settle.stop()
        self._round += 1
        self._listing.close()
        self._worker.close()

    @Slot()
    def refresh(self) -> None:
        """List the folder again, and look at what is new or changed."""
        if self._session.running:
            return  # its end comes here again
        folder = self.folder
        self._listing.start(lambda: recordings_in(folder))

    @Slot(str)
    @Slot(Path)
    @Slot(bool)
    def _changed(self, _: object) -> None:
        self._settle.start()

    @Slot()
    def _moved(self) -> None:
        watched = self._watcher.directories()
        if watched:
            self._watcher.removePaths(watched)
        if self.folder.is_dir():
            self._watcher.addPath(str(self.folder))
        self._worker.clear()
        self._round += 1
        self.files, self.summaries = {}, {}
        self._pending.clear()
        self.listed.emit()
        self.refresh()

    @Slot(object)
    def _took_list(self, files: dict[Path, tuple[float, int]]) -> None:
        if any(path.parent != self.folder for path in files):
            return  # of the folder that was left meanwhile
        before, self.files = self.files, files
        self.summaries = {path: g for path, g in self.summaries.items() if path in files}
        fresh = [
            path for path in files
            if before.get(path) != files[path]
            or (path not in self.summaries and path not in self._pending)
        ]  # fmt: skip
        self.listed.emit()
        self._look(sorted(fresh, key=lambda path: -files[path][0]))

    def _look(self, paths: list[Path]) -> None:
        drive, round_ = self._session.overlay_drive, self._round
        for path in paths:
            job = self._worker.submit(summarise, path, self.model, drive)
            job.finished.connect(lambda found, of=round_: self._took(found, of))
            job.failed.connect(
                lambda words, of=round_, path=path: self._took(
                    RecordingSummary(path, trouble=words), of
                )
            )
        self._pending.update(paths)
        self.busy.emit(len(self._pending))

    def _took(self, found: RecordingSummary, of: int) -> None:
        if of != self._round:
            return
        self._pending.discard(found.path)
        if found.path in self.files:
            self.summaries[found.path] = found
            self.looked.emit(found.path)
        self.busy.emit(len(self._pending))


def shared_library(session: Session) -> Library:
    """The library of ``session``, which all its pages share."""
    found = session.findChild(Library)
    return found if isinstance(found, Library) else Library(session)
