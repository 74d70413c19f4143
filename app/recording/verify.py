"""Verification of a recording: its data against its checksums, scaling and metadata."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from datetime import UTC, datetime
from itertools import pairwise
from pathlib import Path

import h5py
import numpy as np

from dearig.errors import InputError, Note
from dearig.input_file import why_no_file
from dearig.recording.content.checksums import wrong_blocks
from dearig.recording.content.flushes import flush_notes
from dearig.recording.content.journal import whole_journal
from dearig.recording.content.layout import (
    EVENT_LEVELS,
    SIGNALS,
    TIMING,
    counts_name,
    missing_in,
)
from dearig.recording.content.physical import KELVIN, SLICE, Counts
from dearig.recording.content.provenance import CONTINUES
from dearig.recording.content.pyramid import BINS
from dearig.recording.content.safe import Refused, dataset, group
from dearig.recording.content.superblock import consistency_flags
from dearig.recording.content.text import text_of
from dearig.recording.content.timestamps import compare_clocks, local_time
from dearig.recording.lock import refuse_in_use
from dearig.recording.reading.opening import LOOKS, UNREADABLE, damage, file_state, opened
from dearig.recording.reading.reader import open_recording
from dearig.recording.reading.recording import Recording
from dearig.recording.writing.finish import OVERVIEW

__all__ = ["Verification", "verify"]

#: Relative difference that rounding may cause between two libraries.
ROUNDING = 1e-12
#: Largest relative difference of sample clock and computer's clock, in runs of this many s or more.
CLOCKS_APART, CLOCKS_OVER = 0.01, 10.0
#: Attributes of the time at which a channel is sampled, and of the rest of the displacement.
_REST = ("rest_reading", "rest_samples")
#: Faults of one kind that are listed one by one, at most.
LISTED = 5
_RECOVER = ("recover",)  # the command for it


@dataclass
class Verification:
    """Result of a verification: ``faults`` are contradictions, ``notes`` are information."""

    path: Path
    checked: list[str] = field(default_factory=list)
    faults: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    @property
    def sound(self) -> bool:
        """True if there are no faults."""
        return not self.faults


def verify(path: str | Path) -> Verification:
    """Verify the recording at ``path``; every sample is read.

    A file that changes meanwhile is read again. Raises ``InputError`` if there is no such file, or
    if a run that still records to it leaves it in a state that cannot be judged.
    """
    path = Path(path)
    for _ in range(LOOKS):
        if reason := why_no_file(path):  # also one that vanished while it was read
            raise InputError(f"{path} {reason}")
        before = file_state(path)
        found = _look(path)
        if found.sound:
            return found
        refuse_in_use(path)
        if file_state(path) == before:
            break
    return found


def _look(path: Path) -> Verification:
    found = Verification(path)
    try:
        recording = open_recording(path)
        with opened(path) as file:
            _Check(found, recording, file["entry"]).all()
        _state(found, recording)
    except (InputError, Refused) as error:
        found.faults.append(str(error))
    except UNREADABLE as error:
        found.faults.append(str(damage(path, error)))
    return found


def _state(found: Verification, recording: Recording) -> None:
    if whole_journal(found.path) is not None:
        found.notes.append(
            Note(
                "its last changes are in a journal next to it; recover it to apply them",
                command=_RECOVER,
            )
        )
    elif consistency_flags(found.path):
        found.notes.append(
            Note("it was killed, or is being written; recover it to repair it", command=_RECOVER)
        )
    if not recording.complete:
        found.notes.append(f"the run is incomplete: {recording.outcome}")
    faults = [e for e in recording.events if e.level == "fault"]
    found.notes += [f"fault at sample {e.sample} ({e.time:.6g} s): {e.message}" for e in faults]


class _Check:
    def __init__(self, found: Verification, recording: Recording, entry: h5py.Group) -> None:
        self.found = found
        self.recording = recording
        self.entry = entry
        self.data: h5py.Group = entry["data"]
        self.samples = recording.samples
        self.finished = "samples" in entry.attrs

    def all(self) -> None:
        self.stored()
        if self.recording.channels:
            counts = Counts(self.entry, self.samples)
            self.counts_shapes()
            self.timing()
            self.checksums(counts)
            self.pyramid(counts)
            self.physical(counts)
            self.long_overview(counts)
            self.wall_clock()
            self.environment()
        self.events()
        self.provenance()
        self.for_viewers()

    def fault(self, sentence: str) -> None:
        self.found.faults.append(sentence)

    def done(self, what: str) -> None:
        self.found.checked.append(what)

    def slices(self) -> Iterator[tuple[int, int]]:
        for start in range(0, self.samples, SLICE):
            yield start, min(start + SLICE, self.samples)

    def span(self, start: int, stop: int) -> str:
        return f"samples {start} to {stop - 1}"

    def stored(self) -> None:
        """Check that every stored value can be read: HDF5 checks each chunk's checksum."""
        arrays = self.recording.arrays
        for name in arrays.stored:
            before, gaps = -np.inf, 0
            missing = missing_in(self.data[name])
            for start, stop in self.slices():
                try:
                    values = self.data[name][start:stop]
                except (OSError, RuntimeError):
                    self.fault(
                        f"/entry/data/{name}: {self.span(start, stop)} cannot be read: a checksum "
                        f"is wrong"
                    )
                    break
                if name == "time":
                    if values[0] <= before or (np.diff(values) <= 0.0).any():
                        self.fault(f"time does not increase in {self.span(start, stop)}")
                        break
                    before = values[-1]
                    continue
                if missing:
                    gaps += int(np.count_nonzero(np.isnan(values)))
                    values = values[~np.isnan(values)]
                if name != "displacement_model" and not np.isfinite(values).all():
                    self.fault(
                        f"/entry/data/{name} has values that are not finite in "
                        f"{self.span(start, stop)}"
                    )
                    break
            else:
                if gaps != missing:
                    self.fault(
                        f"/entry/data/{name} says that {missing} readings are missing, and {gaps} "
                        f"are"
                    )
                elif gaps:
                    self.found.notes.append(
                        f"{gaps} of {self.samples} readings of /entry/data/{name} are missing"
                    )
        if arrays.stored:
            self.done(f"{len(arrays.stored)} arrays of stored values, {self.samples} samples each")

    def counts_shapes(self) -> None:
        claimed = int(self.entry.attrs.get("samples", self.samples))
        if not self.finished and "time" in self.data:
            self.fault("/entry has physical values, but no number of samples")
        there = {c.name: self.data[counts_name(c.name)].shape[0] for c in self.recording.channels}
        if self.finished:
            for name, many in there.items():
                if many != self.samples:
                    self.fault(f"{name} has {many} counts, not {self.samples}")
        elif max(there.values()) > self.samples:
            self.found.notes.append(
                f"samples after {self.samples - 1} are left out: the run ended while they were "
                f"being written, and not all of them have reached the disk"
            )
        if claimed != self.samples:
            self.fault(f"/entry claims {claimed} samples and holds {self.samples}")
        expected, outcome = self.recording.samples_expected, self.recording.outcome
        if outcome == "finished" and expected is not None and expected != self.samples:
            self.fault(
                f"the outcome is finished, but there are only {self.samples} of {expected} samples"
            )
        self.done(
            f"number of samples: {self.samples} in each of {len(self.recording.channels)} channels"
        )

    def timing(self) -> None:
        """Check that the times of each channel are possible, and are those of its counts."""
        for channel in self.recording.channels:
            raw = self.data[counts_name(channel.name)]
            for key in TIMING:
                value = float(raw.attrs.get(key, 0.0))
                if not 0.0 <= value < np.inf:
                    self.fault(f"{raw.name}: {key} = {value:g} is impossible")
            if channel.name not in self.data:
                if self.finished and "time" in self.recording.arrays.stored:
                    self.fault(f"/entry/data/{channel.name} is missing")
                continue
            values = self.data[channel.name]
            for key in (*TIMING, *_REST):
                if key in values.attrs and values.attrs[key] != raw.attrs.get(key):
                    self.fault(
                        f"{values.name}: {key} = {values.attrs[key]:g}, and its counts have "
                        f"{raw.attrs.get(key)}"
                    )
        self.done("the times of the channels")

    def checksums(self, counts: Counts) -> None:
        if dataset(self.entry, "checksums") is None:
            self.found.notes.append("its counts have no checksums: an earlier version wrote it")
            return
        compared, wrong = wrong_blocks(self.entry, self.samples, counts.raw)
        for channel, start, stop in wrong[:LISTED]:
            name = counts.channels[channel].name
            self.fault(
                f"the counts of {name} are not those that were written: {self.span(start, stop)} "
                f"({start / counts.rate:.6g} to {stop / counts.rate:.6g} s) have another checksum"
            )
        if len(wrong) > LISTED:
            self.fault(f"{len(wrong) - LISTED} more blocks of counts have another checksum")
        if compared < self.samples:
            rest = f"the last {self.samples - compared} samples have no checksum"
            if self.finished:
                self.fault(rest)
            else:
                self.found.notes.append(f"{rest} yet: the run was killed before it was written")
        self.done(f"checksums of the counts of {compared} samples")

    def pyramid(self, counts: Counts) -> None:
        stored = group(self.entry, "pyramid")
        if stored is None:
            return
        for size in BINS:
            level = stored[f"bins_of_{size}"]
            if int(level.attrs.get("bin_samples", size)) != size:
                self.fault(f"{level.name} claims bins of {level.attrs['bin_samples']} samples")
            rows = min(level.shape[0], self.samples // size)
            if self.finished and level.shape[0] != self.samples // size:
                self.fault(
                    f"/entry/pyramid has {level.shape[0]} bins of {size} samples, not "
                    f"{self.samples // size}"
                )
            # about one slice of samples at a time, whatever the width of the bins
            step = max(SLICE // size, 1)
            for first in range(0, rows, step):
                last = min(first + step, rows)
                raw = counts.raw(first * size, last * size)
                binned = raw.reshape(raw.shape[0], last - first, size)
                ends = np.stack((binned.min(axis=2).T, binned.max(axis=2).T), axis=2)
                if not np.array_equal(ends, level[first:last]):
                    self.fault(
                        f"/entry/pyramid does not agree with the counts in "
                        f"{self.span(first * size, last * size)} (bins of {size})"
                    )
                    break
        self.done("minima and maxima of the counts over bins")

    def physical(self, counts: Counts) -> None:
        stored = [n for n in counts.names if n in self.recording.arrays.stored]
        for name in stored:
            for start, stop in self.slices():
                try:
                    there = self.data[name][start:stop]
                except (OSError, RuntimeError):
                    break  # stored() reports it
                expected = counts.window(name, start, stop)
                off = np.abs(there - expected)
                scale = np.abs(expected).max(initial=0.0) + abs(counts.rest.reading)
                if not (off <= ROUNDING * scale).all():
                    at = start + int(np.argmax(~(off <= ROUNDING * scale)))
                    self.fault(
                        f"/entry/data/{name} does not agree with its counts: "
                        f"{there[at - start]:.9g} at sample {at}, not {expected[at - start]:.9g}"
                    )
                    break
        if CONTINUES not in self.recording.provenance:
            self.rest(counts)
        if stored:
            self.done("stored values against counts and scaling")

    def rest(self, counts: Counts) -> None:
        """Check the reading that displacement is counted from against the lead-in."""
        found = Counts(self.entry, self.samples).measured_rest()
        rest = counts.rest
        if abs(found.reading - rest.reading) > 1e-9 * abs(found.reading) + 1e-15:
            self.fault(
                f"displacement is counted from {rest.reading:.9g} m, and the sensor's mean over "
                f"the lead-in is {found.reading:.9g} m"
            )
        if self.finished and found.samples != rest.samples:
            self.fault(
                f"displacement claims a lead-in of {rest.samples} samples, and the voltage has one "
                f"of {found.samples}"
            )

    def long_overview(self, counts: Counts) -> None:
        shown = group(self.entry, "overview")
        if shown is None:
            return
        for name in counts.names:
            if name == "time":
                continue
            _, low, high = counts.overview(name, 0, self.samples, OVERVIEW)
            there = shown[name][()]
            both = np.stack((low, high), axis=1).reshape(-1)
            if there.shape != both.shape or not np.allclose(there, both, rtol=1e-9, atol=1e-15):
                self.fault(f"/entry/overview/{name} does not agree with the counts")
        self.done("the overview for viewers")

    def wall_clock(self) -> None:
        notes = flush_notes(self.entry)
        if notes is None:
            return
        claimed = self.entry["wall_clock"].shape[0]
        if not self.finished:
            notes = notes[notes["sample"] <= self.samples]  # their samples are left out too
        elif notes.size != claimed:
            self.fault(f"/entry/wall_clock has {claimed} rows, of which {notes.size} are filled")
        at, moments = notes["sample"], notes["unix_time"]
        if (np.diff(at) < 0).any() or (at.size and not 0 <= at[0] <= at[-1] <= self.samples):
            self.fault("/entry/wall_clock has sample numbers that go back, or that do not exist")
            return
        if not (np.isfinite(moments) & (moments > 0.0)).all():
            self.fault("/entry/wall_clock has times that are impossible")
            return
        if self.recording.complete and at.size and int(at[-1]) != self.samples:
            self.fault(
                f"/entry/wall_clock ends at sample {at[-1]}, and the run at sample {self.samples}"
            )
        self.start_of_clock(moments)
        if (np.diff(moments) < 0.0).any():
            self.found.notes.append("the computer's clock was set back during the run")
        elif at.size > 1 and not self.recording.provenance.get("simulated", False):
            # the first row was written before the run started
            self.rate_of_clock(at[1:], moments[1:])
        self.done("the sample clock against the computer's clock")

    def environment(self) -> None:
        """Check the readings of a thermo-hygrometer: their order, and that they are possible."""
        readings = self.recording.environment
        if readings is None:
            return
        claimed = self.entry["environment"].shape[0]
        if self.finished and claimed != readings.sample.size:
            self.fault(
                f"/entry/environment has {claimed} rows, of which {readings.sample.size} are filled"
            )
        at = readings.sample
        if (np.diff(at) < 0).any() or at[0] < 0 or (self.finished and at[-1] > self.samples):
            self.fault("/entry/environment has sample numbers that go back, or that do not exist")
        celsius, percent = readings.temperature_degC, readings.relative_humidity_percent
        if (celsius < -KELVIN).any() or (percent < 0.0).any() or np.isinf([celsius, percent]).any():
            self.fault("/entry/environment has values that no room has")
        self.done(f"{at.size} readings of temperature and humidity")

    def start_of_clock(self, moments: np.ndarray) -> None:
        """Check that the clock's first time is the start of the run; both were read at once."""
        started = self.moment("start_time")
        if started is not None and moments.size:
            apart = float(moments[0]) - started.timestamp()
            if abs(apart) > 1.0:
                self.fault(
                    f"/entry/start_time is {started.isoformat()}, and the computer's clock said "
                    f"{datetime.fromtimestamp(float(moments[0]), UTC).isoformat()} then"
                )

    def rate_of_clock(self, at: np.ndarray, moments: np.ndarray) -> None:
        rate = self.recording.rate
        if rate is None:
            return
        clocks = compare_clocks(at, moments, rate)
        if clocks.step:
            self.found.notes.append(
                f"the computer's clock was set {'forward' if clocks.step > 0.0 else 'back'} by "
                f"{_duration(abs(clocks.step))} during the run, or the computer slept, at sample "
                f"{clocks.step_sample} ({clocks.step_sample / rate:.4g} s); the sample clock is "
                f"not affected"
            )
        took, counted = clocks.computer, clocks.counted
        if took >= CLOCKS_OVER and abs(counted - took) > CLOCKS_APART * took:
            self.fault(
                f"the sample clock counted {counted:.6g} s and the computer's clock {took:.6g} s: "
                f"rate_Hz is wrong, or samples are missing"
            )

    def moment(self, name: str) -> datetime | None:
        """Return the time ``name`` in /entry; None where there is none or it cannot be read."""
        try:
            return datetime.fromisoformat(text_of(self.entry[name][()]))
        except (KeyError, ValueError):
            return None

    def events(self) -> None:
        rate, events = self.recording.rate, self.recording.events
        rows = dataset(self.entry, "events")
        if rows is None:
            if self.recording.channels and self.finished:
                self.fault("/entry/events is missing")
        elif rows.ndim != 1 or (self.finished and rows.shape[0] != len(events)):
            self.fault(f"/entry/events claims {rows.shape} events and holds {len(events)}")
        unnamed = [event.level for event in events if event.level not in EVENT_LEVELS]
        if unnamed and self.finished:
            self.fault(
                f"{len(unnamed)} of {len(events)} events are empty, or have a level that is none "
                f"of {', '.join(EVENT_LEVELS)}"
            )
        planned = max(self.samples, self.recording.samples_expected or 0)
        for event in events:
            where = f"the event {event.message[:60]!r}"
            if not 0 <= event.sample <= self.samples:
                # a kill can lose the samples of a block and leave its events
                lost = not self.recording.complete and 0 <= event.sample <= planned
                say = self.found.notes.append if lost else self.fault
                say(f"{where} is at sample {event.sample}, which does not exist")
            elif rate is not None and not abs(event.time - event.sample / rate) <= 1e-6 / rate:
                self.fault(
                    f"{where} is at {event.time:.9g} s, and its sample {event.sample} at "
                    f"{event.sample / rate:.9g} s"
                )
        self.done(f"{len(events)} events")

    def provenance(self) -> None:
        noted = self.recording.provenance
        if "configuration" in noted and "configuration_sha256" in noted:
            digest = hashlib.sha256(str(noted["configuration"]).encode()).hexdigest()
            if digest != noted["configuration_sha256"]:
                self.fault(
                    "/entry/provenance: the configuration does not have the SHA-256 stored with it"
                )
            self.done("the configuration's SHA-256")
        said = self.moment("start_time")
        started = noted.get("start_time")
        if said is not None and started not in (None, "", text_of(self.entry["start_time"][()])):
            self.fault(
                f"/entry/provenance says that the run started at {started}, and /entry at "
                f"{said.isoformat()}"
            )
        moments = [
            text_of(self.entry[n][()]) for n in ("start_time", "end_time") if n in self.entry
        ]
        try:
            times = [datetime.fromisoformat(moment) for moment in moments]
        except ValueError:
            self.fault(f"/entry: one of {', '.join(moments)} is not a time")
            return
        if any(later < earlier for earlier, later in pairwise(times)):
            self.found.notes.append(
                f"it ended at {local_time(moments[1])}, before its start at "
                f"{local_time(moments[0])}"
            )

    def for_viewers(self) -> None:
        """Check the attributes that lead a NeXus viewer to the default plot."""
        shown = text_of(self.entry.attrs.get("default", ""))
        plot = group(self.entry, shown) if shown else None
        if plot is None:
            self.fault(f"/entry names {shown!r} as its default plot, which does not exist")
            return
        if not self.finished and self.recording.channels:
            return  # a killed run has no plot until it is recovered
        signal = text_of(plot.attrs.get("signal", ""))
        if signal != SIGNALS[self.recording.kind] or signal not in plot or "time" not in plot:
            self.fault(f"{plot.name} has no plot of {SIGNALS[self.recording.kind]} over time")
        elif plot[signal].shape != plot["time"].shape:
            self.fault(f"{plot.name}: {signal} and time have different lengths")
        else:
            self.dimension_scales()
        self.done("the default plot")

    def dimension_scales(self) -> None:
        """Check that ``time`` is the scale of every array; files of earlier versions have none."""
        for plot in (self.data, group(self.entry, "overview")):
            if plot is None or "time" not in plot or not plot["time"].is_scale:
                continue
            for name, row in plot.items():
                if name == "time" or row.shape != plot["time"].shape:
                    continue
                scales = list(row.dims[0].values())
                if scales != [plot["time"]]:
                    self.fault(f"the dimension scale of {row.name} is not time")


def _duration(seconds: float) -> str:
    """Return a duration in the unit in which it is a number of few digits: 24 h, 3.5 s."""
    units = ((2.0 * 86_400.0, 86_400.0, "days"), (7200.0, 3600.0, "h"), (120.0, 60.0, "min"))
    of, unit = next(((of, unit) for least, of, unit in units if seconds >= least), (1.0, "s"))
    return f"{seconds / of:.4g} {unit}"
