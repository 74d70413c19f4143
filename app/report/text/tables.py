"""Tables of results as rows of text, for the terminal, the window and the HTML page."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from dearig.report.text.numbers import (
    NO_VALUE,
    interval,
    quoted,
    significant,
    symbol,
    with_symbols,
)
from dearig.report.text.sentences import spring_label
from dearig.report.text.thesis import SIMULATED_CAVEAT, table_3
from dearig.units import SHOWN, parameter_unit

if TYPE_CHECKING:
    from dearig.analysis.outcomes import BranchTrial, Comparison, Published, SpringCandidate
    from dearig.model.fitting import Contribution, Estimate, Identification

__all__ = [
    "BOUND_MARK",
    "BRACKETS_TEXT",
    "BUDGET_HEAD",
    "WORD_MAX",
    "Row",
    "Table",
    "branch_trials",
    "budget_cells",
    "budget_text",
    "by_thesis_table",
    "error_table",
    "parameter_table",
    "spring_candidates",
    "stated_text",
    "thesis_error_table",
    "within_text",
]


#: Characters of a table's line on a phone of 390 pixels, and of a word that is not broken there.
_PHONE_WIDTH, WORD_MAX = 46, 18


@dataclass(frozen=True)
class Row:
    """Row of a table; ``detail`` explains it, ``muted`` greys it, ``mark`` highlights it."""

    cells: tuple[str, ...]
    detail: str = ""
    muted: bool = False
    mark: bool = False


@dataclass(frozen=True)
class Table:
    """Table; ``head`` has name and unit of every column, the first of which names the rows."""

    title: str
    head: tuple[tuple[str, str], ...]
    rows: tuple[Row, ...]
    note: str = ""

    @property
    def is_wide(self) -> bool:
        """True if a phone has no room for the columns next to the longest word of the first."""
        columns = zip(*(row.cells for row in self.rows), strict=False)
        widths = [
            max(
                len(word)
                for text in (*head, *cells)
                for word in (text.split() if i == 0 else [text])
            )
            for i, (head, cells) in enumerate(zip(self.head, columns, strict=False))
        ]
        return sum(min(width, WORD_MAX) + 1 for width in widths) > _PHONE_WIDTH

    def with_columns_of(self, other: Table) -> Table:
        """Return both tables as one. Raises ``ValueError`` unless they have the same rows."""
        if [r.cells[0] for r in self.rows] != [r.cells[0] for r in other.rows]:
            raise ValueError(f"{self.title!r} and {other.title!r} do not have the same rows")
        rows = tuple(
            Row(a.cells + b.cells[1:], a.detail, a.muted, a.mark)
            for a, b in zip(self.rows, other.rows, strict=True)
        )
        notes = " ".join(n for n in (self.note, other.note) if n)
        return Table(self.title, self.head + other.head[1:], rows, notes)


#: After the interval of a parameter at an end of its search range.
BOUND_MARK = ", at bound"
#: Note of a table in which values of parameters stand in brackets.
BRACKETS_TEXT = "Values in brackets are not determined by these data."
#: Heads of the columns that an uncertainty budget adds to a table of parameters.
BUDGET_HEAD = (("Given values", "\N{PLUS-MINUS SIGN}1 sigma"), ("Combined", "95 %"))

_TITLES = {
    "A": "Table A: amplitudes 6 to 8 kV at one frequency (the thesis's Table 4)",
    "B": "Table B: frequencies 0.2 to 1 Hz at one amplitude (the thesis's Table 5)",
    "": "Other recordings",
}


def by_thesis_table(
    comparisons: Sequence[Comparison], alone: str
) -> list[tuple[str, tuple[Comparison, ...]]]:
    """Return ``(title, comparisons)`` for each of the thesis's validation tables that occurs.

    ``alone`` is the title if no recording belongs to such a table.
    """
    found = []
    for table, title in _TITLES.items():
        members = tuple(c for c in comparisons if c.table == table)
        if members:
            outside = table == "" and len(members) == len(comparisons)
            found.append((alone if outside else title, members))
    return found


def _label(comparison: Comparison) -> str:
    # the label of a row is short and does not wrap
    row = comparison.row.replace(" ", "\N{NO-BREAK SPACE}") or comparison.name
    return comparison.marked(row)


def error_table(title: str, comparisons: Sequence[Comparison]) -> Table:
    """Return RMS, relative RMS, largest error, and RMS over noise floor of each recording."""
    shown = SHOWN[comparisons[0].kind]
    film = comparisons[0].kind == "film"
    rows = []
    for c in comparisons:
        e = c.errors
        noise = NO_VALUE if not c.noise else significant(e.rms / c.noise)
        rows.append(
            Row(
                (
                    _label(c),
                    significant(e.rms * shown.error_factor),
                    significant(e.peak_pct if film else e.nrmse_pct),
                    significant(e.max * shown.error_factor),
                    noise,
                )
            )
        )
    head = (
        ("", ""),
        ("RMS", shown.error_unit),
        ("RMS", "% of peak") if film else ("NRMSE", "% of range"),
        ("Max", shown.error_unit),
        ("RMS", "/ noise"),
    )
    return Table(title, head, tuple(rows))


def thesis_error_table(
    title: str, comparisons: Sequence[Comparison], published: Published | None = None
) -> Table | None:
    """Return the thesis's two measures and its published values; None for film data.

    ``published`` is used for comparisons without published values of their own.
    """
    if comparisons[0].kind == "film":
        return None
    rows = []
    for c in comparisons:
        theirs = c.published or published
        rows.append(
            Row(
                (
                    _label(c),
                    significant(c.errors.e_rms_thesis_pct),
                    NO_VALUE if theirs is None else significant(theirs.e_rms_pct),
                    significant(c.errors.e_m_thesis_pct),
                    NO_VALUE if theirs is None else significant(theirs.e_m_pct),
                )
            )
        )
    head = (
        ("", ""),
        ("e_rms", "here"),
        ("e_rms", "thesis"),
        ("e_m", "here"),
        ("e_m", "thesis"),
    )
    compared = any(c.is_simulated and (c.published or published) for c in comparisons)
    return Table(title, head, tuple(rows), SIMULATED_CAVEAT if compared else "")


def budget_cells(e: Estimate, factor: float) -> list[str]:
    """Return the cells below ``BUDGET_HEAD``, in units of ``factor``."""
    shifted = e.systematic * factor
    both = interval(e.combined[0] * factor, e.combined[1] * factor)
    return [significant(shifted, 2) if shifted else NO_VALUE, both]


def budget_text(budget: Sequence[Contribution], known: bool = True) -> str:
    """Return what the columns ``BUDGET_HEAD`` are, and the uncertainties that they come from.

    ``known`` is whether there are intervals.
    """
    values = ", ".join(
        f"{c.given.name} {significant(100.0 * c.given.relative, 2)} %" for c in budget
    )
    given = (
        f"Given values, with standard uncertainties by the rig file ({values}), move a parameter"
    )
    if not known:
        return f"{given} by the column of one standard deviation."
    return (
        f"The 95 % interval is of the noise alone. {given} by the next column; the last interval "
        f"has both."
    )


def stated_text(e: Estimate) -> str:
    """Return what was stated of a parameter before the fit, but for a fixed value; else ""."""
    stated, said = e.constraint, []
    if stated is None:
        return ""
    factor, unit = parameter_unit(e.unit)
    if stated.mean is not None and stated.sd is not None:
        said.append(f"prior {stated.mean * factor:g} ± {stated.sd * factor:g} {unit}")
    if stated.low is not None and stated.high is not None:
        said.append(f"stated bounds {stated.low * factor:g} to {stated.high * factor:g} {unit}")
    elif stated.low is not None:
        said.append(f"stated lower bound {stated.low * factor:g} {unit}")
    elif stated.high is not None:
        said.append(f"stated upper bound {stated.high * factor:g} {unit}")
    return "; ".join(text.rstrip() for text in said)


def within_text(e: Estimate) -> str:
    """Return the 95 % interval of a parameter; of one without, the reason."""
    if e.is_fixed:
        return "fixed"
    factor, _ = parameter_unit(e.unit)
    return interval(e.low * factor, e.high * factor) if e.free else "derived"


def parameter_table(fit: Identification, rejected: bool = False) -> Table:
    """Return every parameter with its 95 % interval, and the thesis's Table 3 if it applies.

    The intervals of a ``rejected`` model hold only if it is right.
    """
    published = table_3(fit.model)
    known = fit.covariance.size > 0
    rows = []
    for e in (*fit.estimates, *fit.sums):
        factor, unit = parameter_unit(e.unit)
        if known:
            # only the digits that all uncertainties support
            low, high = e.combined
            value = quoted(e.value * factor, low * factor, high * factor)
            within = f"{within_text(e)}{BOUND_MARK}" if e.at_bound else within_text(e)
        else:
            value = significant(e.value * factor, 5 if e.is_fixed else 4)
            within = within_text(e) if e.is_fixed else NO_VALUE
            within = BOUND_MARK.lstrip(", ") if e.at_bound else within
        cells = [symbol(e.name), value if e.determined or not known else f"({value})", unit, within]
        if fit.budget:
            shifted, both = budget_cells(e, factor)
            cells += [shifted, both if known else NO_VALUE]
        if published:
            theirs = published.get(e.name, math.nan)
            cells.append(significant(theirs * factor, 4))
        # without intervals all notes are the same, and the page shows it once
        details = [stated_text(e)] if e.is_fixed or not known else [e.note, stated_text(e)]
        detail = with_symbols("; ".join(filter(None, details)))
        rows.append(Row(tuple(cells), detail, known and not e.determined))
    interval_head = ("95 % interval", "if right" if rejected and known else "")
    head = [("", ""), ("Value", ""), ("Unit", ""), interval_head]
    if fit.budget:
        head += BUDGET_HEAD
    if published:
        head.append(("Thesis", "Table 3"))
    notes = []
    if fit.budget:
        notes.append(budget_text(fit.budget, known))
    if any(e.at_bound for e in fit.estimates):
        notes.append("At bound: at an end of its range; the data may ask for more.")
    if any(e.is_fixed for e in fit.estimates):
        notes.append("Fixed: stated before the fit, not fitted; intervals hold for that value.")
    if known and fit.undetermined:
        notes.append(BRACKETS_TEXT)
    if published:
        notes.append("Branches, also those of Table 3, are sorted by relaxation time.")
    return Table("Parameters", tuple(head), tuple(rows), " ".join(notes))


def spring_candidates(candidates: Sequence[SpringCandidate], kind: str) -> Table:
    """Return evidence and errors of each strain energy."""
    shown = SHOWN[kind]

    def error(value: float | None) -> str:
        return NO_VALUE if value is None else significant(value * shown.error_factor)

    several = len({c.branches for c in candidates}) > 1
    rows = []
    for c in candidates:
        name = spring_label(c.spring) + (f", {c.branches} branches" if several else "")
        cells = (
            f"{name}{' *' if c.chosen else ''}",
            f"{c.free}",
            significant(c.criterion),
            f"{c.probability:.2f}",
            error(c.train_rms),
            error(c.left_out_rms),
            error(c.validation_rms),
        )
        rows.append(Row(cells, mark=c.chosen))
    head = (
        ("Spring", ""),
        ("Free", ""),
        ("Criterion", "above best"),
        ("Prob.", ""),
        ("Training", shown.error_unit),
        ("Left out", shown.error_unit),
        ("Validation", shown.error_unit),
    )
    note = (
        "* chosen by the evidence in the training data. Left out: each tenth of the training data, "
        "predicted by a fit to the others. Validation data are not used for the choice."
    )
    return Table("Strain energies", head, tuple(rows), note)


def branch_trials(trials: Sequence[BranchTrial], kind: str) -> Table:
    """Return the errors of each number of branches on training and validation data."""
    shown = SHOWN[kind]
    best = min((t.bic for t in trials), default=0.0)
    rows = []
    for t in trials:
        validation = (t.validation_rms, t.validation_peak_pct)
        cells = (
            f"{t.branches}{' *' if t.chosen else ''}",
            significant(t.train_rms * shown.error_factor),
            significant(t.train_peak_pct),
            NO_VALUE if validation[0] is None else significant(validation[0] * shown.error_factor),
            NO_VALUE if validation[1] is None else significant(validation[1]),
            significant(t.bic - best),
        )
        rows.append(Row(cells, mark=t.chosen))
    head = (
        ("Branches", ""),
        ("Training", shown.error_unit),
        ("", "% of peak"),
        ("Validation", shown.error_unit),
        ("", "% of peak"),
        ("BIC", "above best"),
    )
    note = (
        "* chosen by the Bayesian information criterion (BIC) of the training data; validation "
        "data are not used for the choice."
    )
    return Table("Number of branches", head, tuple(rows), note)
