"""Files of other programs that are not tables: JSON, HDF5, MAT, TDMS and Parquet."""

from __future__ import annotations

import json
import struct
import zlib
from collections.abc import Callable
from datetime import datetime, timedelta
from pathlib import Path

import h5py
import numpy as np
import openpyxl
import pytest
from nptdms import ChannelObject, TdmsWriter
from scipy.io import savemat

from dearig.recording import import_file, open_recording
from dearig.recording.importers.formats.tdms_file import TdmsChannels
from dearig.recording.importers.listing import preview
from tests.tools.imports import (
    MOVED,
    NAMES,
    ROWS,
    TABLE,
    TIME,
    VOLTAGE,
    imported,
    refused,
    same,
    taken,
)
from tests.tools.recordings import Clock


def as_rows(**more: object) -> list[dict[str, object]]:
    return [{**dict(zip(NAMES, row, strict=True)), **more} for row in TABLE.tolist()]


def as_columns() -> dict[str, list[float]]:
    return dict(zip(NAMES, TABLE.T.tolist(), strict=True))


START = datetime(2024, 3, 1, 23, 59, 59, 900_000)
CHANNELS = [
    {"name": name, "unit": unit, "data": values}
    for name, unit, values in zip(
        ("Time", "Voltage", "Travel"), ("s", "V", "mm"), TABLE.T.tolist(), strict=True
    )
]


@pytest.mark.parametrize(
    "content",
    [
        pytest.param(as_columns(), id="columns"),
        pytest.param({"run": {"id": 7, "raw": as_columns()}, "by": ["me", "you"]}, id="nested"),
        pytest.param(as_rows(remark="ok"), id="rows"),
        pytest.param({"samples": [{"t": r} for r in as_rows()]}, id="rows in rows"),
        pytest.param({"columns": NAMES, "index": [0], "data": TABLE.tolist()}, id="pandas split"),
        pytest.param(
            {k: dict(zip(map(str, range(ROWS)), v, strict=True)) for k, v in as_columns().items()},
            id="pandas columns",
        ),
        pytest.param({"channels": CHANNELS}, id="channels"),
        pytest.param({c["name"]: {**c, "name": "x"} for c in CHANNELS}, id="named"),
        pytest.param(
            {"units": {"time": "s", "u": "V", "x": "mm", "Travel": "mm"},
             "time": CHANNELS[0]["data"], "u": CHANNELS[1]["data"], "Travel": CHANNELS[2]["data"]},
            id="units beside",
        ),
        pytest.param([list(NAMES), *TABLE.tolist()], id="names first"),
        pytest.param(
            {"fs_Hz": 100.0, "data": {k: v for k, v in as_columns().items() if k != "time_s"}},
            id="a rate",
        ),
        pytest.param(
            {**as_columns(), "time_s": [(START + timedelta(seconds=t)).isoformat() for t in TIME]},
            id="time stamps",
        ),
    ],
)  # fmt: skip
def test_json_in_the_ways_in_which_programs_write_it(tmp_path: Path, content: object) -> None:
    path = tmp_path / "in.txt"
    path.write_text(json.dumps(content, indent=1), "utf-8")
    same(taken(path))


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
def test_json_lines(tmp_path: Path, encoding: str) -> None:
    path = tmp_path / "in.jsonl"
    path.write_text("\n".join(map(json.dumps, as_rows())) + "\n", encoding)
    same(taken(path))
    path.write_text("\n".join(map(json.dumps, [NAMES, *TABLE.tolist()])), encoding)
    same(taken(path))


