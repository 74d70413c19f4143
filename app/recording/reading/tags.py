"""Tags of recordings, in a small file next to them: a finished recording stays as it was written.

The file ``dearig-tags.json`` of a folder names its recordings by file name and identifier, so that
tags stay with a recording that is renamed, and do not go over to another one of the same name.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from dearig.errors import InputError
from dearig.input_file import parse_json, read_input
from dearig.printable import printable
from dearig.recording.json_file import write_json

__all__ = ["TAGS_FILE", "Tagged", "clean_tags", "read_tags", "tags_of", "write_tags"]

#: Name of the file with the tags of the recordings in its folder.
TAGS_FILE = "dearig-tags.json"
FORMAT = "dearig-tags/1"
#: Limits of the file: bytes, tags of a recording, and characters of a tag.
BYTES_MAX, TAGS_MAX, TAG_MAX = 16_000_000, 20, 40


@dataclass(frozen=True)
class Tagged:
    """The ``tags`` of one recording; ``identifier`` is empty for a file that cannot be read."""

    file: str
    identifier: str
    tags: tuple[str, ...]


def clean_tags(text: str | Iterable[str]) -> tuple[str, ...]:
    """Return the tags in ``text``, which are separated by commas or semicolons, each once.

    Raises ``InputError`` for too many or too long ones.
    """
    parts = text.replace(";", ",").split(",") if isinstance(text, str) else text
    # printable: the tags are shown in windows and terminals, and may come from a file of others
    tags = tuple(dict.fromkeys(t for part in parts if (t := printable(" ".join(part.split())))))
    if len(tags) > TAGS_MAX:
        raise InputError(f"{len(tags)} tags are given; a recording has at most {TAGS_MAX}")
    for tag in tags:
        if len(tag) > TAG_MAX:
            raise InputError(
                f"the tag {tag[:TAG_MAX]}... has {len(tag)} characters; a tag has at most {TAG_MAX}"
            )
    return tags


def read_tags(folder: Path) -> tuple[Tagged, ...]:
    """Return the tags in ``folder``; empty where it has no file of tags.

    Raises ``InputError`` for a file that cannot be read or is of another format.
    """
    path = folder / TAGS_FILE
    if not path.exists():
        return ()
    content = read_input(path, "file of tags", BYTES_MAX)
    try:
        stored = parse_json(content)
        if stored["format"] != FORMAT:
            raise InputError(f"{path} is not of format {FORMAT}")
        return tuple(
            Tagged(str(row["file"]), str(row["identifier"]), clean_tags(map(str, row["tags"])))
            for row in stored["recordings"]
        )
    except (ValueError, TypeError, LookupError, RecursionError) as error:
        raise InputError(f"{path} is damaged: {type(error).__name__}: {error}") from error


def tags_of(known: Iterable[Tagged], file: str, identifier: str) -> tuple[str, ...]:
    """Return the tags of the recording ``identifier`` in ``file``."""
    by_name: tuple[str, ...] = ()
    for row in known:
        if identifier and row.identifier == identifier:
            return row.tags
        if row.file == file and not (identifier and row.identifier):
            by_name = row.tags
    return by_name


def write_tags(folder: Path, fresh: Iterable[Tagged]) -> tuple[Tagged, ...]:
    """Give recordings in ``folder`` the ``fresh`` tags, and return the tags of all.

    The file is read first, so that tags given meanwhile by another program stay. Raises
    ``InputError`` if it cannot be read or written; then it is as it was.
    """
    rows = list(read_tags(folder))
    for new in fresh:
        rows = [row for row in rows if not _same(row, new)]
        if new.tags:
            rows.append(new)
    rows.sort(key=lambda row: row.file)
    write_json(
        {
            "format": FORMAT,
            "recordings": [
                {"file": row.file, "identifier": row.identifier, "tags": list(row.tags)}
                for row in rows
            ],
        },
        folder / TAGS_FILE,
    )
    return tuple(rows)


def _same(row: Tagged, new: Tagged) -> bool:
    if row.identifier and new.identifier:
        return row.identifier == new.identifier
    return row.file == new.file
