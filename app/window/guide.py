"""The guide: the window's own README, with its pictures."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from PySide6.QtCore import Qt, QUrl
from PySide6.QtGui import QImage, QTextDocument
from PySide6.QtWidgets import QDialog, QTextBrowser, QVBoxLayout, QWidget

__all__ = ["Guide"]

_TEXT = Path(__file__).with_name("README.md")
_WIDTH = 760  # px of a picture
_QUESTIONED = "\n## What will be questioned"  # for those who change the window, not for its users


class Guide(QDialog):
    """Shows the guide and leaves the window usable."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setWindowTitle("dearig: the guide")
        self.setModal(False)
        self.resize(_WIDTH + 80, 700)
        self.text = _Illustrated()
        self.text.setOpenExternalLinks(False)
        self.text.document().setDocumentMargin(16)
        self.text.document().setBaseUrl(QUrl.fromLocalFile(str(_TEXT)))
        self.text.setMarkdown(_TEXT.read_text(encoding="utf-8").partition(_QUESTIONED)[0])
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addWidget(self.text)


class _Illustrated(QTextBrowser):
    """A text whose pictures are no wider than it; without them it is a text."""

    def loadResource(self, kind: int, name: QUrl | str) -> Any:  # noqa: N802
        if kind != QTextDocument.ResourceType.ImageResource.value:
            return super().loadResource(kind, name)
        path = Path(self.document().baseUrl().resolved(QUrl(name)).toLocalFile())
        # they lie beside the source, and are not part of an installed program
        picture = QImage(str(path)) if path.is_file() else QImage()
        if picture.isNull():
            return QImage(1, 1, QImage.Format.Format_ARGB32)
        return picture.scaledToWidth(_WIDTH, Qt.TransformationMode.SmoothTransformation)
