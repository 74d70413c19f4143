"""Files in the forms in which programs of measurement and analysis write them."""

from __future__ import annotations

import json
from datetime import datetime, timedelta
from pathlib import Path

import h5py
import numpy as np
import pytest
from nptdms import ChannelObject, TdmsWriter
from openpyxl import Workbook

from dearig.cli.output import with_hints
from dearig.errors import InputError
from dearig.recording import open_recording
from tests.tools.imports import (
    MOVED,
    NAMES,
    ROWS,
    TABLE,
    TIME,
    VOLTAGE,
    imported,
    octave_text,
    refused,
    same,
    taken,
)

COLUMNS = dict(zip(NAMES, TABLE.T, strict=True))


def rows(*columns: object, separator: str = ",") -> str:
    return "\n".join(separator.join(map(str, row)) for row in zip(*columns, strict=True)) + "\n"


def plain(values: np.ndarray) -> list[str]:
    return [f"{value:.12g}" for value in values]


COUNTER = list(range(ROWS))


@pytest.mark.parametrize(
    "text",
    [
        pytest.param(
            "Time (s),Displacement (mm),Voltage (V)\n"
            + rows(plain(TIME), plain(1e3 * MOVED), plain(VOLTAGE), COUNTER),
            id="a last column without a name",
        ),
        pytest.param(
            '"time_s";"displacement_mm";"voltage_V"\n'
            + rows([f'"{i}"' for i in range(1, ROWS + 1)], plain(TIME), plain(1e3 * MOVED),
                   plain(VOLTAGE), separator=";"),
            id="names of rows, as R writes them",
        ),
        pytest.param(
            '"TOA5","rig","CR1000X"\n"TIMESTAMP","RECORD","HV","Laser"\n"TS","RN","V","mm"\n'
            '"","","Smp","Smp"\n'
            + rows([f'"2026-03-02 23:59:{59 + t:06.3f}"' if t < 1 else "" for t in TIME], COUNTER,
                   plain(VOLTAGE), plain(1e3 * MOVED)),
            id="a line of kinds below the units (Campbell)",
        ),
        pytest.param(
            "PLC logger,,,\nDate,Time,1,2\n,,Voltage,Displacement\n,,HV out,laser\n,,FLT,FLT\n"
            + ",,V,mm\n"
            + rows(["2026/03/02" if t < 0.3 else "2026/03/03" for t in TIME],
                   [f"23:59:{59.7 + t:06.3f}" if t < 0.3 else f"00:00:{t - 0.3:06.3f}"
                    for t in TIME],
                   plain(VOLTAGE), plain(1e3 * MOVED)),
            id="names on several lines, date and time of day apart",
        ),
        pytest.param(
            ",rig,rig\n,voltage_V,displacement_mm\ntime_s,,\n"
            + rows(plain(TIME), plain(VOLTAGE), plain(1e3 * MOVED)),
            id="names of two levels, and a line for the index (pandas)",
        ),
        pytest.param(
            "time,voltage_V,displacement_mm\n"
            + rows([f"0 days 00:00:{t:09.6f}" for t in TIME], plain(VOLTAGE), plain(1e3 * MOVED)),
            id="durations (pandas)",
        ),
    ],
)  # fmt: skip
def test_lines_above_a_table(tmp_path: Path, text: str) -> None:
    (tmp_path / "in.csv").write_text(text, "utf-8")
    same(taken(tmp_path / "in.csv"))


def test_a_comma_between_columns_and_before_decimals_is_refused(tmp_path: Path) -> None:
    text = "Time (s),Voltage (V),Displacement (mm)\n"
    body = "\n".join(",".join(f"{v:.4f}".replace(".", ",") for v in row) for row in TABLE)
    (tmp_path / "in.csv").write_text(text + body, "utf-8")
    with refused("3 names, and the rows below it have 6 numbers"):
        imported(tmp_path / "in.csv")


def grouped(values: np.ndarray, digits: int, between: str, decimal: str) -> list[str]:
    swapped = str.maketrans(",.", between + decimal)
    return [f"{v:,.{digits}f}".translate(swapped) for v in values]


LONG = np.arange(1600)
RISE = np.where(LONG < 300, 0.0, LONG - 300.0)  # V


