"""Ways of writing numbers, times and units, and what of them is not sure."""

from __future__ import annotations

from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import pytest

from dearig.recording import Recording, import_file, open_recording
from dearig.recording.importers import Imported, ImportOptions
from dearig.recording.importers.quantities.labels import label_of
from dearig.recording.importers.quantities.text_numbers import Signs, signs_of
from tests.tools.imports import MOVED, TIME, VOLTAGE, refused, same
from tests.tools.recordings import Clock


def imported(folder: Path, text: str | bytes, **options: object) -> tuple[Imported, Recording]:
    path = folder / "in.csv"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    done = import_file(
        path, folder / "out.h5", ImportOptions(**options), overwrite=True, now=Clock()
    )
    return done, open_recording(folder / "out.h5")


def table(names: str, row: str, **how: float) -> str:
    """Rows of ``row``, a format of t (s), v (V) and m (mm), below ``names``."""
    lines = (
        row.format(t=t, v=v, m=m * 1e3, T=how.get("late", 0.0) + t)
        for t, v, m in zip(TIME, VOLTAGE, MOVED, strict=True)
    )
    return f"{names}\n" + "\n".join(lines) + "\n"


GERMAN = str.maketrans(".,", ",.")


@pytest.mark.parametrize(
    "text",
    [
        pytest.param(
            table("Zeit (s);Spannung (V);Weg (mm)", "{t:.2f};{v:,.6f};{m:.9f}").translate(GERMAN),
            id="points between thousands, decimal commas",
        ),
        pytest.param(
            table("Zeit (s);Spannung (V);Weg (mm)", "{t:.2f};{v:,.6f};{m:.9f}").replace(",", "'"),
            id="Swiss",
        ),
        pytest.param(
            table("Time (s);Voltage (V);Travel (mm)", "{t:.2f};{v:,.0f};{m:.9f}")
            .translate(GERMAN).replace("\n", ";\n"),
            id="whole thousands next to decimal commas, and a separator at the end",
        ),
        pytest.param(
            table("Time (s),Voltage (V),Travel (mm)", '{t:.2f},"{v:,.6f}",{m:.9f}'),
            id="quoted thousands between commas",
        ),
        pytest.param(
            table("Time (s)X Voltage (V)X Travel (mm)", '"{t:.2f}"X"{v:.6f}"X"{m:.9f}"')
            .replace(".", ",").replace("X", ","),
            id="quoted decimal commas between commas",
        ),
        pytest.param(
            table("Time (s);Voltage (V);Travel (mm)", "{t:.2f};{v:,.6f};{m:.9f}")
            .replace(",", "\u202f").replace(".", ","),
            id="narrow blanks between thousands",
        ),
        pytest.param(
            table(" TIME_S  VOLTAGE_V  DISPLACEMENT_MM", "{t:.6E} {v:.9E} {m:.9E}")
            .replace("E+", "D+").replace("E-", "D-"),
            id="Fortran",
        ),
        pytest.param(
            table("Time [s] ; Voltage [V] ; Travel [mm]", "{t:.2f} ; {v:.6f} ; {m:.9f}"),
            id="blanks around separators",
        ),
        pytest.param(
            table("s,V,mm\nTime,Voltage,Travel", "{t:.2f},{v:.6f},{m:.9f}"), id="units above names"
        ),
        pytest.param(
            table("Time,Voltage (V),Travel (mm)", "00:{t:05.2f},{v:.6f},{m:.9f}"), id="minutes"
        ),
        pytest.param(
            table("Elapsed,Voltage (V),Travel (mm)", "99:59:{T:05.2f},{v:.6f},{m:.9f}", late=58.0),
            id="hundred hours",
        ),
        pytest.param(table("Time_s,Volts_V,Disp_mm", "{t:.2f},{v:.6f},{m:.9f}"), id="short names"),
        pytest.param(
            table("Time (s);Voltage (V);Travel (mm)", "{t:.2f};{v:.6f};{m:.9f}").encode("utf-16"),
            id="UTF-16",
        ),
    ],
)  # fmt: skip
def test_numbers_are_read_as_people_write_them(tmp_path: Path, text: str | bytes) -> None:
    _, run = imported(tmp_path, text)
    same(run)


