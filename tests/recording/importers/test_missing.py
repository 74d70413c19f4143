"""Readings that a file does not have: their samples stay, and nothing is computed from them."""

from __future__ import annotations

import json
from pathlib import Path

import h5py
import numpy as np
import pytest
from openpyxl import Workbook
from scipy.io import savemat

from dearig.analysis.readings.record import Readings
from dearig.errors import InputError
from dearig.recording.content.layout import MISSING
from dearig.recording.exporters import EXPORTS, export_recording
from dearig.recording.importers import ImportOptions, import_file
from dearig.recording.reading.reader import open_recording
from dearig.recording.reading.recording import Recording
from dearig.recording.reading.summary import describe, describe_rows
from dearig.recording.verify import verify

ROWS = 600
TIME = np.arange(ROWS) * 0.01
VOLTAGE = np.where(TIME < 0.5, 0.0, 3e3 * np.sin(2.0 * (TIME - 0.5)) ** 2)
NOISE = np.random.default_rng(1).normal(0.0, 1e-3, ROWS)  # mm
MM = 0.3 + (VOLTAGE / 3e3) ** 2 + NOISE
#: At rest, where the film moves, a single one, and the last one.
GAPS = [*range(10, 16), *range(200, 230), 400, ROWS - 1]
NAMES = ("Time (s)", "Voltage (V)", "Laser (mm)")
COLUMNS = {"displacement_mm": "Laser (mm)"}


def cells(word: str, decimal: str = ".") -> list[list[str]]:
    rows = [[f"{v:.9g}" for v in row] for row in np.column_stack((TIME, VOLTAGE, MM))]
    for at in GAPS:
        rows[at][2] = word
    return [[cell.replace(".", decimal) for cell in row[:2]] + (
        [row[2] if row[2] == word else row[2].replace(".", decimal)]
    ) for row in rows]  # fmt: skip


def text(path: Path, word: str, separator: str = ",", decimal: str = ".") -> Path:
    lines = [NAMES, *cells(word, decimal)]
    path.write_text("\n".join(map(separator.join, lines)) + "\n", "utf-8")
    return path


def as_json(path: Path) -> Path:
    rows = {n: c.tolist() for n, c in zip(NAMES, (TIME, VOLTAGE, MM), strict=True)}
    for at in GAPS:
        rows[NAMES[2]][at] = None
    path.write_text(json.dumps(rows), "utf-8")
    return path


def workbook(path: Path) -> Path:
    book = Workbook()
    book.active.append(NAMES)
    for row in cells("---"):
        book.active.append([float(c) if c != "---" else None for c in row])
    book.save(path)
    return path


def with_gaps(value: float) -> np.ndarray:
    moved = MM.copy()
    moved[GAPS] = value
    return moved


def matlab(path: Path) -> Path:
    savemat(path, {"time_s": TIME, "voltage_V": VOLTAGE, "laser_mm": with_gaps(np.inf)})
    return path


def netcdf(path: Path) -> Path:
    with h5py.File(path, "w") as file:
        file["time_s"], file["voltage_V"] = TIME, VOLTAGE
        file["laser_mm"] = with_gaps(-999.0)
        file["laser_mm"].attrs["missing_value"] = -999.0
    return path


FILES = {
    "marker": lambda folder: text(folder / "in.csv", "-99999.9999"),
    "overflow": lambda folder: text(folder / "in.csv", "OVRFLW"),
    "comma": lambda folder: text(folder / "in.txt", "---", ";", ","),
    "empty": lambda folder: text(folder / "in.tsv", "", "\t"),
    "nan": lambda folder: text(folder / "in.csv", "NaN"),
    "infinite": lambda folder: text(folder / "in.csv", "-1.#IND"),
    "json": lambda folder: as_json(folder / "in.json"),
    "xlsx": lambda folder: workbook(folder / "in.xlsx"),
    "mat": lambda folder: matlab(folder / "in.mat"),
    "netcdf": lambda folder: netcdf(folder / "in.nc"),
}


