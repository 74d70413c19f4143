"""Files of other programs that are no text: workbooks, JSON, HDF5, MAT, TDMS and Parquet."""

from __future__ import annotations

import json
import re
import zipfile
from collections.abc import Iterable, Sequence
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import pytest
from openpyxl import Workbook

from dearig.errors import InputError
from dearig.recording import Recording, import_file, open_recording
from dearig.recording.importers import Imported, ImportOptions
from dearig.recording.importers.listing import preview
from tests.recording.test_import_kinds import MOVED, ROWS, TIME, VOLTAGE, same
from tests.tools.recordings import Clock

NAMES = ("time_s", "voltage_V", "displacement_mm")
TABLE = np.column_stack([TIME, VOLTAGE, MOVED * 1e3])


def imported(path: Path, **options: object) -> Imported:
    out = path.parent / "out.h5"
    return import_file(path, out, ImportOptions(**options), overwrite=True, now=Clock())


def taken(path: Path, **options: object) -> Recording:
    imported(path, **options)
    return open_recording(path.parent / "out.h5")


def workbook(path: Path, **sheets: Iterable[Sequence[object]]) -> Path:
    book = Workbook()
    book.remove(book.active)
    for title, rows in sheets.items():
        sheet = book.create_sheet(title)
        for row in rows:
            sheet.append(list(row))
    book.save(path)
    return path


def rows(names: Sequence[object] = NAMES, table: np.ndarray = TABLE) -> list[Sequence[object]]:
    return [names, *table.tolist()]


def test_a_workbook_is_read_as_it_is(tmp_path: Path) -> None:
    path = workbook(tmp_path / "in.xlsx", Sheet1=rows())
    same(taken(path))
    assert [(c.number, c.name, c.unit) for c in preview(path)] == [
        (1, "time_s", "s"), (2, "voltage_V", "V"), (3, "displacement_mm", "mm"),
    ]  # fmt: skip
    units = [("Zeit", "Spannung", "Weg"), ("s", "kV", "µm")]
    block = [("Prüfer", "me"), (), ("Dicke", 1.5, "mm")]
    scaled = (TABLE * [1, 1e-3, 1e3]).tolist()
    same(taken(workbook(tmp_path / "in.xlsx", Notes=[("read me",)], Log=[*block, *units, *scaled])))


def test_a_sheet_is_chosen_or_asked_for(tmp_path: Path) -> None:
    path = workbook(
        tmp_path / "in.xlsx",
        First=rows(),
        Second=rows(table=2 * TABLE),
        Summary=rows(("run", "peak_kV"), np.array([[1, 2.3], [2, 4.6]])),
    )
    with pytest.raises(InputError, match=r"--table takes one: First, Second\)\. .* --table First"):
        imported(path)
    np.testing.assert_allclose(taken(path, table="Second").time, 2 * TIME)
    with pytest.raises(
        InputError, match="no table 'Secnd'; there are: First, Second, Summary; did"
    ):
        imported(path, table="Secnd")
    path = workbook(tmp_path / "in.xlsx", Peaks=[NAMES[:2], (1, 2), (3, 4)], Log=rows())
    assert any("of 2 tables, 'Log' was taken" in note for note in imported(path).notes)
    same(open_recording(tmp_path / "out.h5"))


FILM = np.column_stack([TIME, 5.0 * TIME, 0.3 + 2.1 * TIME])


