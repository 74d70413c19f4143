"""Physical values computed from the counts of a run, for any range of samples."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import h5py
import numpy as np

from dearig.drivers.channels import CHANNEL_NAMES, Channel, Scaling
from dearig.errors import InputError
from dearig.recording.content.flushes import flush_notes
from dearig.recording.content.layout import UNITS, counts_name, declared_channels
from dearig.recording.content.pyramid import levels, reduced
from dearig.recording.content.rest_noise import NEGLIGIBLE
from dearig.recording.content.safe import PACKED_MAX
from dearig.recording.content.text import fixed, text_of

__all__ = [
    "KELVIN",
    "SLICE",
    "TEMPERATURE_UNITS",
    "Counts",
    "Rest",
    "average_of",
    "read_channels",
    "resolution",
    "sample_count",
    "write_average",
    "write_channel",
]

#: Units in which a rig may give its temperature; recordings hold degrees Celsius.
TEMPERATURE_UNITS = ("degC", "°C", "C", "K")
KELVIN = 273.15
#: Samples processed at a time, so that memory does not grow with the length of the run.
SLICE = 2**20
#: Chunks at the end that are checked one by one: more than any flush writes.
BACK = 8
#: Samples of the lead-in that are averaged, at most: more add no accuracy.
REST_MAX = 2**22


@dataclass(frozen=True)
class Rest:
    """``reading`` m, the sensor's mean over the ``samples`` of the lead-in."""

    reading: float
    samples: int


def write_channel(counts: h5py.Dataset, channel: Channel, place: int) -> None:
    """Write the attributes that are needed to read a dataset of counts without this program.

    ``place`` is the index of the channel in a block.
    """
    attrs = counts.attrs
    attrs["units"] = fixed("counts")
    attrs["physical_units"] = fixed(channel.unit)
    attrs["scaling"] = fixed("offset + gain * (coefficients[0] + coefficients[1]*counts + ...)")
    attrs["coefficients"] = np.asarray(channel.scaling.coefficients, dtype=np.float64)
    attrs["gain"] = float(channel.scaling.gain)
    attrs["offset"] = float(channel.scaling.offset)
    attrs["skew_s"] = float(channel.skew)
    attrs["delay_s"] = float(channel.delay)
    attrs["delay_error_s"] = float(channel.delay_error)
    if channel.name not in CHANNEL_NAMES:
        attrs["declared"] = place
        attrs["label"] = fixed(channel.label)


def read_channels(data: h5py.Group) -> tuple[Channel, ...]:
    """Return the channels whose counts are in /entry/data, in the order of the blocks."""
    found = []
    for name in (*CHANNEL_NAMES, *declared_channels(data)):
        if counts_name(name) not in data:
            continue
        attrs = data[counts_name(name)].attrs
        coefficients = tuple(float(c) for c in np.atleast_1d(attrs["coefficients"]))
        found.append(
            Channel(
                name=name,
                unit=text_of(attrs["physical_units"]),
                scaling=Scaling(coefficients, float(attrs["gain"]), float(attrs["offset"])),
                skew=float(attrs["skew_s"]),
                delay=float(attrs["delay_s"]),
                delay_error=float(attrs.get("delay_error_s", 0.0)),
                label=text_of(attrs.get("label", "")),
            )
        )
    return tuple(found)


def sample_count(data: h5py.Group, channels: Sequence[Channel]) -> int:
    """Return the number of samples of a run; if it was not closed, up to its last complete flush.

    After a kill some channels can be one block ahead of others. After a full disk there can be
    space for samples that were never written, which HDF5 reads as zeros.
    """
    there = min((_backed(data[counts_name(c.name)]) for c in channels), default=0)
    notes = None if _closed(data) else flush_notes(data.parent)
    if notes is None:
        return there
    return int(max((n for n in notes["sample"] if n <= there), default=0))


def _closed(data: h5py.Group) -> bool:
    return "samples" in data.parent.attrs


