"""Report of a target that was followed: sentences, tables, figures, page and JSON."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from dearig.analysis.decimate import decimate
from dearig.analysis.track_target import missed_parts
from dearig.recording.json_file import finite
from dearig.report.figures.defaults import style
from dearig.report.figures.style import (
    COLUMNS,
    ERROR,
    MARK,
    MEASURED,
    MODEL,
    NOISE,
    THESIS,
    UNSURE,
    WIDTH,
    blank,
    few_ticks,
    legend,
    log_axis,
    shade,
)
from dearig.report.pages.head import head_of
from dearig.report.pages.html import Picture, picture, prefixes, write_page
from dearig.report.text.bands import band_json, band_texts
from dearig.report.text.numbers import NO_VALUE, significant
from dearig.report.text.tables import Row, Table
from dearig.units import readable

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from dearig.analysis.tracking import TrackedRun, TrackOutcome
    from dearig.drivers.gate import Margin

__all__ = [
    "errors_figure",
    "limits_table",
    "margins_table",
    "runs_figure",
    "runs_table",
    "track_headline",
    "track_json",
    "track_summary",
    "track_warnings",
    "write_track_report",
]

_UM = 1e6  # um in a metre
_COLOURS = {"linear": UNSURE, "thesis": THESIS, "model": MODEL, "learned": MEASURED}


def track_headline(outcome: TrackOutcome) -> str:
    """Return how far the runs of a target have come, in one line."""
    name = outcome.target.name
    if not outcome.runs:
        many = len(missed_parts(outcome.inversion.unreachable, outcome.within))
        what = "the whole target" if many == 0 else f"{many} part{'s' if many > 1 else ''} of it"
        return f"{name}: the film can{'not' if many else ''} follow {what}"
    last, best = outcome.runs[-1], outcome.best
    said = f"{name}: {last.label}, {_um(last.rms)} um RMS"
    if math.isfinite(last.rms):
        said += f", {significant(last.rms / outcome.noise)} times the noise"
    if best is not None and best is not last:
        said += f"; the best is {best.label}, {_um(best.rms)} um"
    return readable(said)


def track_summary(outcome: TrackOutcome) -> tuple[str, ...]:
    """Return the result in sentences."""
    said = []
    first = next((r for r in outcome.runs if r.kind == "model"), None)
    best = outcome.best
    if first is None or best is None:
        said.append("No run was finished.")
    else:
        said.append(
            f"With the voltage that the model {outcome.model.name!r} asks for, the film follows "
            f"the target {outcome.target.name!r} within {_um(first.rms)} um RMS; the noise of a "
            f"reading is {_um(outcome.noise)} um."
        )
        if best is not first:
            said.append(
                f"After {best.iteration} {'iterations' if best.iteration > 1 else 'iteration'} of "
                f"learning it is {_um(best.rms)} um."
            )
        said += [
            f"The {other.label} gives {_um(other.rms)} um."
            for other in outcome.runs
            if other.kind in ("linear", "thesis")
        ]
    if outcome.feasible:
        said.append(f"The film can follow the whole target within {_um(outcome.within)} um.")
    if outcome.status != "complete":
        said.append(f"Not all runs were made ({outcome.status}): {outcome.reason}.")
    elif outcome.reason:
        said.append(f"Not all runs were needed: {outcome.reason}.")
    return tuple(readable(sentence) for sentence in said)


def track_warnings(outcome: TrackOutcome) -> tuple[str, ...]:
    """Return what the operator should know of the target, the model and the runs."""
    parts = (f"Not reachable: {part.sentence}." for part in outcome.inversion.unreachable)
    notes = (f"{run.label}: {note}." for run in outcome.runs for note in run.notes)
    return tuple(
        readable(said)
        for said in (*(f"{w.rstrip('.')}." for w in outcome.warnings), *parts, *notes)
    )


def runs_table(outcome: TrackOutcome) -> Table:
    """Return the error of every run."""
    best = outcome.best
    rows = tuple(
        Row(
            (
                run.label,
                _um(run.rms),
                _um(run.largest),
                significant(run.rms / outcome.noise),
                significant(float(run.voltage.max()) * 1e-3),
                significant(run.edge) if run.edge > 0.0 else NO_VALUE,
            ),
            mark=run is best,
        )
        for run in outcome.runs
    )
    head = (
        ("Run", ""), ("RMS", "\N{MICRO SIGN}m"), ("Max", "\N{MICRO SIGN}m"), ("RMS / noise", ""),
        ("Peak voltage", "kV"), ("Learned up to", "Hz"),
    )  # fmt: skip
    return Table("Target minus measured", head, rows)


def margins_table(outcome: TrackOutcome) -> Table:
    """Return how near every run was planned to come to the limits of the rig."""
    runs = [run for run in outcome.runs if run.margins]
    if not runs:
        return Table("Margins", (("Limit", ""),), ())
    head = (("Limit", ""), *((run.label, "") for run in runs), ("Allowed", ""))
    rows = tuple(
        Row(
            (
                f"{margin.quantity} ({margin.unit})",
                *(significant(run.margins[i].reached) for run in runs),
                significant(margin.allowed),
            )
        )
        for i, margin in enumerate(runs[0].margins)
    )
    return Table("Margins", head, rows)


def limits_table(margins: Sequence[Margin]) -> Table:
    """Return how near a run that is not played yet comes to the limits of the rig."""
    head = (("Limit", ""), ("Reached", ""), ("Allowed", ""))
    return Table(
        "Margins of the next run",
        head,
        tuple(
            Row(
                (
                    f"{margin.quantity} ({margin.unit})",
                    significant(margin.reached),
                    significant(margin.allowed),
                )
            )
            for margin in margins
        ),
    )


def runs_figure(outcome: TrackOutcome) -> Figure:
    """Draw voltage, target and measurement, and error of the first and the best run."""
    shown = _shown(outcome)
    found = outcome.inversion
    with style():
        figure = blank(WIDTH, 5.4)
        voltage, both, error = figure.subplots(3, 1, sharex=True, height_ratios=(1.0, 1.7, 1.2))
        target = decimate(found.time, found.target * 1e3, COLUMNS)
        both.plot(*target, color=MARK, linewidth=2.2, label="target")
        for run in shown:
            colour = _COLOURS[run.kind]
            look = {"color": colour, "linewidth": 1.0}
            voltage.plot(*decimate(run.time, run.voltage * 1e-3, COLUMNS), **look)
            both.plot(*_curve(run.time, run.measured * 1e3), label=run.label, **look)
            miss = np.where(found.reachable, found.reference - run.measured, np.nan)
            error.plot(*_curve(run.time, miss * _UM), color=colour, linewidth=0.8)
        _shade(both, outcome)
        voltage.set_ylabel("Voltage (kV)")
        both.set_ylabel("Displacement (mm)")
        error.set_ylabel("Error (\N{MICRO SIGN}m)")
        error.set_xlabel("Time (s)")
        error.set_xlim(found.time[0], found.time[-1])
        if outcome.band is not None:
            half = outcome.band.half_width * _UM
            shade(error, found.time[: half.size], -half, half)
        if math.isfinite(outcome.noise):
            error.axhspan(-outcome.noise * _UM, outcome.noise * _UM, color=NOISE, linewidth=0)
        legend(both, 2)
        for ax in (voltage, both, error):
            few_ticks(ax, y=5)
        figure.align_ylabels([voltage, both, error])
    return figure


def errors_figure(outcome: TrackOutcome) -> Figure:
    """Draw the error of every run of the model, from iteration to iteration, next to the others."""
    ours = [r for r in outcome.runs if r.kind in ("model", "learned")]
    with style():
        figure = blank(WIDTH, 2.6)
        ax = figure.subplots()
        ax.plot(
            [r.iteration for r in ours], [r.rms * _UM for r in ours],
            "o-", color=MEASURED, label="model, then learned",
        )  # fmt: skip
        for run in outcome.runs:
            if run.kind in ("linear", "thesis"):
                ax.axhline(run.rms * _UM, color=_COLOURS[run.kind], linewidth=1.2, label=run.label)
        if math.isfinite(outcome.noise):
            ax.axhline(
                outcome.noise * _UM, color=ERROR, linestyle=(0, (3, 2)), linewidth=1.0,
                label="noise of a reading",
            )  # fmt: skip
        drawn = np.array([r.rms for r in outcome.runs] + [outcome.noise]) * _UM
        drawn = drawn[np.isfinite(drawn) & (drawn > 0.0)]
        if drawn.size:
            log_axis(ax, "y", 0.8 * drawn.min(), 1.25 * drawn.max())
        ax.set_xlabel("Iteration")
        ax.set_ylabel("Error (\N{MICRO SIGN}m RMS)")
        ax.set_xticks([r.iteration for r in ours])
        legend(ax, 2)
    return figure


def write_track_report(outcome: TrackOutcome, path: str | Path) -> Path:
    """Write the report of ``outcome`` to the HTML file ``path``. Raises ``InputError``."""
    return write_page(path, "track.html.j2", _contents(outcome))


def track_json(outcome: TrackOutcome) -> dict[str, Any]:
    """Return ``outcome`` for ``--json``; what is not known is None."""
    found = outcome.inversion
    return {
        "format": "dearig-track/1",
        "target": {
            "name": outcome.target.name,
            "toml": outcome.target.toml,
            "seconds": float(found.time[-1]),
            "largest_mm": float(found.target.max()) * 1e3,
        },
        "rig": outcome.rig,
        "model": outcome.model.name,
        "noise_floor_um": finite(outcome.noise * _UM),
        "feasible": outcome.feasible,
        "within_um": outcome.within * _UM,
        "unreachable": [
            {
                "start_s": part.start,
                "stop_s": part.stop,
                "cause": part.cause,
                "worst_um": part.worst * _UM,
                "needed_kV": finite(part.needed * 1e-3),
                "allowed_kV": finite(part.allowed * 1e-3),
            }
            for part in found.unreachable
        ],
        "runs": [
            {
                "kind": run.kind,
                "iteration": run.iteration,
                "rms_um": finite(run.rms * _UM),
                "max_um": finite(run.largest * _UM),
                "samples": run.samples,
                "recording": str(run.recording),
                "learned_up_to_Hz": finite(run.edge) if run.edge > 0.0 else None,
                "contraction": finite(run.contraction),
                "notes": list(run.notes),
            }
            for run in outcome.runs
        ],
        "band": band_json(outcome.band, "actuator"),
        "status": outcome.status,
        "reason": outcome.reason,
        "warnings": list(outcome.warnings),
        "report": None if outcome.report is None else str(outcome.report),
    }


def _contents(outcome: TrackOutcome) -> Callable[[], dict[str, Any]]:
    def contents() -> dict[str, Any]:
        from dearig.recording.reading.origin import origins_of_files  # imports h5py

        numbers: Iterator[str] = prefixes()
        pictures: list[Picture] = []
        if outcome.runs:
            pictures = [
                picture(
                    runs_figure(outcome), numbers,
                    "Voltage, target and measured displacement, and target minus measured where "
                    "the film can follow. The grey band is the noise of a reading; where the "
                    f"target is shaded, the film cannot follow it.{_band_caption(outcome)}",
                ),
                picture(errors_figure(outcome), numbers, "Error of every run."),
            ]  # fmt: skip
        return {
            "title": outcome.target.name,
            "lead": "Tracking",
            "head": head_of(origins_of_files(run.recording for run in outcome.runs)),
            "summary": track_summary(outcome),
            "warnings": track_warnings(outcome),
            "runs": runs_table(outcome),
            "margins": margins_table(outcome),
            "pictures": pictures,
            "provenance": (
                ("Target", (outcome.target.name,)),
                ("Model", (outcome.model.name,)),
                ("Rig", (outcome.rig,)),
                ("Recordings", tuple(str(run.recording) for run in outcome.runs) or ("none",)),
            ),
        }

    return contents


def _band_caption(outcome: TrackOutcome) -> str:
    if outcome.band is None:
        return ""
    said = " ".join(band_texts(outcome.band, "actuator"))
    return f" The coloured band is that of what the model predicts of its own first run. {said}"


def _shown(outcome: TrackOutcome) -> list[TrackedRun]:
    """Return the runs that are drawn: the compared ones, the model's, and the best."""
    best = outcome.best
    return [r for r in outcome.runs if r.kind != "learned" or r is best]


def _curve(time: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return a curve in as few points as can be seen, where it has values."""
    known = np.isfinite(values)
    return decimate(time[known], values[known], COLUMNS) if known.any() else (time[:0], time[:0])


def _shade(ax: Axes, outcome: TrackOutcome) -> None:
    for part in outcome.inversion.unreachable:
        ax.axvspan(part.start, part.stop, color=NOISE, linewidth=0, zorder=0.5)


def _um(metres: float) -> str:
    return significant(metres * _UM)