def taken(path: Path, skip: bool = True, **options: object) -> Recording:
    out = path.with_name("out.h5")
    name = "laser_mm" if path.suffix in (".mat", ".nc") else "Laser (mm)"
    chosen = ImportOptions(columns={"displacement_mm": name}, skip_bad_rows=skip, **options)
    import_file(path, out, chosen, overwrite=True)
    return open_recording(out)


def whole(folder: Path) -> Recording:
    """The same data without gaps."""
    (folder / "whole").mkdir()
    lines = [NAMES, *([f"{v:.9g}" for v in r] for r in np.column_stack((TIME, VOLTAGE, MM)))]
    path = folder / "whole" / "in.csv"
    path.write_text("\n".join(map(",".join, lines)), "utf-8")
    return taken(path)


@pytest.mark.parametrize("kind", FILES)
def test_a_row_without_a_reading_stays_and_its_reading_is_missing(
    tmp_path: Path, kind: str
) -> None:
    path = FILES[kind](tmp_path)
    if kind != "marker":  # which says itself what it is
        with pytest.raises(InputError, match=f"{len(GAPS)} of {ROWS} rows are so"):
            taken(path, skip=False)
    run = taken(path, skip=kind != "marker")
    np.testing.assert_allclose(run.time, TIME, atol=1e-12)
    np.testing.assert_allclose(run.voltage_command, VOLTAGE, rtol=1e-8)
    assert np.flatnonzero(run.missing).tolist() == GAPS
    assert np.flatnonzero(np.isnan(run.displacement)).tolist() == GAPS
    # the zero is the mean of the readings at rest that are there
    rest = np.delete(MM[: run.quiet_samples], GAPS[:6]).mean() * 1e-3
    assert run.rest_reading == pytest.approx(rest, rel=1e-6)
    there = ~run.missing
    np.testing.assert_allclose(run.displacement[there], 1e-3 * MM[there] - rest, atol=1e-11)
    said = [e.message for e in run.events if e.level == "warning"]
    assert any(f"{len(GAPS)} " in words and "no fit uses them" in words for words in said)
    assert not any("left out" in words for words in said)


def test_no_fit_uses_a_missing_reading(tmp_path: Path) -> None:
    run, other = taken(FILES["marker"](tmp_path), skip=False), whole(tmp_path)
    found, plain = Readings(run), Readings(other)
    record = found.record
    assert not record.valid[GAPS].any()
    assert np.isfinite(record.measured).all()
    assert np.abs(found.displacement).max() < 2e-3
    assert any(f"{len(GAPS)} readings are missing" in words for words in found.quality.findings)
    assert found.noise.value == pytest.approx(plain.noise.value, rel=0.2)
    assert run.noise.value == found.noise.value
    # samples that are there are used as without the gaps
    assert np.count_nonzero(record.valid) >= ROWS - len(GAPS) - 2


def test_missing_readings_are_told_by_info_and_verified(tmp_path: Path) -> None:
    run = taken(FILES["marker"](tmp_path), skip=False)
    rows = dict(describe_rows(run))
    assert rows["displacement"].endswith(f"um, {len(GAPS)} of {ROWS} readings missing")
    channel = next(c for c in describe(run)["channels"] if c["name"] == "displacement")
    assert channel["missing"] == len(GAPS)
    assert channel["max"] < 2e-3
    checked = verify(run.path)
    assert checked.sound
    assert any("readings of /entry/data/displacement are missing" in n for n in checked.notes)


@pytest.mark.parametrize("suffix", list(EXPORTS))
def test_missing_readings_are_exported_and_imported_again(tmp_path: Path, suffix: str) -> None:
    run = taken(FILES["overflow"](tmp_path))
    table = tmp_path / f"again.{suffix}"
    export_recording(run.path, suffix, table)
    done = import_file(table, tmp_path / "again.h5")
    assert any("readings of 'displacement_m' are missing" in words for words in done.warnings)
    again = open_recording(tmp_path / "again.h5")
    assert again.rest_reading == run.rest_reading
    for name, values in run.values.items():
        np.testing.assert_array_equal(again.values[name], values)


