"""Tables of numbers as laboratories have them: what is read, what is asked, what is refused."""

from __future__ import annotations

from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dearig.recording import Recording, import_file, open_recording
from dearig.recording.importers import Imported, ImportOptions
from dearig.recording.importers.formats.text_file import TextFile
from dearig.recording.importers.listing import preview
from dearig.recording.importers.quantities.labels import label_of, target_of
from dearig.recording.importers.quantities.units import UnitScale
from tests.tools.imports import MOVED, ROWS, TIME, VOLTAGE, refused, same
from tests.tools.recordings import Clock


def table(
    names: str = "time_s,voltage_V,displacement_mm",
    scales: tuple[float, ...] = (1.0, 1.0, 1e3),
    decimal: str = ".",
    above: str = "",
) -> str:
    separator = next(c for c in (";", "\t", ",", " ") if c in names)
    columns = np.column_stack([TIME, VOLTAGE, MOVED]) * np.array(scales)
    rows = [separator.join(f"{v:.9g}" for v in row) for row in columns]
    text = "\n".join(rows)
    text = text.replace(".", decimal) if decimal != "." else text
    return f"{above}{names}\n{text}\n"


LABVIEW = """LabVIEW Measurement
Separator\tTab
***End_of_Header***

Y_Unit_Label\tVolts\tMillimeters
Delta_X\t0.01\t0.01
***End_of_Header***
"""


def imported(folder: Path, text: str | bytes, name: str = "in.csv", **options: object) -> Imported:
    path = folder / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return import_file(
        path, folder / "out.h5", ImportOptions(**options), overwrite=True, now=Clock()
    )


def taken(folder: Path, text: str | bytes, name: str = "in.csv", **options: object) -> Recording:
    imported(folder, text, name, **options)
    return open_recording(folder / "out.h5")


@pytest.mark.parametrize(
    "text",
    [
        pytest.param(
            table("Time [s],Voltage [kV],Displacement [mm]", (1, 1e-3, 1e3)), id="brackets"
        ),
        pytest.param(table("Zeit / ms;Spannung / V;Weg / µm", (1e3, 1, 1e6), ","), id="German"),
        pytest.param(
            table("Temps (min)\tTension (V)\tDéplacement (m)", (1 / 60, 1, 1)), id="French"
        ),
        pytest.param(table("t h,u V,x".replace("x", "Weg cm"), (1 / 3600, 1, 1e2)), id="h and cm"),
        pytest.param(table("Zeit;Spannung;Weg\ns;kV;mm", (1, 1e-3, 1e3), ","), id="line of units"),
        pytest.param(table("Time,Voltage,Travel\n(s),(mV),(nm)", (1, 1e3, 1e9)), id="units, nm"),
        pytest.param(table("Time,Voltage,Travel\nSec,VOLTS,Millimeters"), id="units, written out"),
        pytest.param(LABVIEW + table("X_Value\tVoltage\tTravel"), id="LabVIEW's units"),
        pytest.param(table(above="Lab,7\nOperator,me\nThickness,1.5,mm\n"), id="block above"),
        pytest.param(table("time_s;voltage_V;displacement_mm", above="sep=;\n"), id="Excel's sep"),
        pytest.param("# a rig\n# " + table("time_s voltage_V displacement_mm"), id="names after #"),
        pytest.param(table("time_s voltage_V displacement_mm").replace(" ", "   "), id="blanks"),
        pytest.param(table().replace("\n", ",\n"), id="comma at the end"),
        pytest.param(table("time_s,voltage_V,displacement_inch", (1, 1, 1 / 0.0254)), id="inch"),
        pytest.param(
            table("Zeit [s];Spannung [V];Weg [µm]", (1, 1, 1e6)).encode("cp1252"), id="1252"
        ),
        pytest.param(
            table("时间(s),电压(V),位移(mm)").encode("gb18030"), id="Chinese names in GB 18030"
        ),
        pytest.param(
            table("時間,電圧,変位").replace("変位", "変位\n[s],[V],[mm]", 1).encode("cp932"),
            id="Japanese names in Shift-JIS",
        ),
        pytest.param(table().encode("utf-16-le"), id="UTF-16 without its mark"),
        pytest.param(table().encode("utf-16-be"), id="UTF-16 BE without its mark"),
        pytest.param(
            "\n".join(f"{line},{line.split(',')[0]}" for line in table().splitlines()),
            id="a column twice",
        ),
    ],
)
def test_what_the_names_say_is_read(tmp_path: Path, text: str | bytes) -> None:
    same(taken(tmp_path, text, "in.dat"))


