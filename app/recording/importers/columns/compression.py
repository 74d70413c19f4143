"""Sign of strain and stress in compression, which testing machines write as positive numbers."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from dearig.recording.importers.columns.chosen import Chosen, Pick
from dearig.recording.importers.quantities.labels import Label
from dearig.recording.importers.quantities.units import Scale

__all__ = ["as_compression"]

_LENGTHS, _PULLS = ("strain", "true_strain", "displacement"), ("nominal_stress", "true_stress",
                                                               "force")  # fmt: skip


def as_compression(chosen: Chosen, labels: Mapping[str, Label]) -> None:
    """Make compression that ``chosen`` has as positive numbers negative, and say so.

    Where only one of the two columns says that it is of compression and the other one is positive
    too, its sign is asked for. Changes ``chosen``.
    """
    length = next((chosen.picked[q] for q in _LENGTHS if q in chosen.picked), None)
    pull = next((chosen.picked[q] for q in _PULLS if q in chosen.picked), None)
    picks = [pick for pick in (length, pull) if pick is not None]
    named = [p for p in picks if labels[p.column].compressive and not p.behind and not p.is_open]
    turned = [pick for pick in named if _is_positive(chosen, pick)]
    for pick in turned:
        scale = pick.scale
        chosen.picked[pick.target.quantity] = replace(
            pick, scale=Scale(-scale.times, scale.over, -scale.plus), behind="*-1"
        )
        chosen.notes.append(f"{pick.column!r} is positive in compression: its sign was changed")
    for pick in picks if turned else ():
        if pick not in named and not pick.behind and _is_positive(chosen, pick):
            chosen.unsure.append(
                f"{turned[0].column!r} is of compression, and {pick.column!r} is positive too and "
                f"does not say so: give its sign, as "
                f"{shlex.quote(f'{pick.target.name}={pick.column}*-1')} or *1"
            )
            chosen.picked[pick.target.quantity] = replace(
                pick, behind="*FACTOR", doubt=pick.doubt or "scale"
            )


def _is_positive(chosen: Chosen, pick: Pick) -> bool:
    """Return True if the largest value of a column is farther above 0 than the least is below."""
    values = chosen.source.read([pick.column])[pick.column]
    values = values[np.isfinite(values)]
    return bool(values.size) and float(values.max()) > -float(values.min())
