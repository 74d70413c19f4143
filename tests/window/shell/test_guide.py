"""F1: the guide shows the documents, with their pictures, and follows their links."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from PySide6.QtCore import QUrl
from PySide6.QtGui import QTextDocument
from pytestqt.qtbot import QtBot

from dearig.docs import page_at, pages
from dearig.window.shell.guide import Guide


def test_the_guide_opens_on_the_operators_page_with_its_pictures(
    qtbot: QtBot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)  # the documents are those of the package, not of the working folder
    guide = Guide()
    qtbot.addWidget(guide)
    first = page_at("app/docs/window.md")
    assert first is not None
    assert guide.text.toPlainText().startswith(first.title)
    # each as Qt asks for it: resolved from the page
    names = re.findall('<img src="([^"]+)"', guide.text.document().toHtml())
    kind = QTextDocument.ResourceType.ImageResource.value
    widths = [
        guide.text.loadResource(kind, guide.text.source().resolved(QUrl(name))).width()
        for name in names
    ]
    assert len(widths) >= 6
    assert min(widths) > 300


def test_a_link_that_is_clicked_opens_its_page(qtbot: QtBot) -> None:
    guide = Guide()
    qtbot.addWidget(guide)
    html = guide.text.document().toHtml()
    link = next(h for h in re.findall('<a href="([^"]+)"', html) if h.endswith(".md"))
    guide.text.anchorClicked.emit(guide.text.source().resolved(QUrl(link)))
    page = page_at(link.removeprefix("/"))
    assert page is not None
    assert guide.text.toPlainText().startswith(page.title)


def test_the_guide_follows_a_link_and_comes_back(qtbot: QtBot) -> None:
    guide = Guide()
    qtbot.addWidget(guide)
    guide.text.anchorClicked.emit(QUrl("drivers/SAFETY.md#hazards"))
    assert "hardware interlock" in guide.text.toPlainText()
    guide.text.backward()
    assert guide.text.source() == QUrl("app/docs/window.md")


def test_the_guide_can_show_every_document(qtbot: QtBot) -> None:
    guide = Guide()
    qtbot.addWidget(guide)
    for page in pages():
        guide.text.anchorClicked.emit(QUrl(page.path))
        assert guide.text.toPlainText().startswith(page.title), page.path
