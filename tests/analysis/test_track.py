"""A displacement that is followed run after run, on simulated rigs."""

from __future__ import annotations

import signal
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dearig.acquisition.run import RunObserver, RunOptions
from dearig.analysis.track import track
from dearig.analysis.track_target import plan_target
from dearig.analysis.tracking import Tracking, alternatives_of
from dearig.config.modelfile import ModelFile
from dearig.config.rigfile import RigFile
from dearig.config.sequencefile import load_sequence
from dearig.config.targetfile import parse_target
from dearig.drivers.settings import CardSettings, LimitsSettings
from dearig.errors import InputError, Interrupted, SafetyStop
from dearig.model.control import CAUSES
from dearig.model.film.material import TABLE_3, THESIS_FILM, THESIS_LOAD
from dearig.model.simulation.actuator import Actuator
from dearig.model.simulation.strip import Strip
from dearig.recording.reading.reader import open_recording
from dearig.report.pages.track import track_json, track_summary, write_track_report

PATH = """\
name = "path"
lead_in_s = 0.5
tail_s = 0.2
[[segment]]
kind = "ramp"
to_mm = 0.3
duration_s = 1.0
[[segment]]
kind = "sine"
amplitude_mm = 0.05
frequency_Hz = 1.0
offset_mm = 0.3
[[segment]]
kind = "ramp"
to_mm = 0.0
duration_s = 1.5
"""
RIG = RigFile(card=CardSettings(sample_rate_Hz=200.0))
MODEL = ModelFile("Table 3", Actuator(THESIS_FILM, THESIS_LOAD, TABLE_3))
STIFFER = replace(
    TABLE_3,
    equilibrium=replace(TABLE_3.equilibrium, modulus=1.15 * TABLE_3.equilibrium.modulus),
)
WRONG = ModelFile("stiffer", Actuator(THESIS_FILM, THESIS_LOAD, STIFFER))
SOFT = replace(
    TABLE_3,
    equilibrium=replace(TABLE_3.equilibrium, modulus=0.7 * TABLE_3.equilibrium.modulus),
)
WORSE = ModelFile("softer", Actuator(THESIS_FILM, THESIS_LOAD, SOFT))


def target(text=PATH):
    return parse_target(text, "path.toml", Path())


def followed(folder, model=MODEL, **options):
    given = {"iterations": 0, "nearest": True, **options}
    settings = given.pop("rig_file", RIG)
    run = given.pop("options", RunOptions())
    return track(target(), model, "sim", settings, folder, run, **given)


@pytest.fixture(scope="module")
def learned(tmp_path_factory):
    """Learning from a wrong model, with a worse model and a linear map to compare."""
    folder = tmp_path_factory.mktemp("learned") / "out"
    return followed(
        folder, WRONG, iterations=3, compare=WORSE, options=RunOptions(notes="before lunch")
    )


@pytest.mark.deep
def test_a_model_that_predicts_worse_than_the_compared_one_is_not_followed(tmp_path):
    _, right, first = followed(tmp_path / "out", WRONG, compare=MODEL).runs
    assert right.kind == "thesis"
    assert right.rms < 1.2 * right.noise
    assert "'stiffer' predicts this run with an error of" in right.notes[-1]
    assert first.kind == "model"
    np.testing.assert_array_equal(first.voltage, right.voltage)
    assert "Table 3" in open_recording(first.recording).model_toml


def test_a_wrong_model_learns(learned):
    ours = [run for run in learned.runs if run.kind in ("model", "learned")]
    assert [run.iteration for run in ours] == [0, 1, 2, 3]
    assert ours[0].rms > 10.0 * learned.noise
    assert ours[-1].rms < 1.5 * learned.noise
    assert learned.best.rms == min(run.rms for run in ours)
    assert learned.runs[0].kind == "linear"
    assert learned.runs[0].rms > 5.0 * ours[-1].rms
    assert not learned.runs[1].notes  # the worse model is not followed
    assert learned.status == "complete"


