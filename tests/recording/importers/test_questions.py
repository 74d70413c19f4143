"""What is asked when names leave something open, and what the printed command does as it is."""

from __future__ import annotations

import re
import shlex
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import pytest

from dearig.recording import open_recording
from dearig.recording.importers.quantities.labels import label_of
from tests.tools.command import dearig
from tests.tools.imports import MOVED, ROWS, TIME, VOLTAGE, imported, refused, same, taken

FILM = 1.0 + 0.5 * TIME / TIME[-1]
STRESS = 1e5 * (FILM - 1.0) + 10.0


def text(path: Path, names: str, *columns: np.ndarray, above: str = "") -> Path:
    rows = ("\t".join(f"{v:.10g}" for v in row) for row in np.column_stack(columns))
    path.write_text(above + names.replace(",", "\t") + "\n" + "\n".join(rows) + "\n", "utf-8")
    return path


def printed(message: str) -> list[str]:
    """The words of the command that a message prints; none without one."""
    match = re.search(r"run: dearig (import .*)$", message, re.M)
    return shlex.split(match[1]) if match else []


WORDS = """Desired Reference Demand Simulated Predicted Estimated Maximum Peak Lateral Transverse
Static Dynamic Residual Friction Blocked Ideal Soll- Unheard"""


@pytest.mark.parametrize("word", WORDS.split())
def test_a_word_that_leaves_open_what_was_measured_makes_a_question(
    tmp_path: Path, word: str
) -> None:
    path = text(
        tmp_path / "in.csv", f"Time (s),Voltage (V),{word} displacement (mm),OUT1 (mm)",
        TIME, VOLTAGE, 2e3 * MOVED, 1e3 * MOVED,
    )  # fmt: skip
    with refused(r"'OUT1 \(mm\)' may be .* displacement_mm=COLUMN"):
        imported(path)
    path = text(tmp_path / "in.csv", f"Time (s),{word} voltage (V),Displacement (mm)", TIME,
                VOLTAGE, 1e3 * MOVED)  # fmt: skip
    with refused(f"{word.lower().strip('-')}.*leaves open.*=COLUMN"):
        imported(path)


@pytest.mark.parametrize(
    "name", ["Voltage amplitude (V)", "Voltage_max (V)", "Sollspannung (V)", "VoltageSetpoint (V)"]
)
def test_the_word_may_stand_behind_or_be_written_together(tmp_path: Path, name: str) -> None:
    path = text(tmp_path / "in.csv", f"Time (s),{name},Weg (mm)", TIME, VOLTAGE, 1e3 * MOVED)
    with refused("leaves open whether"):
        imported(path)


@pytest.mark.parametrize(
    ("voltage", "moved"),
    [("Measured voltage (V)", "Laser displacement (mm)"), ("Trek HV (V)", "Actual Position (mm)"),
     ("Hochspannung [V]", "Standardweg [mm]"), ("AI0 Voltage (V)", "Sensor 2 travel (mm)"),
     ("Commanded voltage (V)", "Keyence displacement (mm)"), ("Voltage (V)", "Free tip disp (mm)")],
)  # fmt: skip
def test_harmless_words_ask_nothing(tmp_path: Path, voltage: str, moved: str) -> None:
    path = text(tmp_path / "in.csv", f"Time (s),{voltage},{moved}", TIME, VOLTAGE, 1e3 * MOVED)
    same(taken(path))


def test_a_plain_name_beside_a_qualified_one_is_taken(tmp_path: Path) -> None:
    path = text(
        tmp_path / "in.csv", "Time (s),Voltage (V),Target displacement (mm),Displacement (mm)",
        TIME, VOLTAGE, 2e3 * MOVED, 1e3 * MOVED,
    )  # fmt: skip
    same(taken(path))


def test_shear_is_refused(tmp_path: Path) -> None:
    path = text(tmp_path / "in.csv", "Time (s),Shear strain (%),Shear stress (kPa)", TIME,
                FILM, STRESS)  # fmt: skip
    with refused("shear is not modelled here"):
        imported(path)


def test_compression_that_is_written_as_positive_is_negative(tmp_path: Path) -> None:
    names = "Time (s),Compressive strain (%),Compressive stress (kPa)"
    run = taken(text(tmp_path / "in.csv", names, TIME, 100.0 * (FILM - 1.0), STRESS))
    np.testing.assert_allclose(run.stretch, 2.0 - FILM, rtol=1e-9)
    np.testing.assert_allclose(run.nominal_stress, -1e3 * STRESS, rtol=1e-9)
    assert sum("its sign was changed" in e.message for e in run.events) == 2
    run = taken(text(tmp_path / "in.csv", names, TIME, -100.0 * (FILM - 1.0), -STRESS))
    np.testing.assert_allclose(run.stretch, 2.0 - FILM, rtol=1e-9)
    path = text(tmp_path / "in.csv", "Time (s),Compressive strain (%),Stress (kPa)", TIME,
                100.0 * (FILM - 1.0), STRESS)  # fmt: skip
    with refused(r"'Stress \(kPa\)' is positive too .* give its sign"):
        imported(path)


