"""Files in the browser of the computer."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import QUrl
from PySide6.QtGui import QDesktopServices

from dearig.window.kit.widgets import Message

__all__ = ["open_in_browser"]


def open_in_browser(path: Path, message: Message) -> None:
    """Open the report at ``path`` in the browser; without one ``message`` says where it is."""
    if not QDesktopServices.openUrl(QUrl.fromLocalFile(str(path))):
        message.show_text(f"No browser was found. Open {path} in one.", "warn")