def test_runs_end_once_nothing_more_is_learned(tmp_path):
    """The film is right, so that the first run leaves noise; the page has the model's band."""
    table = {"names": ["mu_0"], "matrix": [[50.0**2]]}
    model = ModelFile("exact", MODEL.model, {"covariance": table})
    outcome = followed(tmp_path / "out", model, iterations=3)
    (run,) = outcome.runs
    assert outcome.status == "complete"
    assert outcome.reason == "the error is noise: nothing more is learned, and its voltage is kept"
    assert f"Not all runs were needed: {outcome.reason}." in track_summary(outcome)
    assert outcome.band.noise == run.noise
    told = track_json(outcome)["band"]
    assert told["parameters_um"] == pytest.approx(outcome.band.parameters_rms * 1e6)
    page = write_track_report(outcome, tmp_path / "r.html").read_text(encoding="utf-8")
    assert "what the model predicts of its own first run" in page
    assert replace(outcome, runs=()).band is None


def test_a_target_is_followed_in_means_of_conversions(tmp_path):
    rig_file = RigFile(card=CardSettings(sample_rate_Hz=200.0, average=10))
    outcome = followed(tmp_path / "out", rig_file=rig_file)
    (run,) = outcome.runs
    assert open_recording(run.recording).average == 10
    expected = outcome.inversion.reading
    left, speed = run.measured - expected, 200.0 * np.gradient(expected)
    late = -np.nansum(left * speed) / np.sum(speed**2)
    assert abs(late) < 2e-4  # of a row of 5 ms, nine tenths of which the rig is ahead
    assert np.nanstd(left) < 1.2 * run.noise


RINGING = ModelFile(
    "ringing",
    Actuator(
        THESIS_FILM,
        THESIS_LOAD,
        TABLE_3,
        (("attached mode", (("stiffness", 1.7e5), ("frequency", 5.0), ("damping", 1e-3))),),
    ),
)


@pytest.mark.deep
def test_where_a_model_stands_in_the_way_the_compared_one_learns(tmp_path):
    found = followed(tmp_path / "out", RINGING, compare=WRONG, iterations=5)
    ours = [run for run in found.runs if run.kind in ("model", "learned")]
    said = [run.iteration for run in ours if any("it goes on from" in n for n in run.notes)]
    assert len(said) == 1
    assert ours[said[0]].rms > 2.0 * found.noise
    assert "stiffer" in open_recording(ours[said[0] + 1].recording).model_toml
    assert ours[-1].rms < 0.7 * ours[said[0]].rms


def test_every_run_is_a_recording_with_its_origin(learned):
    for run in learned.runs:
        recording = open_recording(run.recording)
        assert recording.outcome == "finished"
        assert recording.notes == f"before lunch; target 'path', {run.recording.stem}"
        assert f"{run.recording.stem}.csv had sha256" in recording.sequence_toml
        assert run.margins
        assert (recording.displacement_model is None) == (run.kind == "linear")
    assert "stiffer" in open_recording(learned.runs[-1].recording).model_toml


def test_a_learned_voltage_can_be_played_again(learned):
    run = learned.best
    _, voltage = load_sequence(run.recording.with_suffix(".toml")).sample(200.0)
    np.testing.assert_allclose(voltage, run.voltage, atol=1.0)  # V: a step of the converter


def test_the_noise_of_two_runs_differs(learned):
    first, second = (open_recording(r.recording).displacement[:80] for r in learned.runs[-2:])
    assert not np.array_equal(first, second)


def test_what_cannot_be_reached_is_refused_before_anything_is_written(tmp_path):
    folder = tmp_path / "out"
    with pytest.raises(InputError) as refused:
        followed(folder, nearest=False)
    assert CAUSES["zero"] in str(refused.value)
    assert "follow the nearest feasible one" in str(refused.value)
    assert refused.value.options == ("nearest",)
    assert not folder.exists()


def test_the_nearest_feasible_target_respects_the_rig_files_limits(tmp_path):
    low = RIG.model_copy(update={"limits": LimitsSettings(voltage_max_kV=3.0)})
    found = followed(tmp_path / "out", rig_file=low)
    assert "voltage" in {part.cause for part in found.inversion.unreachable}
    (run,) = found.runs
    assert run.voltage.max() <= 3001.0  # V: a step of the converter
    assert run.rms < 1.5 * found.noise  # where it can be reached


def test_a_folder_with_results_is_kept(tmp_path):
    (tmp_path / "old.h5").write_bytes(b"")
    with pytest.raises(InputError, match="is not empty"):
        followed(tmp_path)


def test_a_model_of_a_bare_film_is_refused(tmp_path):
    with pytest.raises(InputError, match="a voltage does not move"):
        followed(tmp_path / "out", ModelFile("film", Strip(TABLE_3)))


