"""Lay out results as text and tables for the terminal."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

from rich.box import SIMPLE_HEAD, Box
from rich.console import Console, ConsoleOptions, Group, RenderableType, RenderResult
from rich.measure import Measurement
from rich.table import Table as RichTable
from rich.text import Text

from dearig.printable import printable
from dearig.report.text.channels import channel_errors, channel_table
from dearig.report.text.diagnosis import (
    family_label,
    headline,
    summary,
    warnings,
)
from dearig.report.text.diagnosis_tables import (
    before_after_table,
    experiment_table,
    rankings,
    step_table,
    thesis_before_after_table,
)
from dearig.report.text.estimates import effect_table
from dearig.report.text.laws import bounds_table, effect_named, law_lines, place_text
from dearig.report.text.numbers import to_ascii
from dearig.report.text.sentences import (
    fit_is_rejected,
    identify_summary,
    listed,
    validate_summary,
    warnings_of,
)
from dearig.report.text.tables import (
    Table,
    branch_trials,
    by_thesis_table,
    error_table,
    parameter_table,
    spring_candidates,
    thesis_error_table,
)

if TYPE_CHECKING:
    from dearig.analysis.outcomes import (
        Comparison,
        DiagnoseOutcome,
        IdentifyOutcome,
        Published,
        ValidateOutcome,
    )
    from dearig.analysis.tracking import TrackOutcome
    from dearig.batch.queue import CampaignOutcome
    from dearig.batch.studies import StudyTable
    from dearig.batch.trends import Trends
    from dearig.model.effects import Effect

__all__ = [
    "branch_table",
    "campaign_runs",
    "diagnosis_tables",
    "identify_table",
    "law_pieces",
    "study_rows",
    "track_table",
    "trend_tables",
    "validate_tables",
]

#: Characters of a row's name where the terminal has no room for more; longer ones are cut in the
#: middle, where names differ least.
_NAME_LEAST = 28
_GAP = 2  # between columns
# rich's own substitute on ASCII terminals has many vertical bars
_ASCII_HEAD = Box("    \n    \n -- \n    \n    \n    \n    \n    \n", ascii=True)


def identify_table(outcome: IdentifyOutcome) -> RenderableType:
    """Return an identification as sentences, parameters and errors.

    ``branch_table`` shows the other numbers of branches.
    """
    published = outcome.published_fit if len(outcome.train) == 1 else None
    return _Fitted(
        [
            *identify_summary(outcome),
            parameter_table(outcome.fit, fit_is_rejected(outcome)),
            *_errors("Training", outcome.train, published),
            *_grouped("Validation", outcome.validation),
            *_channels((*outcome.train, *outcome.validation)),
        ],
        warnings_of(outcome),
    )


def validate_tables(outcome: ValidateOutcome) -> RenderableType:
    """Return the errors of every recording, with the thesis's Tables 4 and 5 where they apply."""
    return _Fitted(
        [
            *validate_summary(outcome),
            *_grouped("By recording", outcome.comparisons),
            *_channels(outcome.comparisons),
        ],
        warnings_of(outcome),
    )


def branch_table(outcome: IdentifyOutcome) -> RenderableType:
    """Return the fit of each number of branches; empty where only one was tried."""
    if not outcome.trials:
        return Group()
    return _Fitted([branch_trials(outcome.trials, outcome.kind)], ())


def spring_table(outcome: IdentifyOutcome) -> RenderableType:
    """Return the strain energies that were compared."""
    return _Fitted([spring_candidates(outcome.springs, outcome.kind)], ())


def track_table(outcome: TrackOutcome) -> RenderableType:
    """Return a target that was followed as sentences, and the error of every run."""
    from dearig.report.pages.track import runs_table, track_summary, track_warnings

    return _Fitted([*track_summary(outcome), runs_table(outcome)], track_warnings(outcome))


def trend_tables(trends: Trends) -> RenderableType:
    """Return trends as sentences, the effects, and what to vary next."""
    from dearig.report.text import trends as words

    return _Fitted(
        [*words.trends_texts(trends), words.effect_table(trends), *words.proposal_texts(trends)], ()
    )