@pytest.mark.parametrize(
    ("columns", "signs"),
    [
        ([["0,5", "1,25"], ["1.012"]], [Signs(","), Signs(",", ".")]),
        ([["0.5"], ["1,012"], ["812"]], [Signs("."), Signs(".", ","), Signs(".")]),
        ([["0,5"], ["812", "77"]], [Signs(","), Signs(",")]),  # so that 1.012 further on is refused
        ([["1,012"]], [Signs(",", open=True)]),
        ([["1,234,567"], ["5,123"]], [Signs(".", ","), Signs(".", ",")]),
        ([["1.234,5"], ["7"]], [Signs(",", "."), Signs(",")]),
        ([["0.5"], ["0,5"], ["1.012"]], [Signs("."), Signs(","), Signs(".", open=True)]),
    ],
)
def test_what_a_column_leaves_open_the_others_decide(
    columns: list[list[str]], signs: list[Signs]
) -> None:
    assert signs_of(columns) == signs


def test_a_comma_that_nothing_explains_is_said(tmp_path: Path) -> None:
    rows = "\n".join(f"{i};{i},000;{1 + i},500" for i in range(1, 30))
    done, run = imported(tmp_path, f"time_s;voltage_kV;displacement_mm\n{rows}\n")
    assert any("'1,000' in column 'voltage_kV' is read as 1.000" in note for note in done.notes)
    assert run.voltage_command.max() == 29e3


def test_thousands_behind_the_sample_are_refused_not_taken_for_decimals(tmp_path: Path) -> None:
    rows = "\n".join(f"{i},5;{i * 2 if i < 500 else f'{i * 2:,}'.replace(',', '.')};{i},25"
                     for i in range(510))  # fmt: skip
    with refused(r"line 502, column 'voltage_V': '1.000' is not a number"):
        imported(tmp_path, f"time_s;voltage_V;displacement_mm\n{rows}\n")


def test_a_typographic_minus_is_a_minus(tmp_path: Path) -> None:
    text = table("time_s,voltage_V,displacement_mm", "{t:.2f},{v:.6f},-{m:.9f}")
    _, run = imported(tmp_path, text.replace("-", "\N{MINUS SIGN}"))
    np.testing.assert_allclose(run.displacement, -MOVED, rtol=1e-8, atol=1e-12)


@pytest.mark.parametrize(
    ("unit", "pascal"), [("psi", 6894.757), ("ksi", 6894757.0), ("bar", 1e5), ("mbar", 100.0)]
)
def test_other_units_of_stress(tmp_path: Path, unit: str, pascal: float) -> None:
    rows = "\n".join(f"{i},{i / 100},{i}" for i in range(30))
    _, run = imported(tmp_path, f"time_s,strain,Stress ({unit})\n{rows}\n")
    np.testing.assert_allclose(run.nominal_stress, np.arange(30) * pascal, rtol=1e-6)


def test_a_unit_that_is_not_known_needs_a_scale(tmp_path: Path) -> None:
    text = table("Time (s),Voltage (V),Travel (px)", "{t:.2f},{v:.6f},{m:.9f}")
    with refused(r"unit 'px' .* not known.*mm=Travel \(px\)\*FACTOR'"):
        imported(tmp_path, text)
    given = {"displacement_mm": "Travel (px)"}
    with refused(r"in 'px' by its name.*or \*1 if it is in mm"):
        imported(tmp_path, text, columns=given)
    done, run = imported(tmp_path, text, columns={"displacement_mm": "Travel (px)*1"})
    same(run)
    assert "displacement in mm from 'Travel (px)', scaled *1" in done.columns
    assert label_of("Travel (measured)").unknown == ""


def test_an_optional_column_with_gaps_costs_no_rows(tmp_path: Path) -> None:
    lines = table("time_s,voltage_V,displacement_mm", "{t:.2f},{v:.6f},{m:.9f}").splitlines()
    gaps = [f"{line},{'23' if i % 9 == 0 else ''}" for i, line in enumerate(lines[1:])]
    text = "\n".join([f"{lines[0]},temperature_C", *gaps])
    for skip in (False, True):
        done, run = imported(tmp_path, text, skip_bad_rows=skip)
        same(run)
        assert run.temperature is None
        assert any("temperature was not imported" in n and "line 3" in n for n in done.notes)
    asked = {"temperature_C": "temperature_C"}
    with refused("line 3, column 'temperature_C': there is no value"):
        imported(tmp_path, text, columns=asked)
    _, run = imported(tmp_path, text, columns=asked, skip_bad_rows=True)
    same(run)
    assert np.isnan(run.temperature).tolist() == [i % 9 != 0 for i in range(TIME.size)]


