"""Files of a study: ``study.json`` with words and numbers, ``curves.npz`` with its curves."""

from __future__ import annotations

import zipfile
from collections.abc import Callable, Mapping
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

import numpy as np

from dearig.analysis.outcomes import Comparison
from dearig.analysis.study import Residual, Study, StudyRequest, Trace, study
from dearig.errors import InputError
from dearig.input_file import parse_json, read_input
from dearig.model.fitting.channels import ChannelCurve
from dearig.model.readings.measures import Errors
from dearig.model.residual import Dependence, MissingStress
from dearig.progress import Progress, quiet
from dearig.recording.files import replaced_when_done, system_text
from dearig.recording.json_file import write_json
from dearig.report.pages.page import write_report
from dearig.report.study_view import Pair, Pieces, StudyView, view_of
from dearig.report.text.tables import Row, Table

__all__ = ["FORMAT", "StudyEntry", "make_study", "open_study", "save_study", "studies_in"]

FORMAT = "dearig-study/1"
_WORDS, _CURVES = "study.json", "curves.npz"
#: Bytes of ``study.json``, and of all curves when unpacked, at most.
_WORDS_MAX, _CURVES_MAX = 2**26, 2**32

_MEASURES = tuple(field.name for field in fields(Errors))

#: Folder, headline and label of a study.
StudyEntry = tuple[Path, str, str]


def make_study(task: StudyRequest, folder: Path, progress: Progress = quiet) -> Study:
    """Do ``task`` in a new folder within ``folder``, with its report, and save what is shown of it.

    Raises ``InputError``, see ``dearig.analysis.study.study``.
    """
    made = study(task, folder, write_report, progress=progress)
    save_study(view_of(made))
    return made


def save_study(view: StudyView) -> Path:
    """Write ``study.json`` and ``curves.npz`` to the folder of ``view``; return the first.

    Raises ``InputError``.
    """
    curves = _Curves()
    words = {
        "format": FORMAT,
        "made": view.made,
        "work": "diagnose" if view.diagnosed else "identify",
        "kind": view.kind,
        "headline": view.headline,
        "label": view.label,
        "about": [list(pair) for pair in view.about],
        "result": _pieces_json(view.result),
        "warnings": list(view.warnings),
        "ranking": _pieces_json(view.ranking),
        "experiment": _pieces_json(view.experiment),
        "sequence": view.sequence,
        "comparisons": [
            {"before": curves.comparison(a), "after": None if b is None else curves.comparison(b)}
            for a, b in view.pairs
        ],
        "residuals": [curves.residual(r) for r in view.residuals],
        "numbers": view.numbers,
    }
    path = view.folder / _CURVES
    with replaced_when_done(path, overwrite=True) as partial, partial.open("wb") as file:
        np.savez_compressed(file, allow_pickle=False, **curves.arrays)
    # last: a folder with this file is a whole study
    write_json(words, view.folder / _WORDS)
    return view.folder / _WORDS


def open_study(folder: Path) -> StudyView:
    """Return what is shown of the study in ``folder``. Raises ``InputError``."""
    words = _read_words(folder)
    try:
        with np.load(_checked_curves(folder), allow_pickle=False) as arrays:
            return _view(folder, words, {name: arrays[name] for name in arrays.files})
    except OSError as error:
        raise InputError(f"{folder / _CURVES} cannot be read: {system_text(error)}") from error
    except (KeyError, TypeError, ValueError, AttributeError, zipfile.BadZipFile) as error:
        raise InputError(
            f"{folder / _WORDS} and {_CURVES} do not belong together, or are damaged ({error}); "
            f"open report.html, or do the study again"
        ) from error


def studies_in(folder: Path) -> tuple[StudyEntry, ...]:
    """Return the studies in ``folder``, newest first; a file that cannot be read says so."""
    found = []
    try:
        paths = [p for p in folder.glob(f"*/{_WORDS}") if p.is_file()]
        paths.sort(key=lambda path: -path.stat().st_mtime)
    except OSError as error:
        raise InputError(f"{folder} cannot be read: {system_text(error)}") from error
    for path in paths:
        try:
            words = _read_words(path.parent)
        except InputError as error:
            found.append((path.parent, str(error), path.parent.name))
        else:
            label = str(words.get("label", path.parent.name))
            found.append((path.parent, str(words.get("headline", "")), label))
    return tuple(found)


def _read_words(folder: Path) -> dict[str, Any]:
    path = folder / _WORDS
    try:
        words = parse_json(read_input(path, "study", _WORDS_MAX))
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path} is not JSON ({error}); do the study again") from error
    if not isinstance(words, dict) or words.get("format") != FORMAT:
        raise InputError(
            f"{path} is not of the format {FORMAT}, which this version reads; open report.html "
            f"next to it, or do the study again"
        )
    return words


