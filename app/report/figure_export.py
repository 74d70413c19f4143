"""Export of figures: PNG files, and SVG elements for an HTML page."""

from __future__ import annotations

import io
import re
from pathlib import Path
from typing import TYPE_CHECKING
from xml.sax.saxutils import quoteattr

from dearig.report.figure_style import style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["save_png", "svg"]


def save_png(figure: Figure, path: str | Path, dpi: int = 200) -> Path:
    """Write ``figure`` as PNG; the file appears as a whole or not at all. Raises ``InputError``."""
    from dearig.recording.files import check_output, replaced_when_done

    path = check_output(path, overwrite=True)
    picture = io.BytesIO()
    with style():
        figure.savefig(picture, format="png", dpi=dpi)
    with replaced_when_done(path) as partial:
        partial.write_bytes(picture.getvalue())
    return path


def svg(figure: Figure, prefix: str, label: str) -> str:
    """``figure`` as an SVG element to stand inside an HTML page.

    ``prefix`` keeps its identifiers apart from other figures of that page, ``label`` says in words
    what is seen. It has no fixed size, takes the page's font, and refers to nothing outside.
    """
    stream = io.StringIO()
    with style():
        figure.savefig(stream, format="svg", metadata={"Date": None, "Creator": None})
    text = stream.getvalue()
    text = text[text.index("<svg") :]
    text = re.sub(r"\s*<metadata>.*?</metadata>", "", text, flags=re.DOTALL)
    text = re.sub(r"\s*<style [^>]*>.*?</style>", "", text, flags=re.DOTALL)
    text = re.sub(r"\s*<!--.*?-->", "", text, flags=re.DOTALL)
    # matplotlib's identifiers differ from run to run; only those that something refers to are kept
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
    """Path data to a hundredth of a point: half the bytes, and nothing that could be seen."""
    return re.sub(r"-?\d+\.\d{3,}", lambda n: f"{float(n[0]):.2f}", path)