def test_the_first_rows_count_even_if_they_cannot_be_read(tmp_path: Path) -> None:
    lines = table("time_s,voltage_V,displacement_mm", "{t:.2f},{v:.6f},{m:.9f}").splitlines()
    for number in (1, 2):
        time, _, moved = lines[number].split(",")
        lines[number] = f"{time},OVER,{moved}"
    with refused("line 2, column 'voltage_V': 'OVER' is not a num"):
        imported(tmp_path, "\n".join(lines))
    done, run = imported(tmp_path, "\n".join(lines), skip_bad_rows=True)
    assert run.samples == TIME.size - 2
    assert "2 rows were left out because they could not be used" in done.warnings


def test_true_strain_beside_engineering_strain_is_no_displacement(tmp_path: Path) -> None:
    names = "Time (s),True Strain,True Stress (MPa),Engineering Strain,Engineering Stress (MPa)"
    rows = "\n".join(f"{i},{i / 9},{i / 8},{i / 10},{i / 20}" for i in range(30))
    done, run = imported(tmp_path, f"{names}\n{rows}\n")
    np.testing.assert_allclose(run.stretch, 1.0 + np.arange(30) / 10)
    assert any("taken as a part of the length, not as %" in note for note in done.notes)


@pytest.mark.parametrize(
    "head",
    [
        "Time (s)   Voltage (V)   Travel (mm)\n--------   -----------   -----------",
        "Time (s) Voltage (V) Travel (mm)",
        "Time.s Voltage..V. Disp__mm",
        "Time[s] Voltage[V](measured) Travel(laser)[mm]",
    ],
)
def test_names_between_blanks_stand_above_their_columns(tmp_path: Path, head: str) -> None:
    text = table(head, "{t:.2f} {v:.6f} {m:.9f}")
    same(imported(tmp_path, text.replace("Voltage..V.", "Voltage..V"))[1])


def test_names_that_cannot_be_told_apart_are_not_guessed(tmp_path: Path) -> None:
    text = table("Time in s Voltage in V Travel in mm", "{t:.2f} {v:.6f} {m:.9f}")
    with refused("the names #1, #2, #3 do not say what the columns are"):
        imported(tmp_path, text)


def test_rows_of_empty_cells_are_blank(tmp_path: Path) -> None:
    text = table("Time (s);Voltage (V);Travel (mm)", "{t:.2f};{v:.6f};{m:.9f}")
    same(imported(tmp_path, f"{text};;\n;;\n")[1])


def stamped(form: str, start: datetime, step: float = 0.01) -> str:
    """Rows with a date and time, one each ``step`` s."""
    moments = (start + timedelta(seconds=step * i) for i in range(TIME.size))
    lines = table("Timestamp,Voltage (V),Travel (mm)", "{v:.6f},{m:.9f}").splitlines()
    rows = [f"{m.strftime(form)},{line}" for m, line in zip(moments, lines[1:], strict=True)]
    return "\n".join([lines[0], *rows]) + "\n"


EVENING, END_OF_APRIL = datetime(2024, 4, 3, 23, 0, 0), datetime(2024, 4, 29, 20, 0, 0)


@pytest.mark.parametrize(
    ("form", "start", "step"),
    [
        pytest.param("%d/%m/%Y %H:%M:%S.%f", EVENING, 0.01, id="one date"),
        pytest.param("%d-%m-%y %H:%M", EVENING, 60.0, id="one date, no seconds"),
        pytest.param("%d/%m/%Y %H:%M:%S", EVENING, 300.0, id="one day after the other"),
        pytest.param("%m/%d/%Y %H:%M:%S", EVENING, 300.0, id="the same, months first"),
        pytest.param("%d/%m/%Y %H:%M:%S", END_OF_APRIL, 3600.0, id="no month 29"),
        pytest.param("%m/%d/%Y %H:%M:%S", END_OF_APRIL, 3600.0, id="no month 29, months first"),
        pytest.param("%d %b %Y %H:%M:%S", END_OF_APRIL, 3600.0, id="names of months"),
        pytest.param("%m/%d/%Y %H:%M:%S:%f", EVENING, 0.01, id="Keysight's parts of a second"),
    ],
)
def test_the_order_of_day_and_month_is_that_of_the_whole_column(
    tmp_path: Path, form: str, start: datetime, step: float
) -> None:
    _, run = imported(tmp_path, stamped(form, start, step))
    np.testing.assert_allclose(run.time, step * np.arange(TIME.size), rtol=0, atol=1e-6)


