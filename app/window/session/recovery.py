"""Recovery file: unsaved texts of a window that ended without a question, for the next start.

The file is written a second after each change, so that a crash loses no more than that. It is
removed when everything is saved, or dropped after a question. Each window has a file of its own,
with a lock that ends with its process: a window offers only the files of those that are gone.
"""

from __future__ import annotations

import json
import logging
import os
import secrets
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

from PySide6.QtCore import QLockFile, QObject, QSettings, QStandardPaths, QTimer, Signal

from dearig.errors import InputError
from dearig.input_file import read_input
from dearig.recording.files import write_whole
from dearig.window.session.text_file import EditedFile

__all__ = ["FORMAT", "Recovery", "UnsavedText", "lock_of", "unsaved_folder"]

log = logging.getLogger(__name__)

FORMAT = "dearig-unsaved/1"
_WAIT = 1000  # ms after a change
#: Bytes of a recovery file, at most: a sequence and a rig file of 2 MiB, with escapes.
_BYTES_MAX = 2**24


@dataclass(frozen=True)
class UnsavedText:
    """Text of a "sequence" or a "rig file" with the ``path`` of its file, "" without one.

    ``saved`` is the text of the file when it was opened, ``folder`` where the files lie that the
    text names. ``changes`` says what is unsaved, and ``at`` is the time in s since 1970.
    """

    text: str
    saved: str
    path: str
    folder: str
    changes: str
    at: float

    def file(self, what: str) -> EditedFile:
        """Return the file that the text came from."""
        path = Path(self.path) if self.path else None
        return EditedFile(what, self.saved, path, Path(self.folder))


class Recovery(QObject):
    """Knows the unsaved texts of this window, keeps them in a file, and finds those of others.

    ``changed``: another text is unsaved, or none is any more.
    """

    changed = Signal()

    def __init__(self, settings: QSettings, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._folder = unsaved_folder(settings)
        self._path = self._folder / f"{os.getpid()}-{secrets.token_hex(4)}.json"
        self._lock: QLockFile | None = None
        self._texts: dict[str, tuple[EditedFile, str]] = {}
        self._timer = QTimer(self, singleShot=True, interval=_WAIT)
        self._timer.timeout.connect(self.write)

    @property
    def unsaved(self) -> list[str]:
        """What would be lost now, each text with what is changed in it."""
        return [file.changes(text) for file, text in self._texts.values()]

    def note(self, file: EditedFile, text: str) -> None:
        """Note the present ``text`` of ``file``: it is kept while it has unsaved changes."""
        was = file.what in self._texts
        if file.is_unsaved(text):
            self._texts[file.what] = (file, text)
        else:
            self._texts.pop(file.what, None)
        if was or file.what in self._texts:
            self._timer.start()
        if was != (file.what in self._texts):
            self.changed.emit()

    def write(self) -> None:
        """Write the file now; without unsaved texts, remove it."""
        self._timer.stop()
        if not self._texts:
            if self._lock is not None:
                self._path.unlink(missing_ok=True)
            return
        texts = {what: asdict(_unsaved(file, text)) for what, (file, text) in self._texts.items()}
        content = json.dumps({"format": FORMAT, "texts": texts}, indent=1)
        try:
            self._folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            if self._lock is None:
                self._lock = lock_of(self._path)
                self._lock.tryLock(0)
            write_whole(self._path, content.encode("utf-8"))
        except (OSError, InputError) as error:
            log.warning("unsaved changes cannot be kept for a next start: %s", error)

    def close(self, keep: bool) -> None:
        """End the window: leave the file for the next start, or remove it."""
        if not keep:
            self._texts.clear()
        self.write()
        if self._lock is not None:
            self._lock.unlock()
            self._lock = None

    def found(self) -> Iterator[tuple[Path, dict[str, UnsavedText]]]:
        """Yield the files of windows that are gone, the newest first, with their texts."""
        files = sorted(self._folder.glob("*.json"), key=lambda path: path.name)
        read = [(path, texts) for path in files if (texts := _read(path))]
        for path, texts in sorted(read, key=lambda f: -max(t.at for t in f[1].values())):
            lock = lock_of(path)
            if path != self._path and lock.tryLock(0):
                try:
                    yield path, texts
                finally:
                    lock.unlock()


def _unsaved(file: EditedFile, text: str) -> UnsavedText:
    path = "" if file.path is None else str(file.path.absolute())
    folder = str(file.folder.absolute())
    return UnsavedText(text, file.saved, path, folder, file.changes(text), time.time())


def unsaved_folder(settings: QSettings) -> Path:
    """Return the folder of the recovery files: next to the settings, where these are a file."""
    file = Path(settings.fileName())
    if os.name == "nt" and settings.format() != QSettings.Format.IniFormat:  # the registry
        file = (
            Path(
                QStandardPaths.writableLocation(
                    QStandardPaths.StandardLocation.AppLocalDataLocation
                )
            )
            / "settings"
        )
    return file.parent / "unsaved"


def lock_of(path: Path) -> QLockFile:
    """Return the lock of the file ``path``, which ends with the process that holds it."""
    lock = QLockFile(f"{path}.lock")
    lock.setStaleLockTime(0)  # only the end of its process ends it
    return lock


def _read(path: Path) -> dict[str, UnsavedText]:
    """Return the texts in a recovery file; none where it is damaged or of another version."""
    try:
        data = json.loads(read_input(path, "recovery file", _BYTES_MAX))
        if data["format"] != FORMAT:
            return {}
        return {str(what): UnsavedText(**text) for what, text in data["texts"].items()}
    except (InputError, ValueError, TypeError, KeyError, AttributeError) as error:
        log.info("recovery file %s cannot be read: %r", path, error)
        return {}
