"""A recording: its values, read on first use, and its metadata."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from dearig.drivers.channels import Channel
from dearig.drivers.rig import Instrument
from dearig.extras import import_extra
from dearig.model.film.specimen import Film, Load
from dearig.model.readings.noise import LEAD_IN
from dearig.recording.content.fields import CONDITIONS
from dearig.recording.content.layout import SIGNALS, UNITS, variable_attributes
from dearig.recording.content.rest_noise import (
    MIN_QUIET,
    ReadingNoise,
    noise_of_readings,
    takes_few_values,
)
from dearig.recording.files import file_sha256
from dearig.recording.reading.arrays import Arrays, Overview
from dearig.recording.reading.environment import Environment, mean_conditions

if TYPE_CHECKING:
    import pandas
    import xarray

__all__ = ["RecordedEvent", "Recording"]

#: Samples of the lead-in for the noise floor, at most: more add no accuracy.
NOISE_MAX = 2**22


@dataclass(frozen=True)
class RecordedEvent:
    """An event at ``sample``, ``time`` s; ``level`` is info, warning or fault."""

    sample: int
    time: float
    level: str
    message: str


@dataclass(frozen=True, eq=False)
class Recording:
    """A recording as read. Arrays are (N,) float64 and read-only; None means "not recorded".

    A reading that an imported file did not have is NaN; time and the drive have a value everywhere.

    They are read from the file on first use, so that a recording of hours opens without delay;
    ``overview`` and ``window`` read only what they return.

    ``kind`` is ``actuator`` (input ``voltage_command`` in V, output ``displacement`` in m from the
    loaded rest state) or ``film`` (input ``stretch``, output ``nominal_stress`` in Pa). ``time`` in
    s increases and need not be even. ``hold``: the voltage is held between samples (a converter);
    otherwise it is linear. ``displacement_skew`` in s is the known time from the tick to the
    conversion of the sensor, ``displacement_delay`` in s the sensor's own lag, known within
    ``displacement_delay_error``; neither has been subtracted from ``time``. ``temperature`` is in
    degrees Celsius. ``complete`` is False for a run that was killed; ``outcome`` says how it ended.
    ``rate`` in Hz is that of the samples, None for data without a sample clock. Each sample is the
    mean of ``average`` conversions, spread evenly over its interval, and its time is the mean of
    their ticks: the converter held the voltage for one conversion after each. ``environment`` are
    the readings of a thermo-hygrometer, None for a run without one. ``texts`` has film, notes and
    others by the keys of ``content.fields.TEXTS``. ``channels`` are those of the counts, empty for
    data without counts; ``declared_channels`` has unit and label of those that a rig file declared.
    """

    path: Path
    kind: str
    name: str
    title: str
    arrays: Arrays
    hold: bool
    kinematics: str
    complete: bool
    rate: float | None = None
    average: int = 1
    displacement_skew: float = 0.0
    displacement_delay: float = 0.0
    displacement_delay_error: float = 0.0
    rest_reading: float = 0.0
    voltage_step: float = 0.0
    film: Film | None = None
    load: Load | None = None
    texts: Mapping[str, str] = field(default_factory=dict)
    sequence_toml: str = ""
    model_toml: str = ""
    outcome: str = ""
    samples_expected: int | None = None
    events: tuple[RecordedEvent, ...] = ()
    instruments: tuple[Instrument, ...] = ()
    channels: tuple[Channel, ...] = ()
    declared_channels: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    provenance: dict[str, object] = field(default_factory=dict)
    environment: Environment | None = None

    @property
    def film_id(self) -> str:
        """The operator's name for the film, "" without one."""
        return self.texts.get("film_id", "")

    @property
    def notes(self) -> str:
        """Notes of the operator."""
        return self.texts.get("notes", "")

    @property
    def time(self) -> np.ndarray:
        """Time of the sample clock in s."""
        return self.arrays.read("time")

    @property
    def displacement(self) -> np.ndarray | None:
        """Displacement from the loaded rest state in m."""
        return self._row("displacement")

    @property
    def voltage_command(self) -> np.ndarray | None:
        """Commanded voltage at the film in V."""
        return self._row("voltage_command")

    @property
    def voltage_monitor(self) -> np.ndarray | None:
        """Monitored voltage at the film in V."""
        return self._row("voltage_monitor")

    @property
    def current_monitor(self) -> np.ndarray | None:
        """Monitored current in A."""
        return self._row("current_monitor")

    @property
    def temperature(self) -> np.ndarray | None:
        """Temperature in degrees Celsius."""
        return self._row("temperature")

    def room(self, name: str) -> np.ndarray | None:
        """Return ``name``, a key of ``CONDITIONS``, over the time of the samples: (N,).

        From a channel at the card, or else from the thermo-hygrometer; None where neither gave it.
        Where a reading is missing, it is on a line between its neighbours.
        """
        row = self._row(CONDITIONS[name].channel)
        if row is not None and np.isnan(row).any():
            row = _filled(self.time, row)
        if row is None and self.environment is not None:
            row = self.environment.at(name, self.time)
        return row

    @property
    def temperature_degC(self) -> float | None:  # noqa: N802
        """Mean temperature of the run in degrees Celsius; None where it is not known."""
        return self.conditions.get("temperature_degC")

    @property
    def relative_humidity_percent(self) -> float | None:
        """Mean relative humidity of the run in per cent; None where it is not known."""
        return self.conditions.get("relative_humidity_percent")

    @cached_property
    def conditions(self) -> dict[str, float]:
        """Means of the run by the keys of ``content.fields.CONDITIONS``, where they are known."""

        def channel(name: str, points: int) -> Overview | None:
            return self.overview(name, points) if name in self.arrays.names else None

        return mean_conditions(self.environment, channel)

    @property
    def displacement_model(self) -> np.ndarray | None:
        """Displacement of the overlay model in m."""
        return self._row("displacement_model")

    @property
    def stretch(self) -> np.ndarray | None:
        """Stretch: length over length at rest."""
        return self._row("stretch")

    @property
    def nominal_stress(self) -> np.ndarray | None:
        """Nominal stress in Pa."""
        return self._row("nominal_stress")

    @property
    def declared(self) -> dict[str, str]:
        """Names of the channels that the rig file declared, and their labels."""
        there = {n: c for n, c in self.declared_channels.items() if n in self.arrays.names}
        return {n: label or n.replace("_", " ") for n, (_, label) in there.items()}

    def unit(self, name: str) -> str:
        """Return the unit of the values of ``name``.

        Raises ``ValueError`` for a channel that the recording does not have.
        """
        self._check_channel(name)
        if name in UNITS:
            return UNITS[name]
        return self.declared_channels[name][0]

    def _attributes(self, name: str) -> dict[str, str]:
        _, label = self.declared_channels.get(name, ("", ""))
        return variable_attributes(name, self.unit(name), label)

    def _row(self, name: str) -> np.ndarray | None:
        return self.arrays.read(name) if name in self.arrays.names else None

    @property
    def values(self) -> dict[str, np.ndarray]:
        """All arrays by name, ``time`` first."""
        return {name: self.arrays.read(name) for name in self.arrays.names}

    @property
    def measured(self) -> np.ndarray:
        """The measured quantity: displacement in m, or nominal stress in Pa; NaN where missing."""
        return self.arrays.read(SIGNALS[self.kind])

    @cached_property
    def signal(self) -> np.ndarray:
        """The measured quantity for computations: missing readings are on a line across them."""
        if self.missing is None:
            return self.measured
        filled = _filled(self.time, self.measured)
        filled.setflags(write=False)
        return filled

    @cached_property
    def missing(self) -> np.ndarray | None:
        """(N,) True where the measured quantity has no reading; None where all are there."""
        gaps = np.isnan(self.measured)
        gaps.setflags(write=False)
        return gaps if gaps.any() else None

    def gaps(self, name: str) -> int:
        """Return how many readings of the channel ``name`` are missing."""
        # a converter always gives a count, so a run need not be read for it
        if self.channels or name in ("time", "displacement_model"):
            return 0
        return int(np.count_nonzero(np.isnan(self.arrays.read(name))))

    @property
    def samples(self) -> int:
        """Number of samples N."""
        return self.arrays.samples

    @property
    def duration(self) -> float:
        """Time from the first to the last sample in s."""
        n = self.samples
        first, last = (float(self.arrays.window("time", i, i + 1)[0]) for i in (0, n - 1))
        return last - first

    def overview(
        self, channel: str, points: int, start: int = 0, stop: int | None = None
    ) -> Overview:
        """Return minima and maxima of ``channel`` in at most about ``points`` bins.

        The samples are ``start`` to before ``stop``, by default the end. Levels stored with the run
        make this as fast for hours as for seconds. Raises ``ValueError`` for a channel that the
        recording does not have.
        """
        self._check_channel(channel)
        if points < 1:
            raise ValueError(f"points = {points} must be 1 or more")
        return self.arrays.overview(channel, points, start, self.samples if stop is None else stop)

    def window(self, channel: str, start: int, stop: int) -> np.ndarray:
        """Return the values (n,) of ``channel`` from sample ``start`` to before ``stop``.

        Only these are read. Raises ``ValueError`` for a channel that the recording does not have.
        """
        self._check_channel(channel)
        return self.arrays.window(channel, start, stop)

    def until(self, end: float) -> Recording:
        """Return the recording up to ``end`` in s, at least its first sample."""
        samples = max(int(np.searchsorted(self.time, end, side="right")), 1)
        room = None if self.environment is None else self.environment.until(end)
        return replace(self, arrays=self.arrays.shortened(samples), environment=room)

    def _check_channel(self, channel: str) -> None:
        if channel not in self.arrays.names:
            raise ValueError(
                f"{self.path} has no channel {channel!r}; it has {', '.join(self.arrays.names)}"
            )

    @cached_property
    def quiet_samples(self) -> int:
        """Number of samples of the lead-in, at 0 V before the first voltage; 0 for a film."""
        if "voltage_command" not in self.arrays.names:
            return 0
        return self.arrays.lead_in(self.voltage_step)

    @cached_property
    def quiet(self) -> np.ndarray:
        """(N,) True in the lead-in. All False for a film."""
        mask = np.zeros(self.samples, dtype=bool)
        mask[: self.quiet_samples] = True
        mask.setflags(write=False)
        return mask

    @cached_property
    def noise(self) -> ReadingNoise | None:
        """Noise of a reading, in m or Pa, and where it is from; None where it is not known.

        From the first samples only, where there are very many.
        """
        return self.noise_of_valid(None)

    def noise_of_valid(self, valid: np.ndarray | None) -> ReadingNoise | None:
        """Return ``noise`` without the readings that are not ``valid`` (N,)."""
        name = "displacement" if self.kind == "actuator" else "nominal_stress"
        if name not in self.arrays.names:
            return None
        quiet, end = min(self.quiet_samples, NOISE_MAX), min(self.samples, NOISE_MAX)
        # only the lead-in is read where it is enough
        for last in (quiet, end) if quiet >= MIN_QUIET else (end,):
            time, readings = (self.arrays.window(n, 0, last) for n in ("time", name))
            if last < end and takes_few_values(readings[np.isfinite(readings)]):
                continue
            usable = None if valid is None else valid[:last]
            there = np.isfinite(readings)
            if not there.all():
                usable = there if usable is None else usable & there
            found = noise_of_readings(time, readings, quiet, usable)
            if found is not None:
                return found
        return None

    @property
    def noise_floor(self) -> float | None:
        """Standard deviation in m of the displacement about a line through the lead-in.

        None for a film, and for a lead-in of fewer than 20 samples.
        """
        noise = self.noise if self.kind == "actuator" else None
        return noise.value if noise is not None and noise.source == LEAD_IN else None

    def to_xarray(self) -> xarray.Dataset:
        """Return the values as an xarray ``Dataset`` over ``time``, in SI units.

        Every variable has ``units`` (degC for a temperature) and, where there is one, a
        ``long_name``; the attributes of the data set are the metadata. Raises ``InputError``
        where xarray is not installed.
        """
        lib = import_extra("xarray", "notebook", "to_xarray")
        about = {
            "title": self.title, "name": self.name, "kind": self.kind, "film_id": self.film_id,
            "outcome": self.outcome, "start_time": str(self.provenance.get("start_time", "")),
            "average": self.average,
        }  # fmt: skip
        columns = {
            name: ("time", values.copy(), self._attributes(name))
            for name, values in self.values.items()
        }
        coordinate = {"time": columns.pop("time")}
        dataset: xarray.Dataset = lib.Dataset(columns, coords=coordinate, attrs=about)
        return dataset

    def to_pandas(self) -> pandas.DataFrame:
        """Return the values as a pandas ``DataFrame`` whose index is ``time`` in s.

        Columns are in SI units (degC for a temperature); ``.attrs["units"]`` has the unit of each,
        and of ``time``. Raises ``InputError`` where pandas is not installed.
        """
        lib = import_extra("pandas", "notebook", "to_pandas")
        columns = {name: values.copy() for name, values in self.values.items()}
        index = lib.Index(columns.pop("time"), name="time")
        frame: pandas.DataFrame = lib.DataFrame(columns, index=index)
        frame.attrs["average"] = self.average
        frame.attrs["units"] = {name: self.unit(name) for name in self.arrays.names}
        return frame

    @cached_property
    def sha256(self) -> str:
        """SHA-256 of the file, computed on first use."""
        return file_sha256(self.path)


def _filled(time: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return ``values`` (N,) at ``time`` (N,) with lines across those that are NaN."""
    there = ~np.isnan(values)
    return np.where(there, values, np.interp(time, time[there], values[there]))
