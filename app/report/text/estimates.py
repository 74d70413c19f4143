"""Tables of the parameters of a diagnosis, with their intervals."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from dearig.report.text.numbers import NO_VALUE, quoted, symbol, with_symbols
from dearig.report.text.tables import (
    BOUND_MARK,
    BRACKETS_TEXT,
    BUDGET_HEAD,
    Row,
    Table,
    budget_cells,
    budget_text,
    stated_text,
    within_text,
)
from dearig.units import parameter_unit

if TYPE_CHECKING:
    from dearig.analysis.outcomes import DiagnoseOutcome
    from dearig.model.diagnosis.results import Stage
    from dearig.model.fitting import Contribution, Estimate

__all__ = ["CONDITIONAL_TEXT", "UNTESTED_TEXT", "condition_text", "effect_table", "estimate_table"]

#: Note of intervals under a model that leaves more than noise.
CONDITIONAL_TEXT = (
    "These data reject the model: the intervals hold only if it were right, and the true values "
    "can lie outside."
)
#: The same where nothing rejects the model, and not everything tests it.
UNTESTED_TEXT = (
    "Nothing rejects the model, but these data do not test all of it: the intervals hold only if "
    "it is right."
)
#: Reasons against a better verdict that reject no model.
_UNTESTED = {"excitation", "rest", "stopped"}


def condition_text(outcome: DiagnoseOutcome) -> str:
    """Return under which condition the intervals of ``outcome`` hold; "" under none."""
    if not outcome.is_rejected:
        return ""
    untested = _UNTESTED & set(outcome.judgement.reasons)
    return UNTESTED_TEXT if untested else CONDITIONAL_TEXT


def effect_table(outcome: DiagnoseOutcome) -> Table:
    """Return the parameters of the effects found, with intervals and meaning."""
    from dearig.model.effects import EFFECTS

    final, rows = outcome.finding.final, []
    alone = len(outcome.finding.steps) == 1
    for step in outcome.finding.steps:
        effect = EFFECTS[step.effect]
        meanings = {p.name: p.meaning for p in effect.parameters}
        if effect.drift_basis is not None:
            meanings["rms"] = "root mean square of what the law adds to that recording"
        for e in step.estimates:
            about = meanings.get(e.name.split(" in ")[0], "")  # may be a parameter of one recording
            detail = "; ".join(w for w in (about, _note(e)) if w)
            name = e.name.replace("_", " ")
            name = name if alone else f"{step.effect}: {name}"
            rows.append(_estimate(e, name, detail, bool(final.budget)))
    shown = [e for step in outcome.finding.steps for e in step.estimates]
    title = "Fitted parameters"
    if alone:
        title += f" of {outcome.finding.steps[0].effect}"
    return _estimates(title, rows, shown, final.budget, condition_text(outcome))


def estimate_table(stage: Stage, condition: str = "") -> Table:
    """Return all parameters of a model, whose intervals hold under a ``condition``."""
    rows = [
        _estimate(e, symbol(e.name).replace("_", " "), _note(e), bool(stage.budget))
        for e in (*stage.estimates, *stage.sums)
    ]
    return _estimates("Parameters", rows, stage.estimates, stage.budget, condition)


def _estimates(
    title: str,
    rows: Sequence[Row],
    shown: Sequence[Estimate],
    budget: Sequence[Contribution],
    condition: str,
) -> Table:
    head = [
        ("", ""),
        ("Value", ""),
        ("Unit", ""),
        ("95 % interval", "if right" if condition else ""),
    ]
    notes = [condition] if condition and rows else []
    if budget and rows:
        head += BUDGET_HEAD
        notes.append(budget_text(budget))
    if any(not e.determined for e in shown):
        notes.append(BRACKETS_TEXT)
    return Table(title, tuple(head), tuple(rows), " ".join(notes))


def _note(e: Estimate) -> str:
    """Return the note of an estimate, with what was stated of it before the fit."""
    said = ("" if e.is_fixed else e.note, stated_text(e))
    return with_symbols("; ".join(filter(None, said)))


def _estimate(e: Estimate, name: str, detail: str, with_budget: bool) -> Row:
    factor, unit = parameter_unit(e.unit)
    value = quoted(e.value * factor, *(end * factor for end in e.combined))
    within = within_text(e)
    if e.free and e.low == e.high == e.value:
        within = NO_VALUE
    if e.at_bound:
        within += BOUND_MARK
    cells = [name, value if e.determined else f"({value})", unit, within]
    if with_budget:
        cells += budget_cells(e, factor)
    return Row(tuple(cells), detail, muted=not e.determined)