def _backed(counts: h5py.Dataset) -> int:
    """Return the number of samples of ``counts`` whose chunks are in the file.

    HDF5 goes on writing when the disk refuses a chunk, so a dataset can claim more than is stored.
    """
    claimed = int(counts.shape[0])
    filtered = counts.id.get_create_plist().get_nfilters() > 0
    most = counts.id.get_storage_size() * (PACKED_MAX if filtered else 1)
    claimed = min(claimed, int(most // counts.dtype.itemsize))
    if counts.chunks is None or _closed(counts.parent):
        return claimed
    chunk = int(counts.chunks[0])
    last = -(-claimed // chunk)
    for i in range(last - 1, max(last - BACK, 0) - 1, -1):
        if not _readable(counts, i * chunk):
            claimed = i * chunk
    return claimed


def _readable(counts: h5py.Dataset, at: int) -> bool:
    """Return True if the chunk with sample ``at`` is in the file and can be read."""
    if counts.id.get_chunk_info_by_coord((at,)).byte_offset is None:
        return False
    try:
        # reading one value reads the whole chunk
        counts[at]
    except (OSError, RuntimeError):
        return False
    return True


def resolution(channel: Channel, average: int = 1) -> float:
    """Return the converter's step in the channel's unit, whose counts are sums of ``average``."""
    ends = channel.scaling.physical(np.array([0, average]))
    return float(abs(ends[1] - ends[0]))


def average_of(data: h5py.Group) -> int:
    """Return the number of conversions whose mean is one row of /entry/data.

    Raises ``InputError`` for what is not a whole number of 1 or more.
    """
    value = data.attrs.get("average", 1)
    if not isinstance(value, int | np.integer) or value < 1:
        raise InputError(
            f"{data.file.filename}: average of /entry/data is {value!r}, not a whole number of 1 "
            f"or more"
        )
    return int(value)


def write_average(data: h5py.Group, average: int, conversion_rate: float | None = None) -> None:
    """Note in /entry/data that rows are means of ``average`` conversions, unless it is 1."""
    if average > 1:
        data.attrs["average"] = average
        if conversion_rate is not None:
            data.attrs["conversion_rate_Hz"] = conversion_rate


class Counts:
    """The counts in an open ``entry``, as physical values.

    Displacement is measured from the mean reading over the lead-in at 0 V, or from the first
    reading of a run that has none.
    """

    def __init__(
        self,
        entry: h5py.Group,
        samples: int | None = None,
        rest: Rest | None = None,
        channels: tuple[Channel, ...] | None = None,
    ) -> None:
        self._entry = entry
        self.data: h5py.Group = entry["data"]
        self.channels = read_channels(self.data) if channels is None else channels
        self.rate = float(self.data.attrs["rate_Hz"])
        self.average = average_of(self.data)
        # time of the first row in rows: a row's time is the mean of its ticks
        self._first = 0.5 * (1.0 - 1.0 / self.average)
        self.samples = sample_count(self.data, self.channels) if samples is None else samples
        self._by_name = {c.name: c for c in self.channels}
        self._rest = rest

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the values, ``time`` among them, in the order of the layout."""
        known = tuple(n for n in UNITS if n == "time" or n in self._by_name)
        return (*known, *(n for n in self._by_name if n not in UNITS))

    def described(self, name: str) -> tuple[str, str]:
        """Return unit and label of ``name`` as its counts say them; empty for ``time``."""
        channel = self._by_name.get(name)
        return ("", "") if channel is None else (channel.unit, channel.label)

    @property
    def rest(self) -> Rest:
        """Rest from which displacement is measured: the stored one, else from the lead-in."""
        if self._rest is None:
            self._rest = self._stored_rest() or self.measured_rest()
        return self._rest

    def _stored_rest(self) -> Rest | None:
        if "displacement" not in self._by_name:
            return Rest(0.0, 0)
        attrs = self.data[counts_name("displacement")].attrs
        if "rest_reading" not in attrs:
            return None
        return Rest(float(attrs["rest_reading"]), int(attrs["rest_samples"]))

    def measured_rest(self) -> Rest:
        """Return the mean over the lead-in, also where another rest is stored."""
        if not self.samples or not {"voltage_command", "displacement"} <= self._by_name.keys():
            return Rest(0.0, 0)
        quiet = self.lead_in()
        readings = self._reading("displacement", 0, min(max(quiet, 1), REST_MAX))
        return Rest(float(readings.mean()), quiet)

    def lead_in(self) -> int:
        """Count the samples at 0 V at the start, as ``rest_noise.lead_in`` of the whole voltage."""
        channel = self._by_name["voltage_command"]
        low, high = self.extremes("voltage_command", 0, self.samples, 2000)[1:]
        largest = float(np.maximum(np.abs(low), np.abs(high)).max(initial=0.0))
        threshold = max(resolution(channel, self.average), NEGLIGIBLE * largest)
        for start, stop in self.slices():
            # for most slices of a lead-in the extremes are enough
            _, low, high = self.extremes("voltage_command", start, stop, 1)
            if float(np.maximum(np.abs(low), np.abs(high)).max()) > threshold:
                loud = np.abs(self._reading("voltage_command", start, stop)) > threshold
                return start + int(np.argmax(loud))
        return self.samples

    def slices(self) -> Iterator[tuple[int, int]]:
        """Yield start and stop of each slice of the run."""
        for start in range(0, self.samples, SLICE):
            yield start, min(start + SLICE, self.samples)

    def raw(self, start: int, stop: int) -> np.ndarray:
        """Return the counts (channels, n) of the samples from ``start`` to before ``stop``."""
        return np.array([self.data[counts_name(c.name)][start:stop] for c in self.channels])

    def window(self, name: str, start: int, stop: int) -> np.ndarray:
        """Return the values (n,) of ``name`` from sample ``start`` to before ``stop``."""
        if name == "time":
            return (np.arange(start, stop) + self._first) / self.rate
        values = self._reading(name, start, stop)
        return values - self.rest.reading if name == "displacement" else values

    def conversion(self, name: str) -> Callable[[np.ndarray], np.ndarray]:
        """Return the function that makes values (n,) of ``name`` from its counts (n,).

        The values of 16 bits come from a table: it costs a tenth, and gives the same bits.
        """
        rest = self.rest.reading if name == "displacement" else 0.0

        def values(counts: np.ndarray) -> np.ndarray:
            return self._scaled(name, counts) - rest

        if self.data[counts_name(name)].dtype.itemsize > 2:
            return values
        table = values(np.arange(2**16).astype(np.uint16).view(np.int16))
        return lambda counts: table[counts.astype(np.uint16)]

    def _reading(self, name: str, start: int, stop: int) -> np.ndarray:
        return self._scaled(name, self.data[counts_name(name)][start:stop])

    def _scaled(self, name: str, counts: np.ndarray) -> np.ndarray:
        channel = self._by_name[name]
        values = channel.scaling.physical(counts)
        return values - KELVIN if name == "temperature" and channel.unit == "K" else values

    def extremes(
        self, name: str, start: int, stop: int, points: int
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return first sample, minimum and maximum (n,) of at most about ``points`` bins.

        Displacements are readings, not counted from the rest. The stored levels make this as fast
        for hours as for seconds.
        """
        counts = self.data[counts_name(name)]
        span = max(stop - start, 0)
        found = levels(self._entry, self.samples)
        size = max((s for s in found if span >= points * s), default=1)
        first, last = -(-start // size), stop // size
        if size == 1 or first >= last:
            raw = counts[start:stop]
            at, low, high = np.arange(start, stop), raw, raw
        else:
            place = self.channels.index(self._by_name[name])
            rows = found[size][first:last, place, :]
            parts = [(np.arange(first, last) * size, rows[:, 0], rows[:, 1])]
            # the samples before the first full bin, and after the last
            for a, b, where in ((start, first * size, 0), (last * size, stop, 2)):
                if b > a:
                    raw = counts[a:b]
                    ends = (np.array([a]), raw.min(keepdims=True), raw.max(keepdims=True))
                    parts.insert(where, ends)
            at, low, high = (np.concatenate(column) for column in zip(*parts, strict=True))
        if at.size > points:
            at = at[(np.arange(points) * at.size) // points]
        low, high = reduced(low, high, points)
        one, two = self._scaled(name, low), self._scaled(name, high)
        return at, np.minimum(one, two), np.maximum(one, two)

    def overview(
        self, name: str, start: int, stop: int, points: int
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return time in s, minimum and maximum (n,) of at most about ``points`` bins."""
        at, low, high = self.extremes(name, start, stop, points)
        rest = self.rest.reading if name == "displacement" else 0.0
        return (at + self._first) / self.rate, low - rest, high - rest
