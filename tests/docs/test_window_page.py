"""The operator's page names the labels that the window has."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize("page", ["app/docs/window.md", "app/docs/tutorial.md", "README.md"])
def test_labels_in_italics_are_labels_of_the_window(page: str) -> None:
    text = (ROOT / page).read_text(encoding="utf-8")
    labels = set(re.findall(r"(?<!\*)\*([A-Z][^*]+)\*(?!\*)", text)) - TITLES
    sources = "".join(
        file.read_text(encoding="utf-8").replace("&", "")
        for file in sorted((ROOT / "app" / "window").rglob("*.py"))
    )
    assert labels
    assert [label for label in sorted(labels) if " ".join(label.split()) not in sources] == []


#: What is in italics for another reason: works, and words that are stressed.
TITLES = {
    "Free-Energy Based Modeling of Planar Dielectric Elastomer Actuators",
}
