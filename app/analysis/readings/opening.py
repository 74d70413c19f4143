"""Recordings from paths: opened once, of one kind, none twice."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from dearig.errors import InputError
from dearig.recording.reading.reader import open_recording
from dearig.recording.reading.recording import Recording

__all__ = ["Source", "check_named_once", "open_all"]

#: A recording that was opened, or the path of one.
Source = str | Path | Recording

_KIND_TEXTS = {"actuator": "an actuator (voltage)", "film": "a film (stretch)"}


def open_all(sources: Sequence[Source]) -> list[Recording]:
    """Return the recordings ``sources``, all of one kind; those given by path are opened.

    Raises ``InputError`` for one that cannot be read, for a mixture of kinds, and for a file given
    twice or together with a copy of it (its samples would count double).
    """
    named: set[Path] = set()
    for source in sources:
        path = _path(source)
        where = Path(os.path.realpath(path))
        if where in named:
            raise InputError(f"{path} is given twice; give each recording once")
        named.add(where)
    recordings = [s if isinstance(s, Recording) else open_recording(s) for s in sources]
    seen: dict[str, Path] = {}
    for recording in recordings:
        if recording.sha256 in seen:
            raise InputError(
                f"{recording.path} is a copy of {seen[recording.sha256]}; leave one of them out"
            )
        seen[recording.sha256] = recording.path
    kinds = {r.kind for r in recordings}
    if len(kinds) > 1:
        text = ", ".join(f"{r.path} is of {_KIND_TEXTS[r.kind]}" for r in recordings)
        raise InputError(f"these recordings cannot be used together: {text}")
    return recordings


def check_named_once(train: Sequence[Source], validation: Sequence[Source]) -> None:
    """Refuse a file that is given both to fit and to validate."""
    named = {os.path.realpath(_path(source)) for source in train}
    for source in validation:
        if os.path.realpath(_path(source)) in named:
            raise InputError(
                f"{_path(source)} is given both to fit and to validate: an error on fitted data "
                f"proves nothing; leave it out of one of them"
            )


def _path(source: Source) -> Path:
    return source.path if isinstance(source, Recording) else Path(source)