def test_what_is_wrong_in_json(tmp_path: Path) -> None:
    path = tmp_path / "in.json"
    lines = as_rows()
    lines[4]["voltage_V"], lines[7]["displacement_mm"] = None, "OVER"
    path.write_text("\n".join(map(json.dumps, lines)), "utf-8")
    with refused("line 5, column 'voltage_V': there is no value; .*; --skip-bad-rows "):
        imported(path)
    imported(path, skip_bad_rows=True)
    run = open_recording(tmp_path / "out.h5")
    np.testing.assert_allclose(run.time, np.delete(TIME, 4))
    assert np.flatnonzero(np.isnan(run.displacement)).tolist() == [6]
    path.write_text(json.dumps({"first": as_columns(), "second": as_columns()}), "utf-8")
    same(taken(path))  # they are the same
    other = {name: [2 * value for value in column] for name, column in as_columns().items()}
    path.write_text(json.dumps({"first": other, "second": as_columns()}), "utf-8")
    with refused("one must be chosen: first, second"):
        imported(path)
    same(taken(path, table="second"))
    for text, match in (
        ("[" * 100_000, "nested too deeply"),
        ('{"time_s": [1, 2', "cannot be read as a JSON file"),
        ('{"a": "b"}', "holds no columns of numbers"),
        (
            '{"time_s": [1' + "0" * 5000 + ", 2]}",
            "cannot be read as a JSON file: Exceeds the limit",
        ),
    ):
        path.write_text(text, "utf-8")
        with refused(match):
            imported(path)


def hdf5(path: Path, content: Callable[[h5py.File], object], userblock: bytes = b"") -> Path:
    with h5py.File(path, "w", userblock_size=512 if userblock else 0) as file:
        content(file)
    if userblock:
        with path.open("r+b") as file:
            file.write(userblock)
    return path


def scan(file: h5py.File, place: str = "scan", times: float = 1.0) -> None:
    for name, values in zip(NAMES, times * TABLE.T, strict=True):
        file[f"{place}/{name}"] = values


def with_units(file: h5py.File) -> None:
    for name, unit, values in zip(("time", "hv", "x"), ("s", "V", "mm"), TABLE.T, strict=True):
        file[f"raw/{name}/data"] = values
        file[f"raw/{name}/data"].attrs["units"] = np.bytes_(unit)
    file["raw/x/data"].attrs["long_name"] = "Laser displacement"
    file["raw/sample_rate_Hz"] = 7.0  # a column of time counts more


def nexus(file: h5py.File) -> None:
    file.attrs["default"] = "entry"
    file.create_group("entry").attrs["default"] = "data"
    scan(file, "entry/instrument", 2.0)
    data = file["entry"].create_group("data")
    data.attrs.update({"NX_class": "NXdata", "signal": "displacement_mm", "axes": ["clock"]})
    data["clock"] = TABLE[:, 0] * 1e3
    data["clock"].attrs["units"] = "ms since 2024-03-01 12:00:00"
    data["voltage_V"] = TABLE[:, 1]
    file["entry/laser"] = TABLE[:, 2]
    data["displacement_mm"] = h5py.SoftLink("/entry/laser")


def matrix(file: h5py.File) -> None:
    file["log"] = TABLE
    file["log"].attrs["columns"] = list(NAMES)


def compound(file: h5py.File) -> None:
    kind = np.dtype([(name, "f8") for name in NAMES] + [("remark", "S3")])
    file["table"] = np.array([(*row, b"ok") for row in TABLE], dtype=kind)


def a_rate(file: h5py.File) -> None:
    scan(file)
    del file["scan/time_s"]
    file["fs"] = 100.0


@pytest.mark.parametrize("content", [scan, with_units, nexus, matrix, compound, a_rate])
def test_hdf5_of_other_programs(tmp_path: Path, content: Callable[[h5py.File], object]) -> None:
    same(taken(hdf5(tmp_path / "in.dat", content)))


def test_groups_of_an_hdf5_file_are_chosen_from(tmp_path: Path) -> None:
    def content(file: h5py.File) -> None:
        scan(file, "run1", 2.0)
        scan(file, "run2")
        file["run3/time_s"] = TIME

    path = hdf5(tmp_path / "in.h5", content)
    with refused("one must be chosen: run1, run2"):
        imported(path)
    same(taken(path, table="run2"))
    columns = {name: f"run2/{name}" for name in NAMES}
    same(taken(path, columns=columns))
    assert "run1/time_s" in [column.name for column in preview(path)]


