"""Many recordings fitted, diagnosed or validated: a table with a row for each of them."""

from __future__ import annotations

import logging
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from dearig.batch.engines import ClusterLost, Engine, LocalEngine
from dearig.batch.fits import KINDS, FitTask, Row, StudyOptions, Subject, fit_task, key_of
from dearig.batch.journal import JOURNAL
from dearig.batch.queue import Queue
from dearig.batch.shared_fits import film_task, fit_film, rows_of
from dearig.batch.table_file import write_csv, write_parquet
from dearig.config.modelfile import ModelFile, load_model, model_toml
from dearig.config.toml_input import read_text
from dearig.errors import InputError
from dearig.input_file import parse_json, read_input
from dearig.progress import Progress, quiet
from dearig.recording.files import system_text
from dearig.recording.json_file import write_json
from dearig.recording.reading.index import ENDINGS, glance, list_folder

__all__ = ["StudyTable", "study_films", "study_recordings", "subjects_of", "with_model"]

log = logging.getLogger(__name__)

#: Version of the rows in the cache; another one is not read.
CACHED = "dearig-study-row/1"
#: Recordings of a study, at most, and bytes of a list of them.
_MOST, _LIST_BYTES = 100_000, 2**24
_ROW_BYTES = 2**26  # of a row in the cache, at most, as of the report's file
_LISTS = (".txt", ".csv", ".list")


@dataclass(frozen=True)
class StudyTable:
    """Rows of a study in the order of their starts, and the files that they were written to.

    ``cached`` rows were computed by an earlier study. ``moved`` says why the rest was computed on
    this computer, "" if it was computed where it should be. ``parquet`` is None where pyarrow is
    not installed.
    """

    options: StudyOptions
    rows: tuple[Row, ...]
    cached: int
    table: Path
    parquet: Path | None
    moved: str = ""

    @property
    def failed(self) -> tuple[Row, ...]:
        """Rows without a result."""
        return tuple(row for row in self.rows if row["state"] != "ok")


def subjects_of(sources: Sequence[Path], out: Path) -> list[Subject]:
    """Return the recordings in ``sources``: folders, lists (text, a path a line), recordings.

    Of the folder of a campaign the runs to warm up are left out. What lies in ``out`` is not a
    source. Raises ``InputError`` where there is none, and for a name that occurs twice.
    """
    found: list[Subject] = []
    for source in sources:
        before = f"{source.as_posix().rstrip('/')}/" if len(sources) > 1 else ""
        if source.is_dir():
            found += _in_folder(source, before, out)
        elif source.suffix.lower() in ENDINGS:
            found.append(Subject(source.as_posix(), source))
        elif source.suffix.lower() in _LISTS:
            found += _listed(source)
        else:
            what = "is not there" if not source.exists() else "is not one of them"
            raise InputError(
                f"{source} {what}: give folders, recordings, or a list of recordings ({_LISTS[0]}) "
                f"with a path on each line"
            )
    if not found:
        raise InputError(f"there is no recording in {', '.join(map(str, sources))}")
    if len(found) > _MOST:
        raise InputError(f"{len(found):,} recordings are more than {_MOST:,}; study them in parts")
    names: set[str] = set()
    files: dict[str, str] = {}
    for subject in found:
        if subject.name in names:
            raise InputError(f"{subject.name} is given twice; give each recording once")
        names.add(subject.name)
        other = files.setdefault(os.path.realpath(subject.path), subject.name)
        if other != subject.name:
            raise InputError(f"{subject.name} and {other} are one file; give each recording once")
    return found


