"""HTML report of trends: the life of the films at a glance."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from dearig.batch.trends import Trends
from dearig.report.html import picture, prefixes, write_page
from dearig.report.trend_words import (
    change_table,
    effect_table,
    own_table,
    proposal_sentences,
    trend_title,
    trends_sentences,
)

__all__ = ["write_trends_report"]

_DRAWN = 8  # numbers with figures; all are in the table


def write_trends_report(trends: Trends, title: str, path: Path) -> Path:
    """Write the report to the HTML file ``path`` and return its path. Raises ``InputError``."""
    return write_page(path, "trends.html.j2", _contents(trends, title))


def _contents(trends: Trends, title: str) -> Callable[[], dict[str, Any]]:
    def contents() -> dict[str, Any]:
        from dearig.report.trend_figures import life_figure, trend_figure

        names = prefixes()
        drawn = []
        for trend in trends.trends[:_DRAWN]:
            pictures = [
                picture(
                    trend_figure(trend),
                    names,
                    f"{trend_title(trend)}. Points: runs, less the film and the other columns. "
                    "Line and band: the common effect with its 95 % interval; grey where none is "
                    "seen. Crosses: films with an effect of their own.",
                ),
                picture(
                    life_figure(trends, trend),
                    names,
                    f"{trend.name} of each film with its 95 % intervals; line: the model; dashed: "
                    f"change points.",
                ),
            ]
            drawn.append((trend.name, pictures))
        tables = [t for t in (effect_table(trends), own_table(trends), change_table(trends)) if t]
        return {
            "title": title,
            "lead": "Trends",
            "summary": tuple(trends_sentences(trends)),
            "tables": tables,
            "next": proposal_sentences(trends),
            "drawn": drawn,
            "not_drawn": ", ".join(t.name for t in trends.trends[_DRAWN:]),
        }

    return contents