@pytest.mark.parametrize("suffix", ["xlsx", "csv"])
def test_specimens_side_by_side_are_chosen_from(tmp_path: Path, suffix: str) -> None:
    """Merged cells name the specimens; the second one has fewer rows."""
    head = [
        ("Specimen 1", None, None, "Specimen 2", None, None),
        ("Time", "Extension", "Load") * 2,
        ("(s)", "(mm)", "(N)") * 2,
    ]
    body = [(*row, *(2 * row if i < 40 else (None,) * 3)) for i, row in enumerate(FILM)]
    path = tmp_path / f"in.{suffix}"
    if suffix == "xlsx":
        workbook(path, Sheet1=[*head, *body])
    else:
        lines = [",".join("" if c is None else str(c) for c in row) for row in [*head, *body]]
        path.write_text("\n".join(lines), "utf-8")
    size = {"gauge_length_mm": 30.0, "area_mm2": 18.0}
    with pytest.raises(InputError, match="--table takes one: Specimen 1, Specimen 2"):
        imported(path, **size)
    one, two = taken(path, **size, table="Specimen 1"), taken(path, **size, table="Specimen 2")
    np.testing.assert_allclose(one.nominal_stress, FILM[:, 2] / 18e-6)
    np.testing.assert_allclose(two.nominal_stress, 2 * FILM[:40, 2] / 18e-6)
    np.testing.assert_allclose(two.stretch, 1 + 2 * FILM[:40, 1] / 30.0)


def test_names_that_repeat_as_a_whole_are_tables(tmp_path: Path) -> None:
    path = tmp_path / "in.csv"
    names = ",".join(NAMES)
    body = "\n".join(f"{a},{b},{c},,{a},{b},{2 * c}" for a, b, c in TABLE.tolist())
    path.write_text(f"{names},,{names}\n{body}\n", "utf-8")
    np.testing.assert_allclose(taken(path, table="2").displacement, 2 * MOVED)
    same(taken(path, table="1"))


def test_dates_and_texts_in_a_workbook(tmp_path: Path) -> None:
    start = datetime(2024, 3, 1, 23, 59, 59, 900_000)
    body = [
        (start + timedelta(seconds=t), f"{v:.6f}".replace(".", ","), d)
        for t, v, d in TABLE.tolist()
    ]
    run = taken(workbook(tmp_path / "in.xlsx", Log=[NAMES, *body]))
    np.testing.assert_allclose(run.time, TIME, atol=1e-3)  # Excel keeps milliseconds
    np.testing.assert_allclose(run.voltage_command, VOLTAGE, atol=1e-6)


def test_cells_of_a_workbook_that_are_no_numbers(tmp_path: Path) -> None:
    body = TABLE.tolist()
    body[9][1] = "OVER"
    body[19][2] = None
    path = workbook(tmp_path / "in.xlsx", Log=[NAMES, *body[:30], [], *body[30:], ["End of test"]])
    with pytest.raises(
        InputError, match="sheet 'Log', row 11, column 'voltage_V': 'OVER' is not a"
    ):
        imported(path)
    done = imported(path, skip_bad_rows=True)
    assert any("3 rows were left out" in doubt for doubt in done.doubts)
    run = open_recording(tmp_path / "out.h5")
    np.testing.assert_allclose(run.time, np.delete(TIME, [9, 19]))
    assert any("row 63" in event.message for event in run.events)


def test_formulas_have_the_values_that_were_saved(tmp_path: Path) -> None:
    body = [(t, v, f"=B{i}*0") for i, (t, v, _) in enumerate(TABLE.tolist(), 2)]
    path = workbook(tmp_path / "in.xlsx", Log=[NAMES, *body])
    with pytest.raises(
        InputError, match="'displacement_mm': a formula without its value: open the"
    ):
        imported(path)
    with zipfile.ZipFile(path) as archive:
        sheet = archive.read(SHEET).decode()
    saved = iter(MOVED.tolist())
    sheet = re.sub(r"</f><v ?/>|</f><v></v>", lambda _: f"</f><v>{1e3 * next(saved)}</v>", sheet)
    rewritten(path, {SHEET: sheet.encode()})
    same(taken(path))


def rewritten(path: Path, change: dict[str, bytes]) -> Path:
    """Put other parts into a workbook."""
    with zipfile.ZipFile(path) as archive:
        parts = {name: archive.read(name) for name in archive.namelist()}
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in {**parts, **change}.items():
            archive.writestr(name, content)
    return path