def test_true_stress_and_strain_are_converted(tmp_path: Path) -> None:
    names = "Time (s),True strain (%),True stress (kPa)"
    run = taken(text(tmp_path / "in.csv", names, TIME, 100.0 * np.log(FILM), STRESS * FILM))
    np.testing.assert_allclose(run.stretch, FILM, rtol=1e-8)
    np.testing.assert_allclose(run.nominal_stress, 1e3 * STRESS, rtol=1e-8)


def test_a_name_that_contradicts_its_line_of_units_is_asked(tmp_path: Path) -> None:
    path = text(
        tmp_path / "in.csv", "Time (s),Voltage (V),Displacement (mm)\n(s)\t(V)\t(um)",
        TIME, VOLTAGE, 1e6 * MOVED,
    )  # fmt: skip
    match = r"in mm by its name and in um by .* 'displacement_UNIT=Displacement \(mm\)'"
    with refused(match):
        imported(path)
    same(taken(path, columns={"displacement_um": "Displacement (mm)"}))


def test_days_since_1900_are_known_by_their_size(tmp_path: Path) -> None:
    names = "Time,Voltage (V),Displacement (mm)"
    days = 46000.5 + TIME / 86400.0
    rows = (
        "\t".join(f"{v:.17g}" for v in row) for row in zip(days, VOLTAGE, 1e3 * MOVED, strict=True)
    )
    (tmp_path / "in.csv").write_text(names.replace(",", "\t") + "\n" + "\n".join(rows), "utf-8")
    run = taken(tmp_path / "in.csv")
    np.testing.assert_allclose(run.time, TIME, atol=2e-6)


#: Files whose columns the names leave open, in the order in which a guess would exchange them.
OPEN = {
    "no names": ("", (TIME, 1e3 * MOVED, VOLTAGE)),
    "names that say nothing": ("a,b,c\n", (TIME, 1e3 * MOVED, VOLTAGE)),
    "a counter first": ("a,b,c,d\n", (np.arange(ROWS), TIME, 1e3 * MOVED, VOLTAGE)),
    "no unit": ("t,V,x\n", (1e3 * TIME, 1e-3 * VOLTAGE, 1e6 * MOVED)),
    "one word": ("Time (s),Voltage (V),Desired strain\n", (TIME, VOLTAGE, 1e3 * MOVED)),
    "two in mm": ("Time (s),Voltage (V),A (mm),B (mm)\n", (TIME, VOLTAGE, VOLTAGE, MOVED)),
    "two in V": ("t (s),Voltage 1 (V),Voltage 2 (V),Weg (m)\n", (TIME, MOVED, VOLTAGE, MOVED)),
    "film": ("a,b,c\n", (TIME, STRESS, FILM)),
}  # fmt: skip


@pytest.mark.parametrize("kind", OPEN)
def test_no_printed_command_imports_what_was_guessed(tmp_path: Path, kind: str) -> None:
    names, columns = OPEN[kind]
    path = tmp_path / "in.csv"
    path.write_text(
        names + "\n".join(",".join(f"{v:.10g}" for v in row) for row in np.column_stack(columns))
    )
    answer = dearig("import", path, "--out", tmp_path / "out.h5")
    for _ in range(4):
        assert answer.code == 2, answer.out
        assert "the columns begin with" in answer.err or "run:" not in answer.err
        words = printed(answer.err)
        if not words:
            break
        answer = dearig(*words)
    assert not (tmp_path / "out.h5").exists()


def test_the_command_for_names_without_units_has_holes_for_them_only(tmp_path: Path) -> None:
    path = text(tmp_path / "in.csv", "t,V,x", TIME, VOLTAGE, 1e3 * MOVED)
    answer = dearig("import", path, "--out", tmp_path / "out.h5")
    words = " ".join(map(shlex.quote, printed(answer.err)))
    for hole, unit in (("time_UNIT", "time_s"), ("voltage_UNIT", "voltage_V"),
                       ("displacement_UNIT", "displacement_mm")):  # fmt: skip
        words = words.replace(hole, unit)
    assert dearig(*shlex.split(words)).code == 0
    same(open_recording(tmp_path / "out.h5"))


