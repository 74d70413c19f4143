"""The room that the parts of a page have, kept from one start to the next."""

from __future__ import annotations

from PySide6.QtCore import QByteArray, QSettings
from PySide6.QtWidgets import QSplitter

__all__ = ["GROUP", "remember"]

#: Of the settings: what is removed with it is as at the first start.
GROUP = "room"


def remember(splitter: QSplitter, settings: QSettings, name: str) -> None:
    """Give ``splitter`` the sizes that it was left with, and keep what is made of them."""
    key = f"{GROUP}/{name}"
    state = settings.value(key)
    if isinstance(state, QByteArray):
        splitter.restoreState(state)
    splitter.splitterMoved.connect(lambda: settings.setValue(key, splitter.saveState()))