@pytest.mark.parametrize(
    ("form", "name"),
    [("%m/%d/%Y %I:%M:%S.%f %p", "Logged"), ("%d.%m.%Y %H:%M:%S.%f", "Datum"),
     ("%Y-%m-%dT%H:%M:%S.%fZ", "Zeitstempel")],
)  # fmt: skip
def test_dates_in_the_ways_of_several_countries(tmp_path: Path, form: str, name: str) -> None:
    start = datetime(2024, 3, 12, 23, 59, 59, 900_000)
    first, *lines = table(f"{name};voltage_V;displacement_mm").splitlines()
    stamps = [(start + timedelta(seconds=t)).strftime(form) for t in TIME]
    rows = [f"{s};{line.partition(';')[2]}" for s, line in zip(stamps, lines, strict=True)]
    same(taken(tmp_path, "\n".join([first, *rows])))


def test_time_stamps_count_from_the_first(tmp_path: Path) -> None:
    lines = table("timestamp,voltage_V,displacement_mm").splitlines()
    stamped = [lines[0]] + [
        f"2024-03-01 23:59:59.{i * 10:03d},{line.partition(',')[2]}" if i < 100 else line
        for i, line in enumerate(lines[1:])
    ]
    same(taken(tmp_path, "\n".join(stamped)))
    unix = [lines[0].replace("timestamp", "time_s")] + [
        f"{1.7e9 + t:.3f},{line.partition(',')[2]}" for t, line in zip(TIME, lines[1:], strict=True)
    ]
    run = taken(tmp_path, "\n".join(unix))
    np.testing.assert_allclose(run.time, TIME, atol=1e-6)
    assert any("counted from the first time stamp" in e.message for e in run.events)


def test_groups_of_thousands_are_read_where_they_are_sure(tmp_path: Path) -> None:
    lines = ["time_s;voltage_V;displacement_mm"]
    for t, volts, moved in zip(TIME, VOLTAGE, MOVED, strict=True):
        grouped = f"{volts:,.1f}".replace(",", " ").replace(".", ",").replace(" ", ".")
        lines.append(f"{t:.2f};{grouped};{moved * 1e3:.9f}".replace(".", ".", 1))
    run = taken(tmp_path, "\n".join(lines))
    np.testing.assert_allclose(run.voltage_command, VOLTAGE, atol=0.051)


@pytest.mark.parametrize(
    ("text", "options", "match"),
    [
        (table("time_s,voltage_V,Weg (mm)"), {"columns": {"displacement_um": "Weg (mm)"}},
         r"'Weg \(mm\)' is in mm by its name, and displacement_um asks for um; give"),
        (table("time_ms,voltage_V,displacement_mm"), {"columns": {"time_s": "time_ms"}},
         "'time_ms' is in ms by its name, and time_s asks for s"),
        (table("time_s,voltage_V,Laser (V)"), {"columns": {"displacement_mm": "Laser (V)"}},
         "is in V by its name, and displacement_mm asks for mm; if it is the output"),
        (table("time_s,voltage_V,Laser (V)"), {}, "the output of an instrument in V"),
        (table("t [s],U [V],s [mm]"), {}, r"'s \[mm\]' may be the displacement, by its unit alone"),
        (table("x-axis,1,2\nsecond,Volt,mm"), {}, "time_s=x-axis .* --column displacement_mm=2"),
        (table("t,V,x"), {}, "'x' may be the displacement, because no .* displacement_UNIT=x"),
        (table("a #1,b #1,c #1"), {}, "no column for voltage"),
        (table("a,b,c"), {}, "'a': 0, 0.01, 0.02; .* time_UNIT=a --column voltage_kV=COLUMN --col"),
        (table("time_s,voltage_V,displacement_mm").replace("time_s,", "").replace("\n0", "\n0"),
         {}, "no column for|are not sure|not sure"),
        (table("time_s,voltage_V,force_N"), {}, "the force of a blocked film is not modelled here"),
        (table() + "End of test,,\n", {}, "line 62, column 'time_s': 'End of test' is no"),
        (table().replace("\n0.1,", "\n,"), {}, "line 12, column 'time_s': there is no value"),
        (table(), {"columns": {"voltage_V": "voltage_V*0"}}, "a scale of 0 leaves nothing"),
        (table(), {"columns": {"displacement_raw_V": "displacement_mm"}}, "their scaling with"),
        (table(), {"rate_Hz": -1.0, "columns": {}}, "the rate is -1.0 Hz"),
        (table(), {"names_line": 9}, "line 9 is not a line of names: the numbers begin in line 2"),
        (b"\x89PNG\r\n\x1a\n" + bytes(range(256)), {}, "not a text file, and of no other kind"),
    ],
)  # fmt: skip
def test_what_is_not_sure_is_asked_or_refused(
    tmp_path: Path, text: str | bytes, options: dict[str, object], match: str
) -> None:
    with refused(match):
        imported(tmp_path, text, **options)
    assert not (tmp_path / "out.h5").exists()


