"""The public command from end to end: what people and their scripts rely on."""

from __future__ import annotations

import itertools
import os
import signal
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from dearig.config.presets import PRESETS, VALIDATION_A, VALIDATION_B
from dearig.config.sequencefile import load_sequence
from dearig.model.film.material import STANDARD_GRAVITY, VACUUM_PERMITTIVITY
from dearig.recording import open_recording
from tests.deep import mostly_deep
from tests.tools.command import (
    LOBE,
    SLOW_RIG,
    Answer,
    dearig,
    done,
    film_csv,
    film_model,
    names,
    strict_json,
    thesis_model,
    write,
)
from tests.tools.recordings import measured_data

ROOT = Path(__file__).parents[2]
MEASURES_UM = {"rms_um", "nrmse_pct", "e_rms_thesis_pct", "e_m_thesis_pct", "max_um"}
MEASURES_KPA = {"rms_kPa", "nrmse_pct", "e_rms_thesis_pct", "e_m_thesis_pct", "max_kPa"}


@pytest.fixture(scope="module")
def lobe(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A short recording at the rig's own rate."""
    folder = tmp_path_factory.mktemp("lobe")
    done("record", write(folder / "lobe.toml", LOBE), "--out", folder / "run.h5", "--film", "F 3")
    return folder / "run.h5"


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the thesis's run and one of its validation runs, sampled slowly."""
    folder = tmp_path_factory.mktemp("bench")
    rig = write(folder / "rig.toml", SLOW_RIG)
    for preset in ("thesis", "validation-a-0.6"):
        done("record", preset, "--out", folder / f"{preset}.h5", "--rig-file", rig)
    return folder


@pytest.fixture(scope="module")
def identified(bench: Path) -> tuple[Path, dict]:
    """The model of the thesis's run, and what identify said of it."""
    answer = done(
        "identify", bench / "thesis.h5", "--out", bench / "model.toml", "--branches", "1-2",
        "--no-intervals", "--validate", bench / "validation-a-0.6.h5", "--json", "-",
    )  # fmt: skip
    return bench / "model.toml", answer.json


# ---------------------------------------------------------------- the command itself


def run(code: str, *arguments: str, **options: object) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", code, *arguments],
        capture_output=True, text=True, encoding="utf-8", cwd=ROOT, check=False, timeout=200,
        **options,
    )  # type: ignore[call-overload,no-any-return]  # fmt: skip


COMMAND = "from dearig.cli.main import main; main()"


def test_without_arguments_it_shows_its_commands_and_fails() -> None:
    ended = run(COMMAND)
    assert ended.returncode == 2
    assert "record" in ended.stdout


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["fly"], "No such command 'fly'"),
        (["record", "thesis"], "Missing option '--out'; dearig record --help"),
        (["record", "thesis", "--out", "x.h5", "--seed", "-1"], "'--seed': it must be at least 0"),
        (["record", "thesis", "--out", "x.h5", "--seed", "1" * 30], "'--seed': it must be at most"),
        (
            ["record", "thesis", "--out", "x.h5", "--seed", "x"],
            "'--seed': it must be a whole number",
        ),
        (["record", "thesis", "--seed"], "'--seed' requires an argument; dearig record --help"),
        (["identify", "x.h5", "--out", "m.toml", "--rest-length-mm", "x"], "it must be a number;"),
        (["export", "x.h5"], "Missing option '--to'; dearig export --help"),
        (["info", "x.h5", "y.h5", "z.h5"], "too many arguments, from y.h5 z.h5 on; dearig info"),
        (["serve-daqmx", "--port", "99999"], "'--port': it must be at most 65535"),
        (["export", "x.h5", "--to", "xls"], "'xls' is not one of 'csv', 'mat', 'parquet'"),
        (["info", "x.h5", "--colour"], "No such option: --colour"),
    ],
)
def test_wrong_usage_is_one_line(arguments: list[str], message: str) -> None:
    answer = dearig(*arguments)
    assert answer.code == 2
    assert message in answer.err
    assert answer.err.startswith("dearig: ")
    assert answer.err.count("\n") == 1
    assert "Value error" not in answer.err


