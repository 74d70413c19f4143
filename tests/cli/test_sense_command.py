"""``dearig sense``: the film as its own sensor, calibrated by one recording, tried on another."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

import dearig as api
from dearig.analysis.readings.scales import scale_errors
from dearig.recording import open_recording
from dearig.report.sensed import sense_json
from tests.tools.command import dearig, done, film_model, refused, thesis_model, write

LOBES = """\
name = "lobes"
lead_in_s = 0.5
tail_s = 0.2
[[segment]]
kind = "half_sine"
amplitude_kV = 7.0
frequency_Hz = 1.0
repeats = 4
"""
#: 100,000 conversions a second, two microseconds apart.
CARD = "sample_rate_Hz = 200\naverage = 500\nfirst_convert_us = 1.0\nconvert_interval_us = 2.0\n"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two recordings of means, one of instants, and the model of their film."""
    folder = tmp_path_factory.mktemp("sense")
    sequence = write(folder / "lobes.toml", LOBES)
    means = write(folder / "means.toml", f"[card]\n{CARD}")
    for name, options in {
        "first": ("--rig-file", means, "--seed", "1"),
        "second": ("--rig-file", means, "--seed", "2"),
        "instants": ("--seed", "1"),
    }.items():
        done("record", sequence, *options, "--out", folder / f"{name}.h5")
    thesis_model(folder / "m.toml")
    return folder


def sense(folder: Path, name: str, *options: str | Path) -> tuple[dict, str]:
    out = folder / f"{name}.json"
    answer = done(
        "sense", folder / f"{name}.h5", "--model", folder / "m.toml", "--json", out, "--force",
        *options,
    )  # fmt: skip
    return json.loads(out.read_text(encoding="utf-8")), answer.out


def test_a_gain_from_one_recording_serves_for_another(folder: Path) -> None:
    first, text = sense(folder, "first")
    # the card converts at fixed times after each step of the output: a gain that is far from 1
    weight = scale_errors(open_recording(folder / "first.h5")).weight
    assert weight == pytest.approx(first["gain_by_laser"], abs=0.03)
    assert weight > 1.05
    assert first["gain_error"] == pytest.approx(np.hypot(weight - 1.0, np.sqrt(2.0) * 0.01))
    assert first["coverage"] > 0.9
    assert f"the readings are {weight:.3g} times the current" in text
    assert "amplifier.gain_V_per_V_uncertainty or" in text
    gain = (
        "--gain",
        str(first["gain_by_laser"]),
        "--gain-error",
        str(first["gain_by_laser_error"]),
    )
    second, text = sense(folder, "second", *gain, "--out", folder / "s.csv")
    assert second["format"] == "dearig-sense/1"
    assert second["usable"]
    assert 0.4 < second["rms_um"] / second["standard_error_um"] < 2.0
    assert second["coverage"] > 0.8
    assert "noise is the larger part" in text
    table = np.genfromtxt(folder / "s.csv", delimiter=",", names=True)
    known = np.isfinite(table["displacement_mm"])
    assert np.count_nonzero(known) == second["rows_with_estimate"]
    assert not known[:90].any()
    difference = (table["displacement_mm"] - table["laser_mm"])[known]
    assert np.sqrt(np.mean(difference**2)) * 1e3 == pytest.approx(second["rms_um"], rel=1e-6)
    result = api.sense(folder / "second.h5", folder / "m.toml", gain=first["gain_by_laser"])
    np.testing.assert_allclose(result.displacement * 1e3, table["displacement_mm"], rtol=1e-9)
    assert result.save(folder / "api.csv").exists()
    assert sense_json(result.outcome)["gain"] == first["gain_by_laser"]
    assert "two standard errors" in result._repr_html_()


def test_instants_carry_no_charge_and_averaging_is_advised(folder: Path) -> None:
    found, text = sense(folder, "instants")
    assert not found["usable"]
    assert found["rms_um"] is None
    assert found["charge_share"] < 0.5
    assert "Record with [card] average = 100" in text


def test_what_cannot_be_sensed_is_refused(folder: Path) -> None:
    first, model = folder / "first.h5", folder / "m.toml"
    refused(dearig("sense", first, "--model", film_model(folder / "film.toml")), "bare film")
    text = model.read_text(encoding="utf-8")
    thick = re.sub(r"(thickness_m) = \S+", r"\1 = 0.009", text)
    assert thick != text
    wrong = write(folder / "thick.toml", thick)
    refused(dearig("sense", first, "--model", wrong), "of what the film of Table 3 takes")
    refused(dearig("sense", first, "--model", model, "--gain", "0"), "gain", "above 0")
    refused(dearig("sense", first, "--model", model, "--out", folder / "x.txt"), ".csv")
    plain = write(
        folder / "p.csv",
        "time_s,voltage_V,displacement_mm\n"
        + "".join(f"{0.001 * i:.3f},{1000 * (i % 7)}.0,{0.1 * (i % 5)}\n" for i in range(500)),
    )
    done("import", plain, "--out", folder / "p.h5")
    refused(dearig("sense", folder / "p.h5", "--model", model), "current cannot be used")
