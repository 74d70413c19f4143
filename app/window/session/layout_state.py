"""Sizes of the parts of a page, kept from one start to the next."""

from __future__ import annotations

from PySide6.QtCore import QSettings
from PySide6.QtWidgets import QSplitter

from dearig.window.session.settings import kept_bytes

__all__ = ["GROUP", "remember"]

#: Group of the settings with all sizes; without it the window has its default layout.
GROUP = "layout"


def remember(splitter: QSplitter, settings: QSettings, name: str) -> None:
    """Restore the sizes of ``splitter`` from ``settings``, and save them when they change."""
    key = f"{GROUP}/{name}"
    splitter.restoreState(kept_bytes(settings, key))
    splitter.splitterMoved.connect(lambda: settings.setValue(key, splitter.saveState()))