@pytest.mark.parametrize(
    ("separator", "between", "decimal", "digits"),
    [(";", ".", ",", 0), (";", ",", ".", 5), (";", " ", ",", 2), ("\t", ".", ",", 5)],
)
def test_thousands_that_come_after_the_lines_that_are_looked_at(
    tmp_path: Path, separator: str, between: str, decimal: str, digits: int
) -> None:
    moved = np.maximum(RISE - 5.0, 0.0) + 100.0  # um, at rest
    text = separator.join(("Time (ms)", "Voltage (V)", "Displacement (um)")) + "\n"
    text += rows(LONG, [f"{v:.0f}" for v in RISE], grouped(moved, digits, between, decimal),
                 separator=separator)  # fmt: skip
    (tmp_path / "in.csv").write_text(text, "utf-8")
    done = imported(tmp_path / "in.csv")
    run = open_recording(tmp_path / "out.h5")
    np.testing.assert_allclose(run.displacement, (moved - 100.0) * 1e-6, atol=1e-12)
    assert any("stands between thousands" in note for note in done.notes)


def test_thousands_of_the_first_column_come_after_those_lines_too(tmp_path: Path) -> None:
    moved = np.maximum(RISE - 5.0, 0.0) + 100.0  # um, at rest
    text = "Weg (um);Spannung (V);Zeit (ms)\n"
    text += rows(grouped(moved, 0, ".", ","), [f"{v:.0f}" for v in RISE], LONG, separator=";")
    (tmp_path / "in.csv").write_text(text + "\n", "utf-8")
    imported(tmp_path / "in.csv")
    run = open_recording(tmp_path / "out.h5")
    np.testing.assert_allclose(run.displacement, (moved - 100.0) * 1e-6, atol=1e-12)


@pytest.mark.parametrize("last", ["", ","])
def test_start_and_increment_of_an_oscilloscope_stand_below_the_names(
    tmp_path: Path, last: str
) -> None:
    text = f"X,CH1,CH2,Start,Increment{last}\nSequence,Volt,Volt,0.5,1.0e-02{last}\n"
    text += "".join(f"{i},{v:.4g},{d:.4g},{last}\n" for i, (v, d) in enumerate(TABLE[:, 1:3]))
    (tmp_path / "in.csv").write_text(text, "utf-8")
    columns = {"voltage_V": "CH1*1000", "displacement_mm": "CH2*1"}
    run = taken(tmp_path / "in.csv", columns=columns)
    np.testing.assert_allclose(np.diff(run.time), 1e-2)


@pytest.mark.parametrize("cells", [["0", "5", "7.5"], ["1", "1.001", "1.01"], ["999", "1000.5"]])
def test_points_before_decimals_stay_so(tmp_path: Path, cells: list[str]) -> None:
    moved = ["0"] * (1600 - len(cells)) + cells
    text = "Time (ms);Voltage (V);Displacement (um)\n"
    text += rows(LONG, [f"{v:.0f}" for v in RISE], moved, separator=";")
    (tmp_path / "in.csv").write_text(text, "utf-8")
    run = taken(tmp_path / "in.csv")
    np.testing.assert_allclose(run.displacement[-len(cells) :], 1e-6 * np.array(cells, float))


def test_a_point_with_two_meanings_is_refused(tmp_path: Path) -> None:
    text = "Time (ms);Voltage (V);Displacement (mm)\n"
    stamps = [f"{5 * i}.000" if 5 * i < 1000 else f"{5 * i / 1e3:.3f}.000" for i in range(1600)]
    text += rows(stamps, [f"{v:.3f}" for v in RISE], [f"{v:.3f}" for v in RISE], separator=";")
    (tmp_path / "in.csv").write_text(text, "utf-8")
    with refused(r"'0.000' and '1.000.000' .* cannot both be right"):
        imported(tmp_path / "in.csv")


def test_universal_files_and_tables_of_qcodes_are_named(tmp_path: Path) -> None:
    (tmp_path / "in.uff").write_text("    -1\n    58\nVoltage\nNONE\n" + "0 1 2 3\n" * 9, "utf-8")
    with refused(r"a universal file .* dataset 58"):
        imported(tmp_path / "in.uff")
    path = tmp_path / "qcodes_1_8eca82b0-0000-0000-0000-01a21f0fa9c5.csv"
    path.write_text(rows(plain(TIME), plain(1e3 * MOVED), plain(VOLTAGE), separator="\t"), "utf-8")
    with refused(r"QCoDeS sorts .* import that one.* voltage_kV=COLUMN"):
        imported(path)


