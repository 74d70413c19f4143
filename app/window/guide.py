"""The guide: the window's own README, with its pictures."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import QUrl
from PySide6.QtWidgets import QDialog, QTextBrowser, QVBoxLayout, QWidget

__all__ = ["Guide"]

_TEXT = Path(__file__).with_name("README.md")


class Guide(QDialog):
    """Shows the guide and leaves the window usable."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setWindowTitle("dearig: the guide")
        self.setModal(False)
        self.resize(760, 640)
        text = QTextBrowser()
        text.setOpenExternalLinks(False)
        text.document().setBaseUrl(QUrl.fromLocalFile(str(_TEXT)))
        text.setMarkdown(_TEXT.read_text(encoding="utf-8"))
        layout = QVBoxLayout(self)
        layout.addWidget(text)