def _in_folder(folder: Path, before: str, out: Path) -> Iterator[Subject]:
    inside = out.resolve()
    runs: dict[str, dict[Path, Any]] = {}
    listing = list_folder(folder)
    # what cannot be read has a row that says so
    for name in sorted([*listing.files, *(entry.path for entry in listing.unread)]):
        path = folder / name
        if path.resolve().is_relative_to(inside):
            continue
        labels: dict[str, Any] = {}
        parent = path.parent
        if (parent / JOURNAL).exists():
            key = str(parent)
            if key not in runs:
                queue = Queue.of(parent / JOURNAL)
                runs[key] = {parent / run.recording: run for run in queue.listed if run.recording}
            run = runs[key].get(path)
            if run is not None and run.warm_up:
                continue
            if run is not None:
                labels = {"run": run.name, **{f"set {n}": v for n, v in run.settings.items()}}
        yield Subject(f"{before}{name}", path, labels)


def _listed(path: Path) -> Iterator[Subject]:
    try:
        lines = read_input(path, "list", _LIST_BYTES).decode("utf-8").splitlines()
    except UnicodeDecodeError as error:
        raise InputError(f"list {path}: not UTF-8 text; save the file in UTF-8") from error
    for line in lines:
        name = line.strip().strip('"')
        if name and not name.startswith("#"):
            yield Subject(name, path.parent / name)


def with_model(options: StudyOptions, model: Path | ModelFile | None) -> StudyOptions:
    """Return ``options`` with the text of the model, or its file, that a validation needs."""
    if options.do not in KINDS:
        raise InputError(f"{options.do} is not one of {', '.join(KINDS)}", option="do")
    if (options.do == "validate") != (model is not None):
        raise InputError(
            "a validation needs a model file"
            if model is None
            else f"a model file is for validate; {options.do} fits a model",
            option=("model", "do"),
        )
    if options.own and options.do != "identify":
        raise InputError(
            f"parameters of each recording's own are for identify; {options.do} shares none",
            option=("own", "do"),
        )
    if options.parameters and (options.own or options.do == "validate"):
        raise InputError(
            "what is known of parameters is for recordings that are fitted each alone",
            option=("parameters", "own" if options.own else "do"),
        )
    if model is None:
        return options
    if isinstance(model, ModelFile):
        return replace(options, model=model_toml(model.name, model.model, model.history))
    load_model(model)  # refuses what is none
    return replace(options, model=read_text(model, "model file"))


def study_recordings(
    subjects: Sequence[Subject],
    options: StudyOptions,
    out: Path,
    engine: Engine,
    *,
    progress: Progress = quiet,
) -> StudyTable:
    """Compute a row for each of ``subjects`` with ``engine``, and write the table to ``out``.

    A row that an earlier study with the same recording, options and version has computed is taken
    from the cache in ``out``. A study that is ended keeps its rows there. Where a cluster is lost,
    the rest is computed on this computer.
    """
    cache = _cache_in(out)
    rows: dict[str, Row] = {}
    tasks: list[FitTask] = []
    unreadable = 0
    for i, subject in enumerate(subjects):
        progress("reading", i / len(subjects))
        try:
            task = FitTask(
                subject.name, subject.path, key_of(subject.path, subject.name, options), options
            )
        except OSError as error:
            rows[subject.name] = _unreadable(subject, error)
            unreadable += 1
            continue
        known = _kept(cache / f"{task.key}.json")
        if known is not None:
            rows[task.name] = known
        else:
            tasks.append(task)
    cached = len(subjects) - len(tasks) - unreadable
    moved = _compute_all(tasks, engine, fit_task, rows, cache, len(subjects), progress)
    return _table(subjects, rows, options, out, cached, moved)