@pytest.mark.parametrize("dates", [False, True])
def test_a_sheet_with_a_date_and_a_time_of_day(tmp_path: Path, dates: bool) -> None:
    book = Workbook()
    began = datetime(2026, 3, 2, 23, 59, 59, 700_000)
    book.active.append(["Day", "Time", "Voltage (V)", "Displacement (mm)"][not dates :])
    for t, v, m in zip(TIME.tolist(), VOLTAGE.tolist(), MOVED.tolist(), strict=True):
        moment = began + timedelta(seconds=t)
        book.active.append([moment.date(), moment.time(), v, 1e3 * m][not dates :])
    book.save(tmp_path / "in.xlsx")
    run = taken(tmp_path / "in.xlsx")
    np.testing.assert_allclose(run.time, TIME, atol=2e-6)


def test_octaves_text(tmp_path: Path) -> None:
    (tmp_path / "in.mat").write_text(octave_text(COLUMNS), "utf-8")
    same(taken(tmp_path / "in.mat"))
    one = "# Created by Octave 9.2.0, Fri Nov 27 22:32:40 2026 UTC <user@host>\n"
    inner = octave_text(COLUMNS).partition("\n")[2]
    (tmp_path / "in.txt").write_text(
        f"{one}# name: note\n# type: string\n# elements: 1\n# length: 2\nab\n\n\n"
        f"# name: run\n# type: scalar struct\n# ndims: 2\n 1 1\n# length: 3\n{inner}\n\n", "utf-8"
    )  # fmt: skip
    same(taken(tmp_path / "in.txt"))
    text = octave_text({n: v for n, v in COLUMNS.items() if n != "time_s"})
    text += "# name: time_s\n# type: double_range\n# base, limit, increment\n0 0.59 0.01\n\n\n"
    (tmp_path / "in.mat").write_text(text, "utf-8")
    same(taken(tmp_path / "in.mat"))
    (tmp_path / "in.mat").write_text(octave_text(COLUMNS)[:900], "utf-8")
    with refused("cannot be read as a text file of Octave"):
        imported(tmp_path / "in.mat")


def test_octaves_hdf5(tmp_path: Path) -> None:
    path = tmp_path / "in.h5"
    with h5py.File(path, "w") as file:
        for name, values in list(COLUMNS.items())[1:]:
            file[f"run/value/{name}/type"] = np.bytes_("matrix")
            file[f"run/value/{name}/value"] = values[None, :]
        kind = [("base", "f8"), ("limit", "f8"), ("increment", "f8")]
        file["run/value/time_s/value"] = np.array((0.0, TIME[-1], 0.01), dtype=kind)
    same(taken(path))


def test_pymodaqs_attributes_are_texts_in_json(tmp_path: Path) -> None:
    path = tmp_path / "in.h5"
    with h5py.File(path, "w") as file:
        for place, (label, unit, values) in enumerate(
            [("time", "s", TIME), ("monitor", "kV", VOLTAGE / 1e3), ("laser", "mm", 1e3 * MOVED)]
        ):
            data = file.create_dataset(f"RawData/CH0{place}/Data00", data=values)
            for key, text in (("label", label), ("units", unit)):
                data.attrs[key] = json.dumps(
                    {"module": "builtins", "type": "str", "data": repr(text)}
                )
    same(taken(path))


def test_rows_of_a_curve_are_columns(tmp_path: Path) -> None:
    path = tmp_path / "in.h5sig"
    with h5py.File(path, "w") as file:
        for name, unit, values in (("Voltage", "V", VOLTAGE), ("Displacement", "m", MOVED)):
            group = file.create_group(name)
            group["xydata"] = np.array([TIME, values, np.full(ROWS, 0.1)])
            for key, text in (
                ("xlabel", "Time"),
                ("xunit", "s"),
                ("ylabel", name),
                ("yunit", unit),
            ):
                group.attrs[key] = text
    same(taken(path))


def test_scales_and_fill_values_of_netcdf(tmp_path: Path) -> None:
    path = tmp_path / "in.nc"
    with h5py.File(path, "w") as file:
        file["time"] = TIME
        volts = file.create_dataset("voltage", data=np.round(VOLTAGE * 2).astype("i2"))
        volts.attrs["scale_factor"], volts.attrs["add_offset"] = 0.5, 3.0
        moved = (1e3 * MOVED).astype("f4")
        moved[50] = 9.96921e36
        file["displacement"] = moved
        file["displacement"].attrs["_FillValue"] = np.float32(9.96921e36)
        for name, unit in (("time", "s"), ("voltage", "V"), ("displacement", "mm")):
            file[name].attrs["units"] = unit
    with refused(
        "row 51, column 'displacement': 9.96921e\\+36 is the _FillValue that the file decl"
    ):
        imported(path)
    run = taken(path, skip_bad_rows=True)
    np.testing.assert_allclose(run.voltage_command, VOLTAGE, atol=0.26)
    np.testing.assert_allclose(run.displacement[~run.missing], np.delete(MOVED, 50), rtol=1e-6)
    assert np.flatnonzero(run.missing).tolist() == [50]


