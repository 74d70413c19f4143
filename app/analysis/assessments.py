"""Cache of the errors of one model against the recordings of a folder, until a file changes."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path

from dearig import __version__
from dearig.analysis.summary import Assessment
from dearig.errors import InputError
from dearig.model.compiled.trusted_folder import cache_root
from dearig.model.readings.measures import Errors
from dearig.recording.files import file_sha256, replaced_when_done

__all__ = ["Stamp", "keep_assessments", "kept_assessments", "model_key"]

#: Size in bytes and time of the last change in ns of a file.
Stamp = tuple[int, int]

#: Version of the cache; another one is not read.
_KEPT = "dearig-assessments/1"


def model_key(model: Path | None, drive: str) -> str:
    """Return what is the same as long as the errors of ``model`` are the same.

    Raises ``InputError`` for a model file that cannot be read.
    """
    if model is None:
        return f"thesis {drive} {__version__}"
    try:
        return f"{file_sha256(model)} {drive} {__version__}"
    except OSError as error:
        raise InputError(f"{model} cannot be read: {error.strerror or error}") from error


def kept_assessments(folder: Path, key: str) -> dict[Path, tuple[Stamp, Assessment]]:
    """Return the errors in the cache; empty where it is missing, damaged or of another version."""
    cache = _cache_of(folder, key)
    if cache is None:
        return {}
    found = {}
    try:
        kept = json.loads(cache.read_text("utf-8"))
        if kept["format"] != _KEPT:
            return {}
        for name, size, changed, noise, unfit, fitted, errors in kept["files"]:
            path = folder / str(name)
            about = None
            if errors is not None:
                samples = int(errors.pop("samples"))
                about = Errors(**{k: float(v) for k, v in errors.items()}, samples=samples)
            found[path] = (
                (int(size), int(changed)),
                Assessment(
                    path,
                    about,
                    None if noise is None else float(noise),
                    str(unfit),
                    bool(fitted),
                ),
            )
    except (OSError, ValueError, TypeError, LookupError, AttributeError, RecursionError):
        return {}
    return found


def keep_assessments(
    folder: Path, key: str, assessments: Mapping[Path, tuple[Stamp, Assessment]]
) -> None:
    """Write ``assessments`` to the cache; without one the next start is only slower."""
    cache = _cache_of(folder, key)
    if cache is None:
        return
    files = [
        [
            path.relative_to(folder).as_posix(), *stamp, found.noise, found.unfit, found.fitted,
            None if found.errors is None else asdict(found.errors),
        ]
        for path, (stamp, found) in assessments.items()
    ]  # fmt: skip
    try:
        with replaced_when_done(cache, overwrite=True) as partial:
            partial.write_text(json.dumps({"format": _KEPT, "files": files}), encoding="utf-8")
    except (OSError, InputError):
        return


def _cache_of(folder: Path, key: str) -> Path | None:
    root = cache_root().path
    name = hashlib.sha256(os.fsencode(folder.resolve()) + b"\0" + key.encode()).hexdigest()[:24]
    return None if root is None else root / f"assessments-{name}.json"