@pytest.mark.deep
def test_a_reader_who_leaves_a_pipe_is_no_error(lobe: Path) -> None:
    # big enough for no buffer, so that the pipe breaks while it is written to
    read, wrote = os.pipe()
    os.close(read)
    for arguments in (["info", str(lobe)], ["info", str(lobe), "--json", "-"]):
        ended = subprocess.run(
            [sys.executable, "-u", "-c", COMMAND, *arguments],
            stdout=wrote, stderr=subprocess.PIPE, text=True, cwd=ROOT, check=False, timeout=200,
        )  # fmt: skip
        assert (ended.returncode, ended.stderr) == (0, "")
    os.close(wrote)


def test_what_the_terminal_cannot_show_ends_nothing(lobe: Path, tmp_path: Path) -> None:
    path = tmp_path / "\N{MICRO SIGN}.h5"
    path.write_bytes(lobe.read_bytes())
    environment = {**os.environ, "PYTHONIOENCODING": "ascii"}
    ended = run(COMMAND, "info", str(path), env=environment)
    assert ended.returncode == 0
    assert r"\xb5 (actuator, one lobe)" in ended.stdout


def test_verbose_tells_of_events_on_standard_error(tmp_path: Path) -> None:
    write(tmp_path / "s.toml", LOBE)
    ended = run(
        "import logging\n"
        "from dearig.drivers.rig import Event\n"
        "from dearig.sim_backend.rig import SimulatedRig\n"
        "deliver = SimulatedRig._deliver\n"
        "def told(self, run, end):\n"
        "    run.events.append(Event(end - 1, 'info', 'all is well'))\n"
        "    return deliver(self, run, end)\n"
        "SimulatedRig._deliver = told\n" + COMMAND,
        "-v", "record", str(tmp_path / "s.toml"), "--out", str(tmp_path / "run.h5"),
    )  # fmt: skip
    assert ended.returncode == 0, ended.stderr
    assert "INFO: all is well" in ended.stderr
    assert "numba" not in ended.stderr


@pytest.mark.deep
def test_results_fit_80_columns_and_pipes_get_no_bars(identified: tuple[Path, dict]) -> None:
    model, _ = identified
    ended = run(
        COMMAND, "validate", str(model), str(model.parent / "validation-a-0.6.h5"),
        env={**os.environ, "COLUMNS": "80"},
    )  # fmt: skip
    assert ended.returncode == 0, ended.stderr
    assert ended.stderr == ""
    assert max(map(len, ended.stdout.splitlines())) <= 80
    assert "\x1b" not in ended.stdout


# ---------------------------------------------------------------- recordings


def test_record_info_export_import_round_trip(lobe: Path, tmp_path: Path) -> None:
    about = done("info", lobe, "--json", "-").json
    assert (about["kind"], about["title"], about["complete"]) == ("actuator", "one lobe", True)
    assert (about["samples"], about["timing"]["even"]) == (1501, True)
    assert about["film"]["id"] == "F 3"
    assert about["format"] == "dearig-recording/1"
    shown = done("info", lobe)
    assert "one lobe" in shown.out

    first = open_recording(lobe)
    for form in ("csv", "mat", "parquet"):
        out = tmp_path / f"out.{form}"
        told = done("export", lobe, "--to", form, "--out", out, "--json", "-")
        assert told.json["out"] == str(out)
        assert out.stat().st_size > 0
    done("import", tmp_path / "out.csv", "--out", tmp_path / "again.h5")
    again = open_recording(tmp_path / "again.h5")
    np.testing.assert_array_equal(again.time, first.time)
    np.testing.assert_array_equal(again.voltage_command, first.voltage_command)
    # counted again from its lead-in, whose mean is zero already
    np.testing.assert_allclose(again.displacement, first.displacement, atol=1e-10)


def test_the_same_seed_records_the_same_counts(tmp_path: Path) -> None:
    sequence = write(tmp_path / "s.toml", LOBE)

    def counts(name: str, *options: str) -> dict[str, np.ndarray]:
        done("record", sequence, "--out", tmp_path / name, *options)
        with h5py.File(tmp_path / name) as file:
            data = file["entry/data"]
            return {n: data[n][()] for n in data if n.endswith("_counts")}

    first = counts("a.h5", "--rig", "sim:7", "--seed", "3")
    again = counts("b.h5", "--rig", "sim:7", "--seed", "3")
    other = counts("c.h5", "--rig", "sim:7", "--seed", "4")
    assert first.keys() == again.keys()
    for name in first:
        np.testing.assert_array_equal(first[name], again[name])
    assert (first["displacement_counts"] != other["displacement_counts"]).any()
    np.testing.assert_array_equal(first["voltage_command_counts"], other["voltage_command_counts"])
    assert open_recording(tmp_path / "a.h5").provenance["rig"] == "sim:7"