#: States of a campaign that goes on when it is started again.
_RESUMABLE = ("armed_runs", "armed_time", "interrupted", "killed")


def campaign_runs(outcome: CampaignOutcome, most: int = 40) -> RenderableType:
    """Return how a campaign stands, and the ``most`` runs around the one that is played."""
    from dearig.report.pages.campaign import campaign_summary, campaign_table

    warnings = (outcome.queue.halted,) if outcome.queue.halted else ()
    on = ["Continue with dearig campaign --resume."] if outcome.status in _RESUMABLE else []
    return _Fitted([*campaign_summary(outcome), *on, campaign_table(outcome, most)], warnings)


def study_rows(table: StudyTable, most: int) -> RenderableType:
    """Return the table of a study of many recordings, at most ``most`` rows of it."""
    from dearig.report.text.study_table import study_table_rows, study_table_texts

    return _Fitted([*study_table_texts(table), study_table_rows(table, most)], ())


_RANKED = 6  # candidates of a round that a terminal shows


def diagnosis_tables(outcome: DiagnoseOutcome) -> RenderableType:
    """Return the verdict, errors before and after, effects found, and candidates tried."""
    finding = outcome.finding
    pieces: list[_Piece] = [f"{headline(outcome)}.", *summary(outcome)]
    for heading, before, after in (
        ("Validation recordings", outcome.before.validation, outcome.after.validation),
        ("Training recordings", outcome.before.train, outcome.after.train),
    ):
        if before and after:
            pieces.append(before_after_table(heading, before, after, outcome.kind))
            theirs = f"{heading}, by the thesis's formulas"
            pieces.append(thesis_before_after_table(theirs, before, after, outcome.kind))
    channels = channel_table(outcome)
    if channels is not None:
        pieces.append(channels)
    pieces.append(step_table(outcome))
    if finding.steps:
        pieces.append(effect_table(outcome))
        for step in finding.steps:
            pieces += law_lines(effect_named(step.effect))
    pieces += [
        table if table.rows else f"{table.title}: {table.note}"
        for table in rankings(outcome, _RANKED)
    ]
    experiments = experiment_table(outcome)
    if experiments is not None:
        pieces.append(experiments)
    return _Fitted(pieces, warnings(outcome))


def law_pieces(effect: Effect) -> RenderableType:
    """Return the equations of an effect, its parameters with bounds, and its source."""
    found: list[_Piece] = [
        f"{effect.name}: {family_label(effect.family)}, acts {place_text(effect.acts_on)}",
        f"{effect.summary[:1].upper()}{effect.summary[1:]}.",
        *law_lines(effect),
        bounds_table(effect),
    ]
    return _Fitted(found, ())


def _grouped(alone: str, comparisons: tuple[Comparison, ...]) -> list[_Piece]:
    pieces: list[_Piece] = []
    for title, members in by_thesis_table(comparisons, alone):
        pieces += _errors(title, members, None)
    return pieces


def _channels(comparisons: tuple[Comparison, ...]) -> list[_Piece]:
    found = channel_errors("Voltage monitor and current", comparisons)
    return [] if found is None else [found]


def _errors(
    title: str, comparisons: tuple[Comparison, ...], published: Published | None
) -> list[_Piece]:
    ours = error_table(title, comparisons)
    theirs = thesis_error_table("By the thesis's formulas, in %", comparisons, published)
    return [ours] if theirs is None else [(ours, theirs)]


#: A sentence, a table, or two tables that become one where the terminal is wide enough.
_Piece = str | Table | tuple[Table, Table]