def test_an_order_of_day_and_month_that_a_late_row_tells(tmp_path: Path) -> None:
    # 500 rows on one date: the layout is found from fewer
    start = datetime(2024, 4, 12, 12, 0, 0)
    moments = [start + timedelta(seconds=i) for i in range(500)]
    moments.append(start + timedelta(days=1))
    rows = [f"{m.strftime('%m/%d/%Y %H:%M:%S')},{i % 7},{i % 5}" for i, m in enumerate(moments)]
    text = "\n".join(["Timestamp,Voltage (V),Travel (mm)", *rows])
    _, run = imported(tmp_path, text)
    assert run.time[-1] == pytest.approx(86400.0)


def test_an_order_of_day_and_month_that_nothing_tells_is_asked(tmp_path: Path) -> None:
    rows = [f"0{1 + i}/0{1 + i * 2}/2024 12:00:00,{i},{i}" for i in range(4)]
    text = "\n".join(["Timestamp,Voltage (V),Travel (mm)", *rows])
    with refused(r"such as 01/01/2024, may have the day or .* --rate-Hz"):
        imported(tmp_path, text)


def by_sixties(unit: str, step: int = 1) -> str:
    lines = table(f"Time{unit},Voltage (V),Travel (mm)", "{v:.6f},{m:.9f}").splitlines()
    times = [2450 + step * i for i in range(TIME.size)]
    rows = [f"{t // 60}.{t % 60:02d},{line}" for t, line in zip(times, lines[1:], strict=True)]
    return "\n".join([lines[0], *rows])


@pytest.mark.parametrize(("unit", "seconds"), [(" (min)", 1.0), (" [h]", 60.0)])
@pytest.mark.parametrize("step", [1, 10])
def test_minutes_and_seconds_with_a_dot(
    tmp_path: Path, unit: str, seconds: float, step: int
) -> None:
    done, run = imported(tmp_path, by_sixties(unit, step))
    np.testing.assert_allclose(run.time, seconds * (2450 + step * np.arange(TIME.size)), rtol=1e-12)
    assert any("41.00 follows 40.5" in note for note in done.notes)
    plain = {f"time_{unit.strip(' ()[]')}": f"Time{unit}*1"}
    _, other = imported(tmp_path, by_sixties(unit, step), columns=plain)
    assert other.time[0] == pytest.approx(40.5 * 60.0 * seconds)


def test_minutes_and_seconds_in_another_unit_are_asked(tmp_path: Path) -> None:
    with refused(r"in s, but .* 41.00 follows 40.59.* --rate-Hz 1$"):
        imported(tmp_path, by_sixties(" (s)"))
    with refused(r"seem to be minutes and seconds.* --column time_UNIT=Time "):
        imported(tmp_path, by_sixties(""))


@pytest.mark.parametrize("step", [0.01, 0.2, 0.5])
def test_even_decimals_are_no_minutes_and_seconds(tmp_path: Path, step: float) -> None:
    text = table("Time (min),Voltage (V),Travel (mm)", "{t:.2f},{v:.6f},{m:.9f}")
    rows = text.splitlines()
    even = [f"{step * i:.2f},{row.partition(',')[2]}" for i, row in enumerate(rows[1:])]
    _, run = imported(tmp_path, "\n".join([rows[0], *even]))
    np.testing.assert_allclose(run.time, 60.0 * step * np.arange(TIME.size), atol=1e-9)


@pytest.mark.parametrize("per_second", [1e3, 1e6])
def test_times_since_1970_tell_their_unit(tmp_path: Path, per_second: float) -> None:
    text = table("timestamp,voltage_V,displacement_mm", "{T:.0f},{v:.6f},{m:.9f}")
    rows = text.splitlines()
    counts = [round((1.7e9 + t) * per_second) for t in TIME]
    late = [f"{c},{row.partition(',')[2]}" for c, row in zip(counts, rows[1:], strict=True)]
    _, run = imported(tmp_path, "\n".join([rows[0], *late]))
    np.testing.assert_allclose(run.time, TIME, atol=1e-6)
