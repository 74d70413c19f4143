"""Measured data from elsewhere: what is taken, and what is said about what is not."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from nptdms import ChannelObject, TdmsWriter
from scipy.io import loadmat, savemat

from dearig.errors import InputError
from dearig.model.film.material import THESIS_FILM, THESIS_LOAD
from dearig.recording import Recording, RunMetadata, export_recording, import_file, open_recording
from dearig.recording.importers import ImportOptions
from tests.tools.imports import refused
from tests.tools.recordings import Clock, measured_data


def csv(folder: Path, content: str | bytes, name: str = "in.csv") -> Path:
    path = folder / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


def taken(
    path: Path,
    columns: dict[str, str] | None = None,
    metadata: RunMetadata | None = None,
    **options: object,
) -> Recording:
    out = path.parent / "out.h5"
    chosen = ImportOptions(columns or {}, **options)
    import_file(path, out, chosen, metadata=metadata, overwrite=True, now=Clock())
    return open_recording(out)


ACTUATOR = "time_s,voltage_kV,displacement_mm\n0,0,0\n0.5,1,0.25\n0.75,2,1\n"


def test_an_actuators_csv(tmp_path: Path) -> None:
    metadata = RunMetadata(film=THESIS_FILM, load=THESIS_LOAD, film_id="film 3")
    run = taken(csv(tmp_path, ACTUATOR), metadata=metadata)
    assert (run.kind, run.name, run.title, run.hold) == ("actuator", "out", "in", False)
    np.testing.assert_array_equal(run.time, [0.0, 0.5, 0.75])
    np.testing.assert_array_equal(run.voltage_command, [0.0, 1000.0, 2000.0])
    np.testing.assert_array_equal(run.displacement, [0.0, 0.25e-3, 1e-3])
    assert (run.film, run.load, run.film_id) == (THESIS_FILM, THESIS_LOAD, "film 3")
    assert run.provenance["source"] == "in.csv"
    assert run.provenance["columns"] == (
        "time_s=time_s, voltage_kV=voltage_kV, displacement_mm=displacement_mm"
    )
    assert run.complete


@pytest.mark.parametrize(
    ("content", "columns"),
    [
        (ACTUATOR.replace(",", ";"), {}),
        (ACTUATOR.replace(",", ";").replace(".", ","), {}),
        (ACTUATOR.replace(",", "\t"), {}),
        (ACTUATOR.replace(",", "\t").replace(".", ","), {}),
        (b"\xef\xbb\xbf" + ACTUATOR.encode(), {}),
        (ACTUATOR.encode("utf-16"), {}),
        (ACTUATOR.replace("\n", "\r\n"), {}),
        (ACTUATOR.replace("\n", "\r"), {}),
        ("# a rig, somewhere\n\n" + ACTUATOR.replace("0.5,", "# a pause\n\n  0.5 , ") + "\n\n", {}),
        (ACTUATOR.replace("time_s", '"time_s"').replace("0.5", '"0.5"'), {}),
        (ACTUATOR.replace("0.75", "+.75").replace("0.25", "2.5E-1"), {}),
        (ACTUATOR.replace("\n", ",ok\n").replace("mm,ok", "mm,remark"), {}),
        (ACTUATOR.replace("time_s", "t"), {"time_s": "t"}),
        (ACTUATOR.replace("voltage_kV", "U"), {"voltage_kV": "U"}),
        (ACTUATOR.replace("voltage_kV", "voltage_V"), {"voltage_kV": "voltage_V*1"}),
        (ACTUATOR.replace("time_s", "Zeit [s]"), {}),
        (ACTUATOR.replace("voltage_kV", "Spannung / kV"), {}),
        (ACTUATOR.replace("displacement_mm", "Déplacement (mm)"), {}),
        (ACTUATOR.replace("0.25", "250").replace(",1\n", ",1000\n").replace("mm", "um"), {}),
        (ACTUATOR.replace("0.25", "2.5e-4").replace(",1\n", ",0.001\n").replace("mm", "m"), {}),
        (ACTUATOR.replace("\n", ",7\n").replace("mm,7", "mm,µ").encode("latin-1"), {}),
    ],
)  # fmt: skip
def test_every_way_to_write_the_same(
    tmp_path: Path, content: str | bytes, columns: dict[str, str]
) -> None:
    run = taken(csv(tmp_path, content), columns)
    np.testing.assert_array_equal(run.time, [0.0, 0.5, 0.75])
    np.testing.assert_array_equal(run.voltage_command, [0.0, 1000.0, 2000.0])
    np.testing.assert_array_equal(run.displacement, [0.0, 0.25e-3, 1e-3])


def test_optional_columns(tmp_path: Path) -> None:
    content = (
        "time_s,voltage_V,displacement_m,current_A,temperature_C,voltage_monitor_kV\n"
        "0,0,0,1e-6,21.5,0\n1,9,1,2e-6,22,0.009\n"
    )
    run = taken(csv(tmp_path, content))
    np.testing.assert_array_equal(run.current_monitor, [1e-6, 2e-6])
    np.testing.assert_array_equal(run.temperature, [21.5, 22.0])
    np.testing.assert_array_equal(run.voltage_monitor, [0.0, 9.0])


FILM = "time_s,displacement_mm,force_N\n0,0,0\n1,8,0.22\n"


def test_film_data(tmp_path: Path) -> None:
    run = taken(csv(tmp_path, FILM), gauge_length_mm=80, area_mm2=22)
    assert (run.kind, run.kinematics) == ("film", "uniaxial")
    np.testing.assert_allclose(run.stretch, [1.0, 1.1], rtol=1e-15)
    np.testing.assert_allclose(run.nominal_stress, [0.0, 1e4], rtol=1e-15)
    assert run.provenance["gauge_length_mm"] == 80.0
    content = "time_s,stretch,nominal_stress_kPa\n0,1,0\n1,1.1,10\n"
    run = taken(csv(tmp_path, content), kinematics="equibiaxial")
    assert run.kinematics == "equibiaxial"
    np.testing.assert_array_equal(run.nominal_stress, [0.0, 1e4])


@pytest.mark.parametrize(
    ("content", "given", "match"),
    [
        ("", {}, r"in\.csv is empty"),
        ("# only words\n\n", {}, r"in\.csv is empty"),
        ("time_s,voltage_V,displacement_mm\n", {}, "a line of names and no data"),
        ("0,0,0\n1,2,3\n", {}, "the names #1, #2, #3 do not say .* time_s=COLUMN --column"),
        ("time_s,voltage_V,displacement_mm\n0,0,0\n", {}, "has 1 row of data; at least 2"),
        (b"\x00\x01\x02" * 50, {}, "is not a text file"),
        (b"\xff\xfe\x00\xd8\x00", {}, "begins as utf-16 text but is not"),
        (ACTUATOR.replace("time_s", "seconds"), {}, "no column for time .time_s.*; there are: sec"),
        (ACTUATOR.replace("time_s", "Time"), {}, "'Time' names no unit.* --column time_UNIT=Time"),
        (ACTUATOR.replace("kV", "pV"), {}, "'voltage_pV' names no unit.*voltage_UNIT=voltage_pV"),
        (ACTUATOR.replace("_mm", " out (V)"), {}, "is the output of an instrument in V, up to 1"),
        ("a,b\n0,1\n1,2\n", {}, "no column for voltage .* nor for film data .* there are: a, b"),
        (ACTUATOR.replace("0.25", "high"), {}, "line 3, column 'displacement_mm': 'high' is not a"),
        (ACTUATOR.replace("0.25", ""), {}, "line 3, column 'displacement_mm': there is no value"),
        (ACTUATOR.replace("0.25", "NaN"), {}, "line 3, column 'displacement_mm': 'NaN' is not a f"),
        (ACTUATOR.replace("0.25", "-inf"), {}, "line 3, .*'-inf' is not a finite number"),
        (ACTUATOR.replace("0.25", "1e999"), {}, "line 3, .*'1e999' is not a finite number"),
        (ACTUATOR.replace("0.25", "1_0"), {}, "line 3, .*'1_0' is not a number"),
        (ACTUATOR.replace("0.25", "x" * 99), {}, r"'x{30}\.\.\.' is not a number"),
        ("# top\n\n" + ACTUATOR.replace("0.25", "high"), {}, "line 5, "),
        (ACTUATOR.replace("0.75", "0.25"), {}, "line 4, column 'time_s': time goes back, from 0.5"),
        (ACTUATOR.replace("0.75", "0.5"), {}, "line 4, column 'time_s': time stands still"),
        ("#\n\n" + ACTUATOR.replace("0.5,", "\n0.5,").replace("0.75", "0.5"), {}, "line 7, "),
        (ACTUATOR.replace("0.25", "0.25,7"), {}, "line 3: 4 values, and the table has 3 columns"),
        (ACTUATOR.replace(",0.25", ""), {}, "line 3: 2 values, and the table has 3 columns"),
        (ACTUATOR.replace(",", ";").replace("0.25", "1,0.5"), {}, "both a comma and a point"),
        (
            ACTUATOR.replace("kV", "kV,voltage_V").replace("\n0", "\n0,0"),
            {},
            "voltage may be voltage_kV, voltage_V",
        ),
        (
            "time_s,time_s,voltage_V,displacement_m\n0,0,0,0\n1,2,1,1\n",
            {},
            "time may be time_s, time_s #2",
        ),
        (
            "t,x,x,voltage_V,displacement_m\n0,0,0,0,0\n1,1,1,1,1\n",
            {"columns": {"time_s": "x*2"}, "rate_Hz": 10.0},
            "both a rate and a column for time",
        ),
        (ACTUATOR, {"columns": {"time_s": "tme_s"}}, "no column 'tme_s'; .* did you mean 'time_s'"),
        (ACTUATOR, {"columns": {"voltage_pV": "x"}}, "'voltage_pV' is not .* may be voltage_V, "),
        (ACTUATOR, {"columns": {"voltage_V": "voltage_kV"}}, "is in kV by its name, and voltage_V"),
        (ACTUATOR, {"columns": {"displacement_mm": "voltage_kV"}}, "asks for mm; if it is the out"),
        (ACTUATOR, {"columns": {"tine_s": "x"}}, "'tine_s' is not .* did you mean 'time_s'"),
        (
            ACTUATOR,
            {"columns": {"voltage_V": "voltage_kV*1", "voltage_kV": "voltage_kV"}},
            "voltage is given twice, as voltage_V and as voltage_kV",
        ),
        ("time_s,voltage_V,stretch\n0,0,1\n1,1,2\n", {}, "has both voltage and stretch: actuator"),
        (FILM, {"gauge_length_mm": 80}, "has force and no nominal stress; .* --area-mm2"),
        (FILM, {"area_mm2": 22}, "displacement and no stretch; .* --gauge-length-mm"),
        (FILM.replace("displacement_mm", "x"), {}, "'x' may be the displacement, because no other"),
        ("time_s,force_N\n0,0\n1,1\n", {}, "no column for stretch .*--gauge-length-mm"),
        ("time_s,stretch\n0,1\n1,2\n", {}, "no column for nominal_stress .*--area-mm2"),
        ("time_s,stretch,force_N\n0,1,0\n1,0,0\n", {"area_mm2": 1}, "line 3: stretch is 0; it is"),
        (FILM, {"gauge_length_mm": 0.0, "area_mm2": 22}, "the gauge length is 0.0; it must be"),
        (FILM, {"gauge_length_mm": 80, "area_mm2": float("nan")}, "the area is nan; it must be"),
        (ACTUATOR, {"kinematics": "twisted"}, "kinematics 'twisted' is not one of constrained"),
    ],
)
def test_what_is_wrong_is_said(
    tmp_path: Path, content: str | bytes, given: dict[str, object], match: str
) -> None:
    path = csv(tmp_path, content)
    with refused(match) as caught:
        taken(path, **given)
    assert "\n" not in str(caught.value)
    assert [p.name for p in tmp_path.iterdir()] == ["in.csv"]


def test_the_source_is_never_overwritten(tmp_path: Path) -> None:
    source = csv(tmp_path, ACTUATOR)
    with refused("is the input file"):
        import_file(source, source, overwrite=True)
    assert source.read_text() == ACTUATOR


def test_nothing_is_overwritten(tmp_path: Path) -> None:
    out = csv(tmp_path, "precious", "out.h5")
    with refused(r"out\.h5 exists already"):
        import_file(csv(tmp_path, ACTUATOR), out)
    assert out.read_bytes() == b"precious"


def test_files_it_cannot_take(tmp_path: Path) -> None:
    with refused(r"none\.csv is not there"):
        taken(tmp_path / "none.csv")
    with refused(r"files named \.csv, .* and \.tdms can .* not '\.docx'"):
        taken(csv(tmp_path, "x", "in.docx"))
    (tmp_path / "folder.csv").mkdir()
    with refused("is a folder"):
        taken(tmp_path / "folder.csv")


def test_a_large_csv_is_exact_in_values_and_line_numbers(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    rows = 200_000
    voltage = rng.normal(size=rows) * 10.0 ** rng.integers(-9, 4, rows)
    lines = [f"{i / 1e4!r},{v!r},{v / 7!r}" for i, v in enumerate(voltage.tolist())]
    run = taken(csv(tmp_path, "time_s,voltage_V,displacement_m\n" + "\n".join(lines)))
    np.testing.assert_array_equal(run.voltage_command, voltage)
    np.testing.assert_array_equal(run.time, np.arange(rows) / 1e4)
    lines[150_000] = "15.0,1.0,none"
    with refused("line 150002, column 'displacement_m': 'none'"):
        taken(csv(tmp_path, "time_s,voltage_V,displacement_m\n" + "\n".join(lines)))


def lead_in(offset: float) -> str:
    rng = np.random.default_rng(2)
    rows = ["time_s,voltage_kV,displacement_um"]
    for i in range(300):
        volts = 0.0 if i < 100 else 5.0
        rows.append(f"{i * 0.01:.2f},{volts},{offset + 100 * volts + rng.normal():.3f}")
    return "\n".join(rows)


def test_displacement_is_counted_from_the_lead_in(tmp_path: Path) -> None:
    run = taken(csv(tmp_path, lead_in(250.0)))
    assert run.displacement is not None
    assert abs(run.displacement[:100].mean()) < 1e-15
    assert run.rest_reading == pytest.approx(250e-6, abs=1e-6)
    assert run.events[0].level == "info"
    assert "mean over the 100 samples at 0 V" in run.events[0].message
    assert run.noise_floor == pytest.approx(1e-6, rel=0.2)


def test_a_mean_within_the_noise_is_left_alone(tmp_path: Path) -> None:
    run = taken(csv(tmp_path, lead_in(0.0)))
    assert run.rest_reading == 0.0
    assert [event.message for event in run.events if "counted" in event.message] == []


@pytest.mark.parametrize(
    ("content", "given", "match"),
    [
        (
            ACTUATOR.replace("_mm", "_m"),
            {"metadata": RunMetadata(film=THESIS_FILM)},
            "spans 1000 mm and the film is 75 mm",
        ),
        (ACTUATOR.replace("_mm", "_m"), {}, "spans 1000 mm and a film is at most 500 mm"),
        (ACTUATOR.replace("0.25", "0").replace(",1\n", ",0.00001\n"), {}, "spans 0.01 um only"),
        (ACTUATOR.replace("kV", "V"), {}, "voltage reaches 2 V only; is it in kV"),
        (ACTUATOR.replace(",2,", ",2000,"), {}, "reaches 2000 kV; is it in V and not in kV"),
        (ACTUATOR.replace(",2,", ",0,").replace(",1,", ",0,"), {}, "voltage never leaves 0 V"),
        (ACTUATOR.replace("\n", ",7\n").replace("mm,7", "mm,current_A"), {}, "current reaches 7 A"),
        (
            ACTUATOR.replace("\n", ",295\n").replace("mm,295", "mm,temperature_C"),
            {},
            "temperature lies between 295 and 295",
        ),
        (ACTUATOR, {"gauge_length_mm": 80}, "gauge length and area are for film data"),
        (FILM, {"gauge_length_mm": 0.08, "area_mm2": 22}, "stretch lies between 1 and 101"),
        (FILM, {"gauge_length_mm": 80, "area_mm2": 22e-6}, "nominal stress reaches 1e.07 kPa"),
        ("time_s,stretch,force_N\n0,1,0\n1,1,1\n", {"area_mm2": 22}, "stretch never changes"),
        (
            "time_s,stretch,nominal_stress_kPa,force_N\n0,1,0,0\n1,2,9,9\n",
            {"area_mm2": 22, "gauge_length_mm": 80},
            "the gauge length was not used",
        ),
    ],
)
def test_what_looks_wrong_is_told(
    tmp_path: Path, content: str, given: dict[str, object], match: str
) -> None:
    out = tmp_path / "out.h5"
    given, metadata = dict(given), given.get("metadata")
    given.pop("metadata", None)
    done = import_file(
        csv(tmp_path, content), out, ImportOptions(**given), metadata=metadata, now=Clock()
    )
    run = open_recording(out)
    assert [e.message for e in run.events] == [*done.notes, *done.warnings]
    assert any(re.search(match, w) for w in done.warnings), done


def test_good_data_raise_no_doubts(tmp_path: Path) -> None:
    path = csv(tmp_path, lead_in(0.0))
    metadata = RunMetadata(film=THESIS_FILM)
    done = import_file(path, tmp_path / "out.h5", metadata=metadata, now=Clock())
    assert done.warnings == ()


@pytest.mark.parametrize("volts", [4000.0, -4000.0])
def test_a_displacement_with_the_other_sign_raises_a_doubt(tmp_path: Path, volts: float) -> None:
    """As of a laser that is mounted the other way round."""
    lobes = np.maximum(0.0, np.sin(0.02 * np.arange(1500))) ** 2
    noise = np.random.default_rng(0).normal(0.0, 2e-6, 1500)
    for sign, doubtful in ((1.0, False), (-1.0, True)):
        rows = np.column_stack([0.01 * np.arange(1500), volts * lobes, sign * 1e-4 * lobes + noise])
        path = tmp_path / "in.csv"
        np.savetxt(path, rows, delimiter=",", comments="", header="time_s,voltage_V,displacement_m")
        found = import_file(path, tmp_path / f"{sign:g}.h5", now=Clock()).warnings
        said = [s for s in found if "falls where the voltage rises: is its sign right?" in s]
        assert bool(said) is doubtful


def test_noise_alone_raises_no_doubt_about_its_sign(tmp_path: Path) -> None:
    lobes = np.maximum(0.0, np.sin(0.02 * np.arange(1500))) ** 2
    for seed in range(10):
        noise = np.random.default_rng(seed).normal(0.0, 1e-5, 1500)
        rows = np.column_stack([0.01 * np.arange(1500), 4000.0 * lobes, noise])
        path = tmp_path / "in.csv"
        np.savetxt(path, rows, delimiter=",", comments="", header="time_s,voltage_V,displacement_m")
        found = import_file(path, tmp_path / f"{seed}.h5", now=Clock()).warnings
        assert not any("sign" in sentence for sentence in found)


def test_mat_variables_fields_and_columns(tmp_path: Path) -> None:
    t = np.arange(5.0)
    path = tmp_path / "in.mat"
    savemat(path, {"time_s": t, "rig": {"voltage_kV": t, "more": {"x": np.c_[t, 3 * t]}}})
    run = taken(path, {"displacement_um": "rig.more.x[1]"})
    np.testing.assert_array_equal(run.voltage_command, 1000.0 * t)
    np.testing.assert_array_equal(run.displacement, 3 * t / 1e6)


@pytest.mark.parametrize(
    ("content", "columns", "match"),
    [
        ({"s": "text"}, {}, "holds no columns of numbers"),
        ({"d": np.zeros((4, 2))}, {"time_s": "d"}, r"'d' holds several columns; .* d\[0\], d\[1\]"),
        ({"d": np.zeros((4, 2))}, {"time_s": "d[2]"}, r"no column 'd\[2\]'; there are: d\[0\]"),
        (
            {"time_s": np.arange(4.0), "voltage_V": np.arange(4.0), "displacement_m": np.zeros(3)},
            {},
            "different lengths: time_s 4, voltage_V 4, displacement_m 3",
        ),
        (
            {
                "time_s": np.arange(4.0),
                "voltage_V": np.array([0, 1, np.nan, 2]),
                "displacement_m": np.zeros(4),
            },
            {},
            "row 3, column 'voltage_V': nan is not a finite number",
        ),
        (
            {"time_s": np.zeros(4), "voltage_V": np.zeros(4), "displacement_m": np.zeros(4)},
            {},
            "row 2, column 'time_s': time stands still",
        ),
    ],
)
def test_what_is_wrong_in_a_mat_file(
    tmp_path: Path, content: dict[str, object], columns: dict[str, str], match: str
) -> None:
    path = tmp_path / "in.mat"
    savemat(path, content)
    with refused(match):
        taken(path, columns)


def test_mat_files_that_cannot_be_read(tmp_path: Path) -> None:
    header = b"MATLAB 7.3 MAT-file".ljust(116) + bytes(8) + b"\x00\x02IM"
    with refused(r"version 7\.3 and no HDF5 file behind it"):
        taken(csv(tmp_path, header + bytes(400), "in.mat"))
    with refused("cannot be read as a MAT file"):
        taken(csv(tmp_path, b"junk" * 100, "in.mat"))


def tdms(path: Path, *channels: ChannelObject) -> Path:
    with TdmsWriter(str(path)) as writer:
        writer.write_segment(list(channels))
    return path


def test_tdms_channels(tmp_path: Path) -> None:
    t = np.arange(5.0)
    path = tdms(
        tmp_path / "in.tdms",
        ChannelObject("rig", "time_s", t),
        ChannelObject("rig", "voltage_kV", t.astype(np.int16)),
        ChannelObject("laser/1", "reading", 2 * t),
        ChannelObject("rig", "remark", ["a", "b"]),
    )
    run = taken(path, {"displacement_um": "laser/1/reading"})
    np.testing.assert_array_equal(run.voltage_command, 1000.0 * t)
    np.testing.assert_array_equal(run.displacement, 2 * t / 1e6)
    with refused("no column 'rig/x'; there are: laser/1/reading, rig/"):
        taken(path, {"displacement_um": "rig/x"})


def test_tdms_waveforms_carry_their_time(tmp_path: Path) -> None:
    timing = {"wf_increment": 0.01, "wf_start_offset": 0.0}
    path = tdms(
        tmp_path / "in.tdms",
        ChannelObject("a", "voltage_V", np.arange(50.0), timing),
        ChannelObject("a", "displacement_um", np.arange(50.0), timing),
    )
    np.testing.assert_allclose(taken(path).time, np.arange(50) * 0.01)


def test_of_a_tdms_file_that_was_cut_short_what_is_whole_is_taken(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    n = np.arange(50.0)
    path = tdms(
        tmp_path / "in.tdms",
        *(ChannelObject("rig", name, n) for name in ("time_s", "voltage_V", "displacement_m")),
    )
    path.write_bytes(path.read_bytes()[:-100])
    run = taken(path)
    np.testing.assert_array_equal(run.voltage_command, n[:37])
    assert any("the file ends early: it was not closed, or" in e.message for e in run.events)
    assert any("37 to 50 values, and the first 37 of each" in e.message for e in run.events)
    assert capfd.readouterr() == ("", "")


def test_tdms_files_that_cannot_be_read(tmp_path: Path) -> None:
    with refused("cannot be read as a TDMS file"):
        taken(csv(tmp_path, b"junk" * 100, "in.tdms"))
    path = tdms(tmp_path / "in.tdms", ChannelObject("a", "b", ["text"]))
    with refused("no channels of numbers"):
        taken(path)


@pytest.mark.parametrize(
    ("name", "rows", "highest"),
    [
        ("vhb4910_cycle_rate0.01_stretch2.0.csv", 10007, 2.0),
        ("vhb4910_cycle_rate0.05_stretch2.0.csv", 2008, 2.0),
        ("vhb4910_relaxation_stretch2.0.csv", 4745, 2.0),
        ("vhb4910_relaxation_stretch4.0.csv", 2953, 4.0),
    ],
)
def test_measured_csv(tmp_path: Path, name: str, rows: int, highest: float) -> None:
    source = measured_data() / name
    out = tmp_path / "out.h5"
    options = ImportOptions(gauge_length_mm=80, area_mm2=22)
    assert import_file(source, out, options, now=Clock()).warnings == ()
    run = open_recording(out)
    raw = np.loadtxt(source, delimiter=",", skiprows=1)
    assert run.samples == rows == len(raw)
    np.testing.assert_array_equal(run.time, raw[:, 0])
    np.testing.assert_allclose(run.stretch, 1.0 + raw[:, 1] / 80.0, rtol=1e-15)
    np.testing.assert_allclose(run.nominal_stress, raw[:, 2] / 22e-6, rtol=1e-15)
    assert run.stretch is not None
    assert run.stretch.max() == pytest.approx(highest, rel=0.01)


def test_measured_mat(tmp_path: Path) -> None:
    source = measured_data() / "vhb4910_data.mat"
    columns = {
        "time_s": "data.xdata[0]",
        "stretch": "data.xdata[1]",
        "nominal_stress_kPa": "data.ydata",
    }
    out = tmp_path / "out.h5"
    assert import_file(source, out, ImportOptions(columns), now=Clock()).warnings == ()
    run = open_recording(out)
    data = loadmat(source)["data"][0, 0]
    np.testing.assert_array_equal(run.time, data["xdata"][:, 0])
    np.testing.assert_array_equal(run.stretch, data["xdata"][:, 1])
    np.testing.assert_array_equal(run.nominal_stress, 1e3 * data["ydata"][:, 0])
    again = taken(export_recording(out, "csv", tmp_path / "again.csv"))
    for name, values in run.values.items():
        np.testing.assert_array_equal(again.values[name], values)


CELLS = st.sampled_from(
    [
        *"0123456789.,;-+eE#\"' \t\n\r\f\0_",
        "nan",
        "inf",
        "time_s",
        "voltage_V",
        "stretch",
        "µ",
        "\n0,1,2",
    ]
)
JUNK = st.one_of(
    st.binary(max_size=80),
    st.lists(CELLS, max_size=60).map(lambda cells: "".join(cells).encode()),
    st.lists(CELLS, max_size=60).map(
        lambda cells: ("time_s,voltage_V,displacement_mm\n0,0,0\n" + "".join(cells)).encode()
    ),
)


@settings(
    max_examples=300,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
@given(content=JUNK)
def test_no_csv_whatever_ends_in_a_traceback(tmp_path: Path, content: bytes) -> None:
    try:
        run = taken(csv(tmp_path, content))
    except InputError as error:
        assert "in.csv" in str(error)  # noqa: PT017
    else:
        assert np.isfinite(run.signal).all()


def test_damaged_mat_files_are_a_sentence(tmp_path: Path) -> None:
    n = np.arange(200.0)
    content = {"time_s": n, "displacement_m": n / 1e4, "rig": {"voltage_kV": n}}
    savemat(tmp_path / "good.mat", content, do_compression=True)
    whole = (tmp_path / "good.mat").read_bytes()
    assert taken(tmp_path / "good.mat").samples == 200
    rng = np.random.default_rng(3)
    damaged = [whole[: int(at)] for at in rng.integers(1, len(whole), 60)]
    for at in rng.integers(124, len(whole), 200):
        raw = bytearray(whole)
        raw[int(at)] ^= int(rng.integers(1, 256))
        damaged.append(bytes(raw))
    refused = 0
    for raw in damaged:
        try:
            run = taken(csv(tmp_path, raw, "in.mat"))
        except InputError as error:
            refused += "in.mat" in str(error)
        else:
            # a bit that the decompression does not look at
            np.testing.assert_array_equal(run.time, n)
    assert refused > 250


def test_the_output_appears_as_a_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("dearig.recording.writing.save.write_provenance", full)
    source = csv(tmp_path, ACTUATOR)
    with refused(r"out\.h5 cannot be written: .*No space left"):
        taken(source)
    assert [p.name for p in tmp_path.iterdir()] == ["in.csv"]
