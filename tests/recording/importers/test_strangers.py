"""Files as a stranger brings them: what each says is known, and comes in right or is asked."""

from __future__ import annotations

import json
from datetime import timedelta
from pathlib import Path

import h5py
import numpy as np
import pytest
from openpyxl import Workbook

from dearig.recording.importers.quantities.labels import label_of
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

HEAD = ("Time (s)", "Voltage (V)", "Displacement (mm)")


def write(folder: Path, *columns: object, head: object = HEAD, separator: str = ",") -> Path:
    """A text table; the columns are arrays or lists of cells, the head is names or lines."""
    lines = head if isinstance(head, str) else separator.join(head) + "\n"
    cells = [[c if isinstance(c, str) else f"{c:.12g}" for c in column] for column in columns]
    path = folder / "in.csv"
    path.write_text(lines + "\n".join(map(separator.join, zip(*cells, strict=True))), "utf-8")
    return path


@pytest.mark.parametrize(
    "name",
    ["Displacement uncertainty (mm)", "Displacement FEM (mm)", "Displacement*10 (mm)",
     "Displacement (mm)/2", "-Displacement (mm)", "d(Displacement)/dt (mm)", "Weg p-p [mm]",
     "log10 displacement (mm)", "Weg x100 [mm]", "Displacement^2 (mm)", "Displacement SP (mm)"],
)  # fmt: skip
def test_what_is_computed_or_not_known_is_no_reading(tmp_path: Path, name: str) -> None:
    assert label_of(name).asked == ("displacement",)
    path = write(tmp_path, TIME, VOLTAGE, 1e3 * MOVED, head=(*HEAD[:2], name))
    with refused("leaves open.*displacement_mm=COLUMN"):
        imported(path)


@pytest.mark.parametrize("name", ["Gap (mm)", "Film thickness (mm)", "Roughness (mm)"])
def test_a_unit_alone_makes_no_ready_command_for_a_name_with_words(
    tmp_path: Path, name: str
) -> None:
    path = write(tmp_path, TIME, VOLTAGE, 1e3 * MOVED, head=(*HEAD[:2], name))
    with refused(r"displacement_mm=COLUMN|has no column for displacement"):
        imported(path)


@pytest.mark.parametrize(
    ("names", "unit"),
    [(("Tiempo (s)", "Voltaje (V)", "Desplazamiento (mm)"), "mm"),
     (("Czas (s)", "Napięcie (V)", "Przemieszczenie (mm)"), "mm"),
     (("Время (s)", "Напряжение (V)", "Перемещение (mm)"), "mm"),
     (('"Time\n(s)"', '"Voltage\n(V)"', '"Displacement\n(mm)"'), "mm")],
)  # fmt: skip
def test_names_in_other_languages_and_on_two_lines(
    tmp_path: Path, names: tuple[str, ...], unit: str
) -> None:
    assert unit in names[2]
    same(taken(write(tmp_path, TIME, VOLTAGE, 1e3 * MOVED, head=names)))


