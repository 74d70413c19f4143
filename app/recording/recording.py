"""A recording in memory: immutable arrays and everything that is known about them."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np

from app.recording.files import file_sha256
from app.recording.layout import SIGNALS, UNITS
from app.recording.quiet import lead_in, noise_floor
from drivers.channels import Channel
from drivers.rig import Instrument
from model.material import Film, Load

__all__ = ["RecordedEvent", "Recording"]


@dataclass(frozen=True)
class RecordedEvent:
    """Something that happened at ``sample``, ``time`` s: ``level`` is info, warning or fault."""

    sample: int
    time: float
    level: str
    message: str


@dataclass(frozen=True, eq=False)
class Recording:
    """What ``open_recording`` found. Arrays are (N,) float64 and read-only; None is "not there".

    ``kind`` is ``actuator`` (``voltage_command`` V drives, ``displacement`` m from the loaded rest
    state answers) or ``film`` (``stretch`` drives, ``nominal_stress`` Pa answers). ``time`` in s
    increases and need not be even. ``hold``: the voltage stands between samples (a converter);
    otherwise it is linear. ``displacement_skew`` and ``displacement_delay`` in s are the known time
    at which the sensor is converted after the tick, and the sensor's own lag; neither has been
    taken off ``time``. ``temperature`` is in degrees Celsius. ``complete`` is False for a run that
    was killed; ``outcome`` says how it ended.
    """

    path: Path
    kind: str
    name: str
    title: str
    time: np.ndarray
    hold: bool
    kinematics: str
    complete: bool
    displacement: np.ndarray | None = None
    voltage_command: np.ndarray | None = None
    voltage_monitor: np.ndarray | None = None
    current_monitor: np.ndarray | None = None
    temperature: np.ndarray | None = None
    displacement_model: np.ndarray | None = None
    stretch: np.ndarray | None = None
    nominal_stress: np.ndarray | None = None
    displacement_skew: float = 0.0
    displacement_delay: float = 0.0
    rest_reading: float = 0.0
    voltage_step: float = 0.0
    film: Film | None = None
    load: Load | None = None
    film_id: str = ""
    notes: str = ""
    sequence_toml: str = ""
    model_toml: str = ""
    outcome: str = ""
    samples_expected: int | None = None
    events: tuple[RecordedEvent, ...] = ()
    instruments: tuple[Instrument, ...] = ()
    channels: tuple[Channel, ...] = ()
    provenance: dict[str, object] = field(default_factory=dict)

    @property
    def values(self) -> dict[str, np.ndarray]:
        """Every array that is there, by name, ``time`` first."""
        found = {name: getattr(self, name) for name in UNITS}
        return {name: values for name, values in found.items() if values is not None}

    @property
    def signal(self) -> np.ndarray:
        """What the film answered: displacement in m, or nominal stress in Pa."""
        values: np.ndarray = getattr(self, SIGNALS[self.kind])
        return values

    @property
    def samples(self) -> int:
        """N."""
        return int(self.time.size)

    @property
    def duration(self) -> float:
        """s, from the first to the last sample."""
        return float(self.time[-1] - self.time[0])

    @cached_property
    def quiet(self) -> np.ndarray:
        """(N,) True in the lead-in: at 0 V, before the first voltage. All False for a film."""
        mask = np.zeros(self.samples, dtype=bool)
        if self.voltage_command is not None:
            mask[: lead_in(self.voltage_command, self.voltage_step)] = True
        mask.setflags(write=False)
        return mask

    @cached_property
    def noise_floor(self) -> float | None:
        """Standard deviation in m of the displacement about a line through the lead-in.

        None for a film, and for a lead-in of fewer than 20 samples.
        """
        if self.displacement is None:
            return None
        return noise_floor(self.time[self.quiet], self.displacement[self.quiet])

    @cached_property
    def sha256(self) -> str:
        """SHA-256 of the file, read when it is first asked for."""
        return file_sha256(self.path)
