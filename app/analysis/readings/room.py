"""Air of the room in recordings, as a model takes it and as it is shown."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy  # loads its parts when they are first used, which a run may never do

from dearig.model.readings.environment import CELSIUS, HUMIDITY, air_texts
from dearig.recording.content.fields import CONDITIONS
from dearig.recording.reading.recording import Recording

__all__ = ["air_texts_of", "moisture_of", "room_texts", "warmth_of"]

_THERMOMETER = 1.0  # s over which a temperature is averaged: films do not warm faster


def warmth_of(recording: Recording) -> tuple[np.ndarray | None, float | None]:
    """Return the temperature above that of the first second (N,) K, and that less 23 degC, or None.

    Both are None where it was not recorded.
    """
    return _air(recording, "temperature_degC", 1.0, CELSIUS)


def moisture_of(recording: Recording) -> tuple[np.ndarray | None, float | None]:
    """Return the relative humidity above that of the first second (N,), and that less 0.5, or None.

    Both are parts of 1, and None where it was not recorded.
    """
    return _air(recording, "relative_humidity_percent", 0.01, HUMIDITY)


def _air(
    recording: Recording, name: str, scale: float, reference: float
) -> tuple[np.ndarray | None, float | None]:
    """Return ``name`` of the room above that of the first second (N,), and that less a reference.

    Each None where it was not recorded; ``scale`` makes the model's unit of the recording's.
    """
    values = recording.room(name)
    if values is None:
        return None, None
    start = recording.time < recording.time[0] + _THERMOMETER
    samples = max(int(np.count_nonzero(start)), 1)
    first = float(values[start].mean())
    changes = scipy.ndimage.uniform_filter1d(values, samples, mode="nearest") - first
    return scale * changes, scale * first - reference


def room_texts(recordings: Sequence[Recording]) -> list[str]:
    """Return a sentence with the means of the room's conditions; none where not recorded."""
    parts = []
    for name, condition in CONDITIONS.items():
        means = [r.conditions[name] for r in recordings if name in r.conditions]
        if means:
            ends = dict.fromkeys(f"{m:.1f}" for m in (min(means), max(means)))
            parts.append(f"{' to '.join(ends)} {condition.unit}")
    return [f"the room was at {', '.join(parts)} (means of the recordings)"] if parts else []


def air_texts_of(recordings: Sequence[Recording]) -> list[str]:
    """Return why what films owe to the recorded air of the room cannot be looked for."""
    driven = [r for r in recordings if r.kind == "actuator"]
    return list(
        air_texts(
            [warmth_of(r)[1] for r in driven],
            [moisture_of(r)[1] for r in driven],
        )
    )
