"""Texts and JSON of a displacement that was sensed by voltage and current."""

from __future__ import annotations

from typing import Any

import numpy as np

from dearig.analysis.readings.sense import SenseOutcome
from dearig.report.text.numbers import significant

__all__ = ["sense_json", "sensed_texts"]


def sensed_texts(outcome: SenseOutcome) -> list[str]:
    """Return the lines on ``outcome`` for a terminal or a notebook."""
    agreement = outcome.agreement
    if agreement is None:
        return list(outcome.sentences)
    scatter = agreement.gain_error
    known = np.isfinite(outcome.sensed.displacement)
    return [
        f"{outcome.name}: {np.count_nonzero(known):,} of {known.size:,} rows have an estimate, of "
        f"voltages from {significant(outcome.sensed.threshold)} V",
        f"difference from the laser: {significant(agreement.rms * 1e6)} um RMS; "
        f"{significant(100.0 * agreement.coverage)} % of the rows are within two standard errors",
        *outcome.sentences,
        f"Gain by the laser: {significant(agreement.gain, 4)}"
        + ("" if scatter is None else f", known to {significant(100.0 * scatter, 2)} %")
        + f"; with it the difference is {significant(agreement.rms_with_gain * 1e6)} um RMS",
    ]


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
        "sentences": list(outcome.sentences),
    }
