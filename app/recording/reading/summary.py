"""Summary of a recording, as plain values for programs or as lines for people."""

from __future__ import annotations

import math
from dataclasses import asdict
from types import MappingProxyType
from typing import Any

import numpy as np

from dearig.recording.content.fields import CONDITIONS, TEXTS
from dearig.recording.content.layout import FORMAT, LINEAR, ZERO_ORDER
from dearig.recording.content.provenance import is_start_known
from dearig.recording.content.timestamps import local_time
from dearig.recording.reading.recording import Recording

__all__ = ["describe", "describe_rows"]

#: Time steps are even if they differ by less than this part of their mean: a file rounds them.
EVEN = 1e-6


def describe(recording: Recording, checksum: bool = True) -> dict[str, Any]:
    """Return the metadata of a recording for JSON, in SI units with units in the names.

    With ``checksum`` the SHA-256 of the whole file is in it, which takes time for gigabytes.
    """
    timing: dict[str, Any] = {"even": False, "rate_Hz": None}
    if recording.rate is not None:
        step = 1.0 / recording.rate
        timing = {
            "even": True,
            "rate_Hz": recording.rate,
            "step_min_s": step,
            "step_max_s": step,
        }
    elif recording.samples > 1:
        steps = np.diff(recording.time)
        low, high, mean = float(steps.min()), float(steps.max()), float(steps.mean())
        even = high - low <= EVEN * mean
        timing = {
            "even": even,
            "rate_Hz": 1.0 / mean if even else None,
            "step_min_s": low,
            "step_max_s": high,
        }
    film, load, noise = recording.film, recording.load, recording.noise
    return {
        "format": FORMAT,
        "path": str(recording.path),
        "sha256": recording.sha256 if checksum else None,
        "name": recording.name,
        "title": recording.title,
        "kind": recording.kind,
        "complete": recording.complete,
        "outcome": recording.outcome,
        "samples": recording.samples,
        "samples_expected": recording.samples_expected,
        "duration_s": recording.duration,
        "timing": timing,
        "average": recording.average,
        "hold": ZERO_ORDER if recording.hold else LINEAR,
        "kinematics": recording.kinematics,
        "channels": [
            _channel(recording, name) for name in recording.arrays.names if name != "time"
        ],
        "quiet_samples": recording.quiet_samples,
        "noise_floor_m": noise.value if noise and recording.kind == "actuator" else None,
        "noise_floor_Pa": noise.value if noise and recording.kind == "film" else None,
        "noise_from": noise.source if noise else None,
        **{name: recording.conditions.get(name) for name in CONDITIONS},
        "environment": _environment(recording),
        "rest_reading_m": recording.rest_reading,
        "displacement_skew_s": recording.displacement_skew,
        "displacement_delay_s": recording.displacement_delay,
        "displacement_delay_error_s": recording.displacement_delay_error,
        "film": asdict(film) | {"id": recording.film_id} if film else None,
        "load": asdict(load) if load else None,
        **{key: recording.texts[key] for key, field in TEXTS.items() if not field.in_provenance},
        "sequence": recording.sequence_toml,
        "model": recording.model_toml,
        "instruments": [
            {
                "role": i.role,
                "model": i.model,
                "serial": i.serial,
                "settings": dict(i.settings),
            }
            for i in recording.instruments
        ],
        "events": [asdict(event) for event in recording.events],
        "provenance": recording.provenance,
    }


def _environment(recording: Recording) -> dict[str, Any] | None:
    """Return how many readings of a thermo-hygrometer there are, and their ranges."""
    readings = recording.environment
    if readings is None:
        return None
    ranges: dict[str, Any] = {"readings": int(readings.sample.size)}
    for name in CONDITIONS:
        values = readings.of(name)
        if values is not None:
            known = values[np.isfinite(values)]
            ranges[name] = [float(known.min()), float(known.max())] if known.size else None
    return ranges


def _room_row(environment: dict[str, Any]) -> str:
    """Return the ranges of a thermo-hygrometer's readings in words."""
    parts = []
    for name in (name for name in CONDITIONS if name in environment):
        condition, span = CONDITIONS[name], environment[name]
        what = condition.short or condition.label
        if span is None:
            parts.append(f"no {what}")
        else:
            ends = [f"{value:.1f}" for value in span]
            parts.append(f"{what} {' to '.join(dict.fromkeys(ends))} {condition.unit}")
    count = environment["readings"]
    return f"{', '.join(parts)}; {count} reading{'s' if count > 1 else ''} of a thermo-hygrometer"


def _channel(recording: Recording, name: str) -> dict[str, Any]:
    whole = recording.overview(name, 2000)
    # the overlay model has no value where it failed
    known = np.isfinite(whole.low)
    low = high = None
    if known.any():
        low, high = float(whole.low[known].min()), float(whole.high[known].max())
    row = {"name": name, "unit": recording.unit(name), "min": low, "max": high}
    if gaps := recording.gaps(name):
        row["missing"] = gaps
    if name in recording.declared:
        row["label"] = recording.declared[name]
    return row


