"""Report of a displacement that was held: sentences, a figure, and JSON."""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np

from dearig.recording.json_file import finite
from dearig.report.figures.defaults import style
from dearig.report.figures.style import DRIVE, MEASURED, NOISE, WIDTH, blank, few_ticks
from dearig.report.text.numbers import seconds, significant
from dearig.units import readable

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from dearig.analysis.hold import HoldOutcome

__all__ = ["hold_figure", "hold_json", "hold_summary"]

_UM = 1e6  # um in a metre


def hold_summary(outcome: HoldOutcome) -> tuple[str, ...]:
    """Return the result in sentences."""
    said = [
        f"{significant(outcome.setpoint * 1e3, 4)} mm were held for {seconds(outcome.duration)} "
        f"within {significant(outcome.rms * _UM)} um RMS, and within "
        f"{significant(outcome.settled_rms * _UM)} um from {significant(outcome.settled)} s on; "
        f"the noise of a reading is {significant(outcome.noise * _UM)} um."
    ]
    done = outcome.feedback
    if done is not None:
        said.append(
            f"The correction went from {done.lowest:+.2%} to {done.highest:+.2%} of the voltage "
            f"and ended at {done.last:+.2%}."
        )
        said.append(
            f"Each answer was output {significant(done.delay)} s after its readings; at least "
            f"{significant(done.waiting)} s of output were waiting then. By the model the loop has "
            f"a gain margin of {significant(done.gain_margin, 2)} and a phase margin of "
            f"{significant(done.phase_margin, 2)} degrees."
        )
        if done.limited > 0.0:
            said.append(
                f"For {seconds(done.limited)} the correction stood at its limit, and the "
                f"displacement was not held: a larger authority or a model that fits better is "
                f"needed."
            )
        if done.frozen > 0.0:
            said.append(
                f"For {seconds(done.frozen)} the laser gave no usable reading, and the correction "
                f"stayed as it was."
            )
    return tuple(readable(sentence) for sentence in said)


def hold_figure(outcome: HoldOutcome) -> Figure:
    """Return a figure of the mean error and the mean correction of every minute."""
    minutes, noise = outcome.minutes, outcome.noise * _UM
    ends = minutes[:, 0] / 60.0
    with style():
        figure = blank(1.2 * WIDTH, 3.6)
        upper, lower = figure.subplots(2, 1, sharex=True)
        if math.isfinite(noise):
            upper.axhspan(-noise, noise, color=NOISE, alpha=0.6, linewidth=0.0)
        upper.plot(ends, minutes[:, 1] * _UM, "o-", color=MEASURED, markersize=3, linewidth=1.2)
        upper.set_ylabel("Mean error\n(\N{MICRO SIGN}m)")
        lower.plot(ends, minutes[:, 2] * 100.0, "o-", color=DRIVE, markersize=3, linewidth=1.2)
        lower.set_ylabel("Correction\n(%)")
        lower.set_xlabel("Time (min)")
        lower.set_xlim(0.0, float(ends[-1]) * 1.02)
        for ax in (upper, lower):
            few_ticks(ax, y=5)
        figure.align_ylabels([upper, lower])
    return figure


def hold_json(outcome: HoldOutcome) -> dict[str, Any]:
    """Return ``outcome`` for ``--json``; what is not known is None."""
    done, run = outcome.feedback, outcome.run
    return {
        "format": "dearig-hold/1",
        "setpoint_mm": outcome.setpoint * 1e3,
        "seconds": outcome.duration,
        "rig": outcome.address,
        "model": outcome.model.name,
        "noise_floor_um": finite(outcome.noise * _UM),
        "rms_um": finite(outcome.rms * _UM),
        "max_um": finite(outcome.largest * _UM),
        "settled_s": outcome.settled,
        "settled_rms_um": finite(outcome.settled_rms * _UM),
        "minutes": [
            {
                "end_s": float(end),
                "error_um": finite(float(error) * _UM),
                "correction_pct": finite(float(correction) * 100.0),
            }
            for end, error, correction in np.atleast_2d(outcome.minutes)
        ],
        "feedback": None
        if done is None
        else {
            "answers": done.answers,
            "delay_s": done.delay,
            "least_waiting_s": finite(done.waiting),
            "correction_lowest_pct": done.lowest * 100.0,
            "correction_highest_pct": done.highest * 100.0,
            "correction_last_pct": done.last * 100.0,
            "limited_s": done.limited,
            "frozen_s": done.frozen,
            "gain_margin": done.gain_margin,
            "phase_margin_deg": done.phase_margin,
        },
        "recording": str(outcome.recording),
        "outcome": run.outcome,
        "events": list(run.events),
        "margins": [asdict(margin) for margin in run.margins],
        "warnings": list(outcome.warnings),
    }