def test_record_says_in_json_what_it_did(tmp_path: Path) -> None:
    out = tmp_path / "run.h5"
    found = done("record", write(tmp_path / "s.toml", LOBE), "--out", out, "--json", "-").json
    margins = {m["quantity"]: m for m in found.pop("margins")}
    assert found == {
        "format": "dearig-run/1", "recording": str(out), "samples": 1501, "rate_Hz": 1000.0,
        "average": 1, "outcome": "finished", "events": [],
    }  # fmt: skip
    assert margins["voltage"]["allowed"] == 8.5
    assert 0.0 < margins["true field"]["reached"] < margins["true field"]["allowed"]


def test_simulate_says_how_near_breakdown_it_comes(tmp_path: Path) -> None:
    model = thesis_model(tmp_path / "m.toml")
    answer = done(
        "simulate", model, "--drive", write(tmp_path / "s.toml", LOBE),
        "--out", tmp_path / "p.csv", "--json", tmp_path / "p.json",
    )  # fmt: skip
    found = strict_json((tmp_path / "p.json").read_text(encoding="utf-8"))
    prediction = np.genfromtxt(tmp_path / "p.csv", delimiter=",", names=True)
    # held in width, z = Z/lam: the loaded film of Table 3 rests at 1.1894
    stretch = 1.18942 + prediction["displacement_mm"] / 75.0
    field = np.max(prediction["voltage_V"] * stretch) / 1e-3
    assert found["true_field_max_V_per_m"] == pytest.approx(field, rel=1e-4)
    assert "true field up to" in answer.out
    assert "pull-in" in answer.out


def test_json_goes_to_a_file_and_words_to_the_terminal(lobe: Path, tmp_path: Path) -> None:
    answer = done("info", lobe, "--json", tmp_path / "info.json")
    assert "one lobe" in answer.out
    assert strict_json((tmp_path / "info.json").read_text(encoding="utf-8"))["samples"] == 1501
    again = dearig("info", lobe, "--json", tmp_path / "info.json")
    assert again.code == 2
    assert "info.json exists already" in again.err
    done("info", lobe, "--json", tmp_path / "info.json", "--force")


def test_presets_are_listed(tmp_path: Path) -> None:
    words, listed = done("presets").out, done("presets", "--json", "-").json
    assert [p["name"] for p in listed["presets"]] == list(PRESETS)
    assert all(name in words for name in PRESETS)
    assert len({*VALIDATION_A, *VALIDATION_B} & PRESETS.keys()) == 10
    # what is listed is what can be played
    text = listed["presets"][0]["sequence"]
    assert load_sequence(write(tmp_path / "s.toml", text)).sequence == load_sequence(
        listed["presets"][0]["name"]
    ).sequence  # fmt: skip


def test_a_rig_file_is_written_to_be_edited(tmp_path: Path) -> None:
    path = tmp_path / "rig.toml"
    assert f"--rig-file {path}" in done("rig-file", path).out
    write(path, path.read_text(encoding="utf-8").replace("= 1000.0  ", "= 1000.0"))
    sequence = write(tmp_path / "s.toml", LOBE)
    done("record", sequence, "--out", tmp_path / "run.h5", "--rig-file", path)
    kept = open_recording(tmp_path / "run.h5").provenance["configuration"]
    assert kept == path.read_text(encoding="utf-8")


def test_a_sequence_file_is_written_to_be_edited_and_can_be_played(tmp_path: Path) -> None:
    path = tmp_path / "my.toml"
    assert f"dearig record {path}" in done("sequence-file", path).out
    text = path.read_text(encoding="utf-8")
    loaded = load_sequence(path)
    assert len(loaded.sequence.segments) > 1
    again = dearig("sequence-file", path)
    assert (again.code, "my.toml exists already" in again.err) == (2, True)
    write(path, "edited")
    done("sequence-file", path, "--force")
    assert path.read_text(encoding="utf-8") == text


