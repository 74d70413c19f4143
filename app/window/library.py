"""Recordings of the session's folder: listed in a thread, read in another process."""

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

_SETTLE_MS = 300  # wait after a change of the folder; several files often change together


class Library(QObject):
    """``files`` in the folder, and the ``summaries`` of those that are read.

    ``listed``: the list of files has changed; ``summarised``: the summary of a file is there;
    ``trouble``: the folder cannot be read; ``busy``: the number of files still to be read. Each
    summary compares its recording with ``model``. During a run no file is opened: it may be the one
    that is being written.
    """

    listed = Signal()
    summarised = Signal(Path)
    trouble = Signal(str)
    busy = Signal(int)

    def __init__(self, session: Session) -> None:
        super().__init__(session)
        self._session = session
        self._worker = Worker(self)
        self._watcher = QFileSystemWatcher(self)
        self._settle = QTimer(self, singleShot=True, interval=_SETTLE_MS)
        self._listing = Background(self)  # a thread, which starts at once; a process takes a second
        self._listing.done.connect(self._take_list)
        self._listing.failed.connect(self.trouble)
        self._pending: set[Path] = set()
        self._round = 0  # number of the current reading; late results of an earlier one are dropped
        self.model: Path | None = None
        self.files: dict[Path, tuple[float, int]] = {}
        self.summaries: dict[Path, RecordingSummary] = {}
        self._settle.timeout.connect(self.refresh)
        self._watcher.directoryChanged.connect(self._changed)
        session.folder_changed.connect(self._folder_changed)
        session.recorded.connect(self._changed)
        session.running_changed.connect(self._changed)
        self._folder_changed()

    @property
    def folder(self) -> Path:
        """Folder of the recordings."""
        return self._session.folder

    def submit(self, function: Callable[..., Any], *given: Any) -> Job:
        """Run ``function(*given)`` in the process, before the summaries that still wait."""
        return self._worker.submit(function, *given, first=True)

    def set_model(self, path: Path | None) -> None:
        """Compare all recordings with the model file ``path``; None is the thesis model."""
        if path != self.model:
            self.model = path
            self._worker.clear()
            self._pending.clear()
            self._round += 1
            self._summarise(sorted(self.files, key=lambda path: -self.files[path][0]))

    def close(self) -> None:
        """End the process."""
        self._settle.stop()
        self._round += 1
        self._listing.close()
        self._worker.close()

    @Slot()
    def refresh(self) -> None:
        """List the folder again, and read new and changed files."""
        if self._session.running:
            return  # the end of the run calls this again
        folder = self.folder
        self._listing.start(lambda: recordings_in(folder))

    @Slot(str)
    @Slot(Path)
    @Slot(bool)
    def _changed(self, _: object) -> None:
        self._settle.start()

    @Slot()
    def _folder_changed(self) -> None:
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
    def _take_list(self, files: dict[Path, tuple[float, int]]) -> None:
        if any(path.parent != self.folder for path in files):
            return  # files of the previous folder
        before, self.files = self.files, files
        self.summaries = {path: g for path, g in self.summaries.items() if path in files}
        fresh = [
            path for path in files
            if before.get(path) != files[path]
            or (path not in self.summaries and path not in self._pending)
        ]  # fmt: skip
        self.listed.emit()
        self._summarise(sorted(fresh, key=lambda path: -files[path][0]))

    def _summarise(self, paths: list[Path]) -> None:
        drive, round_ = self._session.overlay_drive, self._round
        for path in paths:
            job = self._worker.submit(summarise, path, self.model, drive)
            job.finished.connect(lambda found, of=round_: self._take_summary(found, of))
            job.failed.connect(
                lambda words, of=round_, path=path: self._take_summary(
                    RecordingSummary(path, trouble=words), of
                )
            )
        self._pending.update(paths)
        self.busy.emit(len(self._pending))

    def _take_summary(self, found: RecordingSummary, of: int) -> None:
        if of != self._round:
            return
        self._pending.discard(found.path)
        if found.path in self.files:
            self.summaries[found.path] = found
            self.summarised.emit(found.path)
        self.busy.emit(len(self._pending))


def shared_library(session: Session) -> Library:
    """Return the library of ``session``, which its pages share."""
    found = session.findChild(Library)
    return found if isinstance(found, Library) else Library(session)
