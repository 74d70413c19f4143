"""Layout of a recording file: names, units and types.

/                       format, default="entry"
/entry                  NXentry: format, kind, complete, outcome, samples, default="data"
                        after a run: output_state (confirmed, commanded, unknown), with
                        output_state_time, output_set_by (run, guardian), output_monitor_V
/entry/title, start_time, end_time
/entry/entry_identifier_uuid   identifies the recording, whatever its file is called
/entry/data             NXdata: time, the physical values, and their counts as NAME_counts (int16);
                        where rows are means of several conversions, the attributes average and
                        conversion_rate_Hz, and the counts are sums over a row (int32), whose
                        scaling contains the division
                        also of the channels that the rig file declares, by their names; while a
                        run is going on its signal is displacement_counts, and there are no axes
                        readings that an imported file did not have are NaN, counted by the
                        attribute missing of their row; time and the drive have none
/entry/instrument/*     one NXinstrument for each instrument, with its settings as an attribute;
                        channels/NAME links to the counts
/entry/sample           NXsample: film and load
/entry/sequence         TOML (runs only)
/entry/model            TOML of the live overlay (when there was one)
/entry/events           sample, time, level, message
/entry/wall_clock       sample, unix_time: the computer's clock at every flush (runs only)
/entry/environment      sample, unix_time, temperature (degC), relative_humidity (%): readings of a
                        thermo-hygrometer, NaN where it gave none (runs with one only); the means
                        of a run are attributes of /entry: temperature_degC, and
                        relative_humidity_percent
/entry/pyramid/*        minima and maxima of the counts over bins (runs only)
/entry/checksums        CRC-32 of the counts (runs only)
/entry/event, checksum_block, checksum_channel   dimension scales of these tables, which number
                        their rows and columns; after a run
/entry/time             the same dataset as /entry/data/time, after a run: readers of netCDF look
                        for the dimension of a linked row in the groups above it only
/entry/overview         NXdata: minima and maxima of the physical values of a long run
/entry/provenance       versions, configuration and its hash, seed, host, operator
                        of a hold also feedback (TOML)
"""

from __future__ import annotations

import uuid
from datetime import UTC, datetime
from types import MappingProxyType

import h5py
import numpy as np

from dearig.drivers.channels import BAND_ENDINGS
from dearig.recording.content.text import fixed, put_text, text_of

__all__ = [
    "AVERAGE_COLUMN",
    "DRIVING",
    "ENVIRONMENT_TYPE",
    "EVENT_LEVELS",
    "EVENT_TYPE",
    "FORMAT",
    "FORMAT_NAME",
    "IDENTIFIER",
    "KINDS",
    "LIBVER",
    "LINEAR",
    "MESSAGE_BYTES",
    "MISSING",
    "PRESENT_MIN",
    "REQUIRED",
    "SIGNALS",
    "TIMING",
    "UNITS",
    "WALL_CLOCK_TYPE",
    "ZERO_ORDER",
    "attach_time",
    "counts_name",
    "counts_type",
    "create_field",
    "declared_channels",
    "describe_field",
    "iso_time",
    "lay_out",
    "make_own_scale",
    "missing_in",
    "name_dimensions",
    "show_plot",
    "variable_attributes",
]

FORMAT_NAME = "dearig-recording"
FORMAT = f"{FORMAT_NAME}/1"

#: The only library version with which a file survived a kill at every write boundary in tests.
LIBVER = ("v110", "v110")

#: Samples in a chunk of physical values, at most.
CHUNK = 2**17

#: The two kinds: a film driven by voltage, and a film specimen driven by stretch.
KINDS = ("actuator", "film")

#: Measured quantity of each kind: the default plot, and the target of a model.
SIGNALS = MappingProxyType({"actuator": "displacement", "film": "nominal_stress"})

#: Values without which a sample tells nothing: none of them is ever missing.
DRIVING = frozenset({"time", "voltage_command", "stretch"})

#: Values that a recording of each kind must have.
REQUIRED = MappingProxyType(
    {
        "actuator": ("time", "displacement", "voltage_command"),
        "film": ("time", "stretch", "nominal_stress"),
    }
)

_BAND_NAMES = {
    "low95": "lower end of the 95 % band",
    "high95": "upper end of the 95 % band",
    "sd_parameters": "standard deviation, part of the parameters",
    "sd_noise": "standard deviation, part of the noise",
    "sd_law": "standard deviation, part of the law",
}

#: Units of the physical values under /entry/data.
UNITS = MappingProxyType(
    {
        "time": "s",
        "displacement": "m",
        "voltage_command": "V",
        "voltage_monitor": "V",
        "current_monitor": "A",
        "temperature": "degC",
        "displacement_model": "m",
        "stretch": "1",
        "nominal_stress": "Pa",
        **{f"displacement_{end}": "m" for end in BAND_ENDINGS},
        **{f"nominal_stress_{end}": "Pa" for end in BAND_ENDINGS},
    }
)