def refs(file: h5py.File) -> None:
    """Two runs as MATLAB keeps an array of structs: fields of references to hidden datasets."""
    hidden = file.create_group("#refs#")
    for name, values in zip(NAMES, TABLE.T, strict=True):
        kept = []
        for times in (2.0, 1.0):
            hidden[f"{name}{times:g}"] = times * values[None, :]
            kept.append(hidden[f"{name}{times:g}"].ref)
        file.create_dataset(f"run/{name}", data=[kept], dtype=h5py.ref_dtype)
    file["run"].attrs["MATLAB_class"] = np.bytes_("struct")


def turned(file: h5py.File) -> None:
    """A matrix of three columns, whose rows and columns MATLAB exchanges."""
    file["log"] = TABLE.T
    file["log"].attrs["MATLAB_class"] = np.bytes_("double")
    file["fs"] = [[50.0]]


def test_mat_of_version_7_3(tmp_path: Path) -> None:
    head = b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM"
    path = hdf5(tmp_path / "in.mat", refs, head)
    with refused(r"one must be chosen: run\(1\), run\(2\)"):
        imported(path)
    same(taken(path, table="run(2)"))
    path = hdf5(path, turned, head)
    columns = {name: f"log[{i}]" for i, name in enumerate(NAMES)}
    same(taken(path, columns=columns))
    path = hdf5(
        path, lambda file: file.create_dataset("t", data=[1]).attrs.update(MATLAB_object_decode=3),
        head,
    )  # fmt: skip
    with refused(r"objects of MATLAB .* save their columns with"):
        imported(path)


def test_hostile_hdf5_is_a_sentence(tmp_path: Path) -> None:
    def claims(file: h5py.File) -> None:
        file.create_dataset("time_s", shape=(10**12,), chunks=(1000,), dtype="f8")

    def outside(file: h5py.File) -> None:
        scan(file)
        del file["scan/voltage_V"]
        file["scan/voltage_V"] = h5py.ExternalLink("/etc/passwd", "/x")
        file["loop"] = file["/"]

    with refused("holds no columns of numbers"):
        imported(hdf5(tmp_path / "in.h5", claims))
    path = hdf5(tmp_path / "in.h5", matrix)
    raw = bytearray(path.read_bytes())
    heap = raw.index(b"GCOL")
    raw[heap + 16 : heap + 32] = bytes(16)  # free space of size 0 in front of the texts
    path.write_bytes(raw)
    with refused(f"the heap at byte {heap} is damaged"):
        imported(path)
    with refused("no column for voltage"):
        imported(hdf5(tmp_path / "in.h5", outside))
    scan_run = tmp_path / "out.h5"
    same(taken(hdf5(tmp_path / "in.h5", scan)))
    with refused("is a recording already, which needs no import"):
        import_file(scan_run, tmp_path / "again.h5", now=Clock())