def test_traces_are_called_as_their_dataset(tmp_path: Path) -> None:
    path = tmp_path / "in.h5"
    kind = [("t", "f8"), ("values", "f8")]
    with h5py.File(path, "w") as file:
        for name, values in (("HV_monitor_V", VOLTAGE), ("laser_mm", 1e3 * MOVED)):
            trace = np.zeros(ROWS, kind)
            trace["t"], trace["values"] = TIME, values
            file[f"traces/{name}"] = trace
    with refused(r"displacement_mm=traces/laser_mm/values") as raised:
        imported(path)
    assert "voltage_V=traces/HV_monitor_V/values" in with_hints(raised.value)
    assert "time_UNIT=" in with_hints(raised.value)


def pandas_group(file: h5py.File, kind: str) -> h5py.Group:
    group = file.create_group("run")
    group.attrs["pandas_type"] = np.bytes_(kind)
    return group


@pytest.mark.parametrize("dated", [False, True])
def test_pandas_fixed_format(tmp_path: Path, dated: bool) -> None:
    path = tmp_path / "in.h5"
    names = ["displacement_mm", "voltage_V"] + ([] if dated else ["time_s"])
    with h5py.File(path, "w") as file:
        group = pandas_group(file, "frame")
        group["axis0"] = group["block0_items"] = np.array(names, "S15")
        group["block0_values"] = np.column_stack([COLUMNS[name] for name in names])
        stamps = np.round(1e9 * TIME).astype("i8") + 1_772_000_000 * 10**9
        group["axis1"] = stamps if dated else np.arange(ROWS)
        group["axis1"].attrs["kind"] = np.bytes_("datetime64[ns]" if dated else "integer")
        group["axis1"].attrs["name"] = np.bytes_("N.")
    same(taken(path))


def test_pandas_table_format(tmp_path: Path) -> None:
    path = tmp_path / "in.h5"
    kind = [("index", "i8"), ("values_block_0", "f8", (2,))]
    table = np.zeros(ROWS, kind)
    table["index"] = np.round(1e9 * TIME)
    table["values_block_0"] = np.column_stack([1e3 * MOVED, VOLTAGE])
    with h5py.File(path, "w") as file:
        group = pandas_group(file, "frame_table")
        group.attrs["info"] = np.bytes_("(dp0\nI1\n(dp1\nVindex_name\np8\nVelapsed\np9\nss.")
        data = group.create_dataset("table", data=table)
        data.attrs["index_kind"] = np.bytes_("timedelta64[ns]")
        data.attrs["values_block_0_kind"] = np.bytes_(
            "(lp0\nVdisplacement_mm\np1\naVvoltage_V\np2\na."
        )
        index = group.create_group("_i_table")
        index.attrs["CLASS"] = np.bytes_("TINDEX")
        index["sortedLR"] = np.arange(131.0)
    same(taken(path))


def test_a_pickle_is_never_loaded(tmp_path: Path) -> None:
    path = tmp_path / "in.h5"
    with h5py.File(path, "w") as file:
        group = pandas_group(file, "frame_table")
        table = np.zeros(ROWS, [("index", "i8"), ("values_block_0", "f8", (2,))])
        data = group.create_dataset("table", data=table)
        mark = tmp_path / "loaded"
        data.attrs["values_block_0_kind"] = np.bytes_(f"cos\nmkdir\n(V{mark}\ntR.")
    with pytest.raises(InputError):
        imported(path)
    assert not mark.exists()