@pytest.mark.parametrize(
    ("name", "asked", "qualifier"),
    [("Max. Load (N)", ("force",), "max"), ("最大力 (N)", ("force",), "最大力"),
     ("Querdehnung [%]", ("strain",), "quer"), ("Command travel", ("displacement",), "command"),
     ("Nominal strain (%)", (), ""), ("Room temperature", (), ""), ("Set temperature (C)",
     ("temperature",), "set"), ("Control voltage (V)", ("voltage",), "control")],
)  # fmt: skip
def test_qualifiers_of_names(name: str, asked: tuple[str, ...], qualifier: str) -> None:
    label = label_of(name)
    assert (label.asked, label.qualifier) == (asked, qualifier)


BEGAN = datetime(2026, 10, 25, 2, 55)


def stamped(path: Path, stamps: list[str], names: str = "Timestamp") -> Path:
    rows = zip(stamps, VOLTAGE, 1e3 * MOVED, strict=True)
    lines = [
        f"{names},Voltage (V),Displacement (mm)",
        *(f"{s},{v:.9g},{m:.9g}" for s, v, m in rows),
    ]
    path.write_text("\n".join(lines), "utf-8")
    return path


@pytest.mark.parametrize(("hour", "said"), [(-1, "did summer time end"), (1, "time begin")])
def test_a_clock_that_is_set_by_an_hour_is_said(tmp_path: Path, hour: int, said: str) -> None:
    wall = [BEGAN + timedelta(seconds=10 * i, hours=hour * (i >= 30)) for i in range(ROWS)]
    done = imported(stamped(tmp_path / "in.csv", [f"{w}" for w in wall]))
    assert any(said in doubt and "line 31" in doubt for doubt in done.warnings)
    run = open_recording(tmp_path / "out.h5")
    expected = 10.0 * np.arange(ROWS)
    if hour > 0:  # it may have been a pause: the stamps are kept
        expected[30:] += 3600.0
    np.testing.assert_allclose(run.time, expected)


def test_a_time_of_day_goes_on_after_midnight(tmp_path: Path) -> None:
    wall = [datetime(2026, 3, 2, 23, 59, 59, 700_000) + timedelta(seconds=t) for t in TIME]
    run = taken(stamped(tmp_path / "in.csv", [f"{w:%H:%M:%S.%f}" for w in wall]))
    np.testing.assert_allclose(run.time, TIME, atol=1e-6)
    assert any("the next day" in e.message for e in run.events)


@pytest.mark.parametrize(("step", "rate"), [(0.2, "5"), (0.004, "250"), (0.003, "333.333333")])
def test_rows_that_share_stamps_are_given_their_rate(
    tmp_path: Path, step: float, rate: str
) -> None:
    digits = 0 if step > 0.1 else 2
    stamps = [f"{step * i:.{digits}f}" for i in range(ROWS)]
    answer = dearig("import", stamped(tmp_path / "in.csv", stamps, "Time (s)"), "--out",
                    tmp_path / "out.h5")  # fmt: skip
    words = printed(answer.err)
    assert words[-2:] == ["--rate-Hz", rate]
    assert dearig(*words).code == 0
    run = open_recording(tmp_path / "out.h5")
    np.testing.assert_allclose(run.time, step * np.arange(ROWS), rtol=2e-3)


def test_no_command_leaves_out_more_than_single_rows(tmp_path: Path) -> None:
    stamps = [f"{t:.2f}" for t in TIME]
    stamps[20:40] = ["over"] * 20
    answer = dearig("import", stamped(tmp_path / "in.csv", stamps, "Time (s)"), "--out",
                    tmp_path / "out.h5")  # fmt: skip
    assert answer.code == 2
    assert "20 of 60 rows are so, too many to leave out" in answer.err
    assert not printed(answer.err)


@pytest.mark.parametrize("marker", [-99999.9999, 1e6])
def test_a_marker_for_no_reading_is_named_and_its_rows_stay(tmp_path: Path, marker: float) -> None:
    moved = 1e3 * MOVED + 0.01 * np.sin(9.0 * np.arange(ROWS))
    path = text(
        tmp_path / "in.csv", "Time (s),Voltage (V),Displacement (mm)", TIME, VOLTAGE,
        np.where((np.arange(ROWS) > 40) & (np.arange(ROWS) < 50), marker, moved),
    )  # fmt: skip
    done = imported(path)
    assert any(f"9 readings of 'Displacement (mm)' are {marker:.9g}" in d for d in done.warnings)
    run = open_recording(tmp_path / "out.h5")
    np.testing.assert_allclose(run.time, TIME)
    assert np.flatnonzero(np.isnan(run.displacement)).tolist() == list(range(41, 50))
    assert np.nanmax(np.abs(run.displacement)) < 1e-3


def test_a_step_is_no_marker(tmp_path: Path) -> None:
    moved = np.where(np.arange(ROWS) < 40, 0.0, 5.0)
    path = text(tmp_path / "in.csv", "Time (s),Voltage (V),Displacement (mm)", TIME, VOLTAGE, moved)
    assert taken(path).samples == ROWS
