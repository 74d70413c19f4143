"""Description of an exported table, in a file of its own: W3C's "Metadata for Tabular Data" (CSVW).

A table of text has no place for units, events and the film, and programs that read such tables
expect numbers below one line of names.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from dearig.recording.content.layout import FORMAT

__all__ = ["description_path", "read_description", "write_description"]

#: Bytes of such a file that are read, at most.
BYTES_MAX = 2**24
_ENDING = "-metadata.json"
_CONTEXT = "http://www.w3.org/ns/csvw"


def description_path(table: Path) -> Path:
    """Return the path of the description of ``table``, by the rule of CSVW."""
    return table.with_name(table.name + _ENDING)


def write_description(
    path: Path, name: str, sha256: str, units: Mapping[str, str], about: Mapping[str, str]
) -> None:
    """Write the description of the table ``name`` to ``path``.

    ``units`` are those of its columns, in their order, ``about`` the texts of the recording, and
    ``sha256`` is that of the table: for another table of that name the description does not count.
    """
    columns = [
        {"name": column, "titles": column, "datatype": "double", "schema:unitText": unit}
        for column, unit in units.items()
    ]
    content = {
        "@context": _CONTEXT,
        "url": name,
        "tableSchema": {"columns": columns},
        "notes": [{"format": FORMAT, "sha256": sha256, "about": dict(about)}],
    }
    path.write_text(json.dumps(content, indent=1) + "\n", "utf-8", newline="\n")


def read_description(table: Path, sha256: str) -> dict[str, str] | None:
    """Return what the file next to ``table``, which has that ``sha256``, says of it, as texts.

    None where it describes another table.
    """
    for note in _notes(description_path(table)):
        match note:
            case {"format": str(form), "sha256": str(digest), "about": dict(about)}:
                if form == FORMAT and digest == sha256:
                    return {n: text for n, text in about.items() if isinstance(text, str)}
    return None


def _notes(path: Path) -> list[Any]:
    """Return the notes in the description at ``path``; none if it is something else."""
    try:
        if not path.is_file() or path.stat().st_size > BYTES_MAX:
            return []
        found = json.loads(path.read_text("utf-8"))
    except (OSError, ValueError, RecursionError):
        return []
    notes = found.get("notes") if isinstance(found, dict) else None
    return notes if isinstance(notes, list) else []
