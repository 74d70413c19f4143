"""What the window had at its end or before a crash, for its next start.

Folder, sequence and overlay models are written to the settings as they change. The page and the
layout are kept by the window itself. A rig, an armed state and an acknowledgement are never kept: a
start is always disarmed, on the rig that was asked for.
"""

from __future__ import annotations

import os
from pathlib import Path

from PySide6.QtCore import QObject, QSettings, Slot

from dearig.config.toml_input import read_text
from dearig.errors import DearigError
from dearig.window.run.overlay_chooser import read_overlay
from dearig.window.session.settings import kept_text, kept_texts
from dearig.window.session.state import Session

__all__ = ["GROUP", "SessionKeeper", "kept_folder", "restore"]

#: Group of the settings with what is restored.
GROUP = "session"
_FOLDER, _FILE, _TEXT, _BESIDE, _OVERLAYS, _DRIVE = (
    f"{GROUP}/{name}"
    for name in (
        "folder", "sequence file", "sequence text", "sequence folder", "overlays", "drive",
    )
)  # fmt: skip
#: Characters of a sequence without a file that are kept, at most: settings are read as a whole.
_TEXT_MAX = 200_000
#: Stands for the thesis model among the files of overlay models.
_THESIS = "thesis model"
_DRIVES = ("command", "monitor")


class SessionKeeper(QObject):
    """Writes folder, sequence and overlays of ``session`` to its settings when they change."""

    def __init__(self, session: Session) -> None:
        super().__init__(session)
        self._session = session
        session.folder_changed.connect(self._keep_folder)
        session.sequence_changed.connect(self._keep_sequence)
        session.overlays_changed.connect(self._keep_overlays)
        self._keep_folder()

    def _set(self, key: str, value: object) -> None:
        self._session.settings.setValue(key, value)

    @Slot()
    def _keep_folder(self) -> None:
        self._set(_FOLDER, str(self._session.folder))

    @Slot()
    def _keep_sequence(self) -> None:
        session, path = self._session, self._session.sequence_path
        text = session.sequence_toml if path is None else ""
        self._set(_FILE, "" if path is None else str(path.absolute()))
        self._set(_TEXT, text if len(text) <= _TEXT_MAX else "")
        self._set(_BESIDE, str(session.sequence_folder.absolute()))

    @Slot()
    def _keep_overlays(self) -> None:
        session = self._session
        names = [_THESIS if m.path is None else str(m.path.absolute()) for m in session.overlays]
        self._set(_OVERLAYS, names or [""])
        self._set(_DRIVE, session.overlay_drive)


def kept_folder(settings: QSettings, instead: Path) -> tuple[Path, str]:
    """Return the folder of the last session; ``instead``, and a sentence, where it is gone."""
    text = kept_text(settings, _FOLDER)
    if not text:
        return instead, ""
    folder = Path(text)
    try:
        there = folder.is_dir() and os.access(folder, os.R_OK)
    except (OSError, ValueError):
        there = False
    if there:
        return folder, ""
    return instead, f"the folder {folder} of the last session cannot be read; this is {instead}"


def restore(session: Session) -> list[str]:
    """Give ``session`` the sequence and the overlay models of the last one.

    Returns sentences on what could not be restored.
    """
    return [*_restore_sequence(session), *_restore_overlays(session)]


def _restore_sequence(session: Session) -> list[str]:
    settings = session.settings
    file, text = kept_text(settings, _FILE), kept_text(settings, _TEXT, most=_TEXT_MAX)
    if file:
        path = Path(file)
        try:
            session.set_sequence(read_text(path, "sequence"), path.parent, path)
        except DearigError as error:
            return [f"the sequence of the last session is not restored: {error}"]
    elif text:
        session.set_sequence(text, Path(kept_text(settings, _BESIDE)))
    return []


def _restore_overlays(session: Session) -> list[str]:
    names = kept_texts(session.settings, _OVERLAYS, 2)
    if not names:
        return []
    said, overlays = [], []
    for name in filter(None, names):
        if name == _THESIS:
            overlays.append(session.thesis_model)
            continue
        try:
            overlays.append(read_overlay(Path(name)))
        except DearigError as error:
            said.append(f"an overlay model of the last session is not restored: {error}")
    drive = kept_text(session.settings, _DRIVE, "command")
    session.set_overlays(tuple(overlays), drive if drive in _DRIVES else "command")
    return said
