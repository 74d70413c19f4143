"""Pictures that are not drawn, for tests of the pages around them."""

from __future__ import annotations

from xml.sax.saxutils import quoteattr

import pytest
from matplotlib.figure import Figure

__all__ = ["pictures", "sketched"]


def sketched(figure: Figure, prefix: str, label: str) -> str:
    """An element as ``svg`` makes it, with the size of ``figure`` and nothing in it."""
    width, height = 72.0 * figure.get_size_inches()
    box = f'viewBox="0 0 {width:g} {height:g}"'
    return f'<svg {box} role="img" aria-label={quoteattr(label)} id="{prefix}-0"></svg>'


@pytest.fixture(autouse=True)
def pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Drawing a figure takes a third of a second, and says nothing about the page around it.

    The pages that a module makes once for all of its tests are made before, with their pictures.
    """
    monkeypatch.setattr("dearig.report.pages.html.svg", sketched)