def test_a_scale_and_the_rig_files_scaling(tmp_path: Path) -> None:
    text = table("time_s,TREK monitor (V),Laser (V)", (1, 1e-3, 250.0))  # 1 V/kV, 4 mm/V
    columns = {"voltage_kV": "TREK monitor (V)*1", "displacement_mm": "Laser (V)*4"}
    same(taken(tmp_path, text, columns=columns))
    raw = {"voltage_monitor": UnitScale(1e3), "displacement": UnitScale(4.0, 1e3)}
    same(taken(tmp_path, text, raw=raw))
    offset = {"voltage_V": "#2*1e3+5", "displacement_m": "#3/250", "time_s": "#1"}
    run = taken(tmp_path, text, columns=offset)
    np.testing.assert_allclose(run.voltage_command, VOLTAGE, atol=1e-9)  # 5 V at rest come off
    assert any("an offset of 5 V" in e.message for e in run.events)


def test_a_known_rate_makes_the_time(tmp_path: Path) -> None:
    text = "\n".join(line.partition(",")[2] for line in table().splitlines())
    same(taken(tmp_path, text, rate_Hz=100.0))


def test_bad_rows_are_left_out_counted_and_kept_as_events(tmp_path: Path) -> None:
    lines = table().splitlines()
    lines[10] += "high"
    lines.insert(20, lines[19])  # time stands still
    lines[30] = lines[30].replace(",", "")
    lines.append("End of test")
    done = imported(tmp_path, "\n".join(lines), skip_bad_rows=True)
    run = open_recording(tmp_path / "out.h5")
    kept = np.delete(np.arange(ROWS), 28)
    np.testing.assert_allclose(run.time, TIME[kept], atol=1e-12)
    assert any("3 rows were left out" in doubt for doubt in done.warnings)
    assert np.flatnonzero(np.isnan(run.displacement)).tolist() == [9]  # its voltage is known
    said = [(e.sample, e.message) for e in run.events if "left out before" in e.message]
    assert [(at, words.rpartition(": ")[2]) for at, words in said] == [
        (19, "line 21"), (28, "line 31"), (58, "line 63"),
    ]  # fmt: skip


def test_the_film_that_is_assumed_is_said(tmp_path: Path) -> None:
    assert any("1000 um thick" in note for note in imported(tmp_path, table()).notes)


