"""What a browser of recordings shows of them, against the recordings themselves."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dearig.analysis import assessments
from dearig.analysis.assessments import keep_assessments, kept_assessments, model_key
from dearig.analysis.summary import (
    QUANTITIES,
    Assessment,
    RecordingSummary,
    assess,
    curves,
    differences,
    export_file,
    how_it_ended,
    numbers,
    read_entries,
    recover_file,
    spectra,
    summary_of,
)
from dearig.config.modelfile import save_model
from dearig.errors import InputError
from dearig.model.compiled.trusted_folder import CacheFolder
from dearig.model.film.material import TABLE_3, THESIS_FILM, THESIS_LOAD, Network, Spring
from dearig.model.simulation.actuator import Actuator
from dearig.model.simulation.strip import Strip
from dearig.recording import open_recording
from dearig.recording.reading.recording import RecordedEvent
from tests.window.made_recordings import killed, made


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("recordings")
    made(folder, "low", 4.0, operator="Ada", film_id="film 1")
    made(folder, "high", 6.0, operator="Grace", film_id="film 1")
    killed(folder, "torn")
    (folder / "text.h5").write_text("no recording")
    (folder / "notes.txt").write_text("of another kind")
    return folder


def summary(folder: Path, name: str) -> RecordingSummary:
    (entry,) = read_entries(folder, [name])
    return summary_of(folder, entry)


def test_a_summary_tells_what_a_recording_is(folder):
    found, recording = summary(folder, "low.h5"), open_recording(folder / "low.h5")
    assert (found.name, found.title, found.film, found.texts["operator"]) == (
        "low", "lobes of 4.0 kV", "film 1", "Ada",
    )  # fmt: skip
    assert (found.samples, found.duration) == (recording.samples, recording.duration)
    assert found.peaks["displacement"] == recording.displacement.max()
    assert found.peaks["voltage_command"] == pytest.approx(4000.0, rel=1e-3)
    time, signal = found.thumbnail
    assert 20 < time.size <= 80
    assert (signal.min(), signal.max()) == (0.0, 1.0)


def test_a_thumbnail_draws_rising_and_falling_slopes_alike(folder):
    _, signal = summary(folder, "high.h5").thumbnail
    top = int(np.argmax(signal[: signal.size // 2]))
    # in the order of the slope: no teeth, on either side of a lobe
    assert (np.diff(signal[top // 2 : top + 1]) >= 0.0).all()
    assert (np.diff(signal[top : top + top // 2]) <= 0.0).all()


def test_numbers_are_in_the_units_that_are_shown(folder):
    found = replace(
        summary(folder, "high.h5"),
        errors=(assessed := assess(folder / "high.h5", None)).errors,
        noise=assessed.noise,
    )
    told = numbers(found)
    assert told["peak_kV"] == pytest.approx(6.0, rel=1e-3)
    assert told["mm_per_kV2"] == pytest.approx(told["peak_mm"] / 36.0, rel=1e-2)
    assert told["rms_um"] == pytest.approx(1.0, abs=0.2)
    assert told["over_noise"] == pytest.approx(1.0, abs=0.15)
    assert {quantity.key for quantity in QUANTITIES} >= set(told)
    assert numbers(summary(folder, "text.h5")) == {}


def test_a_summary_never_raises(folder):
    assert "is not an HDF5 file" in summary(folder, "text.h5").trouble
    assert "gone.h5 is not there" in summary(folder, "gone.h5").trouble
    torn = summary(folder, "torn.h5")
    assert (torn.trouble, torn.complete) == ("", False)
    assert torn.samples > 0


def test_the_end_of_a_run_is_in_a_few_words(folder):
    event = RecordedEvent(1, 0.1, "fault", "interlock over_current: 2.1 mA")
    whole = summary(folder, "low.h5")
    assert how_it_ended(whole) == ("", "finished")
    assert how_it_ended(summary(folder, "torn.h5")) == ("warning", "killed, or still running")
    assert how_it_ended(summary(folder, "text.h5")) == ("fault", "is not an HDF5 file")
    for outcome, events, expected in (
        ("interrupted by the operator", (), ("warning", "interrupted by the operator")),
        ("stopped by an interlock: x", (event,), ("fault", "stopped by an interlock: x")),
        ("finished", (replace(event, level="warning"),) * 2, ("warning", "finished, 2 events")),
        ("finished", (replace(event, level="info"),), ("", "finished")),
    ):
        assert how_it_ended(replace(whole, outcome=outcome, events=events)) == expected


def test_errors_of_the_thesis_model_on_its_own_rig_are_noise(folder):
    found = assess(folder / "low.h5", None)
    assert found.errors.rms == pytest.approx(found.noise, rel=0.15)


def test_an_assessment_says_why_there_are_no_errors(folder, tmp_path):
    found = assess(folder / "low.h5", tmp_path / "gone.toml")
    assert found.errors is None
    assert "gone.toml" in found.unfit
    assert "is not an HDF5 file" in assess(folder / "text.h5", None).unfit


def test_the_error_of_what_a_model_was_fitted_to_is_marked(folder, tmp_path):
    recording = open_recording(folder / "low.h5")
    model = Actuator(THESIS_FILM, THESIS_LOAD, TABLE_3)
    history = {"train": [{"name": "low", "sha256": recording.sha256}]}
    path = save_model(tmp_path / "model.toml", "fitted", model, history)
    assert assess(folder / "low.h5", path).fitted
    assert not assess(folder / "high.h5", path).fitted


def test_errors_are_kept_until_the_model_changes(folder, tmp_path, monkeypatch):
    monkeypatch.setattr(assessments, "cache_root", lambda: CacheFolder(tmp_path))
    path = folder / "low.h5"
    found = assess(path, None)
    unfit = Assessment(folder / "text.h5", unfit="it is none")
    key = model_key(None, "command")
    known = {path: ((1, 2), found), unfit.path: ((3, 4), unfit)}
    keep_assessments(folder, key, known)
    assert kept_assessments(folder, key) == known
    assert kept_assessments(folder, model_key(None, "monitor")) == {}
    model = tmp_path / "model.toml"
    model.write_text("a = 1")
    first = model_key(model, "command")
    model.write_text("a = 2")
    assert model_key(model, "command") != first
    with pytest.raises(InputError, match="cannot be read"):
        model_key(tmp_path / "gone.toml", "command")
    (cache,) = tmp_path.glob("*.json")
    for broken in ("", "[]", '{"format": "x"}', cache.read_text().replace("rms", "smr")):
        cache.write_text(broken)
        assert kept_assessments(folder, key) == {}


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


def test_no_file_is_hashed_to_draw_its_curves(folder, monkeypatch):
    hashed: list[Path] = []
    monkeypatch.setattr(
        "dearig.recording.reading.recording.file_sha256", lambda p: hashed.append(p) or ""
    )
    assert curves(folder / "high.h5", None).model is not None
    assert spectra(folder / "high.h5", None).residual is not None
    assert assess(folder / "high.h5", None).errors is not None
    assert hashed == []


def test_differences_are_those_of_conditions_not_of_results(folder):
    rows = differences([folder / "low.h5", folder / "high.h5"])
    found = {(row.group, row.what): row.values for row in rows}
    assert found["Sequence", "name"] == ("lobes of 4.0 kV", "lobes of 6.0 kV")
    assert found["Run", "operator"] == ("Ada", "Grace")
    assert found["Sequence", "segment 1: amplitude (kV)"] == ("4", "6")
    assert not {"displacement", "film", "load", "load: mass (g)"} & {row.what for row in rows}
    # one group after the other
    groups = [row.group for row in rows]
    assert groups == sorted(groups, key=["Run", "Sample", "Sequence"].index)
    assert differences([folder / "low.h5"] * 2) == ()


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