def array_of(name: bytes, body: bytes, kind: int = 6) -> bytes:
    """Return the element of a MAT variable (n,) of doubles."""

    def element(code: int, content: bytes) -> bytes:
        return struct.pack("<2I", code, len(content)) + content + bytes(-len(content) % 8)

    shape = struct.pack("<2i", len(body) // 8, 1)
    return element(14, element(6, struct.pack("<2I", kind, 0)) + element(5, shape)
                   + element(1, name) + element(9, body))  # fmt: skip


MAT_HEAD = b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM"


def test_a_mat_variable_whose_stream_has_no_end_is_read(tmp_path: Path) -> None:
    """MATLAB leaves the end out where a variable takes whole blocks of 65536 bytes."""
    parts = []
    for name, values in zip(NAMES, TABLE.T, strict=True):
        packing = zlib.compressobj()
        body = packing.compress(array_of(name.encode(), values.tobytes()))
        body += packing.flush(zlib.Z_SYNC_FLUSH)
        parts.append(struct.pack("<2I", 15, len(body)) + body)
    path = tmp_path / "in.mat"
    path.write_bytes(MAT_HEAD + b"".join(parts))
    same(taken(path))
    cut = parts[2][8:-40]
    path.write_bytes(MAT_HEAD + parts[0] + parts[1] + struct.pack("<2I", 15, len(cut)) + cut)
    with refused("is truncated: the variable at byte"):
        imported(path)


RAW = dict(zip(NAMES[1:], TABLE.T[1:], strict=True))


def cells(*values: np.ndarray) -> np.ndarray:
    found = np.empty((1, len(values)), dtype=object)
    for place, value in enumerate(values):
        found[0, place] = value
    return found


def signals(values: np.ndarray) -> np.ndarray:
    """Return what Simulink calls a structure with time."""
    kind = [("values", "O"), ("label", "O"), ("unit", "O")]
    rows = zip(("Voltage", "Travel"), ("V", "mm"), values.T[1:], strict=True)
    return np.array([[(column[:, None], label, unit) for label, unit, column in rows]], dtype=kind)


@pytest.mark.parametrize(
    ("content", "options"),
    [
        ({"runs": cells(2 * TIME, TIME)}, None),
        ({"fs": 100.0, **RAW}, {}),
        ({"dt_ms": 10.0, **RAW}, {}),
        ({"log": np.array([list(NAMES), *TABLE.tolist()], dtype=object)}, {}),
        ({"out": {"time_s": TIME, "signals": signals(TABLE)}}, {}),
        (
            {"run": np.array([[tuple(2 * TABLE.T), tuple(TABLE.T)]], [(n, "O") for n in NAMES])},
            {"table": "run(2)"},
        ),
    ],
    ids=["cells", "a rate", "a step", "cells of a table", "signals", "structs"],
)
def test_what_mat_files_hold(
    tmp_path: Path, content: dict[str, object], options: dict[str, object] | None
) -> None:
    path = tmp_path / "in.mat"
    savemat(path, content)
    if options is None:
        assert [column.name for column in preview(path)] == ["runs{1}", "runs{2}"]
    else:
        same(taken(path, **options))


def test_objects_of_matlab_are_named_as_such(tmp_path: Path) -> None:
    path = tmp_path / "in.mat"
    path.write_bytes(MAT_HEAD + array_of(b"t", b"", kind=17))
    with refused(r"objects of MATLAB \(tables, timetables, time series\)"):
        imported(path)


STEP = {"wf_increment": 0.01, "wf_start_offset": 0.0}


def tdms(path: Path, *channels: ChannelObject) -> Path:
    with TdmsWriter(str(path)) as writer:
        writer.write_segment(list(channels))
    return path


def channels(**more: object) -> list[ChannelObject]:
    return [ChannelObject("Log", n, v, {**STEP, **more}) for n, v in RAW.items()]


def test_tdms_of_several_rates(tmp_path: Path) -> None:
    slow = ChannelObject("Slow", "temperature_C", np.full(6, 23.0), {"wf_increment": 0.1})
    path = tdms(tmp_path / "in.tdms", *channels(), slow)
    done = imported(path)
    same(open_recording(tmp_path / "out.h5"))
    assert any("temperature was not imported: 'Slow/temperature_C' has 6" in n for n in done.notes)
    with refused(r"have different times: .* every 0.1 s .* not resampled"):
        imported(path, columns={"temperature_C": "Slow/temperature_C"})
    fast = ChannelObject("Fast", "Laser (mm)", np.zeros(600), {"wf_increment": 0.001})
    with refused(r"every 0.001 s from 0 s; they are not resampled here"):
        imported(tdms(path, channels()[0], fast))
    start = np.datetime64("2024-03-01T12:00:00.000000")
    later = {**STEP, "wf_start_time": start + np.timedelta64(2, "s")}
    late = ChannelObject("Late", "Laser (mm)", np.zeros(ROWS), later)
    with refused(r"every 0\.01 s from 2 s; they are not resampled"):
        imported(tdms(path, channels(wf_start_time=start)[0], late))


def test_tdms_units_scales_and_time_stamps(tmp_path: Path) -> None:
    monitor = {**STEP, "unit_string": "kV"}
    path = tdms(
        tmp_path / "in.tdms",
        ChannelObject("Log", "HV monitor", VOLTAGE / 1e3, monitor),
        ChannelObject("Log", "Laser", MOVED * 1e6, {**STEP, "unit_string": "µm"}),
    )
    same(taken(path))
    scale = {
        "NI_Scaling_Status": "unscaled", "NI_Number_Of_Scales": 1,
        "NI_Scale[0]_Scale_Type": "Linear", "NI_Scale[0]_Linear_Slope": 0.25,
        "NI_Scale[0]_Linear_Y_Intercept": 0.0, "NI_Scale[0]_Linear_Input_Source": 0xFFFFFFFF,
    }  # fmt: skip
    counts = np.round(VOLTAGE * 4).astype(np.int16)
    start = np.datetime64("2024-03-01T23:59:59.900000")
    stamps = start + np.round(TIME * 1e6).astype("timedelta64[us]")
    path = tdms(
        path,
        ChannelObject("Log", "voltage_V", counts, scale),
        ChannelObject("Log", "displacement_mm", MOVED * 1e3),
        ChannelObject("Log", "time_s", stamps),
    )
    run = taken(path)
    np.testing.assert_array_equal(run.voltage_command, counts * 0.25)
    np.testing.assert_allclose(run.time, TIME, atol=1e-9)


def test_tdms_time_stamps_keep_each_microsecond(tmp_path: Path) -> None:
    start = np.datetime64("2024-03-01T12:00:00.000000")
    rows = np.arange(1000)  # at 1 MHz: npTDMS reads some stamps a microsecond early
    volts = np.where(rows < 200, 0.0, rows - 200.0)
    path = tdms(
        tmp_path / "in.tdms",
        ChannelObject("Log", "voltage_V", volts),
        ChannelObject("Log", "displacement_mm", 1e-6 * volts**2),
        ChannelObject("Log", "time_s", start + rows),
    )
    np.testing.assert_allclose(taken(path).time, 1e-6 * rows, rtol=0, atol=1e-15)


def test_tdms_starts_of_waveforms_keep_each_microsecond(tmp_path: Path) -> None:
    start = np.datetime64("2024-03-01T12:00:00.000000")
    begun = [
        c.properties | {"wf_start_time": start + np.timedelta64(us, "us")}
        for us, c in enumerate(channels())
    ]
    path = tdms(
        tmp_path / "in.tdms",
        *(ChannelObject("Log", n, v, p) for p, (n, v) in zip(begun, RAW.items(), strict=True)),
    )
    found = [column.start_s for column in TdmsChannels(path)._columns.values()]
    np.testing.assert_allclose(found, 1e-6 * np.arange(len(RAW)), rtol=0, atol=1e-15)


def big_endian() -> bytes:
    """Return a file as a big-endian computer writes it; only the flags stay little-endian."""

    def text(value: str) -> bytes:
        return struct.pack(">I", len(value)) + value.encode()

    objects = b""
    for name in RAW:
        objects += text(f"/'Log'/'{name}'") + struct.pack(">IIIQ", 20, 10, 1, ROWS)
        objects += struct.pack(">I", 1) + text("wf_increment") + struct.pack(">Id", 10, 0.01)
    meta = struct.pack(">I", len(RAW)) + objects
    raw = b"".join(values.astype(">f8").tobytes() for values in RAW.values())
    flags = (1 << 1) | (1 << 2) | (1 << 3) | (1 << 6)
    sizes = struct.pack(">IQQ", 4713, len(meta) + len(raw), len(meta))
    return b"TDSm" + struct.pack("<I", flags) + sizes + meta + raw


def test_tdms_of_a_big_endian_computer(tmp_path: Path) -> None:
    path = tmp_path / "in.tdms"
    path.write_bytes(big_endian())
    assert not any("ends early" in doubt for doubt in imported(path).warnings)
    same(open_recording(tmp_path / "out.h5"))


def test_tdms_that_was_not_closed(tmp_path: Path) -> None:
    """The last segment says that its writing was not completed, and lacks some values."""
    path = tdms(tmp_path / "in.tdms", *channels())
    whole = path.read_bytes()
    last = whole[:12] + struct.pack("<Q", 2**64 - 1) + whole[20:]
    path.write_bytes(whole + last[: -8 * 20])
    done = imported(path)
    assert any("ends early" in doubt for doubt in done.warnings)
    assert open_recording(tmp_path / "out.h5").samples == 2 * ROWS - 20


def parquet(path: Path, **columns: object) -> Path:
    pytest.importorskip("pyarrow")
    import pyarrow
    from pyarrow.parquet import write_table

    write_table(pyarrow.table(columns), path)
    return path


def test_parquet_of_time_stamps_and_structs(tmp_path: Path) -> None:
    stamps = np.datetime64("2024-03-01T23:59:59.9", "ns") + np.round(TIME * 1e9).astype("m8[ns]")
    same(taken(parquet(tmp_path / "in.parquet", **{**RAW, "time_s": stamps})))
    run = [dict(zip(NAMES, row, strict=True)) for row in TABLE.tolist()]
    same(taken(parquet(tmp_path / "in.parquet", run=run)))
    clock = [(START + timedelta(seconds=t)).time() for t in TIME]
    found = taken(parquet(tmp_path / "in.parquet", **{**RAW, "time": clock}))
    np.testing.assert_allclose(found.time, 86399.9 + TIME)  # over midnight


def test_rows_of_a_parquet_file_without_values_are_left_out(tmp_path: Path) -> None:
    moved = [None if i == 7 else d for i, d in enumerate(TABLE[:, 2].tolist())]
    volts = np.where(TIME[9] == TIME, np.nan, VOLTAGE)
    path = parquet(tmp_path / "in.parquet", time_s=TIME, voltage_V=volts, displacement_mm=moved)
    with refused("row 8, column 'displacement_mm': there is no value; 2 of 60 rows are so; --"):
        imported(path)
    done = imported(path, skip_bad_rows=True)
    assert any("1 row was left out" in doubt for doubt in done.warnings)
    run = open_recording(tmp_path / "out.h5")
    np.testing.assert_allclose(run.time, np.delete(TIME, 9))
    assert np.flatnonzero(np.isnan(run.displacement)).tolist() == [7]


def test_dates_with_months_first_in_json_and_workbooks(tmp_path: Path) -> None:
    start = datetime(2024, 4, 12, 23, 59, 58)
    stamps = [(start + timedelta(seconds=i)).strftime("%m/%d/%Y %H:%M:%S") for i in range(6)]
    rows = [[s, 100.0 * i, 0.1 * i] for i, s in enumerate(stamps)]
    names = ["Timestamp", "voltage_V", "displacement_mm"]
    as_json = tmp_path / "dates.json"
    as_json.write_text(json.dumps(dict(zip(names, zip(*rows, strict=True), strict=True))))
    book = openpyxl.Workbook()
    for row in (names, *rows):
        book.active.append(row)
    book.save(tmp_path / "dates.xlsx")
    for path in (as_json, tmp_path / "dates.xlsx"):
        np.testing.assert_allclose(taken(path).time, np.arange(6.0))


@pytest.mark.parametrize(
    ("name", "first", "what"),
    [
        ("run.mf4", b"MDF     4.10    asammdf ", "MDF"),
        ("run.csv", b"MDF     4.10    asammdf ", "MDF"),
        ("qcodes.db", b"SQLite format 3\0", "SQLite"),
        ("run.csv.gz", b"\x1f\x8b\x08\0", "gzip"),
        ("run.csv", b"\x1f\x8b\x08\0", "gzip"),
        ("run.nc", b"CDF\x01\0\0\0\0", "netCDF"),
        ("run.npy", b"\x93NUMPY\x01\0", "NumPy"),
    ],
)
def test_a_known_format_that_is_not_read_is_named(
    tmp_path: Path, name: str, first: bytes, what: str
) -> None:
    path = tmp_path / name
    path.write_bytes(first + bytes(100))
    with refused(rf"{what}.* is not read: "):
        import_file(path, tmp_path / "out.h5")
