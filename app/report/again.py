"""Reports made again, and their figures for print, from the result in a report or a JSON file."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, fields, is_dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dearig.analysis.outcomes import DiagnoseOutcome, IdentifyOutcome, ValidateOutcome
from dearig.errors import InputError
from dearig.input_file import parse_json, read_input
from dearig.progress import Progress, quiet
from dearig.report.made import made_by
from dearig.report.pages.seal import check_page
from dearig.report.stored import StoredReport, restored, stored_in

if TYPE_CHECKING:
    from dearig.report.pages.html import Picture

__all__ = ["PrintedFigure", "read_result", "write_again", "write_figures"]

#: Bytes of a report or of its JSON, at most: some hundred times those of a diagnosis.
_LARGEST = 2**28


@dataclass(frozen=True)
class PrintedFigure:
    """A figure that was written: its number in the report, its file and its caption."""

    number: int
    path: Path
    caption: str


def read_result(path: Path) -> StoredReport:
    """Return the result in the report or the JSON file at ``path``. Raises ``InputError``."""
    try:
        text = read_input(path, "report", _LARGEST).decode("utf-8")
        if text.startswith("<!DOCTYPE html>"):
            check_page(text, str(path))
            held = stored_in(text)
        else:
            whole = parse_json(text)
            held = whole.get("report") if isinstance(whole, dict) else None
    except (ValueError, LookupError) as error:
        raise InputError(f"{path} is neither a report nor the JSON of a result") from error
    if not isinstance(held, str):
        raise InputError(
            f"{path} holds no result: only reports and JSON of identify, validate, diagnose and "
            f"demo do, and those of earlier versions do not"
        )
    return restored(held, str(path))


def write_again(source: Path, out: Path, overwrite: bool = False) -> Path:
    """Write the report of the result in ``source`` to ``out``. Raises ``InputError``."""
    from dearig.recording.files import check_output
    from dearig.report.pages.html import write_page

    check_output(out, overwrite, source)
    result = read_result(source)
    with made_by(result.made), _of_this_version():
        template, contents = _page_of(result)
        return write_page(out, template, contents, result.outcomes)


def write_figures(
    result: StoredReport, kind: str, columns: int, folder: Path, progress: Progress = quiet
) -> tuple[tuple[PrintedFigure, ...], Path]:
    """Draw the figures of ``result`` for print, into ``folder``.

    ``kind`` is pdf, svg or png, ``columns`` the width: 1 or 2 columns of a journal's page. Returns
    the figures, and the text file with their captions. Raises ``InputError``.
    """
    from dearig.recording.files import replaced_when_done
    from dearig.report.figures.defaults import for_print
    from dearig.report.figures.export import save_for_print

    with made_by(result.made), for_print(columns), _of_this_version():
        contents = _page_of(result)[1]()
        banner = contents["head"].banner
        note = f" Simulated data: {banner}." if banner else ""
        about = f"{contents['title']}. {result.made.program}."
        written: list[PrintedFigure] = []
        pictures = _pictures(contents)
        for picture in pictures:
            progress("figures", len(written) / len(pictures))
            number = int(picture.number)
            path = folder / f"figure-{number:02d}.{kind}"
            caption = f"{picture.caption}{note}"
            save_for_print(picture.figure, path, kind, f"Figure {number}. {caption}", about)
            written.append(PrintedFigure(number, path, caption))
    captions = folder / "captions.txt"
    lines = [f"{f.path.name}: Figure {f.number}. {f.caption}\n" for f in written]
    with replaced_when_done(captions, overwrite=True) as partial:
        partial.write_text(
            "\n".join([f"{about}\n", *lines]), encoding="utf-8", errors="replace", newline="\n"
        )
    return tuple(written), captions


@contextmanager
def _of_this_version() -> Iterator[None]:
    """Turn the errors of values that no outcome of this version has into an ``InputError``."""
    try:
        yield
    except (ArithmeticError, LookupError, TypeError, ValueError) as error:
        what = " ".join(str(error).split())[:200]
        raise InputError(
            f"this version of dearig cannot show the result ({what}); the version that wrote it can"
        ) from error


def _page_of(result: StoredReport) -> tuple[str, Callable[[], dict[str, Any]]]:
    """Return the template of a result's page, and what makes its values."""
    from dearig.report.pages.diagnosis import diagnosis_contents
    from dearig.report.pages.html import fits_contents

    first = result.outcomes[0]
    if isinstance(first, DiagnoseOutcome):
        return "diagnosis.html.j2", diagnosis_contents(first)
    fits = [o for o in result.outcomes if isinstance(o, IdentifyOutcome | ValidateOutcome)]
    return "report.html.j2", fits_contents(fits)


def _pictures(value: object) -> list[Picture]:
    """Return the pictures in the values of a page, in the order of their numbers."""
    found: dict[int, Picture] = {}
    _collect(value, found)
    return [found[number] for number in sorted(found)]


def _collect(value: object, found: dict[int, Picture]) -> None:
    from dearig.report.pages.html import Picture

    if isinstance(value, Picture):
        found[int(re.sub(r"\D", "", value.number))] = value
    elif isinstance(value, dict):
        for part in value.values():
            _collect(part, found)
    elif isinstance(value, tuple | list):
        for part in value:
            _collect(part, found)
    elif is_dataclass(value) and not isinstance(value, type):
        for field in fields(value):
            _collect(getattr(value, field.name), found)
