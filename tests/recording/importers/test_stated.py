"""What a file states next to its values: scales, units, rates, formats of cells, and names."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pyarrow as pa
import pytest
from nptdms import ChannelObject, GroupObject, RootObject, TdmsWriter
from openpyxl import Workbook
from pyarrow import parquet
from scipy.io import savemat

from dearig.recording.importers.formats.excel_file import NumberFormat, shown_by
from dearig.recording.importers.formats.stored import stated_scale
from dearig.recording.importers.quantities.labels import label_of
from tests.tools.imports import MOVED, NAMES, ROWS, TIME, VOLTAGE, refused, same, taken

MM = 1e3 * MOVED
HALF = VOLTAGE / 2
Write = Callable[[Path], Path]


def text(head: str, *columns: np.ndarray | list[str]) -> Write:
    """A text table below ``head``, whose columns are arrays or lists of cells."""

    def write(folder: Path) -> Path:
        cells = [[c if isinstance(c, str) else f"{c:.12g}" for c in column] for column in columns]
        lines = "\n".join(",".join(row) for row in zip(*cells, strict=True))
        (folder / "in.csv").write_text(f"{head}\n{lines}\n", "utf-8")
        return folder / "in.csv"

    return write


def hdf5(voltage: np.ndarray, **attributes: object) -> Write:
    def write(folder: Path) -> Path:
        with h5py.File(folder / "in.h5", "w") as file:
            file["time_s"], file["displacement_mm"] = TIME, MM
            file.create_dataset("voltage_V", data=voltage).attrs.update(attributes)
        return folder / "in.h5"

    return write


def grouped(**attributes: object) -> Write:
    def write(folder: Path) -> Path:
        with h5py.File(folder / "in.h5", "w") as file:
            file["run/time_s"], file["run/voltage_V"], file["run/displacement_mm"] = TIME, HALF, MM
            file["run"].attrs.update(attributes)
        return folder / "in.h5"

    return write


def in_json(content: object) -> Write:
    def write(folder: Path) -> Path:
        (folder / "in.json").write_text(json.dumps(content), "utf-8")
        return folder / "in.json"

    return write


def in_parquet(folder: Path) -> Path:
    fields = [pa.field(name, pa.float64()) for name in NAMES]
    fields[1] = pa.field("voltage_V", pa.float64(), metadata={"scale": "2"})
    table = pa.table([TIME, HALF, MM], schema=pa.schema(fields))
    parquet.write_table(table, folder / "in.parquet")
    return folder / "in.parquet"


def tdms(*objects: object) -> Write:
    def write(folder: Path) -> Path:
        with TdmsWriter(folder / "in.tdms") as writer:
            writer.write_segment(list(objects))
        return folder / "in.tdms"

    return write


def mat(**variables: object) -> Write:
    def write(folder: Path) -> Path:
        savemat(folder / "in.mat", variables)
        return folder / "in.mat"

    return write


COLUMNS = {"time_s": TIME.tolist(), "displacement_mm": MM.tolist()}
SCALED = {
    "an attribute of integers": hdf5(np.round(10 * VOLTAGE).astype("i4"), scaling_factor=0.1),
    "an attribute of floats": hdf5(HALF, Gain=2.0),
    "an offset": hdf5(VOLTAGE + 5.0, offset=-5.0),
    "a text": hdf5(HALF, scale_factor="2"),
    "JSON": in_json(COLUMNS | {"voltage": {"unit": "V", "factor": 2, "data": HALF.tolist()}}),
    "JSON beside": in_json(COLUMNS | {"voltage_V": HALF.tolist(), "scales": {"voltage_V": 2}}),
    "an attribute of the group": grouped(voltage_gain=2.0),
    "Parquet": in_parquet,
    "TDMS": tdms(
        ChannelObject("g", "time_s", TIME), ChannelObject("g", "displacement_mm", MM),
        ChannelObject("g", "voltage_V", HALF, {"Scale": 2.0}),
    ),
    "a variable": mat(time_s=TIME, voltage_V=HALF, voltage_scale=2.0, displacement_mm=MM),
    "a line of words": text("Gain,1,2,1\nTime (s),Voltage (V),Displacement (mm)", TIME, HALF, MM),
    "a line of signs": text("Time,Voltage,Displacement\ns,V,mm\nx1,x10,x1", TIME, HALF, MM),
}  # fmt: skip


@pytest.mark.parametrize("kind", SCALED)
def test_a_scale_that_stands_beside_the_values_is_asked_for(tmp_path: Path, kind: str) -> None:
    path = SCALED[kind](tmp_path)
    with refused(r"not known whether its values contain it.*\*FACTOR"):
        taken(path)
    column = "voltage" if kind == "JSON" else {"a line of words": "Voltage (V)"}.get(kind)
    column = column or {"a line of signs": "Voltage"}.get(kind, "voltage_V")
    with refused("not known whether its values contain it"):
        taken(path, columns={"voltage_V": column})
    given = {"an attribute of integers": "*0.1", "an offset": "*1-5"}.get(kind, "*2")
    same(taken(path, columns={"voltage_V": column + given}))


@pytest.mark.parametrize(
    "told", [{"gain": 1.0}, {"offset": 0}, {"calibration": 5.0}, {"scale": "linear"}, {"note": 2.0}]
)
def test_a_scale_that_changes_nothing_is_none(told: dict[str, object]) -> None:
    assert stated_scale(told) == ""


def test_a_unit_beside_a_name_that_contradicts_it_is_asked(tmp_path: Path) -> None:
    with refused("in V by its name and in mV by the unit that the file gives.*voltage_UNIT"):
        taken(hdf5(VOLTAGE * 1e3, units="mV")(tmp_path))


def test_units_of_the_fields_of_a_compound_dataset(tmp_path: Path) -> None:
    rows = np.rec.fromarrays([1e3 * TIME, VOLTAGE, MM], names=["time", "voltage", "displacement"])
    with h5py.File(tmp_path / "in.h5", "w") as file:
        file.create_dataset("log", data=rows).attrs["units"] = ["ms", "V", "mm"]
    same(taken(tmp_path / "in.h5"))


def given_rate(**attributes: object) -> Write:
    def write(folder: Path) -> Path:
        with h5py.File(folder / "in.h5", "w") as file:
            group = file.create_group("daq")
            group.attrs.update(attributes)
            group["voltage_V"], group["displacement_mm"] = VOLTAGE, MM
        return folder / "in.h5"

    return write


WAVEFORM = {"wf_increment": 10.0, "wf_xunit_string": "ms"}
SIGNALS = (("Voltage", VOLTAGE, "V"), ("Displacement", MM, "mm"))
UNITS_BESIDE = {f"{name}_unit": unit for name, _, unit in SIGNALS} | {"Time_unit": "s"}
TOLD = {
    "a rate of the group": given_rate(sample_rate=100),
    "steps in a unit": given_rate(dt=10.0, dt_unit="ms"),
    "TDMS in ms": tdms(
        *(ChannelObject("g", n, v, {"NI_UnitDescription": u} | WAVEFORM) for n, v, u in SIGNALS)
    ),
    "a rate of the TDMS group": tdms(
        RootObject(), GroupObject("g", {"SampleRate": 100.0}),
        ChannelObject("g", "voltage_V", VOLTAGE), ChannelObject("g", "displacement_mm", MM),
    ),
    "units beside": in_json(
        {n: v.tolist() for n, v, _ in SIGNALS} | {"Time": TIME.tolist()} | UNITS_BESIDE
    ),
    "a column called #": text(
        "#,time,voltage,displacement\n#,s,V,mm", [str(i) for i in range(ROWS)], TIME, VOLTAGE, MM
    ),
    "an empty name before a #": text(
        ",no,time,voltage,displacement\n,#,s,V,mm",
        [""] * ROWS, [str(i) for i in range(ROWS)], TIME, VOLTAGE, MM,
    ),
    "units in Cyrillic": text("Время (с),Напряжение (В),Перемещение (мм)", TIME, VOLTAGE, MM),  # noqa: RUF001
}  # fmt: skip


@pytest.mark.parametrize("kind", TOLD)
def test_what_a_file_tells_is_not_asked_for(tmp_path: Path, kind: str) -> None:
    same(taken(TOLD[kind](tmp_path)))


def lvm(folder: Path) -> Path:
    rows = "".join(f"\t{v:.12g}\t{m:.12g}\n" for v, m in zip(VOLTAGE, MM, strict=True))
    (folder / "in.lvm").write_text(
        "LabVIEW Measurement\nX_Columns\tNo\n***End_of_Header***\nY_Unit_Label\tV\tmm\n"
        f"Delta_X\t0.01\t0.02\n***End_of_Header***\nX_Value\tVoltage\tDisplacement\n{rows}",
        "utf-8",
    )
    return folder / "in.lvm"


@pytest.mark.parametrize(
    ("write", "said"),
    [
        (mat(fs=1e3, decimation=10, voltage_V=VOLTAGE, displacement_mm=MM), "decimation' is 10"),
        (mat(fs=1e3, Ts=0.01, voltage_V=VOLTAGE, displacement_mm=MM), "give the rate of the rows"),
        (lvm, "rate-Hz RATE"),
        (given_rate(sample_rate=1e3, decimation=10), "rate-Hz RATE"),
        (text(",".join(NAMES), [*map(str, range(3)), "time_s", "3", "4"], [*"000", NAMES[2], *"12"],
              [*"000", NAMES[1], *"00"]), "line 5: here are names of columns again"),
        (text("timestamp (s),voltage_V,displacement_mm", 1e3 * (1.8e9 + TIME), VOLTAGE, MM),
         r"count ms from 1970.*'time_ms=timestamp \(s\)\*1'"),
        (text(",".join(NAMES), [str(i) for i in range(ROWS)], TIME, VOLTAGE, MM),
         "both the first and the second one may be the time"),
        (text("Response time (ms),voltage_V,displacement_mm", TIME, VOLTAGE, MM), "'response'"),
        (text("time_s,|Voltage| (V),displacement_mm", TIME, VOLTAGE, MM), r"'\|Voltage\|'"),
    ],
)  # fmt: skip
def test_what_a_file_leaves_open_is_asked(tmp_path: Path, write: Write, said: str) -> None:
    with refused(said):
        taken(write(tmp_path))


@pytest.mark.parametrize("place", [1, 2])
def test_numbers_too_large_for_an_instrument_are_no_readings(tmp_path: Path, place: int) -> None:
    columns = [TIME, VOLTAGE.copy(), MM.copy()]
    columns[place][[40, 45]] = 9.9e37, -9.91e37
    run = taken(text(",".join(NAMES), *columns)(tmp_path))
    kept = np.arange(ROWS) if place == 2 else np.delete(np.arange(ROWS), [40, 45])
    np.testing.assert_allclose(run.voltage_command, VOLTAGE[kept], rtol=1e-8)
    assert np.nanmax(np.abs(run.displacement)) < 1.0


@pytest.mark.parametrize(
    ("number_format", "times", "unit"),
    [("0.00%", 100.0, "%"), ("0.000,", 1e-3, ""), ('0.00" kV";-0.00" kV"', 1.0, "kV"),
     ("#,##0.00", 1.0, ""), ("General", 1.0, ""), ('0.0" x"', 1.0, "")],
)  # fmt: skip
def test_what_a_format_of_cells_shows(number_format: str, times: float, unit: str) -> None:
    assert shown_by(number_format) == NumberFormat(times, unit)


def test_a_strain_that_a_workbook_shows_in_per_cent(tmp_path: Path) -> None:
    book = Workbook()
    book.active.append(["Time (s)", "Strain (%)", "Stress (kPa)"])
    for t in TIME.tolist():
        book.active.append([t, 0.5 * t, 10.0 * t])
    for cell in book.active["B"][1:]:
        cell.number_format = "0.0%"
    book.save(tmp_path / "in.xlsx")
    np.testing.assert_allclose(taken(tmp_path / "in.xlsx").stretch, 1.0 + 0.5 * TIME, rtol=1e-12)
    book.active["B9"].number_format = "General"
    book.save(tmp_path / "in.xlsx")
    with refused("'Strain.*give them one format"):
        taken(tmp_path / "in.xlsx")


@pytest.mark.parametrize(
    ("name", "quantities", "asked"),
    [("Elongation (%)", ("strain",), ()), ("Stroke (%)", (), ()), ("Strain ()", ("strain",), ()),
     ("Stretch - 1", (), ("stretch",)), ("Laser-1 (mm)", ("displacement",), ()),
     ("2nd PK stress (kPa)", (), ("nominal_stress",))],
)  # fmt: skip
def test_names_of_lengths(name: str, quantities: tuple[str, ...], asked: tuple[str, ...]) -> None:
    label = label_of(name)
    assert (label.quantities, label.asked) == (quantities, asked)