_DECIMALS_MAX = 6
#: Factors and units in which values are shown to people.
_READABLE = MappingProxyType(
    {
        "displacement": (1e6, "um"),
        "displacement_model": (1e6, "um"),
        "voltage_command": (1e-3, "kV"),
        "voltage_monitor": (1e-3, "kV"),
        "current_monitor": (1e3, "mA"),
        "nominal_stress": (1e-3, "kPa"),
        "stretch": (1.0, ""),
        "temperature": (1.0, "°C"),
    }
)


def _span(low: float, high: float) -> str:
    """Return the ends of a range, both to four digits of the larger one."""
    largest = max(abs(low), abs(high))
    decimals = 3 - math.floor(math.log10(largest)) if largest else 0
    if decimals > _DECIMALS_MAX:
        return f"{low:.4g} to {high:.4g}"
    # + 0.0 turns a negative zero into zero
    ends = (f"{round(end, decimals) + 0.0:.{max(decimals, 0)}f}" for end in (low, high))
    return " to ".join(ends)


def describe_rows(recording: Recording) -> list[tuple[str, str]]:
    """Return the metadata as (label, value) pairs of text, the most important first."""
    d = describe(recording, checksum=False)
    rows = [("recording", f"{d['name']} ({d['kind']}, {d['title']})")]
    outcome = d["outcome"] if d["complete"] else f"INCOMPLETE: {d['outcome']}"
    rows.append(("outcome", outcome))
    samples = f"{d['samples']} over {d['duration_s']:.6g} s"
    if d["samples_expected"] is not None and d["samples_expected"] != d["samples"]:
        samples += f", {d['samples_expected']} were planned"
    rows.append(("samples", samples))
    timing = d["timing"]
    if timing["even"]:
        rows.append(("rate", f"{timing['rate_Hz']:.6g} Hz"))
    elif "step_min_s" in timing:
        rows.append(
            ("rate", f"uneven, steps of {timing['step_min_s']:.4g} to {timing['step_max_s']:.4g} s")
        )
    if recording.average > 1:
        rows.append(("row", f"mean of {recording.average} conversions"))
    for channel in d["channels"]:
        scale, unit = _READABLE.get(channel["name"], (1.0, channel["unit"]))
        if channel["min"] is not None:
            span = f"{_span(channel['min'] * scale, channel['max'] * scale)} {unit}".rstrip()
            if gaps := channel.get("missing"):
                span += f", {gaps} of {d['samples']} readings missing"
            shown = channel.get("label", channel["name"].replace("_", " "))
            rows.append((shown, span))
    if d["environment"] is not None:
        rows.append(("room", _room_row(d["environment"])))
    noise = recording.noise
    if noise is not None and d["kind"] == "actuator":
        rows.append(("noise floor", f"{noise.value * 1e6:.3g} um, {noise.words}"))
    elif noise is not None:
        rows.append(("noise floor", f"{noise.value * 1e-3:.3g} kPa, from second differences"))
    else:
        rows.append(("noise floor", "unknown: the readings do not change"))
    if d["kind"] == "actuator":
        between = "zero-order hold" if recording.hold else "linear"
        rows.append(("voltage interpolation", between))
    rows.append(("kinematics", d["kinematics"]))
    film, load = recording.film, recording.load
    if film is not None:
        size = " x ".join(f"{x * 1e3:.6g}" for x in (film.length, film.width, film.thickness))
        identifier = f"{recording.film_id}, " if recording.film_id else ""
        rows.append(
            (
                "film",
                f"{identifier}{size} mm, permittivity {film.permittivity:.4g}, "
                f"density {film.density:.6g} kg/m3",
            )
        )
    if load is not None:
        rest = "" if load.rest_length is None else f", at rest {load.rest_length * 1e3:.6g} mm"
        rows.append(("load", f"{load.mass * 1e3:.6g} g{rest}"))
    # the film's name is in its row
    rows += [
        (field.label.lower(), recording.texts[key])
        for key, field in TEXTS.items()
        if not field.in_provenance and key != "film_id" and recording.texts[key]
    ]
    feedback = str(recording.provenance.get("feedback", ""))
    if feedback:
        rows.append(("feedback", feedback.strip().replace(" = ", " ").replace("\n", "; ")))
    for instrument in recording.instruments:
        parts = [f"{instrument.model}, serial {instrument.serial or 'unknown'}"]
        parts += [f"{name} {value}" for name, value in instrument.settings]
        rows.append((instrument.role, "; ".join(parts)))
    rows += [(f"{event.level} at {event.time:.4g} s", event.message) for event in recording.events]
    listed = [field.place.partition("/")[2] for field in TEXTS.values() if field.in_provenance]
    for name in ("start_time", *listed, "host", "source", "seed", "dearig_version", "git_revision"):
        value = recording.provenance.get(name)
        if value not in (None, ""):
            text = local_time(str(value)) if name == "start_time" else str(value)
            if name == "start_time" and not is_start_known(recording.provenance):
                text += ", of the import: the file does not tell that of the measurement"
            rows.append((name.replace("_", " "), text))
    return rows
