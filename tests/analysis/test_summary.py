"""What a browser of recordings shows of them, against the recordings themselves."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest

from dearig.analysis.summary import (
    curves,
    differences,
    export_file,
    recordings_in,
    recover_file,
    summarise,
)
from dearig.config.modelfile import save_model
from dearig.errors import InputError
from dearig.model.actuator import Actuator
from dearig.model.film import Strip
from dearig.model.material import TABLE_3, THESIS_FILM, THESIS_LOAD, Network, Spring
from dearig.recording import open_recording
from tests.window.recordings import killed, made


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("recordings")
    made(folder, "low", 4.0, operator="Ada", film_id="film 1")
    made(folder, "high", 6.0, operator="Grace", film_id="film 1")
    killed(folder, "torn")
    (folder / "text.h5").write_text("no recording")
    (folder / "notes.txt").write_text("of another kind")
    return folder


def test_a_folder_lists_what_may_be_recordings(folder):
    found = recordings_in(folder)
    assert {path.name for path in found} == {"low.h5", "high.h5", "torn.h5", "text.h5"}
    assert found[folder / "torn.h5"] == (1.6e9, (folder / "torn.h5").stat().st_size)
    with pytest.raises(InputError, match=r"gone cannot be read: No such file"):
        recordings_in(folder / "gone")


def test_a_summary_tells_what_a_recording_is_and_how_the_thesis_s_model_does(folder):
    found, recording = summarise(folder / "low.h5", None), open_recording(folder / "low.h5")
    assert (found.title, found.film, found.operator) == ("lobes of 4.0 kV", "film 1", "Ada")
    assert (found.samples, found.duration) == (recording.samples, recording.duration)
    # the rig is the thesis's model, seen through a laser: only noise is left
    assert found.errors.rms == pytest.approx(found.noise, rel=0.15)
    time, signal = found.thumbnail
    assert time.size < 130
    assert signal.max() == recording.displacement.max()
    assert signal.min() == recording.displacement.min()


def test_a_summary_never_raises(folder):
    assert "is not an HDF5 file" in summarise(folder / "text.h5", None).trouble
    assert "gone.h5 is not there" in summarise(folder / "gone.h5", None).trouble
    torn = summarise(folder / "torn.h5", None)
    assert (torn.trouble, torn.complete) == ("", False)
    assert torn.samples > 0


def test_a_summary_says_why_a_model_does_not_go_with_a_recording(folder, tmp_path):
    found = summarise(folder / "low.h5", tmp_path / "gone.toml")
    assert found.errors is None
    assert "gone.toml" in found.unfit
    assert found.trouble == ""


def test_the_error_of_what_a_model_was_fitted_to_is_marked(folder, tmp_path):
    recording = open_recording(folder / "low.h5")
    model = Actuator(THESIS_FILM, THESIS_LOAD, TABLE_3)
    history = {"train": [{"name": "low", "sha256": recording.sha256}]}
    path = save_model(tmp_path / "model.toml", "fitted", model, history)
    assert summarise(folder / "low.h5", path).fitted
    assert not summarise(folder / "high.h5", path).fitted


def test_curves_are_the_recording_and_the_model(folder, tmp_path):
    recording = open_recording(folder / "high.h5")
    soft = Network(replace(TABLE_3.equilibrium, modulus=0.9 * TABLE_3.equilibrium.modulus))
    path = save_model(tmp_path / "soft.toml", "soft", Actuator(THESIS_FILM, THESIS_LOAD, soft), {})
    found = curves(folder / "high.h5", path)
    time, measured = found.measured
    np.testing.assert_array_equal(time, recording.time)
    np.testing.assert_array_equal(measured, recording.displacement)
    np.testing.assert_array_equal(found.drive[1], recording.voltage_command)
    np.testing.assert_allclose(found.residual[1], measured - found.model[1])
    assert found.errors.rms == pytest.approx(np.sqrt(np.mean(found.residual[1] ** 2)))
    assert ("rig", "sim") in found.about


def test_long_curves_keep_their_peaks(folder, monkeypatch):
    monkeypatch.setattr("dearig.analysis.summary._COLUMNS", 20)
    recording, found = open_recording(folder / "high.h5"), curves(folder / "high.h5", None)
    assert found.measured[0].size <= 42
    assert found.measured[1].max() == recording.displacement.max()


def test_differences_are_those_of_conditions_not_of_results(folder):
    found = {row.what: row.values for row in differences([folder / "low.h5", folder / "high.h5"])}
    assert found["sequence"] == ("lobes of 4.0 kV", "lobes of 6.0 kV")
    assert found["operator"] == ("Ada", "Grace")
    assert found["sequence: segment 1.amplitude_kV"] == ("4.0", "6.0")
    assert not {"displacement", "film", "load", "rig file: load.mass_g"} & set(found)
    assert differences([folder / "low.h5"] * 2) == ()


def test_a_moment_is_in_words_that_a_narrow_column_can_break(folder, tmp_path):
    later = made(tmp_path, "later", 4.0)
    with h5py.File(later, "r+") as file:
        file["entry/provenance"].attrs["start_time"] = "2027-01-15T08:00:01.5+00:00"
    found = {row.what: row.values for row in differences([folder / "low.h5", later])}
    assert found["start time"][1] == "2027-01-15 08:00:01"


def test_a_torn_recording_is_mended_and_a_whole_one_left_alone(folder, tmp_path):
    path = killed(tmp_path, "again")
    assert recover_file(path) == "again.h5 was recovered: 2000 samples can be read by any program"
    assert "needs no recovery" in recover_file(path)
    assert "needs no recovery" in recover_file(folder / "low.h5")


def test_exports_replace_what_the_operator_said_may_be_replaced(folder, tmp_path):
    out = tmp_path / "low.csv"
    out.write_text("old")
    assert export_file(folder / "low.h5", "csv", out) == out
    assert out.read_text().startswith("time_s,displacement_m")


def test_the_spring_of_a_model_of_another_kind_is_said(folder, tmp_path):
    path = save_model(tmp_path / "strip.toml", "strip", Strip(Network(Spring(1e5)), "uniaxial"), {})
    found = curves(folder / "low.h5", path)
    assert found.model is None
    assert "the model is of a bare film" in found.unfit