SHEET = "xl/worksheets/sheet1.xml"
HEAD = b'<worksheet xmlns="http://schemas.openxmlformats.org/spreadsheetml/2006/main"><sheetData>'
TAIL = b"</sheetData></worksheet>"


@pytest.mark.parametrize(
    ("part", "content", "match"),
    [
        (SHEET, HEAD + b'<row r="4000000000"><c r="A4000000000"><v>1</v></c></row>' + TAIL,
         "no two lines|is empty|more than 1,048,576 rows"),
        (SHEET, HEAD + b'<row r="1"><c r="ZZZ1"><v>1</v></c></row>' + TAIL, "18,278 columns"),
        (SHEET, HEAD + b"<row>" + b" " * 2**26 + b"</row>" + TAIL, "unpacks to 67,1.* export it"),
        (SHEET, HEAD + b"<row>" + b"<c/>" * 2**19 + b"</row>" + TAIL, "a row of more than"),
        (SHEET, b'<!DOCTYPE x [<!ENTITY a "aaaa">]>' + HEAD + TAIL, "does not begin as a part"),
        (SHEET, HEAD + b"<row", "cannot be read as an Excel workbook"),
        ("xl/sharedStrings.xml", b"<sst>" + b"<si/>" * 2**20 + b"</sst>", "sharedStrings.xml unp"),
        ("xl/styles.xml", b"<x>" + b" " * 2**21 + b"</x>", "styles.xml unpacks to"),
    ],
)  # fmt: skip
def test_hostile_workbooks_are_a_sentence(
    tmp_path: Path, part: str, content: bytes, match: str
) -> None:
    path = rewritten(workbook(tmp_path / "in.xlsx", Log=rows()), {part: content})
    with pytest.raises(InputError, match=match):
        imported(path)


def test_what_looks_like_a_workbook_and_is_none(tmp_path: Path) -> None:
    path = tmp_path / "in.xls"
    path.write_bytes(b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(600))
    with pytest.raises(InputError, match=r"Excel 97 to 2003, or one with a password.* as \.xlsx"):
        imported(path)
    path.write_text(
        ",".join(NAMES) + "\n" + "\n".join(f"{a},{b},{c}" for a, b, c in TABLE), "utf-8"
    )
    same(taken(path))  # many programs call a text table .xls
    for part, match in (
        ("content.xml", "an OpenDocument file: open it"),
        ("xl/workbook.bin", r"a binary workbook \(\.xlsb\)"),
        ("run.csv", "an archive of run.csv and no workbook: unpack it"),
    ):
        with zipfile.ZipFile(tmp_path / "in.zip", "w") as archive:
            archive.writestr(part, "x")
        with pytest.raises(InputError, match=match):
            imported(tmp_path / "in.zip")


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
    with pytest.raises(InputError, match="line 5, column 'voltage_V': there is no value; --skip-"):
        imported(path)
    imported(path, skip_bad_rows=True)
    run = open_recording(tmp_path / "out.h5")
    np.testing.assert_allclose(run.time, np.delete(TIME, [4, 7]))
    path.write_text(json.dumps({"first": as_columns(), "second": as_columns()}), "utf-8")
    same(taken(path))  # they are the same
    other = {name: [2 * value for value in column] for name, column in as_columns().items()}
    path.write_text(json.dumps({"first": other, "second": as_columns()}), "utf-8")
    with pytest.raises(InputError, match="--table takes one: first, second"):
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
        with pytest.raises(InputError, match=match):
            imported(path)


def test_stretch_is_proposed_for_numbers_that_look_like_it(tmp_path: Path) -> None:
    table = np.column_stack([TIME, 1 + TIME, 20 * TIME])
    path = workbook(tmp_path / "in.xlsx", Log=table.tolist())
    with pytest.raises(InputError, match="'stretch=#2' --column 'nominal_stress_kPa=#3'"):
        imported(path)
    columns = {"time_s": "#1", "stretch": "#2", "nominal_stress_kPa": "#3"}
    assert taken(path, columns=columns).samples == ROWS