def test_rest_is_found_by_its_own_noise(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    for offset in (0.0, -9.0, 8.0):
        noisy = VOLTAGE + offset + rng.normal(0.0, 1.3, ROWS)
        rows = np.column_stack([TIME, noisy, 2.0 + MOVED * 1e3 + rng.normal(0.0, 2e-3, ROWS)])
        text = "time_s,voltage_V,displacement_mm\n" + "\n".join(
            ",".join(f"{v:.9g}" for v in row) for row in rows
        )
        run = taken(tmp_path, text)
        assert 29 <= run.quiet_samples <= 33
        assert abs(run.voltage_command[:30].mean()) < 1.0
        assert run.rest_reading == pytest.approx(2e-3, abs=2e-6)
        assert run.noise_floor == pytest.approx(2e-6, rel=0.5)


def test_data_without_a_rest_say_so(tmp_path: Path) -> None:
    lines = table().splitlines()
    done = imported(tmp_path, "\n".join([lines[0], *lines[35:]]))
    assert any("no quiet lead-in" in doubt for doubt in done.warnings)


def test_columns_are_listed_with_what_they_seem_to_be(tmp_path: Path) -> None:
    path = tmp_path / "in.csv"
    path.write_text(table("Zeit (s);Laser (V);x"), "utf-8")
    found = preview(path)
    assert [(c.number, c.name, c.quantities, c.unit) for c in found] == [
        (1, "Zeit (s)", ("time",), "s"), (2, "Laser (V)", ("displacement",), "V"), (3, "x", (), ""),
    ]  # fmt: skip
    assert found[0].values == (0.0, 0.01, 0.02, 0.03, 0.04)


@pytest.mark.parametrize(
    ("name", "quantities", "unit"),
    [
        ("Standardkraft [N]", ("force",), "N"),
        ("Traversenweg (mm)", ("displacement",), "mm"),
        ("Traversenweg in mm", ("displacement",), "mm"),
        ("Traversenposition [mm]", ("displacement",), "mm"),
        ("Kolbenweg [mm]", ("displacement",), "mm"),
        ("Prüfzeit [s]", ("time",), "s"),
        ("Prüfdauer [s]", ("time",), "s"),
        ("Nominelle Dehnung [%]", ("strain",), "pct"),
        ("Feindehnung [%]", ("strain",), "pct"),
        ("Techn. Spannung [MPa]", ("nominal_stress",), "MPa"),
        ("Bruchdehnung [%]", (), "pct"),
        ("Traversengeschwindigkeit [mm/min]", (), ""),
        ("Load (kN)", ("force",), "kN"),
        ("Tensile strain (%)", ("strain",), "pct"),
        ("Strain, mm/mm", ("strain",), "1"),
        ("Spannung [MPa]", ("nominal_stress",), "MPa"),
        ("Spannung [kV]", ("voltage",), "kV"),
        ("Contrainte (kPa)", ("nominal_stress",), "kPa"),
        ("True stress (MPa)", ("true_stress",), "MPa"),
        ("Crosshead speed (mm/min)", (), ""),
        ("Temperatur (°C)", ("temperature",), "C"),
        ("Strom in nA", ("current",), "nA"),
        ("试验力（kN）", ("force",), "kN"),  # noqa: RUF001
        ("ひずみ [%]", ("strain",), "pct"),
        ("应力 / MPa", ("nominal_stress",), "MPa"),
        ("压力 (MPa)", (), "MPa"),
        ("Channel A", (), "A"),
        ("CH1", (), ""),
    ],
)
def test_names_are_understood(name: str, quantities: tuple[str, ...], unit: str) -> None:
    label = label_of(name)
    assert (label.quantities, label.unit) == (quantities, unit)


@pytest.mark.parametrize("name", ["Channel A", "Kanal A", "Ch A", "Input C", "Probe A"])
def test_the_letter_of_a_channel_is_no_unit_where_the_file_gives_one(name: str) -> None:
    assert (label_of(name, "V").unit, label_of(name, "V").conflict) == ("V", "")


@pytest.mark.parametrize("name", ["Force (mN)", "Load (N)", "Blocked force (N)", "Kraft [mN]"])
def test_the_force_of_a_blocked_film_is_refused_whatever_it_is_called(
    tmp_path: Path, name: str
) -> None:
    text = f"Time (s),Voltage (kV),{name}\n" + "".join(
        f"{0.1 * i},{i % 5},{i}\n" for i in range(60)
    )
    (tmp_path / "in.csv").write_text(text, "utf-8")
    with refused("the force of a blocked film is not modelled here"):
        import_file(tmp_path / "in.csv", tmp_path / "out.h5")


@settings(max_examples=60, deadline=None)
@given(
    value=st.floats(-1e6, 1e6),
    name=st.sampled_from(
        ["force_kN", "time_min", "displacement_nm", "temperature_K", "strain_pct"]
    ),
)
def test_scales_are_those_of_the_units(value: float, name: str) -> None:
    oracle = {
        "force_kN": value * 1e3, "time_min": value * 60, "displacement_nm": value / 1e9,
        "temperature_K": value - 273.15, "strain_pct": value / 100,
    }[name]  # fmt: skip
    assert target_of(name).scale.apply(np.array([value]))[0] == pytest.approx(oracle, rel=1e-15)


def test_blocks_of_a_large_file_join_without_a_seam(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("dearig.recording.importers.formats.text_blocks.BLOCK", 97)
    path = tmp_path / "in.csv"
    path.write_text(table(), "utf-8")
    source = TextFile(path)
    found = source.read(source.names)
    np.testing.assert_allclose(found["voltage_V"], VOLTAGE, rtol=1e-8)
    assert [source.row(i) for i in (0, 30, 59)] == ["line 2", "line 32", "line 61"]


@pytest.mark.parametrize("first", range(3, 12))
def test_rows_with_a_further_cell_are_refused_wherever_they_begin(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, first: int
) -> None:
    # also where a block has only such rows, of which pandas leaves the last cells out
    monkeypatch.setattr("dearig.recording.importers.formats.text_blocks.BLOCK", 97)
    rows = [f"{i},{i},{i}{',7' if i >= first else ''}" for i in range(30)]
    text = "\n".join(["time_s,voltage_V,displacement_mm", *rows, ""])
    with refused(f"line {first + 2}: 4 values, and the table has 3 columns"):
        taken(tmp_path, text)