def test_stauchung_is_compression(tmp_path: Path) -> None:
    stretch = 1.0 - 0.2 * TIME
    names = ("Zeit [s]", "Stauchung [%]", "Druckkraft [N]")
    path = write(tmp_path, TIME, 100.0 * (1.0 - stretch), TIME, head=names)
    run = taken(path, area_mm2=10.0)
    np.testing.assert_allclose(run.stretch, stretch, rtol=1e-9)
    np.testing.assert_allclose(run.nominal_stress, -1e5 * TIME, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize(
    ("place", "marker", "said"),
    [(2, "-9999", ""), (2, "-32768", ""), (2, "-7999", ""), (1, "-99999", ""), (0, "99999", ""),
     (2, "-1.#IND", "skip"), (2, "1.#QNAN", "skip")],
)  # fmt: skip
def test_written_markers_stand_for_no_reading(
    tmp_path: Path, place: int, marker: str, said: str
) -> None:
    cells = [[f"{v:.12g}" for v in column] for column in (TIME, VOLTAGE, 1e6 * MOVED + 300.0)]
    for at in (40, 41, 58):
        cells[place][at] = marker
    path = write(tmp_path, *cells, head=(*HEAD[:2], "Displacement (um)"))
    if said:
        with refused(r"3 of 60 rows are so; --skip-bad-rows"):
            imported(path)
    run = taken(path, skip_bad_rows=bool(said))
    kept = np.delete(np.arange(ROWS), [40, 41, 58])
    there = np.isfinite(run.displacement)
    assert run.samples == (ROWS if place == 2 else kept.size)
    np.testing.assert_allclose(run.time[there], TIME[kept], atol=1e-9)
    np.testing.assert_allclose(run.voltage_command[there], VOLTAGE[kept], rtol=1e-8)
    np.testing.assert_allclose(run.displacement[there], MOVED[kept], atol=1e-12)


def test_a_single_row_of_nines_is_a_marker_and_a_step_is_none(tmp_path: Path) -> None:
    moved = [f"{1e3 * m + 0.3:.9g}" for m in MOVED]
    moved[50] = "-99999"
    run = taken(write(tmp_path, TIME, VOLTAGE, moved))
    assert np.flatnonzero(run.missing).tolist() == [50]
    volts = np.where(TIME < 0.3, np.sin(9.0 * np.arange(ROWS)), 9990.0)
    assert taken(write(tmp_path, TIME, volts, 1e3 * MOVED)).samples == ROWS


@pytest.mark.parametrize(("at", "stamp"), [(57, "55"), (5, "-1")])
def test_the_stamp_that_is_wrong_is_left_out_and_not_all_behind_it(
    tmp_path: Path, at: int, stamp: str
) -> None:
    stamps = [f"{t:.2f}" for t in TIME]
    stamps[at] = stamp
    run = taken(write(tmp_path, stamps, VOLTAGE, 1e3 * MOVED), skip_bad_rows=True)
    np.testing.assert_allclose(run.time, np.delete(TIME, at), atol=1e-9)


def test_a_jump_of_the_time_is_said(tmp_path: Path) -> None:
    for ahead, said in ((3600.0, "did summer time begin"), (60.0, "was the clock set")):
        late = TIME + ahead * (np.arange(ROWS) >= 30)
        done = imported(write(tmp_path, late, VOLTAGE, 1e3 * MOVED))
        assert any(said in doubt and "line 31" in doubt for doubt in done.warnings)


def test_days_that_are_called_seconds_are_led_on(tmp_path: Path) -> None:
    days = [f"{46_000.5 + t / 86_400.0:.17g}" for t in TIME]
    path = write(tmp_path, days, VOLTAGE, 1e3 * MOVED)
    with refused(r"count days from 1900.*--column 'time_d=Time \(s\)\*1'"):
        imported(path)
    run = taken(path, columns={"time_d": "Time (s)*1"})
    np.testing.assert_allclose(run.time - run.time[0], TIME, atol=2e-6)


def test_few_stamps_of_a_coarse_clock_tell_the_rate(tmp_path: Path) -> None:
    stamps = [f"12:00:{int(t * 6):02d}" for t in TIME]  # 3.6 s
    with refused(r"share each time stamp.*--rate-Hz 16\.6666667"):
        imported(write(tmp_path, stamps, VOLTAGE, 1e3 * MOVED, head=("Time", *HEAD[1:])))


@pytest.mark.parametrize("form", ["0:00:{:02d}:{:03d}", "P0DT0H0M{}.{:03d}S"])
def test_times_with_thousandths_behind_a_colon_and_of_iso(tmp_path: Path, form: str) -> None:
    cells = [form.format(*divmod(round(1e3 * t), 1000)) for t in TIME]
    same(taken(write(tmp_path, cells, VOLTAGE, 1e3 * MOVED, head=("Elapsed", *HEAD[1:]))))


def sheet(folder: Path, *rows: list[object]) -> Path:
    book = Workbook()
    for row in rows:
        book.active.append(row)
    book.save(folder / "in.xlsx")
    return folder / "in.xlsx"


def test_merged_titles_stand_before_the_names_below_them(tmp_path: Path) -> None:
    body = [[*row, 2.0 * row[2]] for row in TABLE.tolist()]
    body = [[t, double, moved, volts] for t, volts, moved, double in body]
    titles = ["Time (s)", "Displacement", None, "Voltage (V)"]
    same(taken(sheet(tmp_path, titles, [None, "set (mm)", "actual (mm)"], *body)))
    with refused("displacement may be .*upper.*lower|upper.*leaves open"):
        imported(sheet(tmp_path, titles, [None, "upper (mm)", "lower (mm)"], *body))


def test_durations_in_a_workbook_are_the_time(tmp_path: Path) -> None:
    rows = [[timedelta(seconds=t), v, m] for t, v, m in TABLE.tolist()]
    run = taken(sheet(tmp_path, ["Elapsed", *HEAD[1:]], *rows))
    np.testing.assert_allclose(run.time, TIME, atol=1e-3)


def test_rows_of_json_by_their_numbers(tmp_path: Path) -> None:
    rows = {str(i): dict(zip(NAMES, row, strict=True)) for i, row in enumerate(TABLE.tolist())}
    (tmp_path / "in.json").write_text(json.dumps(rows), "utf-8")
    same(taken(tmp_path / "in.json"))


def test_integers_without_sign_and_with_a_gain_of_their_own(tmp_path: Path) -> None:
    path = tmp_path / "in.nc"
    scale = MOVED.max() / 65_000.0
    with h5py.File(path, "w") as file:
        file["time_s"], file["voltage_V"] = TIME, VOLTAGE
        data = file.create_dataset(
            "displacement", data=np.round(MOVED / scale).astype("u2").view("i2")
        )
        data.attrs.update({"_Unsigned": "true", "scale_factor": scale, "units": "m"})
    np.testing.assert_allclose(taken(path).displacement, MOVED, atol=scale)
    with h5py.File(path, "r+") as file:
        file["displacement"].attrs["gain"] = 2.0
    with refused(r"stands gain = 2, .*'displacement_m=displacement\*FACTOR'"):
        imported(path)


def test_names_of_two_levels_in_a_table_of_pandas(tmp_path: Path) -> None:
    path = tmp_path / "in.h5"
    table = np.zeros(ROWS, [("index", "i8"), ("values_block_0", "f8", (3,))])
    table["values_block_0"] = TABLE
    kind = "(lp0\n(Vrig\np1\nVtime_s\np2\ntp3\na(g1\nVvoltage_V\np4\ntp5\na(g1\n"
    with h5py.File(path, "w") as file:
        group = file.create_group("run")
        group.attrs["pandas_type"] = np.bytes_("frame_table")
        data = group.create_dataset("table", data=table)
        data.attrs["values_block_0_kind"] = np.bytes_(f"{kind}Vdisplacement_mm\np6\ntp7\na.")
    same(taken(path))


def test_an_unknown_unit_beside_a_known_one_is_asked(tmp_path: Path) -> None:
    head = "Time (s),Voltage (V),Displacement (mm)\ns,counts,mm\n"
    path = write(tmp_path, TIME, VOLTAGE, 1e3 * MOVED, head=head)
    with refused("in V by its name and in counts by the unit"):
        imported(path)
    assert label_of("Strain (in/in)").unit == "1"
    same(taken(path, columns={"voltage_V": "Voltage (V)"}))


@pytest.mark.parametrize("epoch", [1.7e9, 3.9e9])
@pytest.mark.parametrize(
    ("at", "stamp", "said"),
    [(40, 0.38, "goes back, from 0.39 to 0.38"), (40, 0.39, "stands still, from 0.39 to 0.39")],
)
def test_times_since_an_epoch_are_shown_from_the_first_row(
    tmp_path: Path, epoch: float, at: int, stamp: float, said: str
) -> None:
    stamps = [f"{epoch + t:.2f}" for t in TIME]
    stamps[at] = f"{epoch + stamp:.2f}"
    with refused(f"line {at + 2}, column 'Time .s.': time {said} since the first row"):
        imported(write(tmp_path, stamps, VOLTAGE, 1e3 * MOVED))
