"""HTML of values for a notebook: it inherits the page's colours, so that it fits light and dark."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterable, Sequence
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dearig.report.figures.export import svg
from dearig.report.figures.style import DRIVE, MARK, NOISE
from dearig.report.pages import html
from dearig.report.pages.head import head_of
from dearig.report.text.tables import Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from dearig.recording.reading.origin import Origin

__all__ = ["card", "drawing", "facts", "table_html", "write_page"]

_LINE = "border-bottom:1px solid rgba(128,128,128,.35)"
_CELL = f"padding:.25em .7em .25em 0;{_LINE};background:none;vertical-align:baseline"
_SENTENCES_MAX = 4  # of a card; the report has them all
_PREFIX = "dearig-figure"

#: What a figure draws in the colours of paper, and what stands for it on a page of any colour.
_INK = re.compile(rf"#(?:111111|404040|000000|{MARK[1:]}|{DRIVE[1:]})\b", re.IGNORECASE)
_PAPER = re.compile(r"fill: #ffffff\b", re.IGNORECASE)
_GRID = re.compile(r"stroke: #e3e6ea\b", re.IGNORECASE)
_BAND = re.compile(rf"fill: {NOISE}\b", re.IGNORECASE)


def card(title: str, *parts: str, sentences: Iterable[str] = ()) -> str:
    """Return a block with ``title``, the first ``sentences``, and ``parts`` that are HTML."""
    said = "".join(
        f'<p style="margin:.4em 0">{escape(sentence)}</p>'
        for sentence in list(sentences)[:_SENTENCES_MAX]
    )
    return (
        '<div style="border-left:3px solid #0072B2;padding:.1em 0 .1em 1em;margin:0 0 1em;'
        'max-width:48em">'
        f'<p style="margin:.2em 0 .5em;font-weight:600;font-size:1.1em">{escape(title)}</p>'
        f"{said}{''.join(parts)}</div>"
    )


def facts(rows: Iterable[tuple[str, str]]) -> str:
    """Return a table of (name, value) rows."""
    lines = "".join(
        f'<tr style="background:none"><th style="{_CELL};text-align:left;font-weight:400;'
        f'opacity:.75;overflow-wrap:anywhere">{escape(name)}</th>'
        f'<td style="{_CELL};text-align:left">{escape(value)}</td></tr>'
        for name, value in rows
    )
    return f'<table style="border-collapse:collapse;margin:.5em 0">{lines}</table>'


def table_html(table: Table) -> str:
    """Return ``table`` as HTML, its first column to the left and numbers to the right."""

    def row(cells: Sequence[str], tag: str, look: str) -> str:
        made = []
        for i, cell in enumerate(cells):
            side = "left" if i == 0 else "right"
            made.append(f'<{tag} style="{_CELL};text-align:{side};{look}">{cell}</{tag}>')
        return f'<tr style="background:none">{"".join(made)}</tr>'

    head = ["<br>".join(escape(part) for part in (name, unit) if part) for name, unit in table.head]
    lines = [
        row(
            [escape(cell) for cell in line.cells],
            "td",
            "opacity:.6" if line.muted else "font-weight:600" if line.mark else "",
        )
        for line in table.rows
    ]
    note = f'<p style="margin:.2em 0;opacity:.75">{escape(table.note)}</p>' if table.note else ""
    return (
        '<div style="overflow-x:auto"><table style="border-collapse:collapse;margin:.5em 0">'
        f"<thead>{row(head, 'th', 'font-weight:600')}</thead><tbody>{''.join(lines)}</tbody>"
        f"</table></div>{note}"
    )


def drawing(figure: Figure, label: str) -> str:
    """Return ``figure`` as an inline SVG without a background, described by ``label``."""
    text = svg(figure, _PREFIX, label)
    # one page may show many figures, whose identifiers must differ
    text = text.replace(_PREFIX, "d" + hashlib.sha256(text.encode()).hexdigest()[:10])
    text = _PAPER.sub("fill: none", text)
    text = _GRID.sub("stroke: currentColor; stroke-opacity: 0.15", text)
    text = _BAND.sub("fill: currentColor; fill-opacity: 0.15", text)
    text = _INK.sub("currentColor", text)
    return f'<div style="max-width:36em;margin:.6em 0">{text}</div>'


def write_page(
    path: str | Path, title: str, lead: str, body: str, origins: Iterable[Origin] = ()
) -> Path:
    """Write ``body``, HTML, as a page with the head of reports to ``path``, replacing it.

    ``lead`` is the kind of the page, ``origins`` those of its recordings. Raises ``InputError``
    where the file may not be written.
    """
    from markupsafe import Markup

    def contents() -> dict[str, Any]:
        # the functions of this module have escaped all text in it
        markup = Markup(body)  # noqa: S704
        return {"title": title, "lead": lead, "head": head_of(origins), "body": markup}

    return html.write_page(path, "card.html.j2", contents)
