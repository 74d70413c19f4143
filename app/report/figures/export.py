"""Export of figures: files, and SVG elements for an HTML page."""

from __future__ import annotations

import io
import re
from pathlib import Path
from typing import TYPE_CHECKING
from xml.sax.saxutils import quoteattr

from dearig.report.figures.defaults import style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["save_for_print", "save_png", "svg"]


def save_png(figure: Figure, path: str | Path, dpi: int = 200) -> Path:
    """Write ``figure`` as PNG, completely or not at all. Raises ``InputError``."""
    from dearig.recording.files import check_output, replaced_when_done

    path = check_output(path, overwrite=True)
    picture = io.BytesIO()
    with style():
        figure.savefig(picture, format="png", dpi=dpi)
    with replaced_when_done(path, overwrite=True) as partial:
        partial.write_bytes(picture.getvalue())
    return path


def save_for_print(figure: Figure, path: Path, kind: str, title: str, about: str) -> None:
    """Write ``figure`` as ``kind`` (pdf, svg or png) with a ``title`` and what it is ``about``.

    Fonts of a PDF are TrueType (type 42), and text of an SVG is text. The file has no date.
    Raises ``InputError``.
    """
    from dearig.recording.files import replaced_when_done

    if kind == "pdf":
        notes = {"Title": title, "Subject": about, "Creator": "dearig", "CreationDate": None}
    elif kind == "svg":
        notes = {"Title": title, "Description": about, "Creator": "dearig", "Date": None}
    else:
        notes = {"Title": title, "Description": about, "Software": "dearig"}
    picture = io.BytesIO()
    with style():
        figure.savefig(picture, format=kind, metadata=notes)
    with replaced_when_done(path, overwrite=True) as partial:
        partial.write_bytes(picture.getvalue())


def svg(figure: Figure, prefix: str, label: str) -> str:
    """Return ``figure`` as an SVG element for an HTML page.

    ``prefix`` separates its identifiers from those of other figures; ``label`` describes it for
    screen readers. It has no fixed size, uses the font of the page, and refers to no other file.
    """
    from matplotlib.backends.backend_svg import FigureCanvasSVG

    stream, canvas, dpi = io.StringIO(), figure.canvas, figure.dpi
    notes = {"Date": None, "Creator": None}
    try:
        with style():
            # savefig would draw all of it once more beforehand, for the layout alone
            FigureCanvasSVG(figure).print_svg(stream, metadata=notes)  # type: ignore[no-untyped-call]
    finally:  # it is drawn as before where it is saved elsewhere
        figure.set_canvas(canvas)
        figure.dpi = dpi
    text = stream.getvalue()
    text = text[text.index("<svg") :]
    text = re.sub(r"\s*<metadata>.*?</metadata>", "", text, flags=re.DOTALL)
    text = re.sub(r"\s*<style [^>]*>.*?</style>", "", text, flags=re.DOTALL)
    text = re.sub(r"\s*<!--.*?-->", "", text, flags=re.DOTALL)
    # identifiers of matplotlib differ from run to run; only those that are referred to are kept
    text = re.sub(r"\bxlink:href=", "href=", text)
    used = dict.fromkeys(re.findall(r'(?:href="|url\()#([^")]+)', text))
    short = {name: f"{prefix}-{i}" for i, name in enumerate(used)}
    text = re.sub(r' id="([^"]*)"', lambda d: f' id="{short[d[1]]}"' if d[1] in short else "", text)
    text = re.sub(r'(href="|url\()#([^")]+)', lambda d: f"{d[1]}#{short[d[2]]}", text)
    text = re.sub(r' d="[^"]*"', lambda d: _rounded(d[0]), text)
    text = text.replace("'DejaVu Sans', sans-serif", "inherit").replace("'DejaVu Sans'", "inherit")
    box = re.search(r'viewBox="[^"]*"', text)
    if box is None:
        raise ValueError("the SVG that was drawn has no viewBox")
    head = (
        f'<svg {box[0]} role="img" aria-label={quoteattr(label)} '
        f'style="stroke-linejoin:round;stroke-linecap:butt">'
    )
    return head + text[text.index(">") + 1 :].strip()


def _rounded(path: str) -> str:
    """Round path data to 0.01 point, which halves the size and is not visible."""
    return re.sub(r"-?\d+\.\d{3,}", lambda n: f"{float(n[0]):.2f}", path)
