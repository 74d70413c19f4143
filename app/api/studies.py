"""Studies of many recordings and their trends, from folders or objects to values."""

from __future__ import annotations

import tempfile
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dearig.api.analysis import ParameterSource, stated_in
from dearig.api.arguments import named_arguments
from dearig.api.display import card, drawing, table_html, write_page
from dearig.api.models import ModelSource, as_model_file
from dearig.api.written import HasFiles, HasPage, Writers
from dearig.batch import trends as batch_trends
from dearig.batch.engines import engine_at
from dearig.batch.fits import StudyOptions, fit_task
from dearig.batch.shared_fits import fit_film
from dearig.batch.studies import (
    StudyTable,
    study_films,
    study_recordings,
    subjects_of,
    with_model,
)
from dearig.batch.table_file import read_table, write_csv, write_parquet
from dearig.config.modelfile import ModelFile
from dearig.errors import InputError
from dearig.extras import import_extra
from dearig.progress import Progress, quiet
from dearig.recording.json_file import write_json
from dearig.recording.reading.recording import Recording
from dearig.report.figures.trends import life_figure, rows_figure, trend_figure
from dearig.report.pages.trends import origins_of_rows, write_trends_report
from dearig.report.text.study_table import study_table_json, study_table_rows, study_table_texts
from dearig.report.text.trends import change_table, effect_table, trends_json, trends_texts

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame

__all__ = ["StudyResult", "TrendsResult", "study", "trends"]

_ROWS = 40  # rows that a notebook shows

StudySource = str | Path | Recording


@dataclass(frozen=True, eq=False, repr=False)
class StudyResult(HasFiles, HasPage):
    """Rows of a study, one for each recording, in the order in which they were started.

    It is saved as ``.csv`` or ``.parquet`` (the rows) or ``.json`` (all numbers).

    Attributes
    ----------
    table : dearig.batch.studies.StudyTable
        Rows and options. A row is a mapping by column: the recording, its state, what it says of
        itself, and each number with its 95 % interval.
    """

    table: StudyTable

    @property
    def rows(self) -> tuple[dict[str, Any], ...]:
        """The rows; units are in the names of the columns."""
        return self.table.rows

    @property
    def failed(self) -> tuple[dict[str, Any], ...]:
        """Rows without a result; ``reason`` says why."""
        return self.table.failed

    def to_pandas(self) -> DataFrame:
        """Return the rows as a data frame.

        Returns
        -------
        pandas.DataFrame
            A row for each recording, by its name.

        Raises
        ------
        InputError
            If pandas is not installed.
        """
        lib = import_extra("pandas", "notebook", "to_pandas")
        frame: DataFrame = lib.DataFrame(list(self.rows)).set_index("recording")
        return frame

    def plot(self, number: str) -> Figure:
        """Plot one number of every recording with its 95 % interval, in the order of the runs.

        Parameters
        ----------
        number : str
            A column, such as ``mu_0_kPa`` or ``rms_um``.

        Returns
        -------
        matplotlib.figure.Figure
            The figure, in the unit of the column.

        Raises
        ------
        InputError
            If no row has such a number.
        """
        known = batch_trends.numbers_in(self.rows)
        if not any(isinstance(row.get(number), int | float) for row in self.rows):
            raise InputError(f"{number!r} is not a number of this study; it has {', '.join(known)}")
        return rows_figure(self.rows, number)

    def _writers(self) -> Writers:
        def parquet(out: Path, _: bool) -> None:
            import_extra("pyarrow", "parquet", "a table in Parquet")
            write_parquet(self.rows, out)

        return {
            ".csv": ("the rows", lambda out, _: write_csv(self.rows, out)),
            ".parquet": ("the rows with their types", parquet),
            ".json": ("all numbers", lambda out, _: write_json(study_table_json(self.table), out)),
        }

    def _write_page(self, path: Path) -> Path:
        body = self._html(len(self.rows))
        return write_page(path, "Study", "Study", body, origins_of_rows(self.rows))

    def __repr__(self) -> str:
        """Return what was computed in sentences."""
        return " ".join(study_table_texts(self.table))

    def _repr_html_(self) -> str:
        return self._html(_ROWS)

    def _html(self, most: int) -> str:
        rows = table_html(study_table_rows(self.table, most))
        return card("Study", rows, sentences=study_table_texts(self.table))