def test_a_target_too_long_to_be_inverted_is_refused():
    long = target(PATH.replace("duration_s = 1.5", "duration_s = 6000.0"))
    with pytest.raises(InputError, match=r"more than 1,000,000 samples at 200 Hz"):
        plan_target(long, MODEL.model, RIG)


def test_a_voltage_that_the_gate_refuses_leaves_nothing(tmp_path):
    brief = RIG.model_copy(update={"limits": LimitsSettings(time_at_voltage_max_s=0.5)})
    folder, kept = tmp_path / "out", []
    with pytest.raises(InputError, match="time at 1 kV or more reaches"):
        followed(folder, rig_file=brief, ended=kept.append)
    assert not folder.exists()
    assert kept == []


def test_a_fault_keeps_what_was_done(tmp_path):
    kept = []
    with pytest.raises(SafetyStop):
        followed(
            tmp_path / "out", ended=kept.append,
            options=RunOptions(faults=["arc@1.2"]),
        )  # fmt: skip
    (outcome,) = kept
    assert outcome.status == "stopped"
    assert outcome.runs == ()
    assert "0 V" in outcome.reason


def test_nothing_is_learned_from_a_run_at_another_rate(learned):
    faster = RIG.model_copy(update={"card": CardSettings(sample_rate_Hz=250.0)})
    tracking = Tracking(target(), WRONG, faster)
    with pytest.raises(InputError, match="was not recorded at 250 Hz"):
        tracking.add(open_recording(learned.runs[0].recording))
    assert tracking.proposed.kind == "model"  # it can still be played


class _SecondRunInterrupted(RunObserver):
    """Presses ctrl-C in the second run."""

    def __init__(self):
        self.runs = 0

    def started(self, *_):
        self.runs += 1

    def block(self, *_):
        if self.runs == 2:
            self.runs += 1
            signal.raise_signal(signal.SIGINT)


def test_an_interrupt_ends_at_zero_and_keeps_what_was_done(tmp_path):
    kept, folder = [], tmp_path / "out"
    with pytest.raises(Interrupted, match="ramped down to 0 V"):
        followed(folder, WRONG, iterations=3, ended=kept.append, observer=_SecondRunInterrupted())
    (outcome,) = kept
    assert outcome.status == "interrupted"
    assert [run.kind for run in outcome.runs] == ["model"]
    last = open_recording(folder / "learned-1.h5")
    assert last.outcome.startswith("interrupted")
    assert abs(last.voltage_command[-1]) < 1.0


def _with_covariance(names, matrix):
    lagged = replace(MODEL.model, effects=(("sensor lag", (("time_constant", 0.02),)),))
    return ModelFile("fitted", lagged, {"covariance": {"names": names, "matrix": matrix}})


def test_a_joint_covariance_makes_an_alternative_of_each_independent_direction():
    lag = "sensor lag: time_constant"
    # mu_1 and mu_2 are known by their sum alone
    matrix = np.array([[4e6, -4e6, 0.0], [-4e6, 4e6, 0.0], [0.0, 0.0, 1e-6]])
    found = alternatives_of(_with_covariance(["mu_1", "mu_2", lag], matrix.tolist()))
    base = _with_covariance([], []).model
    moduli = [[b.spring.modulus for b in m.network.branches[:2]] for m in (base, *found)]
    lags = sorted(dict(m.effects)["sensor lag"][0][1] for m in found)
    np.testing.assert_allclose(np.sum(moduli, axis=1), np.sum(moduli[0]), rtol=1e-9)
    (shared,) = {round(abs(m[0] - moduli[0][0])) for m in moduli[1:]} - {0}
    assert shared == pytest.approx(1.96 * 2e3, rel=1e-3)
    assert lags[0] == pytest.approx(0.02 - 1.96e-3, rel=1e-2) or lags[-1] == pytest.approx(
        0.02 + 1.96e-3, rel=1e-2
    )


@pytest.mark.parametrize(
    ("names", "matrix"),
    [(["mu_9"], [[1.0]]), (["mu_1"], [[1.0, 2.0]]), (["mu_1"], [["x"]]), (3, [[1.0]])],
    ids=["another model's", "not square", "words", "no names"],
)
def test_a_covariance_that_is_not_the_models_makes_no_alternatives(names, matrix):
    assert alternatives_of(_with_covariance(names, matrix)) == ()
    assert alternatives_of(MODEL) == ()