class _Fitted:
    """Pieces that are laid out for the width and the characters of the terminal."""

    def __init__(self, pieces: list[_Piece], warnings: tuple[str, ...]) -> None:
        self._pieces = pieces
        self._warnings = warnings

    def __rich_measure__(self, console: Console, options: ConsoleOptions) -> Measurement:
        return Measurement(min(20, options.max_width), options.max_width)

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        show = _ascii if options.ascii_only else printable
        width = options.max_width
        for i, piece in enumerate(self._pieces):
            if isinstance(piece, str):
                yield Text(show(piece))
                continue
            if i:
                yield Text()
            if isinstance(piece, Table):
                yield from _laid_out(piece, show, width)
                continue
            joined = piece[0].with_columns_of(_in_per_cent(piece[1]))
            if _width(joined, show) <= width:
                yield from _laid_out(joined, show, width)
            else:
                yield from _laid_out(piece[0], show, width)
                yield Text()
                yield from _laid_out(piece[1], show, width)
        if self._warnings:
            yield Text()
        for warning in self._warnings:
            yield Text(show(f"Warning: {warning}"), style="yellow")


def _ascii(text: str) -> str:
    return printable(to_ascii(text))


def _in_per_cent(table: Table) -> Table:
    """Return the table with its unit in the head, for use without its title."""
    head = tuple((name, f"% {unit}" if unit else "") for name, unit in table.head)
    return Table(table.title, head, table.rows, table.note)


def _laid_out(table: Table, show: Callable[[str], str], width: int) -> Iterator[RenderableType]:
    yield Text(show(table.title), style="bold")
    longest = max(_NAME_LEAST, width - _width(table, show, 0))
    widths = _widths(table, show, longest)
    if _width(table, show) > width:
        yield from _listed(table, show)
    else:
        grid = RichTable(
            box=_ASCII_HEAD if show is _ascii else SIMPLE_HEAD,
            show_edge=False, pad_edge=False, padding=(0, _GAP - 1, 0, 0), header_style="",
        )  # fmt: skip
        for i, (name, unit) in enumerate(table.head):
            grid.add_column(
                Text(f"{show(name)}\n{show(unit)}".strip("\n")),
                justify="right" if i else "left",
                no_wrap=True,
                min_width=widths[i],
                vertical="bottom",
            )
        for row in table.rows:
            cells = [show(_cut(row.cells[0], longest)), *(show(c) for c in row.cells[1:])]
            look = "dim" if row.muted else "bold" if row.mark else ""
            grid.add_row(*(Text(c) for c in cells), style=look)
        yield grid
    details: dict[str, list[str]] = {}
    for row in table.rows:
        if row.detail:
            details.setdefault(row.detail, []).append(row.cells[0])
    lines = [f"{listed(names)}: {detail}" for detail, names in details.items()]
    for line in (*lines, *([table.note] if table.note else [])):
        yield Text(show(line), style="dim")


def _listed(table: Table, show: Callable[[str], str]) -> Iterator[RenderableType]:
    """Give a line for each row of a table that is too wide for the terminal."""
    for row in table.rows:
        cells = [
            " ".join(part for part in (*head, cell) if part)
            for head, cell in zip(table.head[1:], row.cells[1:], strict=True)
            if cell
        ]
        text = show(f"{row.cells[0]}: {'; '.join(cells)}")
        yield Text(text, style="dim" if row.muted else "bold" if row.mark else "")


def _widths(table: Table, show: Callable[[str], str], longest: int) -> list[int]:
    """Return the widths of the columns, with names of at most ``longest`` characters."""
    widths = [max(len(show(name)), len(show(unit))) for name, unit in table.head]
    for row in table.rows:
        cells = (_cut(row.cells[0], longest), *row.cells[1:])
        widths = [max(w, Text(show(c)).cell_len) for w, c in zip(widths, cells, strict=True)]
    return widths


def _width(table: Table, show: Callable[[str], str], longest: int = _NAME_LEAST) -> int:
    widths = _widths(table, show, longest)
    return sum(widths) + _GAP * (len(widths) - 1)


def _cut(name: str, longest: int) -> str:
    if len(name) <= longest:
        return name
    half = (longest - 1) // 2
    if half < 1:
        return name[:longest]
    return f"{name[:half]}\N{HORIZONTAL ELLIPSIS}{name[len(name) - (longest - 1 - half) :]}"
