"""Settings of the window that are kept between its starts, each checked as it is read.

The file may be damaged, of another version or edited by hand. A value of the wrong type counts as
missing, so that the window opens as at its first start.
"""

from __future__ import annotations

import logging
import os
import tempfile
import threading
from collections.abc import Callable
from pathlib import Path

from PySide6.QtCore import QByteArray, QEvent, QObject, QSettings

from dearig.model.compiled.trusted_folder import distrust, distrust_file

__all__ = [
    "HeldSettings",
    "kept_bytes",
    "kept_number",
    "kept_text",
    "kept_texts",
    "open_settings",
    "write_apart",
]

log = logging.getLogger(__name__)

#: Longest text that is read, in characters: more than any path or name has.
_TEXT_MAX = 4096


def open_settings() -> QSettings:
    """Return the user's settings; empty ones, not kept, where the file may be another user's work.

    A settings file can hold serialised Python objects, which run code when they are read.
    """
    settings = QSettings()
    path = Path(settings.fileName())
    if os.name == "nt":  # the registry, in which other users cannot write here
        return settings
    reason = distrust(path.parent.resolve()) or (distrust_file(path) if path.exists() else "")
    if not reason:
        return settings
    log.warning("the settings of the window are not read or kept: %s", reason)
    folder = tempfile.mkdtemp(prefix="dearig-settings-")
    return QSettings(f"{folder}/dearig.ini", QSettings.Format.IniFormat)


class HeldSettings(QObject):
    """Holds changes of settings in memory while ``is_busy``, until ``write``.

    Qt writes them in the interface's thread, and waits until they are on the disk: a slow disk
    keeps STOP waiting for a tenth of a second and more.
    """

    def __init__(
        self, settings: QSettings, is_busy: Callable[[], bool], parent: QObject | None = None
    ) -> None:
        super().__init__(parent)
        self._settings = settings
        self._is_busy = is_busy
        self._are_held = False
        settings.installEventFilter(self)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:  # noqa: N802, ARG002  (Qt's)
        """Hold Qt's own event that writes changes."""
        if event.type() != QEvent.Type.UpdateRequest or not self._is_busy():
            return False
        self._are_held = True
        return True

    def write(self) -> None:
        """Write what was held, unless ``is_busy``."""
        if self._are_held and not self._is_busy():
            self._are_held = False
            self._settings.sync()


def write_apart(settings: QSettings) -> threading.Thread:
    """Write all changes of ``settings`` in a thread of its own, which is returned."""
    place = settings.fileName(), settings.format()
    # objects with the same file share what is not written yet
    thread = threading.Thread(target=lambda: QSettings(*place).sync(), name="settings")
    thread.start()
    return thread


def _value(settings: QSettings, key: str) -> object:
    try:
        return settings.value(key)
    except Exception as error:  # noqa: BLE001  (Qt's reader of damaged values raises many kinds)
        log.info("setting %s cannot be read: %r", key, error)
        return None


def kept_text(settings: QSettings, key: str, default: str = "", most: int = _TEXT_MAX) -> str:
    """Return the text of ``key``, ``default`` without one or if it is longer than ``most``."""
    value = _value(settings, key)
    return value if isinstance(value, str) and len(value) <= most else default


def kept_texts(settings: QSettings, key: str, most: int) -> list[str]:
    """Return the list of texts of ``key``, at most ``most``."""
    value = _value(settings, key)
    if isinstance(value, str):  # QSettings returns a list of one as a text
        value = [value]
    found = value if isinstance(value, list) else []
    return [text for text in found if isinstance(text, str) and len(text) <= _TEXT_MAX][:most]


def kept_number(settings: QSettings, key: str, default: int) -> int:
    """Return the whole number of ``key``; ``default`` where there is none."""
    try:
        return int(kept_text(settings, key, str(_value(settings, key)))[:20])
    except ValueError:
        return default


def kept_bytes(settings: QSettings, key: str) -> QByteArray:
    """Return the bytes of ``key``; empty where there are none."""
    value = _value(settings, key)
    return value if isinstance(value, QByteArray) else QByteArray()
