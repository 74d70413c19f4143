"""Numbers that a fit, a validation or a diagnosis gives, by names that end in their units."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np

from dearig.analysis.outcomes import Comparison, DiagnoseOutcome, IdentifyOutcome, ValidateOutcome
from dearig.model.verdict import is_rejected, smallest_p
from dearig.recording.json_file import finite
from dearig.recording.reading.recording import Recording
from dearig.units import SHOWN, parameter_key, parameter_unit

__all__ = [
    "conditions_of",
    "errors_of",
    "numbers_of",
    "parameter_of",
    "parameters_of",
    "peaks_of",
    "rejection_of",
]


def parameters_of(outcome: IdentifyOutcome | DiagnoseOutcome) -> list[dict[str, Any]]:
    """Return name, value, interval and whether the data determine it, for each parameter.

    Names end in the unit of the value: ``mu_0_kPa``. The parameters of an effect begin with its
    name. Bounds that are not known are None.
    """
    estimates: Iterable[tuple[str, Any]]
    if isinstance(outcome, IdentifyOutcome):
        estimates = [("", e) for e in outcome.fit.estimates]
    else:
        estimates = [
            (f"{step.effect}.", e) for step in outcome.finding.steps for e in step.estimates
        ]
    return [parameter_of(estimate, before) for before, estimate in estimates]


def parameter_of(estimate: Any, before: str = "") -> dict[str, Any]:
    """Return one entry of ``parameters_of``; ``before`` is put before a name without an effect."""
    factor, _ = parameter_unit(estimate.unit)
    is_whole = ": " in estimate.name or "." in estimate.name
    name = estimate.name if is_whole else before + estimate.name
    return {
        "name": parameter_key(name, estimate.unit),
        "value": finite(estimate.value * factor),
        "low95": finite(estimate.low * factor) if estimate.low != 0.0 else None,
        "high95": finite(estimate.high * factor),
        "determined": bool(estimate.determined),
    }


def errors_of(comparison: Comparison) -> dict[str, float]:
    """Return the errors of a model on a recording, in µm or kPa and in percent."""
    shown, errors = SHOWN[comparison.kind], comparison.errors
    found = {
        f"rms_{shown.suffix}": errors.rms * shown.error_factor,
        "nrmse_pct": errors.nrmse_pct,
        f"max_{shown.suffix}": errors.max * shown.error_factor,
    }
    return {name: float(value) for name, value in found.items() if math.isfinite(value)}


def rejection_of(*comparisons: Comparison) -> dict[str, Any]:
    """Return the probability that noise as that at rest leaves the residuals, and what follows."""
    p = smallest_p(c.misfit_p for c in comparisons)
    return {"misfit_p": finite(p), "rejected": None if p is None else is_rejected(p)}


def peaks_of(recording: Recording) -> dict[str, float | None]:
    """Return the largest voltage in kV and displacement in mm, with their signs; {} of a film."""
    if recording.kind != "actuator":
        return {}
    return {
        "peak_voltage_kV": _peak(recording.voltage_command, 1e-3),
        "peak_displacement_mm": _peak(recording.displacement, 1e3),
    }


def _peak(values: np.ndarray | None, factor: float) -> float | None:
    """Return the value of the largest size times ``factor``, with its sign; None without any."""
    known = values[np.isfinite(values)] if values is not None else np.empty(0)
    return float(known[np.argmax(np.abs(known))]) * factor if known.size else None


def conditions_of(recording: Recording) -> dict[str, float]:
    """Return the peak displacement of a run, and the means of its room; what is known of them."""
    peak = peaks_of(recording).get("peak_displacement_mm")
    found = {} if peak is None else {"peak_displacement_mm": peak}
    return {**found, **recording.conditions}


def numbers_of(
    outcome: IdentifyOutcome | ValidateOutcome | DiagnoseOutcome,
) -> dict[str, float]:
    """Return the numbers of an outcome; of a fit the parameters that the data determine."""
    if isinstance(outcome, ValidateOutcome):
        return dict(_named("validation", outcome.comparisons))
    what = "fit" if isinstance(outcome, IdentifyOutcome) else "diagnosis"
    train = outcome.train if isinstance(outcome, IdentifyOutcome) else outcome.after.train
    parameters = {
        p["name"]: p["value"]
        for p in parameters_of(outcome)
        if p["determined"] and p["value"] is not None
    }
    return {**parameters, **dict(_named(what, train))}


def _named(what: str, comparisons: Iterable[Comparison]) -> Iterator[tuple[str, float]]:
    for comparison in comparisons:
        for name, value in errors_of(comparison).items():
            yield f"{what}_{name}", value
