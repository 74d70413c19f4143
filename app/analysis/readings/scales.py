"""Uncertainties of the scales of voltage and current, as a recording's rig file states them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

from pydantic import ValidationError

from dearig.config.rigfile import RigFile
from dearig.config.toml_input import parse_toml
from dearig.errors import InputError
from dearig.model.readings.channels import CURRENT, GAIN_ERROR
from dearig.recording.reading.recording import Recording

__all__ = ["ScaleErrors", "scale_errors"]

_SAME = 1e-6  # relative: two lags that are taken as different by this part
_FILM = ("length_mm", "width_mm", "thickness_mm", "relative_permittivity")


@dataclass(frozen=True)
class ScaleErrors:
    """Relative standard uncertainties of scales; None where the rig file states none.

    ``command``, ``monitor`` and ``current`` are of the amplifier's gain and of its monitors,
    ``capacitance`` of the film's. ``weight`` is the mean of the readings of a current over the mean
    of the current, where each row is a mean of conversions at a fixed time after each step of the
    output: the pulse of a step is not over, or not there yet.
    """

    command: float | None
    monitor: float | None
    current: float | None
    capacitance: float | None
    weight: float

    def of_channel(self, name: str) -> float:
        """Return the uncertainty of the scale of an electrical channel over its prediction."""
        mine = self.current if name == CURRENT else self.monitor
        return _joined(mine, self.command)

    def of_charge(self, drive: str) -> float:
        """Return that of charge over voltage, both as the card reads them, over the film's.

        ``drive`` is command or monitor.
        """
        voltage = self.monitor if drive == "monitor" else self.command
        known = [GAIN_ERROR if e is None else e for e in (voltage, self.current)]
        return math.hypot(*known, self.capacitance or 0.0, self.weight - 1.0)


def _joined(*errors: float | None) -> float:
    stated = [e for e in errors if e is not None]
    return math.hypot(*stated) if stated else GAIN_ERROR


def scale_errors(recording: Recording) -> ScaleErrors:
    """Return the uncertainties that the rig file in ``recording`` states.

    Without one, bandwidths are those of a rig file that says nothing.
    """
    rig_file = _rig_file(str(recording.provenance.get("configuration", "")))
    amplifier, film = rig_file.amplifier, rig_file.film

    def of(section: object, key: str) -> float | None:
        value, error = getattr(section, key), getattr(section, f"{key}_uncertainty")
        return error / value if error > 0.0 < value else None

    sizes = [e for e in (of(film, key) for key in _FILM) if e is not None]
    return ScaleErrors(
        command=of(amplifier, "gain_V_per_V"),
        monitor=of(amplifier, "monitor_V_per_kV"),
        current=of(amplifier, "current_monitor_V_per_mA"),
        capacitance=math.hypot(*sizes) if sizes else None,
        weight=_weight(recording, rig_file),
    )


@lru_cache(maxsize=16)
def _rig_file(text: str) -> RigFile:
    if not text:
        return RigFile()
    try:
        return RigFile.model_validate(parse_toml(text, "the rig file of a recording"))
    except (InputError, ValidationError):
        return RigFile()  # one of another version states nothing that is known here


def _weight(recording: Recording, rig_file: RigFile) -> float:
    """Return the mean of readings over the mean of the current; 1 unless rows are means.

    A pulse h(t) of charge 1 after each step, through the lags of output and monitor, is read at
    t = s, s + T, ...: T times the sum of h.
    """
    if recording.average == 1 or recording.samples < 2:
        return 1.0
    interval = recording.duration / (recording.samples - 1) / recording.average
    skew = next((c.skew for c in recording.channels if c.name == "current_monitor"), 0.0)
    amplifier = rig_file.amplifier
    first, last = (
        1.0 / (2.0 * math.pi * 1e3 * kHz)
        for kHz in (amplifier.bandwidth_kHz, amplifier.current_monitor_bandwidth_kHz)
    )
    if abs(last - first) < _SAME * first:
        last = first * (1.0 + _SAME)

    def summed(lag: float) -> float:
        return math.exp(-skew / lag) / -math.expm1(-interval / lag)

    return interval * (summed(last) - summed(first)) / (last - first)