def _checked_curves(folder: Path) -> Path:
    path = folder / _CURVES
    with zipfile.ZipFile(path) as archive:
        if sum(item.file_size for item in archive.infolist()) > _CURVES_MAX:
            raise InputError(
                f"{path} unpacks to more than {_CURVES_MAX} bytes: it is not a study's"
            )
    return path


# ---------------------------------------------------------------- written


def _pieces_json(pieces: Pieces) -> list[Any]:
    return [piece if isinstance(piece, str) else asdict(piece) for piece in pieces]


class _Curves:
    """Collects arrays under names, and gives the JSON of values without their arrays."""

    def __init__(self) -> None:
        self.arrays: dict[str, np.ndarray] = {}

    def put(self, value: np.ndarray) -> str:
        name = f"a{len(self.arrays)}"
        self.arrays[name] = np.asarray(value)
        return name

    def plain(self, value: object, *left_out: str) -> dict[str, Any]:
        """Return the fields of a dataclass; arrays become their names."""
        found = {}
        for field in fields(value):  # type: ignore[arg-type]
            if field.name not in left_out:
                item = getattr(value, field.name)
                found[field.name] = self.put(item) if isinstance(item, np.ndarray) else item
        return found

    def comparison(self, value: Comparison) -> dict[str, Any]:
        stored = self.plain(
            value,
            "errors",
            "published",
            "ended",
            "warnings",
            "origin",
            "channels",
            "curves",
            "band",
        )
        # not every number is finite, and JSON has only finite ones
        return stored | {
            "errors": self.put(np.array([float(x) for x in asdict(value.errors).values()])),
            "curves": [self.plain(curve) for curve in value.curves],
        }

    def residual(self, value: Residual) -> dict[str, Any]:
        nested = ("over_time", "density", "dependences", "missing")
        return self.plain(value, *nested) | {
            "over_time": [self.plain(t) for t in value.over_time],
            "density": [self.plain(t) for t in value.density],
            "dependences": [[self.plain(d) for d in group] for group in value.dependences],
            "missing": [self.plain(m) for m in value.missing],
        }


# ---------------------------------------------------------------- read


def _view(folder: Path, words: Mapping[str, Any], arrays: Mapping[str, np.ndarray]) -> StudyView:
    def made(cls: Callable[..., Any], stored: Mapping[str, Any], *names: str) -> Any:
        return cls(**{k: arrays[v] if k in names else v for k, v in stored.items()})

    def comparison(stored: Mapping[str, Any]) -> Comparison:
        numbers = dict(zip(_MEASURES, arrays[stored["errors"]].tolist(), strict=True))
        samples = int(numbers.pop("samples"))
        curves = tuple(
            made(ChannelCurve, c, "time", "measured", "predicted") for c in stored.get("curves", ())
        )
        parts = {**stored, "errors": Errors(**numbers, samples=samples), "curves": curves}
        found: Comparison = made(Comparison, parts, "time", "drive", "measured", "model")
        return found

    def pair(stored: Mapping[str, Any]) -> Pair:
        after = stored["after"]
        return comparison(stored["before"]), None if after is None else comparison(after)

    def residual(stored: Mapping[str, Any]) -> Residual:
        parts = {
            "over_time": tuple(made(Trace, t, "x", "y") for t in stored["over_time"]),
            "density": tuple(made(Trace, t, "x", "y") for t in stored["density"]),
            "dependences": tuple(
                tuple(made(Dependence, d, "at", "loading", "unloading", "error") for d in group)
                for group in stored["dependences"]
            ),
            "missing": tuple(
                made(MissingStress, m, "time", "stress", "stretch", "rate", "voltage")
                for m in stored["missing"]
            ),
            "words": tuple(stored["words"]),
        }
        return Residual(**{**stored, **parts})

    return StudyView(
        folder=folder,
        made=str(words["made"]),
        diagnosed=words["work"] == "diagnose",
        kind=str(words["kind"]),
        headline=str(words["headline"]),
        about=tuple((str(name), str(value)) for name, value in words["about"]),
        result=_pieces(words["result"]),
        warnings=tuple(str(w) for w in words["warnings"]),
        ranking=_pieces(words["ranking"]),
        experiment=_pieces(words["experiment"]),
        sequence=str(words["sequence"]),
        pairs=tuple(pair(p) for p in words["comparisons"]),
        residuals=tuple(residual(r) for r in words["residuals"]),
        numbers=words["numbers"],
    )


def _pieces(stored: list[Any]) -> Pieces:
    return tuple(piece if isinstance(piece, str) else _table(piece) for piece in stored)


def _table(stored: Mapping[str, Any]) -> Table:
    return Table(
        stored["title"],
        tuple((name, unit) for name, unit in stored["head"]),
        tuple(Row(tuple(r["cells"]), r["detail"], r["muted"], r["mark"]) for r in stored["rows"]),
        stored["note"],
    )