def test_brackets_in_names_and_notes_are_shown_as_they_are(tmp_path: Path) -> None:
    csv = tmp_path / "data [red].csv"
    write(csv, "time_s,voltage_V,displacement_mm,temperature [/C]\n0,0,0,1\n1,0,1,2\n2,0,1,3\n")
    out = tmp_path / "run [bold].h5"
    answer = done("import", csv, "--out", out, "--notes", "[/x] [red]film")
    assert f"{out}: 3 samples" in answer.out
    assert "[/x] [red]film" in done("info", out).out


def test_nothing_to_recover_is_said_so(lobe: Path, tmp_path: Path) -> None:
    path = tmp_path / "run.h5"
    path.write_bytes(lobe.read_bytes())
    assert "nothing to recover; 1501 samples" in done("recover", path).out
    assert done("recover", path, "--json", "-").json["recovered"] is False


# ---------------------------------------------------------------- models


def test_identify_says_what_the_contract_says(identified: tuple[Path, dict]) -> None:
    model, found = identified
    assert found["format"] == "dearig-identification/1"
    assert found["kind"] == "actuator"
    assert found["model_path"] == str(model)
    assert {"name", "value", "unit", "ci95"} <= found["parameters"][0].keys()
    assert [t["branches"] for t in found["trials"]] == [1, 2]
    assert sum(t["chosen"] for t in found["trials"]) == 1
    for role in ("train", "validation"):
        (row,) = found[role]
        assert row.keys() >= MEASURES_UM
        assert row["role"] == role
        assert row["rms_um"] < 1.1 * found["noise_floor_um"]
    # the thesis's own validation table, with its printed figures
    (row,) = found["validation"]
    assert (row["table"], row["row"]) == ("A", "f = 0.6 Hz")
    assert row["published"] == {"e_rms_pct": 5.8952, "e_m_pct": 3.8678}
    assert found["published_fit"] == {"e_rms_pct": 2.13, "e_m_pct": 4.07}


def test_validate_marks_what_was_fitted(identified: tuple[Path, dict], tmp_path: Path) -> None:
    model, _ = identified
    runs = [model.parent / "thesis.h5", model.parent / "validation-a-0.6.h5"]
    found = done("validate", model, *runs, "--json", "-", "--report", tmp_path / "r.html").json
    assert [r["role"] for r in found["recordings"]] == ["train", "validation"]
    for row in found["recordings"]:
        assert row.keys() >= MEASURES_UM
        assert row["rms_um"] == pytest.approx(found["noise_floor_um"], rel=0.1)
    page = (tmp_path / "r.html").read_text(encoding="utf-8")
    assert "validation-a-0.6" in page or "f = 0.6 Hz" in page


def test_a_copy_of_a_fitted_recording_is_known_by_its_content(
    identified: tuple[Path, dict], tmp_path: Path
) -> None:
    model, _ = identified
    copy = tmp_path / "another name.h5"
    copy.write_bytes((model.parent / "thesis.h5").read_bytes())
    (row,) = done("validate", model, copy, "--json", "-").json["recordings"]
    assert row["role"] == "train"
    answer = dearig("validate", model, copy, model.parent / "thesis.h5")
    assert answer.code == 2
    assert "is a copy of" in answer.err


def test_simulate_agrees_with_the_recording_to_its_noise(bench: Path, tmp_path: Path) -> None:
    run_, out = bench / "thesis.h5", tmp_path / "out.h5"
    done("simulate", thesis_model(tmp_path / "m.toml"), "--drive", run_, "--out", out)
    measured, simulated = open_recording(run_), open_recording(out)
    np.testing.assert_array_equal(measured.time, simulated.time)
    np.testing.assert_array_equal(measured.voltage_command, simulated.voltage_command)
    assert simulated.hold == measured.hold
    assert simulated.notes == "a prediction of a model, not a measurement"
    # the sensor shows what was there a moment before
    lag = measured.displacement_delay - measured.displacement_skew
    shown = np.interp(measured.time - lag, simulated.time, simulated.displacement)
    floor = measured.noise_floor
    assert floor is not None
    assert np.std(measured.displacement - shown) < 1.1 * floor


