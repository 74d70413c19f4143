"""Recordings of the session's folder: listed in a thread, read in another process."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from PySide6.QtCore import QFileSystemWatcher, QObject, QTimer, Signal, Slot

from dearig.analysis.assessments import (
    Stamp,
    keep_assessments,
    kept_assessments,
    model_key,
)
from dearig.analysis.summary import (
    Assessment,
    RecordingSummary,
    assess,
    read_entries,
    summary_of,
)
from dearig.errors import InputError
from dearig.recording.reading.index import Entry, Listing, keep_index, list_folder
from dearig.recording.reading.tags import TAGS_FILE, Tagged, read_tags, tags_of, write_tags
from dearig.window.jobs.background import Background
from dearig.window.jobs.worker import Job, Worker
from dearig.window.session.settings import kept_text
from dearig.window.session.state import Session

__all__ = ["Library", "shared_library"]

_SETTLE_MS = 300  # wait after a change of the folder; several files often change together
#: Files that are read in one job: some 20 ms each, so that a click on a recording waits shortly.
_BATCH = 10
#: Subfolders that are watched: the system has a limit, and others need some too.
_WATCHED_MAX = 200


@dataclass(frozen=True)
class _Listed:
    """What the thread found: files, tags by folder, known errors, and what could not be read."""

    listing: Listing
    tags: dict[Path, tuple[Tagged, ...]]
    key: str
    assessments: dict[Path, tuple[Stamp, Assessment]]
    troubles: tuple[str, ...]


class Library(QObject):
    """``files`` in the folder, and the ``summaries`` of those that are read.

    ``listed``: the list of files has changed; ``summarised``: the summary of a file is there or has
    changed; ``trouble``: the folder, or a part of it, cannot be read, or an empty text: it can;
    ``busy``: the number of files still to be read or compared with ``model``. During a run no file
    is opened: it may be the one that is being written.
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
        self._listing.failed.connect(self._no_list)
        self._round = 0  # number of the current reading; late results of an earlier one are dropped
        self._listed: _Listed | None = None
        self._entries: dict[str, Entry] = {}
        self._stamps: dict[str, Stamp] = {}
        self._unread: list[Path] = []  # without an entry, the next one last
        self._in_reading = 0  # files of the job that reads them
        self._unassessed: dict[Path, None] = {}  # without errors, in their order
        self._preferred: tuple[Path, ...] = ()
        self._job: Job | None = None
        self._fresh_entries = self._fresh_assessments = False
        self._assessments: dict[Path, tuple[Stamp, Assessment]] = {}
        self._keeping = Background(self)
        self.model: Path | None = None
        self.deep = kept_text(session.settings, "subfolders", "yes") == "yes"
        self.files: dict[Path, tuple[float, int]] = {}
        self.summaries: dict[Path, RecordingSummary] = {}
        self._settle.timeout.connect(self.refresh)
        self._watcher.directoryChanged.connect(self._changed)
        session.folder_changed.connect(self._folder_changed)
        session.recorded.connect(self._changed)
        session.running_changed.connect(self._running_changed)
        self._folder_changed()

    @property
    def folder(self) -> Path:
        """Folder of the recordings."""
        return self._session.folder

    @property
    def left(self) -> int:
        """Number of files still to be read or compared with the model."""
        return len(self._unread) + self._in_reading + len(self._unassessed)

    def submit(self, function: Callable[..., Any], *given: Any) -> Job:
        """Run ``function(*given)`` in the process, before the summaries that still wait."""
        return self._worker.submit(function, *given, first=True)

    def set_model(self, path: Path | None) -> None:
        """Compare all recordings with the model file ``path``; None is the thesis model."""
        if path != self.model:
            self._keep()
            self.model = path
            self._restart()
            for name, summary in self.summaries.items():
                self.summaries[name] = replace(
                    summary, errors=None, noise=None, unfit="", fitted=False
                )
            self._assessments = {}
            self.listed.emit()
            self.refresh()

    def set_deep(self, deep: bool) -> None:
        """List subfolders too, or only the folder itself."""
        if deep != self.deep:
            self.deep = deep
            self._session.settings.setValue("subfolders", "yes" if deep else "no")
            self._folder_changed()

    def prefer(self, paths: Iterable[Path]) -> None:
        """Compare these recordings with the model before the others."""
        self._preferred = tuple(paths)

    def set_tags(self, tags: dict[Path, tuple[str, ...]]) -> None:
        """Give recordings these tags, in the file of tags of each folder. Raises ``InputError``."""
        by_folder: dict[Path, list[Tagged]] = {}
        for path, chosen in tags.items():
            summary = self.summaries.get(path)
            identifier = "" if summary is None else summary.identifier
            by_folder.setdefault(path.parent, []).append(Tagged(path.name, identifier, chosen))
        for folder, fresh in by_folder.items():
            known = write_tags(folder, fresh)
            if self._listed is not None:
                self._listed.tags[folder] = known
        for path, chosen in tags.items():
            if path in self.summaries:
                self.summaries[path] = replace(self.summaries[path], tags=chosen)
                self.summarised.emit(path)

    def close(self) -> None:
        """End the process."""
        self._settle.stop()
        self._keep()
        self._restart()
        self._listing.close()
        self._keeping.close()
        self._worker.close()

    @Slot()
    def refresh(self) -> None:
        """List the folder again, and read new and changed files."""
        if self._session.running:
            return  # the end of the run calls this again
        folder, deep = self.folder, self.deep
        model, drive = self.model, self._session.overlay_drive
        self._listing.start(lambda: _list(folder, deep, model, drive))

    @Slot(str)
    @Slot(Path)
    def _changed(self, _: object) -> None:
        self._settle.start()

    @Slot(bool)
    def _running_changed(self, running: bool) -> None:
        if not running:
            self._settle.start()

    @Slot()
    def _folder_changed(self) -> None:
        self._keep()
        self._restart()
        self._listed, self._entries, self._assessments = None, {}, {}
        self.files, self.summaries = {}, {}
        self._watch(())
        self.listed.emit()
        self.busy.emit(0)
        self.refresh()

    def _restart(self) -> None:
        """Drop what is being read; late results no longer count."""
        self._round += 1
        self._worker.clear()
        self._unread.clear()
        self._unassessed.clear()
        self._forget_job()

    def _forget_job(self) -> None:
        self._job, self._in_reading = None, 0

    def _watch(self, folders: tuple[str, ...]) -> None:
        wanted = [str(self.folder), *(str(self.folder / name) for name in folders)][:_WATCHED_MAX]
        watched = set(self._watcher.directories())
        if gone := sorted(watched - set(wanted)):
            self._watcher.removePaths(gone)
        if fresh := [name for name in wanted if name not in watched and Path(name).is_dir()]:
            self._watcher.addPaths(fresh)

    @Slot(str)
    def _no_list(self, words: str) -> None:
        self.trouble.emit(words)

    @Slot(object)
    def _take_list(self, found: _Listed) -> None:
        listing = found.listing
        if listing.folder != self.folder or self._session.running:
            return  # of the previous folder; or a run has begun, whose end lists again
        self._restart()
        self._listed = found
        self._watch(listing.folders)
        self.files = {
            self.folder / name: (changed / 1e9, size)
            for name, (size, changed) in listing.files.items()
        }
        # what was read since the cache was written counts too, unless its file has changed
        self._entries = {
            name: entry
            for name, entry in self._entries.items()
            if name in listing.files and self._stamps.get(name) == listing.files[name]
        } | listing.entries
        self._stamps = listing.files
        self._assessments = {
            path: kept
            for path, kept in {**found.assessments, **self._assessments}.items()
            if path in self.files and kept[0] == self._stamp(path)
        }
        self.summaries = {
            self.folder / name: self._summary(entry) for name, entry in self._entries.items()
        }
        newest = sorted(self.files, key=lambda path: -self.files[path][0])
        # what could not be read for a reason of the system may be readable now
        again = {self.folder / name for name, entry in self._entries.items() if entry.passing}
        self._unread = [
            path for path in reversed(newest) if path not in self.summaries or path in again
        ]
        self._unassessed = {path: None for path in newest if self._to_assess(path)}
        self.trouble.emit("; ".join((*(e.trouble for e in listing.unread), *found.troubles)))
        self.listed.emit()
        self.busy.emit(self.left)
        self._next()

    def _stamp(self, path: Path) -> Stamp:
        return self._stamps[path.relative_to(self.folder).as_posix()]

    def _summary(self, entry: Entry) -> RecordingSummary:
        path = self.folder / entry.path
        summary = summary_of(self.folder, entry)
        known = () if self._listed is None else self._listed.tags.get(path.parent, ())
        summary = replace(summary, tags=tags_of(known, path.name, entry.identifier))
        kept = self._assessments.get(path)
        return summary if kept is None else _with_errors(summary, kept[1])

    def _to_assess(self, path: Path) -> bool:
        summary = self.summaries.get(path)
        return summary is not None and not summary.trouble and path not in self._assessments

    def _next(self) -> None:
        """Read the next files, or compare the next recording; one job at a time."""
        if self._job is not None or self._session.running:
            return
        of = self._round
        if self._unread:
            paths = [self._unread.pop() for _ in range(min(_BATCH, len(self._unread)))]
            self._in_reading = len(paths)
            names = [path.relative_to(self.folder).as_posix() for path in paths]
            self._job = self._worker.submit(read_entries, self.folder, names)
            self._job.finished.connect(lambda entries: self._take_entries(entries, of))
            self._job.cancelled.connect(lambda: self._again(paths, of))
            self._job.failed.connect(
                lambda words: self._take_entries(
                    tuple(Entry(name, 0, trouble=words, passing=True) for name in names), of
                )
            )
        elif self._unassessed:
            path = next((p for p in self._preferred if p in self._unassessed), None)
            path = next(iter(self._unassessed)) if path is None else path
            drive = self._session.overlay_drive
            self._job = self._worker.submit(assess, path, self.model, drive)
            self._job.finished.connect(lambda found: self._take_errors(found, of, kept=True))
            self._job.cancelled.connect(lambda: self._again([], of))
            self._job.failed.connect(
                lambda words: self._take_errors(Assessment(path, unfit=words), of, kept=False)
            )
        else:
            self._keep()

    def _again(self, paths: list[Path], of: int) -> None:
        """Go on after a job that an interrupt of another job has ended: it came too late."""
        if of == self._round:
            self._forget_job()
            self._unread += reversed(paths)
            self._next()

    def _take_entries(self, entries: tuple[Entry, ...], of: int) -> None:
        if of != self._round:
            return
        self._forget_job()
        self._fresh_entries = True
        for entry in entries:
            path = self.folder / entry.path
            if path not in self.files:
                continue
            self._entries[entry.path] = entry
            self.summaries[path] = self._summary(entry)
            if self._to_assess(path):
                self._unassessed[path] = None
            self.summarised.emit(path)
        self.busy.emit(self.left)
        self._next()

    def _take_errors(self, found: Assessment, of: int, *, kept: bool) -> None:
        if of != self._round:
            return
        self._forget_job()
        self._unassessed.pop(found.path, None)
        if found.path in self.summaries:
            if kept:
                self._fresh_assessments = True
                self._assessments[found.path] = (self._stamp(found.path), found)
            self.summaries[found.path] = _with_errors(self.summaries[found.path], found)
            self.summarised.emit(found.path)
        self.busy.emit(self.left)
        self._next()

    def _keep(self) -> None:
        """Write what was read to the caches, in a thread."""
        listed = self._listed
        if listed is None or not (self._fresh_entries or self._fresh_assessments):
            return
        entries = dict(self._entries) if self._fresh_entries else None
        assessments = dict(self._assessments) if self._fresh_assessments else None
        self._fresh_entries = self._fresh_assessments = False

        def write() -> None:
            if entries is not None:
                keep_index(listed.listing, entries)
            if assessments is not None:
                keep_assessments(listed.listing.folder, listed.key, assessments)

        self._keeping.start(write)


def _with_errors(summary: RecordingSummary, found: Assessment) -> RecordingSummary:
    return replace(
        summary, errors=found.errors, noise=found.noise, unfit=found.unfit, fitted=found.fitted
    )


def _list(folder: Path, deep: bool, model: Path | None, drive: str) -> _Listed:
    """List a folder with all that is known of it, in a thread. Raises ``InputError``."""
    listing = list_folder(folder, deep=deep)
    tags: dict[Path, tuple[Tagged, ...]] = {}
    troubles = []
    for inner in (folder, *(folder / name for name in listing.folders)):
        if (inner / TAGS_FILE).exists():
            try:
                tags[inner] = read_tags(inner)
            except InputError as error:
                troubles.append(str(error))
    try:
        key = model_key(model, drive)
    except InputError:
        key = f"{model} {time.time_ns()}"  # the comparison says what is wrong; nothing is cached
    return _Listed(listing, tags, key, kept_assessments(folder, key), tuple(troubles))


def shared_library(session: Session) -> Library:
    """Return the library of ``session``, which its pages share."""
    found = session.findChild(Library)
    return found if isinstance(found, Library) else Library(session)
