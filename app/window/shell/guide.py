"""Guide of the window: the documents that ``dearig docs`` shows, opened at the operator's page."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from PySide6.QtCore import Qt, QUrl
from PySide6.QtGui import QDesktopServices, QImage, QTextDocument
from PySide6.QtWidgets import QDialog, QTextBrowser, QVBoxLayout, QWidget

from dearig.docs import page_at, to_html
from dearig.docs.pages import file_at

__all__ = ["Guide"]

_FIRST = "app/docs/window.md"
_WIDTH = 760  # px of a picture
_STYLE = """
code, pre { font-family: monospace; }
pre { margin-left: 20px; }
table { border-collapse: collapse; border: 1px solid gray; }
td, th { border: 1px solid gray; padding: 3px; text-align: left; }
"""


class Guide(QDialog):
    """Shows the documents and leaves the window usable."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setWindowTitle("dearig: guide")
        self.setModal(False)
        self.resize(_WIDTH + 80, 700)
        self.text = _Documents()
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addWidget(self.text)


class _Documents(QTextBrowser):
    """Documents by their paths in the repository; a picture is no wider than the text."""

    def __init__(self) -> None:
        super().__init__()
        self.setOpenLinks(False)
        self.anchorClicked.connect(self._follow)
        self.document().setDocumentMargin(16)
        self.document().setDefaultStyleSheet(_STYLE)
        # by its type: Qt takes the ending .md for a file of the working folder
        self.setSource(QUrl(_FIRST), QTextDocument.ResourceType.HtmlResource)

    def loadResource(self, kind: int, name: QUrl | str) -> Any:  # noqa: N802
        path = QUrl(name).path().removeprefix("/")
        if kind == QTextDocument.ResourceType.HtmlResource.value:
            page = page_at(path)
            return None if page is None else to_html(page, _address, formulas=False)
        if kind == QTextDocument.ResourceType.ImageResource.value:
            return _picture(file_at(path))
        return super().loadResource(kind, name)

    def _follow(self, link: QUrl) -> None:
        if link.scheme():
            QDesktopServices.openUrl(link)
        else:
            target = QUrl(link)
            target.setPath(link.path().removeprefix("/") or self.source().path())
            self.setSource(target, QTextDocument.ResourceType.HtmlResource)


def _address(path: str) -> str | None:
    """A linked file as the guide names it; None where it is not packaged.

    With a slash before it: a link is resolved from the folder of its page.
    """
    known = page_at(path) is not None or (path.endswith(".png") and file_at(path) is not None)
    return f"/{path}" if known else None


def _picture(file: Path | None) -> QImage:
    picture = QImage() if file is None else QImage(str(file))
    if picture.isNull():
        return QImage(1, 1, QImage.Format.Format_ARGB32)
    if picture.width() > _WIDTH:
        return picture.scaledToWidth(_WIDTH, Qt.TransformationMode.SmoothTransformation)
    return picture
