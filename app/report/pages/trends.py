"""HTML report of trends: the life of the films at a glance."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from dearig.batch.trends import Trends
from dearig.recording.content.timestamps import local_time
from dearig.recording.reading.origin import Origin
from dearig.report.pages.head import head_of
from dearig.report.pages.html import picture, prefixes, write_page
from dearig.report.text.trends import (
    change_table,
    effect_table,
    number_name,
    own_table,
    proposal_texts,
    trend_title,
    trends_texts,
)

__all__ = ["origins_of_rows", "write_trends_report"]

_NAMED_MAX = 24  # films that the head names
_DRAWN = 8  # numbers with figures; all are in the table


def write_trends_report(trends: Trends, title: str, path: Path) -> Path:
    """Write the report to the HTML file ``path`` and return its path. Raises ``InputError``."""
    return write_page(path, "trends.html.j2", _contents(trends, title))


def _contents(trends: Trends, title: str) -> Callable[[], dict[str, Any]]:
    def contents() -> dict[str, Any]:
        from dearig.report.figures.trends import life_figure, trend_figure

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
                    f"{number_name(trend.name)} of each film with its 95 % intervals; line: the "
                    f"model; dashed: change points.",
                ),
            ]
            drawn.append((number_name(trend.name), pictures))
        tables = [t for t in (effect_table(trends), own_table(trends), change_table(trends)) if t]
        return {
            "title": title,
            "lead": "Trends",
            "head": head_of(origins_of_rows(trends.rows), [("Film", [_films(trends)])]),
            "summary": tuple(trends_texts(trends)),
            "tables": tables,
            "next": proposal_texts(trends),
            "drawn": drawn,
            "not_drawn": ", ".join(number_name(t.name) for t in trends.trends[_DRAWN:]),
        }

    return contents


def origins_of_rows(rows: Iterable[Mapping[str, Any]]) -> Iterator[Origin]:
    """Yield what the ``rows`` of a study's table say of each recording."""
    for row in rows:
        rig = str(row.get("rig") or "")
        yield Origin(
            name=str(row["recording"]),
            sha256=str(row.get("sha256") or ""),
            # a recording that was imported has no rig
            simulated=rig.partition(":")[0] == "sim" if rig else None,
            source=f"rig {rig}" if rig else "",
            started=local_time(str(row.get("started") or "")),
            operator=str(row.get("operator") or ""),
            film=str(row.get("film") or ""),
        )


def _films(trends: Trends) -> str:
    """Return the names of the films in a line."""
    names = sorted(set(trends.films) - {""})
    if not names:
        return "no film has a name"
    more = f" and {len(names) - _NAMED_MAX} more" if len(names) > _NAMED_MAX else ""
    return f"{len(names)}: {', '.join(names[:_NAMED_MAX])}{more}"