@dataclass(frozen=True, eq=False, repr=False)
class TrendsResult(HasFiles, HasPage):
    """What many recordings say together, saved as ``.csv`` (effects) or ``.json`` (all numbers).

    Attributes
    ----------
    trends : dearig.batch.trends.Trends
        The trend of each number, with effects, change points, and what to vary next.
    source : Path
        The table, or the folder of the study.
    """

    trends: batch_trends.Trends
    source: Path

    @property
    def effects(self) -> list[dict[str, Any]]:
        """A mapping for each number and column: slope, 95 % intervals, p value and verdict."""
        return self.trends.effect_rows()

    @property
    def changes(self) -> list[dict[str, Any]]:
        """A mapping for each change point: film, recordings before and after, and the jump."""
        return self.trends.change_rows()

    def to_pandas(self) -> DataFrame:
        """Return the effects as a data frame.

        Returns
        -------
        pandas.DataFrame
            A row for each number and column.

        Raises
        ------
        InputError
            If pandas is not installed.
        """
        lib = import_extra("pandas", "notebook", "to_pandas")
        frame: DataFrame = lib.DataFrame(self.effects)
        return frame

    def plot(self, number: str = "", what: str = "columns") -> Figure:
        """Plot the trend of one number.

        Parameters
        ----------
        number : str
            A number of the study; the first one by default.
        what : str
            ``columns``: over each column. ``films``: each film over its days.

        Returns
        -------
        matplotlib.figure.Figure
            The figure, with axes in the units that its labels name.

        Raises
        ------
        InputError
            If there is no such trend or figure.
        """
        every = {trend.name: trend for trend in self.trends.trends}
        name = number or next(iter(every))
        if name not in every:
            raise InputError(f"{name!r} has no trend; what has one is {', '.join(every)}")
        if what == "columns":
            return trend_figure(every[name])
        if what == "films":
            return life_figure(self.trends, every[name])
        raise InputError(f"{what!r} cannot be plotted; what can is columns, films")

    def _writers(self) -> Writers:
        def numbers(out: Path, _: bool) -> None:
            write_json(trends_json(self.trends, self.source, {}), out)

        return {
            ".csv": ("the effects", lambda out, _: write_csv(self.effects, out)),
            ".json": ("all numbers", numbers),
        }

    def _write_page(self, path: Path) -> Path:
        return write_trends_report(self.trends, f"Trends of {self.source.stem}", Path(path))

    def __repr__(self) -> str:
        """Return what was found in sentences."""
        return "\n".join(trends_texts(self.trends))

    def _repr_html_(self) -> str:
        tables = [t for t in (effect_table(self.trends), change_table(self.trends)) if t]
        return card(
            f"Trends of {self.source.stem}",
            *map(table_html, tables),
            drawing(self.plot(), "Trend of the first number"),
            sentences=trends_texts(self.trends),
        )


