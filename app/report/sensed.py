"""Texts and JSON of a displacement that was sensed by voltage and current."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from dearig.analysis.readings.sense import SenseOutcome
from dearig.model.readings.channels import GAIN_ERROR
from dearig.model.readings.measures import root_mean_square
from dearig.report.text.numbers import significant

__all__ = ["sense_json", "sense_texts", "sensed_texts"]


def sensed_texts(outcome: SenseOutcome) -> list[str]:
    """Return the lines on ``outcome`` for a terminal or a notebook."""
    agreement = outcome.agreement
    if agreement is None:
        return list(sense_texts(outcome))
    scatter = agreement.gain_error
    known = np.isfinite(outcome.sensed.displacement)
    return [
        f"{outcome.name}: {np.count_nonzero(known):,} of {known.size:,} rows have an estimate, of "
        f"voltages from {significant(outcome.sensed.threshold)} V",
        f"difference from the laser: {significant(agreement.rms * 1e6)} um RMS; "
        f"{significant(100.0 * agreement.coverage)} % of the rows are within two standard errors",
        *sense_texts(outcome),
        f"Gain by the laser: {significant(agreement.gain, 4)}"
        + ("" if scatter is None else f", known to {significant(100.0 * scatter, 2)} %")
        + f"; with it the difference is {significant(agreement.rms_with_gain * 1e6)} um RMS",
    ]


def sense_texts(outcome: SenseOutcome) -> tuple[str, ...]:
    """Return how large the error of ``outcome`` is, and what would reduce it."""
    sensed, agreement = outcome.sensed, outcome.agreement
    if agreement is None:
        if outcome.is_instantaneous:
            return (
                f"No displacement: the readings carry {100.0 * sensed.share:.2g} % of the film's "
                f"charge. After each step of the output the film charges within microseconds, "
                f"between two readings. Record with [card] average = {outcome.advised}: such rows "
                f"are means, which contain the charging current.",
            )
        return (
            f"No displacement: the noise of the current, {sensed.noise * 1e6:.3g} uA, is too large "
            f"for a film that takes {sensed.scale * 1e6:.3g} uC. {_help(outcome)}",
        )
    known = np.isfinite(sensed.displacement)
    noise, common = (root_mean_square(e[known]) for e in (sensed.noise_error, sensed.gain_error))
    least = float(np.min(sensed.standard_error[known]))
    said = [
        f"The standard error is {_um(agreement.error)} RMS ({_um(least)} at best): {_um(noise)} "
        f"from the noise of the current and {_um(common)} from the scale of the charge "
        f"({100.0 * outcome.gain_error:.2g} %), which is common to all rows.",
        *_scales(outcome),
    ]
    if common > noise:
        said.append(
            "The scale is the larger part: take the gain that the laser of a recording gives for "
            "the others of this rig."
        )
    else:
        said.append(f"The noise is the larger part. {_help(outcome)}")
    off = abs(math.log(agreement.gain / outcome.gain))
    if off > 3.0 * math.hypot(outcome.gain_error, agreement.gain_error or 0.0):
        said.append(
            f"By the laser the charge is {agreement.gain:.4g} times that of the model, more than "
            f"the scale's uncertainty: the cable to the film charges too, the film has another "
            f"thickness or permittivity, or the conversions are slower than the current monitor."
        )
    return tuple(said)


def _scales(outcome: SenseOutcome) -> list[str]:
    """Return what the uncertainty of the scale is from, where no calibration gave it."""
    scales = outcome.scales
    if scales is None:
        return []
    weight = abs(scales.weight - 1.0)
    said = []
    if weight > 0.0:
        said.append(
            f"Of the scale's uncertainty {100.0 * weight:.2g} % is that each conversion reads the "
            f"current at a fixed time after a step of the output: by the bandwidths in the rig "
            f"file the readings are {scales.weight:.3g} times the current."
        )
    missing = [
        f"amplifier.{key}_uncertainty"
        for key, error in (
            ("gain_V_per_V", scales.command),
            ("current_monitor_V_per_mA", scales.current),
        )
        if error is None
    ]
    if missing:
        said.append(
            f"{100.0 * GAIN_ERROR:.2g} % is taken for each scale of which the rig file does not "
            f"state {' or '.join(missing)}."
        )
    return said


def _help(outcome: SenseOutcome) -> str:
    means = ""
    if outcome.average < outcome.advised:
        better = math.sqrt(outcome.advised / outcome.average)
        means = f"[card] average = {outcome.advised} divides it by {better:.2g}; "
    return (
        f"It is in proportion to noise/(C_0 V): {means}a film of twice the area, or one of half "
        f"the thickness under the same voltage if it withstands that, halves it; a drive that is "
        f"four times as fast halves it too."
    )


def _um(length: float) -> str:
    """Return a ``length`` in m as a person reads it, to three digits."""
    return f"{float(f'{length * 1e6:.3g}'):g} um"


def sense_json(outcome: SenseOutcome) -> dict[str, Any]:
    """Return ``outcome`` for ``--json``."""
    sensed, agreement = outcome.sensed, outcome.agreement
    known = np.isfinite(sensed.displacement)

    def rms(values: np.ndarray) -> float | None:
        return float(np.sqrt(np.mean(values[known] ** 2))) * 1e6 if known.any() else None

    return {
        "format": "dearig-sense/1",
        "recording": outcome.name,
        "model": outcome.model_name,
        "usable": agreement is not None,
        "average": outcome.average,
        "rows": int(known.size),
        "rows_with_estimate": int(np.count_nonzero(known)),
        "threshold_V": sensed.threshold,
        "gain": outcome.gain,
        "gain_error": outcome.gain_error,
        "rms_um": None if agreement is None else agreement.rms * 1e6,
        "standard_error_um": rms(sensed.standard_error),
        "least_error_um": float(np.min(sensed.standard_error[known])) * 1e6
        if known.any()
        else None,
        "noise_error_um": rms(sensed.noise_error),
        "gain_error_um": rms(sensed.gain_error),
        "coverage": None if agreement is None else agreement.coverage,
        "gain_by_laser": None if agreement is None else agreement.gain,
        "gain_by_laser_error": None if agreement is None else agreement.gain_error,
        "rms_with_gain_um": None if agreement is None else agreement.rms_with_gain * 1e6,
        "charge_share": sensed.share,
        "noise_A": sensed.noise,
        "offset_A": sensed.offset,
        "conductance_S": sensed.conductance,
        "anchored_lobes": sensed.anchors,
        "excess": sensed.excess,
        "sentences": list(sense_texts(outcome)),
    }
