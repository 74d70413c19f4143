"""Readings of a recording: what it measured, checked, with its noise, ready to fit."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy  # loads its parts when they are first used, which a run may never do

from dearig.analysis.readings.channels import electric_of
from dearig.analysis.readings.early_ends import choose
from dearig.analysis.readings.opening import Source, open_all
from dearig.analysis.readings.quality import Quality, check_driven, driven_by, inspect
from dearig.analysis.readings.room import moisture_of, warmth_of
from dearig.errors import InputError
from dearig.model.errors import ModelError
from dearig.model.readings.channels import ElectricRecord
from dearig.model.readings.denoise import reading_noise, smoothed
from dearig.model.readings.noise import LEAD_IN, require_readings, rest_of_rounded, slow_at_rest
from dearig.model.readings.records import ActuatorRecord, FilmRecord, Record, interpolated
from dearig.model.simulation.actuator import Drive
from dearig.recording.content.rest_noise import MIN_QUIET, ReadingNoise
from dearig.recording.reading.recording import Recording

__all__ = ["Readings", "noise_texts", "read_all", "recordings_of"]


@dataclass(frozen=True, eq=False)
class Readings:
    """Readings of an open ``recording`` whose film is driven by ``drive``, command or monitor.

    A function that is given paths makes them once, by ``read_all``, and passes them on. Each
    property is computed on first use and kept; it raises ``InputError`` for a recording that cannot
    be used for it. ``is_held``: the voltage is held between the samples, also where the recording
    does not say so.
    """

    recording: Recording
    drive: str = "command"
    is_held: bool = False

    @property
    def name(self) -> str:
        """Name of the recording."""
        return self.recording.name

    @property
    def kind(self) -> str:
        """``actuator`` or ``film``."""
        return self.recording.kind

    @property
    def moved_by(self) -> np.ndarray | None:
        """Drive (N,) of the film: the stretch, or the commanded or monitored voltage in V."""
        return driven_by(self.recording, self.drive)

    @cached_property
    def quality(self) -> Quality:
        """Which readings can be used, and sentences on the others."""
        return inspect(self.recording, self.moved_by)

    @cached_property
    def noise(self) -> ReadingNoise | None:
        """Noise of the readings that can be used, from the lead-in where there is one.

        None where no reading differs from its neighbours.
        """
        valid = self.quality.valid
        return self.recording.noise if valid is None else self.recording.noise_of_valid(valid)

    @cached_property
    def displacement(self) -> np.ndarray:
        """Displacement (N,) in m from the rest state.

        Its zero is the mean of the lead-in; that of coarse readings, which rounding shifts, is the
        most probable one.
        """
        recording = self.recording
        _present(recording.displacement)
        displacement, noise = recording.signal, recording.noise
        if noise is None or not noise.step or not self.lead_in:
            return displacement
        at_rest = displacement[: recording.quiet_samples]
        return displacement - rest_of_rounded(at_rest, noise.step, noise.value)

    @property
    def lead_in(self) -> int:
        """Samples whose mean is the zero of displacement; 0 if they are too few for it."""
        quiet = self.recording.quiet_samples
        return quiet if quiet >= MIN_QUIET else 0

    @property
    def lag(self) -> float:
        """Time in s from the film's motion to its reading, on the clock of the drive.

        A mean of conversions is about the mean of their ticks. The voltage was held for one
        conversion after each tick, so that its mean belongs half a conversion later.
        """
        recording = self.recording
        lag = recording.displacement_delay - recording.displacement_skew
        if recording.average == 1 or recording.samples < 2:
            return lag
        row = recording.duration / (recording.samples - 1)
        return lag + 0.5 * row / recording.average

    @cached_property
    def voltage(self) -> Drive:
        """Voltage that drives the model: the command, or the monitor's reading.

        A voltage that was read is smoothed to remove the reading's noise. The air of the room is
        included where it was recorded: its temperature and humidity above those of the first
        second, as means over a second, and those of the first second.
        """
        recording = self.recording
        voltage = self.moved_by
        warmth, temperature = warmth_of(recording)
        moisture, humidity = moisture_of(recording)
        try:
            volts = _present(voltage)
            noise = reading_noise(volts)
            if noise > 0.0:
                volts = smoothed(volts, noise)
            if recording.average > 1:
                volts = _with_means(volts)
            hold = (self.is_held or recording.hold) and recording.average == 1
            return Drive(recording.time, volts, hold, warmth, moisture, temperature, humidity)
        except ModelError as error:
            raise InputError(f"{recording.path}: {error}") from error

    @cached_property
    def record(self) -> Record:
        """The record that a fit takes.

        Readings that must not be used are masked, and replaced by a line across them. Coarse
        readings at rest are masked as well: all of them are rounded alike, so they say no more than
        their zero.
        """
        try:
            return self._record()
        except ModelError as error:
            raise InputError(f"{self.recording.path}: {error}") from error

    @cached_property
    def electric(self) -> ElectricRecord | None:
        """The voltage monitor and the current; None for a film, and where neither was recorded."""
        if self.kind == "film":
            return None
        displacement = interpolated(self.recording.time, self.displacement, self.quality.valid)
        return electric_of(self.recording, self.voltage, displacement, self.drive)

    def check_driven(self) -> None:
        """Refuse readings under a drive that never changes, to which nothing can be fitted."""
        check_driven(self.recording, self.moved_by)

    def known_noise(self) -> ReadingNoise:
        """Return ``noise``.

        Raises ``ModelError`` for too few readings, and where none differs from its neighbours.
        """
        return _known(self.recording, self.noise)

    def held(self) -> Readings:
        """Return the same readings under a voltage that is held between the samples."""
        held = replace(self, is_held=True)
        # what was found of the samples does not depend on the voltage between them
        found = {name: value for name, value in vars(self).items() if name in _OF_SAMPLES}
        vars(held).update(found)
        return held

    def _record(self) -> Record:
        recording = self.recording
        if recording.kind == "film":
            stretch, stress = _present(recording.stretch), recording.signal
            _known(recording, recording.noise)  # refuses one that never changes
            self.check_driven()
            valid, noise = self.quality.valid, self.known_noise()
            stress = interpolated(recording.time, stress, valid)
            return FilmRecord(recording.name, recording.time, stretch, stress, noise.value, valid)
        displacement = self.displacement
        _known(recording, recording.noise)
        driven = self.voltage
        self.check_driven()
        valid, noise = self.quality.valid, self.known_noise()
        displacement = interpolated(recording.time, displacement, valid)
        if noise.step:
            valid = ~recording.quiet if valid is None else valid & ~recording.quiet
        return ActuatorRecord(
            recording.name,
            driven,
            displacement,
            noise.value,
            self.lag,
            valid,
            self.lead_in,
            means_of=recording.average,
            average=recording.average,
            lag_error=recording.displacement_delay_error,
            rounding=noise.step / math.sqrt(12.0),
            electric=self.electric,
        )


#: Properties of ``Readings`` that depend on the samples alone, not on what is between them.
_OF_SAMPLES = ("quality", "noise", "displacement")


def read_all(
    sources: Sequence[Source | Readings], drive: str = "command", ended_early: str = "keep"
) -> tuple[list[Readings], list[str]]:
    """Return the readings of ``sources``, and a sentence on each recording that is left out.

    Recordings that are given by path are opened; readings that were made before are used as they
    are. ``ended_early`` is keep, cut or leave-out: what is done with recordings whose runs ended
    early. Raises ``InputError`` for those that ``open_all`` refuses.
    """
    made = {id(s.recording): s for s in sources if isinstance(s, Readings)}
    opened = open_all([s.recording if isinstance(s, Readings) else s for s in sources])
    used, said = choose(opened, ended_early)
    return [made.get(id(recording)) or Readings(recording, drive) for recording in used], said


def recordings_of(readings: Iterable[Readings]) -> list[Recording]:
    """Return the recordings of ``readings``."""
    return [each.recording for each in readings]


def _with_means(means: np.ndarray) -> np.ndarray:
    """Return the voltage (N,) at the middles of rows, between which it is linear, with ``means``.

    The mean of such a line over a row, half-way to each neighbour, is (v[-1] + 6 v[0] + v[1])/8.
    The square of the voltage, which pulls, then has the right mean too, to the fourth order.
    """
    bands = np.full((3, means.size), 0.125)
    bands[1] = 0.75
    bands[1, [0, -1]] = 0.875  # beyond the ends it stands still
    return np.asarray(scipy.linalg.solve_banded((1, 1), bands, means))


def noise_texts(readings: Iterable[Readings]) -> list[str]:
    """Return a sentence on each recording of an actuator whose noise is not simply that at rest.

    It is from no lead-in, or something moves there.
    """
    said = []
    for recording in (each.recording for each in readings):
        noise = recording.noise
        if recording.kind != "actuator" or noise is None:
            continue
        if noise.source == LEAD_IN:
            at_rest = slice(0, recording.quiet_samples)
            rest = recording.signal[at_rest]
            slow = slow_at_rest(recording.time[at_rest], rest, noise.value)
            if slow:
                fast = math.sqrt(noise.value**2 - slow**2)
                said.append(
                    f"{recording.name}: the readings at rest move slowly, by {slow * 1e6:.3g} um "
                    f"RMS in addition to a noise of {fast * 1e6:.3g} um: both count as noise, "
                    f"which hides smaller effects"
                )
        else:
            said.append(
                f"{recording.name}: the noise, {noise.value * 1e6:.3g} um, is {noise.words}; fast "
                f"motion counts in it, and the zero of displacement is known to "
                f"{'a part of a step' if noise.step else 'one reading'} only"
            )
    return said


def _known(recording: Recording, noise: ReadingNoise | None) -> ReadingNoise:
    require_readings(recording.signal)
    if noise is None:
        raise ModelError(
            "the signal never changes, or on a straight line only: check that "
            "the sensor was connected and that the right column was imported"
        )
    return noise


def _present(values: np.ndarray | None) -> np.ndarray:
    if values is None:
        raise ModelError("a channel that its kind needs is missing")
    return values