LONG_NAMES = MappingProxyType(
    {
        "displacement": "displacement from the loaded rest state",
        "voltage_command": "voltage at the film, commanded",
        "voltage_monitor": "voltage at the film, monitored",
        "current_monitor": "current, monitored",
        "displacement_model": "displacement, live model",
        "nominal_stress": "nominal stress",
        **{
            f"{signal}_{end}": f"{signal.replace('_', ' ')}, {name}"
            for signal in SIGNALS.values()
            for end, name in _BAND_NAMES.items()
        },
    }
)

#: Name of the recording's identifier in /entry, as NeXus has it.
IDENTIFIER = "entry_identifier_uuid"

#: Attributes of a row: skew, delay and the error of the delay, in s.
TIMING = ("skew_s", "delay_s", "delay_error_s")

#: Attribute of a row: how many of its readings are missing, which are NaN; absent where none is.
MISSING = "missing"
#: Readings of such a row that are not missing, at least: a line across the gaps has two ends.
PRESENT_MIN = 2

#: Column of an exported table without metadata: conversions whose mean each row is, if several.
AVERAGE_COLUMN = "conversions_per_row"

#: Interpolation of the voltage between samples: a converter holds it, imported data are linear.
ZERO_ORDER, LINEAR = "zero-order", "linear"

EVENT_LEVELS = ("info", "warning", "fault")
MESSAGE_BYTES = 480
EVENT_TYPE = np.dtype(
    [
        ("sample", "<i8"),
        ("time", "<f8"),
        ("level", h5py.string_dtype("utf-8", 8)),
        ("message", h5py.string_dtype("utf-8", MESSAGE_BYTES)),
    ]
)

#: The computer's clock and the sample clock: number of samples at a Unix time in s.
WALL_CLOCK_TYPE = np.dtype([("sample", "<i8"), ("unix_time", "<f8")])

#: A reading of a thermo-hygrometer before a sample: Unix time in s, degrees Celsius, per cent.
ENVIRONMENT_TYPE = np.dtype(
    [
        ("sample", "<i8"),
        ("unix_time", "<f8"),
        ("temperature", "<f8"),
        ("relative_humidity", "<f8"),
    ]
)


def counts_name(channel: str) -> str:
    """Return the name of the raw counts of ``channel``."""
    return f"{channel}_counts"


def counts_type(average: int) -> np.dtype:
    """Return the type of the counts of a run whose rows are means of ``average`` conversions.

    The sum of several counts takes 32 bits; that of one is the count, as the converter gave it.
    """
    return np.dtype("<i2" if average == 1 else "<i4")


def iso_time(moment: float) -> str:
    """Return the Unix time ``moment`` in s as ISO 8601 in UTC."""
    return datetime.fromtimestamp(moment, tz=UTC).isoformat(timespec="milliseconds")


def declared_channels(data: h5py.Group) -> dict[str, tuple[str, str]]:
    """Return unit and label of the channels in /entry/data that the rig file declared, by name.

    Their counts, or their values where there are none, have an attribute ``declared`` with their
    place in the order.
    """
    suffix = counts_name("")
    found = {}
    for row in data:
        name = row.removesuffix(suffix)
        if name in UNITS or not isinstance(data.get(row, getlink=True), h5py.HardLink):
            continue
        attrs = data[row].attrs
        if "declared" in attrs:
            unit = attrs["physical_units" if row.endswith(suffix) else "units"]
            place = int(attrs["declared"])
            found[name] = place, text_of(unit), text_of(attrs.get("label", ""))
    ordered = sorted(found.items(), key=lambda one: (one[1][0], one[0]))
    return {name: (unit, label) for name, (_, unit, label) in ordered}


def missing_in(row: h5py.Dataset) -> int:
    """Return how many readings of ``row`` are missing, as the file says; the drive has them all."""
    count = row.attrs.get(MISSING, 0)
    name = row.name.rpartition("/")[2]
    return int(count) if isinstance(count, int | np.integer) and name not in DRIVING else 0


def variable_attributes(name: str, unit: str = "", label: str = "") -> dict[str, str]:
    """Return ``units`` of the physical values ``name`` and, where there is one, ``long_name``.

    ``unit`` and ``label`` are those of a channel that the rig file declared.
    """
    found = {"units": UNITS.get(name, unit)}
    if long_name := LONG_NAMES.get(name, label):
        found["long_name"] = long_name
    return found


