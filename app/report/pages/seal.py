"""What tells a report of this program from any other page, and what such a page may hold.

A checksum at its end shows that a page is whole and unchanged. Anyone can compute it, so it
allows nothing on its own: the beginning has to hold the content policy of reports, before anything
else can act, and every element has to be one that reports have. None of them loads or runs
anything.
"""

from __future__ import annotations

import hashlib
import re

from markupsafe import escape

from dearig.errors import InputError

__all__ = ["POLICY", "check_page", "sealed"]

#: A page runs no script and loads nothing, whatever is in it; its links to CSV files are data.
POLICY = "default-src 'none'; style-src 'unsafe-inline'; base-uri 'none'; form-action 'none'"
_HEAD = (
    '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
    f'<meta http-equiv="Content-Security-Policy" content="{escape(POLICY)}">\n'
    '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
    '<meta name="generator" content="dearig">\n'
)
_SEAL = "<!-- dearig report, sha256 of what is above: {} -->\n"
_SEALED = re.compile(re.escape(_SEAL).replace(re.escape("{}"), "([0-9a-f]{64})") + r"\Z")
#: Elements of reports and of their figures, after the head. The text of others has none: it is
#: escaped.
_ELEMENTS = frozenset(
    """
    html head title style body main header nav article section div p br wbr h1 h2 h3 h4 b em
    strong cite code pre span sub sup ul ol li dl dt dd a details summary table caption thead
    tbody tr th td colgroup col figure figcaption svg defs g path use text tspan clippath rect
    line polyline polygon circle ellipse lineargradient stop marker
    math mfrac mi mn mo mover mrow mspace msqrt mstyle msub msubsup msup mtable mtd mtext mtr munder
    munderover
    """.split()  # noqa: SIM905  (a table of words)
)
_OPENED = re.compile(r"<(?:/?([A-Za-z][^\s/>]*)|([!?/]))")


def sealed(page: str) -> str:
    """Return the ``page`` of a report with its checksum at the end."""
    # bytes of a file name that are not text are shown as ?
    page = page.encode("utf-8", "replace").decode("utf-8")
    return page + _SEAL.format(_digest(page))


def check_page(page: str, name: str) -> None:
    """Raise ``InputError`` unless ``page`` is a report as this program writes it.

    ``name`` is that of its file, for the message.
    """
    seal = _SEALED.search(page)
    if seal is None or not page.startswith(_HEAD):
        raise InputError(
            f"{name} is not a report of this program, or one of an earlier version; give the "
            f"page of a fit or a diagnosis, such as report.html, or write the report again",
            option="report",
        )
    body = page[: seal.start()]
    if seal[1] != _digest(body):
        raise InputError(f"{name} was changed after it was written; write the report again")
    # every < counts, wherever a browser would see it: in no report does one stand for itself
    for found in _OPENED.finditer(body, len(_HEAD)):
        element = (found[1] or found[2]).lower()
        if element not in _ELEMENTS:
            raise InputError(
                f"{name} holds <{element[:40]}>, which no report has; it is not printed"
            )


def _digest(page: str) -> str:
    return hashlib.sha256(page.encode("utf-8")).hexdigest()
