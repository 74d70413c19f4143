"""Runs that the thesis made too, by their sequences: table, row and printed errors."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path

from dearig.analysis.outcomes import Published
from dearig.config.presets import PRESETS, VALIDATION_A, VALIDATION_B
from dearig.config.sequencefile import parse_sequence
from dearig.errors import InputError
from dearig.model.simulation.excitation import Lobes
from dearig.recording.reading.recording import Recording

__all__ = ["PUBLISHED_FIT", "place_of"]

#: The thesis's printed errors of its identification run.
PUBLISHED_FIT = Published(2.13, 4.07)

# Tables 4 and 5 of the thesis, by preset: e_rms and e_m in per cent, as printed
_TABLE_4 = dict(
    zip(
        VALIDATION_A,
        ((5.8484, 6.9696), (8.8924, 2.4462), (5.8952, 3.8678), (8.7797, 5.8924), (5.9604, 3.8877)),
        strict=True,
    )
)
_TABLE_5 = dict(
    zip(
        VALIDATION_B,
        ((2.4729, 7.4374), (2.9408, 6.7550), (3.5766, 7.0148), (7.7592, 5.6113), (8.6652, 4.6098)),
        strict=True,
    )
)


def place_of(recording: Recording) -> tuple[str, str, Published | None]:
    """Return table, row and printed errors of a run that the thesis made too."""
    elsewhere = ("", recording.name, None)
    if not recording.sequence_toml:
        return elsewhere
    try:
        played = _lobes(recording.sequence_toml, recording.name)
    except InputError:
        return elsewhere  # a sequence with a CSV file that is missing: not one of the thesis's
    return elsewhere if played is None else _thesis_runs().get(played, elsewhere)


@cache
def _thesis_runs() -> Mapping[Lobes, tuple[str, str, Published | None]]:
    """Return table, row and printed errors of the thesis's runs, by one period of their lobes."""
    places: dict[str, tuple[str, str, Published | None]] = {
        "thesis": ("", "identification", PUBLISHED_FIT)
    }
    for preset, frequency in VALIDATION_A.items():
        places[preset] = ("A", f"f = {frequency:g} Hz", Published(*_TABLE_4[preset]))
    for preset, amplitude in VALIDATION_B.items():
        places[preset] = ("B", f"a = {amplitude:g} kV", Published(*_TABLE_5[preset]))
    runs = {_lobes(PRESETS[preset], preset): place for preset, place in places.items()}
    return {lobes: place for lobes, place in runs.items() if lobes is not None}


def _lobes(toml: str, name: str) -> Lobes | None:
    """Return one period of a sequence of the thesis's lobes alone; None for any other."""
    segments = parse_sequence(toml, name, Path()).sequence.segments
    if len(segments) == 1 and isinstance(segments[0], Lobes):
        # one period, so that runs of any length compare equal
        return replace(segments[0], periods=1)
    return None