@named_arguments
def study(
    recordings: StudySource | Iterable[StudySource],
    do: str,
    *,
    out: str | Path | None = None,
    on: str = "local",
    workers: int | None = None,
    model: ModelSource | None = None,
    branches: int = 3,
    spring: str = "gent",
    drive: str = "command",
    intervals: bool = True,
    ended_early: str = "keep",
    own: Iterable[str] = (),
    parameters: ParameterSource | None = None,
    progress: Progress = quiet,
) -> StudyResult:
    """Fit, diagnose or validate many recordings, each separately, into one table.

    Parameters
    ----------
    recordings : recording, path, or several
        Recordings, folders of recordings, and lists of them (a text file with a path on each line).
    do : str
        What is done with each recording: ``identify``, ``diagnose`` or ``validate``.
    out : str or Path, optional
        Folder for the table and the cache, from which a study that was ended goes on. Without it
        nothing is kept.
    on : str
        Where the fits are computed: ``local`` in processes of this computer, or ``dask:ADDRESS``.
    workers : int, optional
        Processes of ``local``. The default is one for each core.
    model : model, result or path, optional
        The model of ``validate``.
    branches : int
        Number of Maxwell branches.
    spring : str
        Strain energy of ``identify``.
    drive : str
        Voltage that drives the model: ``command`` or ``monitor``.
    intervals : bool
        Compute 95 % intervals.
    ended_early : str
        For recordings whose runs ended early: ``keep`` them, ``cut`` the end that may show a fault,
        or ``leave-out``.
    own : iterable of str
        With ``identify``: the recordings of each film are fitted together, and these parameters
        (``mu_0``, ``permittivity``, ...) each recording has for itself.
    parameters : mapping or path, optional
        What is known of parameters, as for ``dearig.identify``: fixed values, bounds, priors.
    progress : callable, optional
        Called with a stage and the fraction of it that is done (0 to 1).

    Returns
    -------
    StudyResult
        A row for each recording. A broken recording fails alone, and its row says why.

    Raises
    ------
    InputError
        If there is no recording, or the options do not go together.

    Examples
    --------
    >>> import dearig
    >>> table = dearig.study("ageing", "identify", out="study")
    >>> table.to_pandas()["mu_0_kPa"]
    >>> dearig.trends(table)
    """
    given = [recordings] if isinstance(recordings, StudySource) else list(recordings)
    sources = [each.path if isinstance(each, Recording) else Path(each) for each in given]
    file = None if model is None else as_model_file(model)
    options = with_model(
        StudyOptions(
            do,
            branches,
            spring,
            drive,
            ended_early,
            intervals,
            own=tuple(own),
            parameters=stated_in(parameters),
        ),
        file if file is None or isinstance(file, ModelFile) else Path(file),
    )
    engine = engine_at(on, workers, fit_film if options.own else fit_task)
    work = study_films if options.own else study_recordings
    with tempfile.TemporaryDirectory(prefix="dearig-study-") as scratch:
        folder = Path(out or scratch)
        subjects = subjects_of(sources, folder)
        return StudyResult(work(subjects, options, folder, engine, progress=progress))


@named_arguments
def trends(
    study: StudyResult | str | Path | Iterable[Mapping[str, Any]],
    *,
    numbers: Iterable[str] = (),
    against: Iterable[str] = (),
    progress: Progress = quiet,
) -> TrendsResult:
    """Find what drives parameter changes across recordings: in all films, in one, and when.

    Each number is fitted by a mixed model with a random intercept of each film.

    Parameters
    ----------
    study : StudyResult, path or rows
        A study, its folder or table (``.csv``, ``.parquet``), or rows as mappings.
    numbers : iterable of str
        Columns whose trends are wanted. The default is all parameters and errors.
    against : iterable of str
        Columns that may change the numbers. The default is temperature, humidity, cycles, days,
        settings and rig.
    progress : callable, optional
        Called with a stage and the fraction of it that is done (0 to 1).

    Returns
    -------
    TrendsResult
        Effects with their intervals, change points, and what to vary next.

    Raises
    ------
    InputError
        If the table cannot be read, or no number has a trend.

    Examples
    --------
    >>> import dearig
    >>> found = dearig.trends("study", numbers=["mu_0_kPa"], against=["temperature_degC"])
    >>> found.effects[0]["slope"]  # percent per degree
    """
    if isinstance(study, str | Path):
        source = batch_trends.table_of(Path(study))
        rows = read_table(source)
    else:
        source = Path("study")
        rows = [dict(r) for r in (study.rows if isinstance(study, StudyResult) else study)]
    found = batch_trends.find_trends(
        rows, source=source, numbers=tuple(numbers), against=tuple(against), progress=progress
    )
    return TrendsResult(found, source)