@pytest.mark.parametrize("index", ["time", "numbers", "dates"])
def test_json_with_an_index_for_keys(tmp_path: Path, index: str) -> None:
    began = datetime(2026, 3, 2, 12)
    keys = {
        "time": plain(TIME),
        "numbers": [str(i) for i in range(ROWS)],
        "dates": [(began + timedelta(seconds=t)).isoformat(timespec="milliseconds") for t in TIME],
    }[index]
    names = NAMES[index != "numbers" :]
    content = {n: dict(zip(keys, COLUMNS[n].tolist(), strict=True)) for n in names}
    (tmp_path / "in.json").write_text(json.dumps(content), "utf-8")
    if index == "time":
        with refused("time_UNIT=index --column voltage_V=voltage_V"):
            imported(tmp_path / "in.json")
        same(taken(tmp_path / "in.json", columns={"time_s": "index"}))
    else:
        same(taken(tmp_path / "in.json"))


def test_mat_7_3_is_known_by_the_signature_behind_its_text(tmp_path: Path) -> None:
    path = tmp_path / "in.mat"
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, values in COLUMNS.items():
            file[name] = values[None, :]
            file[name].attrs["MATLAB_class"] = np.bytes_("double")
    content = path.read_bytes()
    text = b"MATLAB 5.0 MAT-file, Platform: Python".ljust(124) + b"\0\2IM"
    path.write_bytes(text + content[len(text) :])
    same(taken(path))


@pytest.mark.parametrize("again", [0.0, 60.0])
def test_a_tdms_file_that_was_continued_is_said(tmp_path: Path, again: float) -> None:
    path = tmp_path / "in.tdms"
    start = np.datetime64("2026-03-02T09:00:00")
    for part, late in ((slice(0, 30), 0.0), (slice(30, ROWS), again)):
        about = {
            "wf_increment": 0.01, "wf_start_offset": 0.0,
            "wf_start_time": start + np.timedelta64(int(late * 1e3), "ms"),
        }  # fmt: skip
        with TdmsWriter(path, mode="w" if part.start == 0 else "a") as writer:
            writer.write_segment(
                [ChannelObject("rig", n, v[part], about) for n, v in list(COLUMNS.items())[1:]]
            )
    done = imported(path)
    assert any("was continued" in d and "60 s after its start" in d for d in done.warnings) == (
        again > 0
    )


@pytest.mark.parametrize("word", ["Labels", "Label", "Channel Label:"])
def test_the_labels_of_an_oscilloscope_name_its_channels(tmp_path: Path, word: str) -> None:
    path = tmp_path / "in.csv"
    head = f"Model,MSO24\n\nVertical Scale,1,1\n{word},HV (V),Laser (mm)\nTIME (s),CH1,CH2\n"
    path.write_text(head + "\n".join(",".join(f"{v:.12g}" for v in row) for row in TABLE), "utf-8")
    same(taken(path))
    # what the line leaves empty keeps its name
    path.write_text(path.read_text("utf-8").replace(",HV (V),", ",,"), "utf-8")
    same(taken(path, columns={"voltage_V": "CH1"}))


def test_a_first_column_of_labels_is_a_column(tmp_path: Path) -> None:
    path = tmp_path / "in.csv"
    rows = "\n".join(f"{i},{v:.12g},{d:.12g}" for i, (_, v, d) in enumerate(TABLE.tolist()))
    path.write_text(f"Label,HV (V),Laser (mm)\n{rows}\n", "utf-8")
    same(taken(path, rate_Hz=100.0))


@pytest.mark.parametrize("dated", [False, True])
def test_the_index_of_a_table_that_pandas_splits_may_be_the_time(
    tmp_path: Path, dated: bool
) -> None:
    path = tmp_path / "in.json"
    start = datetime(2024, 4, 12, 23, 59, 58)
    index = [(start + timedelta(seconds=t)).isoformat() if dated else t for t in TIME.tolist()]
    content = {"columns": NAMES[1:], "index": index, "data": TABLE[:, 1:].tolist()}
    path.write_text(json.dumps(content), "utf-8")
    if not dated:
        with refused("'index' may be the time.*--column time_UNIT=index"):
            imported(path)
    same(taken(path, columns={} if dated else {"time_s": "index"}))


def test_an_index_without_a_name_may_be_the_time_in_a_table_of_pandas(tmp_path: Path) -> None:
    path = tmp_path / "in.json"
    rows = [dict(zip(("index", *NAMES[1:]), row, strict=True)) for row in TABLE.tolist()]
    fields = [{"name": name, "type": "number"} for name in rows[0]]
    path.write_text(json.dumps({"schema": {"fields": fields}, "data": rows}), "utf-8")
    with refused("'data.index' may be the time.*--column time_UNIT=data.index"):
        imported(path)
    same(taken(path, columns={"time_s": "data.index"}))