def test_only_the_drive_is_needed_of_a_row(tmp_path: Path) -> None:
    rows = cells("")
    rows[300][1] = "OVRFLW"
    rows[301][0] = ""
    for at, row in enumerate(rows):
        row += [f"{3e-3 * at:.6g}" if at % 50 else "OL", f"{0.1 * at:.6g}"]
    names = [*NAMES, "Monitor (kV)", "Current (uA)"]
    path = tmp_path / "in.csv"
    path.write_text("\n".join(map(",".join, [names, *rows])), "utf-8")
    asked = COLUMNS | {"voltage_monitor_kV": "Monitor (kV)", "current_uA": "Current (uA)"}
    import_file(path, tmp_path / "out.h5", ImportOptions(columns=asked, skip_bad_rows=True))
    run = open_recording(tmp_path / "out.h5")
    np.testing.assert_allclose(run.time, np.delete(TIME, [300, 301]), atol=1e-12)
    assert np.isnan(run.voltage_monitor).sum() == ROWS // 50 - 1
    assert np.isfinite(run.current_monitor).all()
    with pytest.raises(InputError, match="11 of 598 readings of the voltage monitor are missing"):
        _ = Readings(run, "monitor").quality
    reasons = {c.name: c.reason for c in Readings(run).electric.channels}
    assert "a part of its readings is missing" in reasons["voltage_monitor"]


def test_of_a_film_the_stress_may_be_missing_and_the_stretch_not(tmp_path: Path) -> None:
    stretch = 1.0 + 0.2 * TIME
    stress = 50.0 * (stretch - stretch**-2) + NOISE
    rows = [[f"{v:.9g}" for v in row] for row in np.column_stack((TIME, stretch, stress))]
    rows[100][2] = rows[101][2] = "***"
    rows[200][1] = "***"
    path = tmp_path / "in.csv"
    lines = [("Time (s)", "Stretch", "Nominal stress (kPa)"), *rows]
    path.write_text("\n".join(map(",".join, lines)), "utf-8")
    import_file(path, tmp_path / "out.h5", ImportOptions(skip_bad_rows=True))
    run = open_recording(tmp_path / "out.h5")
    assert run.samples == ROWS - 1
    assert np.flatnonzero(run.missing).tolist() == [100, 101]
    assert not Readings(run).record.valid[[100, 101]].any()


def test_a_column_without_readings_is_refused(tmp_path: Path) -> None:
    rows = [[*row[:2], "OVRFLW"] for row in cells("")]
    path = tmp_path / "in.csv"
    path.write_text("\n".join(map(",".join, [NAMES, *rows])), "utf-8")
    with pytest.raises(InputError, match="has 0 numbers in 600 rows, and at least 2 are needed"):
        taken(path)


def test_groups_of_thousands_are_no_missing_readings(tmp_path: Path) -> None:
    rows = [[t, v, f'"{1e3 * float(m):,.3f}"'] for t, v, m in cells("0.5")]
    names = (*NAMES[:2], "Laser (um)")
    path = tmp_path / "in.csv"
    path.write_text("\n".join(map(",".join, [names, *rows])), "utf-8")
    options = ImportOptions(columns={"displacement_um": "Laser (um)"}, skip_bad_rows=True)
    import_file(path, tmp_path / "out.h5", options)
    assert open_recording(tmp_path / "out.h5").missing is None


@pytest.mark.parametrize(
    ("name", "value", "count"),
    [("displacement", np.nan, 0), ("displacement", np.nan, 2), ("displacement", np.inf, 1),
     ("voltage_command", np.nan, 1), ("displacement", np.nan, [1])],
)  # fmt: skip
def test_a_damaged_value_is_no_missing_reading(
    tmp_path: Path, name: str, value: float, count: int
) -> None:
    run = whole(tmp_path)
    with h5py.File(run.path, "r+") as file:
        row = file["entry/data"][name]
        row[30] = value
        row.attrs[MISSING] = count
    assert not verify(run.path).sound
    with pytest.raises(InputError, match="at sample 30, not a number"):
        open_recording(run.path).arrays.read(name)
