"""What the window had at its end or before a crash, for its next start.

Folder, sequence, overlay models and the rig file are written to the settings as they change. The
page and the layout are kept by the window itself. A rig, an armed state and an acknowledgement are
never kept: a start is always disarmed, on the rig that was asked for. A hold is not kept either:
its ramps without their feedback are not the hold, and the sequence before it comes back.
"""

from __future__ import annotations

import os
from pathlib import Path

from PySide6.QtCore import QObject, QSettings, Slot

from dearig.config.rigfile import load_rig_file
from dearig.config.toml_input import read_text
from dearig.errors import DearigError
from dearig.window.run.overlay_chooser import read_overlay
from dearig.window.session.settings import kept_text, kept_texts
from dearig.window.session.state import Session

__all__ = ["GROUP", "SessionKeeper", "kept_folder", "restore"]

#: Group of the settings with what is restored.
GROUP = "session"
_FOLDER, _FILE, _TEXT, _BESIDE, _OVERLAYS, _DRIVE, _RIG, _HOLD = (
    f"{GROUP}/{name}"
    for name in (
        "folder", "sequence file", "sequence text", "sequence folder", "overlays", "drive",
        "rig file", "hold",
    )
)  # fmt: skip
#: Characters of a sequence without a file that are kept, at most: settings are read as a whole.
_TEXT_MAX = 200_000
#: Stands for the thesis model among the files of overlay models.
_THESIS = "thesis model"
_DRIVES = ("command", "monitor")
_BLOCK = "kept rig file"  # of the session


class SessionKeeper(QObject):
    """Writes what is restored of ``session`` to its settings when it changes."""

    def __init__(self, session: Session) -> None:
        super().__init__(session)
        self._session = session
        session.folder_changed.connect(self._keep_folder)
        session.sequence_changed.connect(self._keep_sequence)
        session.overlays_changed.connect(self._keep_overlays)
        session.hold_changed.connect(self._forget_hold)
        session.rig_changed.connect(self._keep_rig)
        self._rig_file = session.rig_file
        self._before: dict[str, str] = {}  # what was kept before the present sequence
        self._keep_folder()
        if session.rig_path is not None:
            self._set(_RIG, str(session.rig_path.absolute()))

    def _set(self, key: str, value: object) -> None:
        self._session.settings.setValue(key, value)

    @Slot()
    def _keep_folder(self) -> None:
        self._set(_FOLDER, str(self._session.folder))

    @Slot()
    def _keep_sequence(self) -> None:
        session, path = self._session, self._session.sequence_path
        if session.is_feedforward:
            return
        keys = (_FILE, _TEXT, _BESIDE)
        self._before = {key: kept_text(session.settings, key, most=_TEXT_MAX) for key in keys}
        self._set(_HOLD, "")
        text = session.sequence_toml if path is None else ""
        self._set(_FILE, "" if path is None else str(path.absolute()))
        self._set(_TEXT, text if len(text) <= _TEXT_MAX else "")
        self._set(_BESIDE, str(session.sequence_folder.absolute()))

    @Slot()
    def _forget_hold(self) -> None:
        """Keep the sequence before that of a hold, which was taken for a sequence as any other."""
        if self._session.hold is not None:
            for key, text in self._before.items():
                self._set(key, text)
            self._set(_HOLD, "1")

    @Slot()
    def _keep_rig(self) -> None:
        session = self._session
        if session.rig_file is self._rig_file:  # another address
            return
        self._rig_file = session.rig_file
        self._set(_RIG, "" if session.rig_path is None else str(session.rig_path.absolute()))
        session.unblock(_BLOCK)

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
    """Give ``session`` the rig file, the sequence and the overlay models of the last one.

    A rig file that was asked for stays. Returns sentences on what could not be restored.
    """
    said = _restore_rig(session)
    if kept_text(session.settings, _HOLD):
        said.append("the hold of the last session is not restored: prepare it again on Follow")
    return [*said, *_restore_sequence(session), *_restore_overlays(session)]


def _restore_rig(session: Session) -> list[str]:
    """Use the kept rig file; where it cannot be read, block arming: other limits are in force."""
    file = kept_text(session.settings, _RIG)
    if not file or session.rig_path is not None:
        return []
    path = Path(file)
    try:
        text = read_text(path, "rig file")
        session.set_rig_file(path, text, load_rig_file(path))
    except DearigError as error:
        sentence = f"the rig file of the last session cannot be used: {error}"
        session.block(
            _BLOCK, f"{sentence}. Open one, or choose Thesis rig to use its limits", "Rig"
        )
        return [sentence]
    return []


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