@pytest.mark.deep
def test_simulated_csv_is_what_another_solver_gives(tmp_path: Path) -> None:
    sequence = write(
        tmp_path / "s.toml",
        'name = "one period"\nlead_in_s = 0.5\ntail_s = 0.5\n'
        '[[segment]]\nkind = "thesis"\nperiods = 1\n',
    )
    out = tmp_path / "out.csv"
    told = done(
        "simulate", thesis_model(tmp_path / "m.toml"), "--drive", sequence, "--out", out,
        "--json", "-",
    ).json  # fmt: skip
    assert told["out"] == str(out)
    assert out.read_text(encoding="utf-8").splitlines()[0] == "time_s,voltage_V,displacement_mm"
    time, voltage, displacement = np.loadtxt(out, delimiter=",", skiprows=1, unpack=True)
    assert voltage.max() == pytest.approx(8000.0, rel=1e-4)
    expected = _displacement_by_lsoda(load_sequence(sequence).sequence, time)
    assert np.max(np.abs(displacement * 1e-3 - expected)) < 0.2e-6


def _displacement_by_lsoda(sequence, time: np.ndarray) -> np.ndarray:
    """Eq. 36-48 with Table 3, written down once more, through SciPy's LSODA; (N,) in m."""
    L1, L2, Z, rho, eps = 0.075, 0.072, 0.001, 1000.0, 4.7 * VACUUM_PERMITTIVITY
    mu = np.array([4.5772e4, 4.0037e4, 5.1736e4, 2.3021e2])
    J = np.array([9.7749e3, 4.2709e3, 9.5677e3, 7.2315e3])
    T = np.array([0.39802, 0.33969, 8.3874])
    weight = 0.2 * STANDARD_GRAVITY / (L2 * Z)

    def pull(e: float, limit: float) -> float:
        return (e - e**-3) / (1.0 - (e**2 + e**-2 - 2.0) / limit)

    rest = brentq(lambda e: mu[0] * pull(e, J[0]) - weight, 1.0, 2.0, xtol=1e-14)

    def slopes(t: float, y: np.ndarray) -> list[float]:
        lam, rate, xi = y[0], y[1], y[2:]
        volts = float(sequence.voltage(np.array([t]))[0])
        squared = lam**2 / xi**2
        stiff = 1.0 - (squared + 1.0 / squared - 2.0) / J[1:]
        branches = np.sum(mu[1:] * (lam / xi**2 - xi**2 / lam**3) / stiff)
        force = weight + eps * (volts / Z) ** 2 * lam - mu[0] * pull(lam, J[0]) - branches
        flow = -(1.0 / squared - squared) / stiff / T
        return [rate, force / (rho * L1**2 / 3.0), *flow]

    y, out = np.array([rest, 0.0, rest, rest, rest]), np.zeros_like(time)
    edges = [time[0], *sequence.boundaries, time[-1]]
    lobes = sequence.lead_in + np.cumsum(
        [0.0, *(1.0 / f for f in sequence.segments[0].frequencies)]
    )
    edges = np.unique(np.concatenate([edges, lobes]))  # where the slope of the voltage jumps
    for start, end in itertools.pairwise(edges):
        if end - start < 1e-9:
            continue
        inside = (time > start + 1e-12) & (time <= end + 1e-12)
        at = np.unique(np.append(np.minimum(time[inside], end), end))
        solved = solve_ivp(slopes, (start, end), y, "LSODA", at, rtol=1e-9, atol=1e-11)
        assert solved.success
        out[inside] = (solved.y[0, : np.count_nonzero(inside)] - rest) * L1
        y = solved.y[:, -1]
    return out


# ---------------------------------------------------------------- films


def test_film_data_from_import_to_validation(tmp_path: Path) -> None:
    for name, rate, seed in (("train", 0.1, 1), ("other", 0.02, 2)):
        csv = film_csv(tmp_path / f"{name}.csv", rate, seed)
        found = done("import", csv, "--out", tmp_path / f"{name}.h5", "--json", "-").json
        assert (found["kind"], found["kinematics"], found["samples"]) == ("film", "uniaxial", 400)
    model = tmp_path / "m.toml"
    found = done(
        "identify", tmp_path / "train.h5", "--out", model, "--branches", "1-2", "--no-intervals",
        "--json", "-",
    ).json  # fmt: skip
    assert [t["branches"] for t in found["trials"]] == [1, 2]
    assert [t["chosen"] for t in found["trials"]] == [True, False]
    assert found["train"][0].keys() >= MEASURES_KPA
    (row,) = done("validate", model, tmp_path / "other.h5", "--json", "-").json["recordings"]
    assert row.keys() >= MEASURES_KPA
    assert row["e_rms_thesis_pct"] is None
    assert row["rms_kPa"] < 0.1  # the noise is 0.05
    out = tmp_path / "out.csv"
    done("simulate", model, "--drive", tmp_path / "other.h5", "--out", out)
    assert out.read_text(encoding="utf-8").splitlines()[0] == "time_s,stretch,nominal_stress_kPa"