def describe_field(dataset: h5py.Dataset, name: str, unit: str = "", label: str = "") -> None:
    """Write ``units`` of a physical dataset and, where the channel has one, a ``long_name``."""
    found = variable_attributes(name, unit, label)
    for key, text in found.items():
        # viewers show the long name in place of name and unit
        with_unit = f"{text} ({found['units']})" if key == "long_name" else text
        dataset.attrs[key] = fixed(with_unit)


def create_field(
    data: h5py.Group, name: str, samples: int, unit: str = "", label: str = ""
) -> h5py.Dataset:
    """Make the physical dataset ``name``, to be filled; HDF5 keeps a checksum of every chunk.

    ``unit`` and ``label`` are those of a channel that the rig file declared.
    """
    dataset = data.create_dataset(
        name,
        shape=(samples,),
        dtype="<f8",
        # chunks of equal size: HDF5 stores the last one in full
        chunks=(-(-samples // -(-samples // CHUNK)),) if samples else None,
        fletcher32=bool(samples),
    )
    describe_field(dataset, name, unit, label)
    return dataset


def attach_time(data: h5py.Group) -> None:
    """Make ``time`` the dimension scale of every row in ``data`` that has its length.

    With it xarray finds the time coordinate. SWMR mode forbids the attributes that this writes, so
    it is done when a run is finished, which is also when ``time`` is written.
    """
    time = data["time"]
    if not time.is_scale:
        time.make_scale("time")
    for name, row in data.items():
        if name != "time" and row.shape == time.shape and not len(row.dims[0]):
            row.dims[0].attach_scale(time)


def make_own_scale(rows: h5py.Dataset) -> None:
    """Make a table under /entry a dimension scale, so that its dimension has a name.

    xarray warns of nameless dimensions in every group above the one that it opens. For a table that
    grows in SWMR mode this must be done when it is created. ``rows`` is (n,): no reader of netCDF
    takes a scale with more dimensions.
    """
    rows.make_scale(rows.name.rpartition("/")[2])


def name_dimensions(entry: h5py.Group) -> None:
    """Give the dimensions under ``entry`` names that netCDF finds; for a finished run.

    SWMR mode forbids it during the run. Files of earlier versions have the checksums themselves as
    a scale, which is taken off.
    """
    for table, names in NUMBERED.items():
        rows = entry.get(table)
        if rows is None:
            continue
        for attribute in ("CLASS", "NAME", "REFERENCE_LIST"):
            if attribute in rows.attrs:
                del rows.attrs[attribute]
        for axis, name in enumerate(names):
            _number(entry, rows, axis, name)
    if "time" in entry["data"] and "time" not in entry and entry["data/time"].is_scale:
        entry["time"] = entry["data/time"]


def _number(entry: h5py.Group, rows: h5py.Dataset, axis: int, name: str) -> None:
    """Give the dimension ``axis`` of ``rows`` a scale ``name`` that numbers it."""
    if name in entry:
        if entry[name].shape[0] == rows.shape[axis]:
            return
        rows.dims[axis].detach_scale(entry[name])
        del entry[name]
    scale = entry.create_dataset(name, data=np.arange(rows.shape[axis], dtype="<i4"))
    scale.make_scale(name)
    rows.dims[axis].attach_scale(scale)


#: Scales of the dimensions of tables under /entry. The events are none themselves: xarray reads
#: scales when it opens a file, and netCDF-C corrupts its memory when it reads texts in a row.
NUMBERED = MappingProxyType(
    {"checksums": ("checksum_block", "checksum_channel"), "events": ("event",)}
)


def show_plot(data: h5py.Group, kind: str, *, live: bool) -> None:
    """Name what viewers plot: the physical values over time, or the counts while a run is going on.

    SWMR mode forbids a change during the run.
    """
    data.attrs["signal"] = fixed(counts_name(SIGNALS[kind]) if live else SIGNALS[kind])
    if live:
        data.attrs.pop("axes", None)
    else:
        data.attrs["axes"] = fixed(["time"])


def lay_out(file: h5py.File, kind: str, title: str, started: float) -> h5py.Group:
    """Create the root, /entry and an empty /entry/data of a new file; return /entry."""
    file.attrs["NX_class"] = fixed("NXroot")
    file.attrs["format"] = fixed(FORMAT)
    file.attrs["default"] = fixed("entry")
    entry = file.create_group("entry")
    entry.attrs["NX_class"] = fixed("NXentry")
    entry.attrs["format"] = fixed(FORMAT)
    entry.attrs["default"] = fixed("data")
    entry.attrs["kind"] = fixed(kind)
    entry.attrs["complete"] = False
    put_text(entry, "title", title)
    put_text(entry, "start_time", iso_time(started))
    put_text(entry, IDENTIFIER, str(uuid.uuid4()))
    data = entry.create_group("data")
    data.attrs["NX_class"] = fixed("NXdata")
    show_plot(data, kind, live=False)
    return entry
