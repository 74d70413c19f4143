"""Plausibility of imported values: sentences about what looks like a wrong unit."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from dearig.model.film.specimen import Film
from dearig.recording.content.bounds import (
    CURRENT,
    DISPLACEMENT_SPAN,
    STRESS,
    STRETCH,
    TEMPERATURE,
    VOLTAGE,
)
from dearig.recording.content.sign import sign_text

__all__ = ["plausibility_warnings"]


def _span(values: np.ndarray) -> float:
    return float(np.nanmax(values) - np.nanmin(values))


def _largest(values: np.ndarray) -> float:
    """Return the largest absolute value of ``values`` (n,)."""
    return max(float(np.nanmax(values)), -float(np.nanmin(values)))


def plausibility_warnings(values: Mapping[str, np.ndarray], film: Film | None) -> list[str]:
    """Return a sentence for each of ``values`` (in the recording's units) that is doubtful."""
    found = []

    def check(name: str, wrong: bool, sentence: str) -> None:
        if name in values and wrong:
            found.append(sentence)

    if "displacement" in values:
        span = _span(values["displacement"])
        longest, whose = (
            (film.length, "the film is") if film else (DISPLACEMENT_SPAN.high, "a film is at most")
        )
        check(
            "displacement",
            span > longest,
            f"displacement spans {span * 1e3:.4g} mm and {whose} {longest * 1e3:.4g} mm long; "
            f"is its unit right?",
        )
        check(
            "displacement",
            span < DISPLACEMENT_SPAN.low,
            f"displacement spans {span * 1e6:.4g} um only; is its unit right?",
        )
    for kind, drive, signal in (
        ("actuator", "voltage_command", "displacement"),
        ("film", "stretch", "nominal_stress"),
    ):
        if {drive, signal} <= values.keys():
            sentence = sign_text(kind, values[drive], values[signal])
            check(signal, bool(sentence), sentence)
    if "voltage_command" in values:
        highest = _largest(values["voltage_command"])
        check(
            "voltage_command",
            highest > VOLTAGE.usual.high,
            f"voltage reaches {highest * 1e-3:.4g} kV; is it in V and not in kV?",
        )
        check("voltage_command", highest == 0.0, "voltage never leaves 0 V")
        check(
            "voltage_command",
            0.0 < highest < VOLTAGE.usual.low,
            f"voltage reaches {highest:.4g} V only; is it in kV?",
        )
    if "current_monitor" in values:
        highest = _largest(values["current_monitor"])
        check(
            "current_monitor",
            highest > CURRENT.high,
            f"current reaches {highest:.4g} A, which no high-voltage amplifier gives; "
            f"is its unit right?",
        )
    if "temperature" in values:
        low, high = (float(end(values["temperature"])) for end in (np.nanmin, np.nanmax))
        check(
            "temperature",
            low < TEMPERATURE.low or high > TEMPERATURE.high,
            f"temperature lies between {low:.4g} and {high:.4g} degC; is its unit right?",
        )
    if "stretch" in values:
        low, high = float(values["stretch"].min()), float(values["stretch"].max())
        check(
            "stretch",
            low < STRETCH.usual.low or high > STRETCH.usual.high,
            f"stretch lies between {low:.4g} and {high:.4g}; is it length over length at rest, "
            f"and the gauge length right?",
        )
        check("stretch", low == high, "stretch never changes")
    if "nominal_stress" in values:
        highest = _largest(values["nominal_stress"])
        check(
            "nominal_stress",
            highest > 0.0 and highest not in STRESS,
            f"nominal stress reaches {highest * 1e-3:.4g} kPa; are its unit and the area right?",
        )
    return found
