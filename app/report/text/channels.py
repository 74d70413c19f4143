"""Electrical channels in words and tables: what a model leaves of each, and what each says."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from dearig.report.text.numbers import NO_VALUE, significant
from dearig.report.text.tables import Row, Table
from dearig.units import SHOWN_CHANNELS

if TYPE_CHECKING:
    from dearig.analysis.outcomes import Comparison, DiagnoseOutcome
    from dearig.model.fitting.channels import ChannelResult

__all__ = ["channel_errors", "channel_table", "channel_title"]

_HEAD = (("RMS", "before"), ("RMS", "after"), ("Noise", ""), ("Unit", ""))


def channel_title(name: str) -> str:
    """Return a channel's name in words."""
    return name.replace("_", " ")


def channel_table(outcome: DiagnoseOutcome) -> Table | None:
    """Return what is left of each electrical channel before and after; None without channels."""
    channels = outcome.finding.channels
    if not channels:
        return None
    rows = tuple(Row((channel_title(c.name), *_cells(c)), c.reason) for c in channels)
    note = (
        "Residuals of means at 200 Hz on the training recordings, and the noise of such a mean. "
        "Before is the plain film's circuit; after has the effects found."
    )
    return Table("Voltage monitor and current", (("", ""), *_HEAD), rows, note)


def channel_errors(title: str, comparisons: Sequence[Comparison]) -> Table | None:
    """Return what a model leaves of each channel of each recording; None without channels.

    Before is the circuit of the plain film, without the effects of the model.
    """
    rows = tuple(
        Row((f"{c.marked_name}, {channel_title(x.name)}", *_cells(x)), x.reason)
        for c in comparisons
        for x in c.channels
    )
    if not rows:
        return None
    head = (("", ""), ("RMS", "plain film"), ("RMS", "model"), *_HEAD[2:])
    return Table(title, head, rows, "Residuals of means at 200 Hz, and the noise of such a mean.")


def _cells(result: ChannelResult) -> tuple[str, ...]:
    shown = SHOWN_CHANNELS[result.name]
    values = (result.before, result.after, result.noise)
    return (
        *(NO_VALUE if v is None else significant(v * shown.error_factor) for v in values),
        shown.error_unit,
    )
