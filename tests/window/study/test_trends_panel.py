"""Trends of many recordings on the page Study: open a table, look at effects and films."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from PySide6.QtWidgets import QWidget
from pytestqt.qtbot import QtBot

from dearig.batch.table_file import write_csv
from dearig.window.session.state import Session
from dearig.window.study.trends_panel import TrendsPanel
from tests.tools.made_campaign import made_rows
from tests.window.shown_text import shown_texts

pytest.importorskip("statsmodels", reason='takes the extra "trends"')

Keep = Callable[[QWidget], None]
_PATIENCE = 120_000  # ms; on a machine that may be busy


@pytest.fixture
def panel(session: Session, keep: Keep) -> TrendsPanel:
    panel = TrendsPanel(session)
    panel.resize(900, 700)
    keep(panel)
    return panel


def opened(panel: TrendsPanel, path: Path, qtbot: QtBot) -> None:
    panel.open(path)
    qtbot.waitUntil(panel.open_button.isEnabled, timeout=_PATIENCE)


def test_a_table_is_shown_with_its_band_and_films_are_marked(
    panel: TrendsPanel, qtbot: QtBot, tmp_path: Path
) -> None:
    rows = made_rows(1, films=5, runs=8, own={"F03": 0.05})
    write_csv(rows, tmp_path / "study.csv")
    assert not panel.number.isEnabled()
    opened(panel, tmp_path / "study.csv", qtbot)
    assert [panel.number.itemText(i) for i in range(3)] == ["μ₀ (kPa)", "permittivity", "RMS (µm)"]
    panel.column.setCurrentText("temperature")
    (marked,) = [c for c in panel.plot.curves_in_key() if "of their own" in c.title]
    assert marked.points[0].size == 8
    band = [c.title for c in panel.plot.curves_in_key()]
    assert "common effect" in band
    panel.film.setCurrentIndex(panel.film.findData("F01"))
    assert "runs of F01" in [c.title for c in panel.plot.curves_in_key()]
    text = "\n".join(words for _, words in shown_texts(panel))
    assert "one film has an effect of its own: F03" in text
    assert "What to vary next" in text


def test_a_table_that_is_none_is_refused_in_a_sentence(
    panel: TrendsPanel, qtbot: QtBot, tmp_path: Path
) -> None:
    (tmp_path / "t.csv").write_text("a,b\n1,2\n", "utf-8")
    opened(panel, tmp_path / "t.csv", qtbot)
    assert "not a table of a study" in panel.message.text()
    assert not panel.report_button.isEnabled()