@pytest.mark.deep
def test_measured_film_data(tmp_path: Path) -> None:
    folder = measured_data()
    specimen = ("--gauge-length-mm", "80", "--area-mm2", "22")
    for name in ("cycle_rate0.05", "relaxation"):
        source = folder / f"vhb4910_{name}_stretch2.0.csv"
        done("import", source, "--out", tmp_path / f"{name}.h5", *specimen)
    model = tmp_path / "m.toml"
    found = done(
        "identify", tmp_path / "cycle_rate0.05.h5", "--out", model, "--branches", "1-2",
        "--no-intervals", "--json", "-",
    ).json  # fmt: skip
    assert found["train"][0]["peak_pct"] < 8.0
    (row,) = done("validate", model, tmp_path / "relaxation.h5", "--json", "-").json["recordings"]
    assert row["role"] == "validation"
    assert row["peak_pct"] < 40.0


# ---------------------------------------------------------------- ctrl-C for real


@pytest.mark.skipif(sys.platform == "win32", reason="a POSIX signal is sent")
@pytest.mark.parametrize("name", mostly_deep(["SIGINT", "SIGTERM"], ["SIGINT"]))
def test_ctrl_c_in_real_time_ramps_down(tmp_path: Path, name: str) -> None:
    sequence = write(
        tmp_path / "s.toml",
        'name = "a long hold"\nlead_in_s = 0.1\n'
        '[[segment]]\nkind = "ramp"\nto_kV = 3.0\nduration_s = 0.1\n'
        '[[segment]]\nkind = "hold"\nduration_s = 30.0\n'
        '[[segment]]\nkind = "ramp"\nto_kV = 0.0\nduration_s = 1.0\n',
    )
    out = tmp_path / "run.h5"
    # says so when the voltage is up; a parent may have told its children to ignore the signal
    code = (
        "import signal\n"
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "signal.signal(signal.SIGTERM, signal.SIG_DFL)\n"
        "from dearig.sim_backend.rig import SimulatedRig\n"
        "read = SimulatedRig.read\n"
        "def told(self):\n"
        "    block = read(self)\n"
        "    if block is not None and block.start == 300:\n"
        "        print('up', flush=True)\n"
        "    return block\n"
        "SimulatedRig.read = told\n" + COMMAND
    )
    with subprocess.Popen(
        [sys.executable, "-c", code, "record", str(sequence), "--out", str(out), "--paced"],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=ROOT,
    ) as process:  # fmt: skip
        try:
            assert process.stdout is not None
            assert process.stdout.readline() == "up\n"
            process.send_signal(getattr(signal, name))
            _, err = process.communicate(timeout=200)
        finally:
            process.kill()
    assert process.returncode == 130
    who = "the operator" if name == "SIGINT" else "the signal SIGTERM, which asks a program to end"
    assert "the voltage was ramped down to 0 V, and what was recorded is in" in err
    recording = open_recording(out)
    assert recording.complete
    assert recording.outcome == f"interrupted by {who}; ramped down to 0 V"
    volts = recording.voltage_command
    assert volts.max() == pytest.approx(3000.0, abs=1.0)
    assert volts[-1] == pytest.approx(0.0, abs=0.2)
    ramp = volts[np.flatnonzero(volts > 2999.0)[-1] :]
    assert ramp.size == pytest.approx(500, abs=5)  # the set half second
    assert (np.diff(ramp) <= 0.0).all()
    assert any(f"interrupted by {who}" in e.message for e in recording.events)
    assert names(tmp_path) == {"s.toml", "run.h5"}


def test_film_model_of_the_tests_is_one(tmp_path: Path) -> None:
    answer: Answer = dearig("validate", film_model(tmp_path / "m.toml"), tmp_path / "no.h5")
    assert (answer.code, "no.h5 is not there" in answer.err) == (2, True)