def study_films(
    subjects: Sequence[Subject],
    options: StudyOptions,
    out: Path,
    engine: Engine,
    *,
    progress: Progress = quiet,
) -> StudyTable:
    """Fit the recordings of each film together, and write their rows to ``out``.

    The parameters ``options.own`` each recording has for itself, the others are of the film.
    ``engine`` computes films by ``fit_film``; they are cached, and a lost cluster is replaced, as
    ``study_recordings`` does it. A recording without the name of a film has no result.
    """
    cache = _cache_in(out)
    rows: dict[str, Row] = {}
    films: dict[str, list[tuple[Subject, str]]] = {}
    for i, subject in enumerate(subjects):
        progress("reading", i / len(subjects))
        try:
            key = key_of(subject.path, subject.name, options)
            film = glance(subject.path, subject.name, subject.path.stat().st_size).film
        except OSError as error:
            rows[subject.name] = _unreadable(subject, error)
            continue
        if film:
            films.setdefault(film, []).append((subject, key))
        else:
            reason = f"{subject.name}: it does not name its film, whose parameters it would share"
            rows[subject.name] = {"recording": subject.name, "state": "failed", "reason": reason}
    tasks = [film_task(film, members, options) for film, members in films.items()]
    found: dict[str, Row] = {}
    for task in tasks:
        known = _kept(cache / f"{task.key}.json")
        if known is not None:
            found[task.name] = known
    cached = sum(len(found[task.name]["rows"]) for task in tasks if task.name in found)
    rest = [task for task in tasks if task.name not in found]
    moved = _compute_all(rest, engine, fit_film, found, cache, max(len(tasks), 1), progress)
    for task in tasks:
        rows |= rows_of(task, found[task.name])
    return _table(subjects, rows, options, out, cached, moved)


def _table(
    subjects: Sequence[Subject],
    rows: Mapping[str, Row],
    options: StudyOptions,
    out: Path,
    cached: int,
    moved: str,
) -> StudyTable:
    """Write the rows, sorted by start time, with the columns ``labels`` of their subjects."""
    made = [{**rows[s.name], **s.labels} for s in subjects]
    made.sort(key=lambda row: (str(row.get("started", "")), row["recording"]))
    table = out / "study.csv"
    write_csv(made, table)
    parquet = write_parquet(made, out / "study.parquet")
    return StudyTable(options, tuple(made), cached, table, parquet, moved)


def _cache_in(out: Path) -> Path:
    cache = out / "cache"
    try:
        cache.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{cache} cannot be created: {system_text(error)}") from error
    return cache


def _unreadable(subject: Subject, error: OSError) -> Row:
    reason = f"{subject.name} cannot be read: {system_text(error)}"
    return {"recording": subject.name, "state": "failed", "reason": reason}


def _compute_all(
    tasks: Sequence[FitTask],
    engine: Engine,
    work: Callable[[FitTask], Row],
    rows: dict[str, Row],
    cache: Path,
    total: int,
    progress: Progress,
) -> str:
    """Compute ``tasks``, those left by a lost cluster by ``work`` here; return a sentence on it."""
    try:
        _compute(tasks, engine, rows, cache, total, progress)
    except ClusterLost as error:
        moved = f"the cluster was lost ({error}); the rest was computed on this computer"
        log.warning("%s", moved)
        rest = [task for task in tasks if task.name not in rows]
        _compute(rest, LocalEngine(work=work), rows, cache, total, progress)
        return moved
    return ""


def _compute(
    tasks: Sequence[FitTask],
    engine: Engine,
    rows: dict[str, Row],
    cache: Path,
    total: int,
    progress: Progress,
) -> None:
    progress("fitting", len(rows) / total)
    for task, row in engine.run(tasks):
        rows[task.name] = row
        # one that could not be read, or whose worker was lost, may have a result the next time
        if "sha256" in row:
            _keep(cache / f"{task.key}.json", row)
        progress("fitting", len(rows) / total)


def _keep(path: Path, row: Row) -> None:
    write_json({"format": CACHED, "row": row}, path)


def _kept(path: Path) -> Row | None:
    """Return the row in the cache; None where there is none, or a damaged one."""
    try:
        found = parse_json(read_input(path, "result of a study", _ROW_BYTES))
    except (InputError, ValueError, RecursionError):
        return None
    if not isinstance(found, dict) or found.get("format") != CACHED:
        return None
    row = found.get("row")
    return row if isinstance(row, dict) and {"recording", "state"} <= set(row) else None
