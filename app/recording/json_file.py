"""Write a result as JSON, for programs."""

from __future__ import annotations

import json
import math
import sys
from pathlib import Path
from typing import Any

from dearig.errors import InputError
from dearig.recording.files import check_output, replaced_when_done

__all__ = ["finite", "write_json"]


def finite(value: float | None) -> float | None:
    """Return ``value`` as a number of JSON, which has neither NaN nor infinity: None for them."""
    return float(value) if value is not None and math.isfinite(value) else None


def write_json(obj: dict[str, Any], target: str | Path) -> None:
    """Write ``obj`` as JSON to the file ``target``, or to standard output if that is ``-``.

    A file appears complete or not at all. Raises ``InputError`` if it cannot be written, and
    ``ValueError`` for NaN and infinity, which JSON does not have.
    """
    # non-ASCII characters are escaped: any terminal and any reader accepts any file name; JSON
    # leaves one control character, DEL
    text = json.dumps(obj, indent=2, allow_nan=False).replace("\x7f", "\\u007f") + "\n"
    if str(target) == "-":
        try:
            sys.stdout.write(text)
            sys.stdout.flush()
        except OSError as error:
            raise InputError(f"the JSON cannot be written to standard output: {error}") from error
        return
    path = check_output(target, overwrite=True)
    with replaced_when_done(path, overwrite=True) as partial:
        partial.write_text(text, encoding="utf-8", newline="\n")
