"""Workbooks, and files with several tables: sheets, and specimens in all their arrangements."""

from __future__ import annotations

import re
import zipfile
from collections.abc import Iterable, Sequence
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import pytest
from openpyxl import Workbook

from dearig.recording import open_recording
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
    with refused(r"one must be chosen: First, Second\)\. Put .* TABLE, and run: .* --table TABLE$"):
        imported(path)
    np.testing.assert_allclose(taken(path, table="Second").time, 2 * TIME)
    with refused("no table 'Secnd'; there are: First, Second, Summary; did"):
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
    with refused("one must be chosen: Specimen 1, Specimen 2"):
        imported(path, **size)
    one, two = taken(path, **size, table="Specimen 1"), taken(path, **size, table="Specimen 2")
    np.testing.assert_allclose(one.nominal_stress, FILM[:, 2] / 18e-6)
    np.testing.assert_allclose(two.nominal_stress, 2 * FILM[:40, 2] / 18e-6)
    np.testing.assert_allclose(two.stretch, 1 + 2 * FILM[:40, 1] / 30.0)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-16", "cp1252"])
def test_specimens_one_below_another_are_chosen_from(tmp_path: Path, encoding: str) -> None:
    path = tmp_path / "in.txt"
    names = ["Zeit (s)\tWeg (mm)\tKraft (N)"]
    first, second = (["\t".join(map(str, row)) for row in times * FILM] for times in (1.0, 2.0))
    second[5] = "over\t1\t2"
    parts = [["Prüfling\tA"], names, first, ["", "Prüfling\tB", "Prüfer\tme"], names, second]
    path.write_text("\n".join(line for part in parts for line in part), encoding)
    size = {"gauge_length_mm": 30.0, "area_mm2": 18.0}
    with refused("one must be chosen: Prüfling A, Prüfling B"):
        imported(path, **size)
    assert [column.table for column in preview(path)] == [*["Prüfling A"] * 3, *["Prüfling B"] * 3]
    one = taken(path, **size, table="Prüfling A")
    np.testing.assert_allclose(one.nominal_stress, FILM[:, 2] / 18e-6)
    line = 2 + ROWS + 4 + 6
    with refused(f"line {line}, column 'Prüfling B/Zeit .s.': 'over' is not"):
        imported(path, **size, table="Prüfling B")
    two = taken(path, **size, table="Prüfling B", skip_bad_rows=True)
    np.testing.assert_allclose(two.nominal_stress, np.delete(2 * FILM[:, 2], 5) / 18e-6)
    assert any(f"line {line}" in event.message for event in two.events)


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
    with refused("sheet 'Log', row 11, column 'voltage_V': 'OVER' is not a"):
        imported(path)
    done = imported(path, skip_bad_rows=True)
    assert any("2 rows were left out" in doubt for doubt in done.warnings)
    assert any("row 21 (there is no value): no fit uses it" in doubt for doubt in done.warnings)
    run = open_recording(tmp_path / "out.h5")
    np.testing.assert_allclose(run.time, np.delete(TIME, 9))
    assert np.flatnonzero(np.isnan(run.displacement)).tolist() == [18]
    assert any("row 63" in event.message for event in run.events)


def test_formulas_have_the_values_that_were_saved(tmp_path: Path) -> None:
    body = [(t, v, f"=B{i}*0") for i, (t, v, _) in enumerate(TABLE.tolist(), 2)]
    path = workbook(tmp_path / "in.xlsx", Log=[NAMES, *body])
    with refused("'displacement_mm': a formula without its value: open the"):
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
    with refused(match):
        imported(path)


def test_what_looks_like_a_workbook_and_is_none(tmp_path: Path) -> None:
    path = tmp_path / "in.xls"
    path.write_bytes(b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(600))
    with refused(r"Excel 97 to 2003, or one with a password.* as \.xlsx"):
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
        with refused(match):
            imported(tmp_path / "in.zip")


def test_stretch_is_proposed_for_numbers_that_look_like_it(tmp_path: Path) -> None:
    table = np.column_stack([TIME, 1 + TIME, 20 * TIME])
    path = workbook(tmp_path / "in.xlsx", Log=table.tolist())
    with refused(r"stretch=COLUMN --column nominal_stress_MPa=COLUMN$"):
        imported(path)
    columns = {"time_s": "#1", "stretch": "#2", "nominal_stress_kPa": "#3"}
    assert taken(path, columns=columns).samples == ROWS
