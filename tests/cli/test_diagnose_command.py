"""dearig diagnose from end to end: recordings in, the missing effect and a better model out."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dearig.analysis import diagnose as app_diagnose
from dearig.analysis.readings.record import Readings
from dearig.config.modelfile import load_model, save_model
from dearig.config.sequencefile import parse_sequence
from dearig.errors import DiskFault, InstrumentFault, Interrupted, NotSafe, SafetyStop
from dearig.model.diagnosis.results import Diagnosis
from dearig.model.film.material import Network, Spring
from dearig.model.simulation.actuator import Actuator
from dearig.model.simulation.strip import Strip
from dearig.recording import open_recording
from tests.deep import mostly_deep
from tests.report.pages.test_page import check
from tests.tools.command import (
    SHORT_PRESETS,
    dearig,
    done,
    film_csv,
    film_model,
    names,
    strict_json,
    thesis_model,
    write,
)
from tests.tools.diagnosis import LAGGED, RIVAL, STEP, finding, stage
from tests.tools.engine import PLAIN, effect
from tests.tools.reports import ESTIMATES

RIG = "[card]\nsample_rate_Hz = 50.0\n"
#: What the simulated rig of these tests hides.
HIDDEN = replace(PLAIN, effects=effect("amplifier offset", offset=60.0))
#: What a search has found: an effect that nothing rivals, for which no experiment is searched, and
#: one that has a rival.
NAMED = finding(rivals=())
OPEN = finding(
    final=stage(LAGGED, 1e-6, estimates=ESTIMATES), rivals=(("amplifier", RIVAL),), steps=(STEP,)
)


@pytest.fixture(scope="module", autouse=True)
def _short_thesis() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("dearig.config.sequencefile.PRESETS", SHORT_PRESETS)
        yield


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with runs of a rig that has an offset, and of one that hides nothing."""
    folder = tmp_path_factory.mktemp("bench")
    rig = write(folder / "rig.toml", RIG)
    save_model(folder / "hidden.toml", "hidden", HIDDEN, {})
    save_model(folder / "plain.toml", "plain", PLAIN, {})
    for i, preset in enumerate(("thesis", "validation-a-0.6", "validation-b-7.0")):
        done(
            "record", preset, "--model", folder / "hidden.toml", "--rig-file", rig,
            "--out", folder / f"{preset}.h5", "--seed", i,
        )  # fmt: skip
    done(
        "record", "thesis", "--model", folder / "plain.toml", "--rig-file", rig,
        "--out", folder / "clean.h5", "--seed", 9,
    )  # fmt: skip
    return folder


def instead(monkeypatch: pytest.MonkeyPatch, *found: Diagnosis) -> list[int]:
    """Put ``found``, one after another, in the place of the search; how many records each saw.

    Nor are the recordings searched for events of their own.
    """
    seen: list[int] = []

    def search(
        records: list,
        base: Actuator | Strip,
        *,
        progress: Callable,
        stop: Callable,
        thorough: bool,
        others: list,
        constraints: tuple,
    ) -> Diagnosis:
        seen.append(len(records))
        progress("search", 0.5)
        progress("search", 1.0)
        return replace(found[len(seen) - 1], interrupted=found[len(seen) - 1].interrupted or stop())

    monkeypatch.setattr(app_diagnose, "diagnose", search)
    monkeypatch.setattr("dearig.analysis.readings.events.own_of", lambda *_, **__: None)
    return seen


@pytest.fixture(scope="module")
def diagnosed(bench: Path) -> dict:
    """What the command makes of the rig that has an offset; the search is the real one."""
    return done(
        "diagnose", bench / "thesis.h5", "--validate", bench / "validation-a-0.6.h5",
        "--validate", bench / "validation-b-7.0.h5", "--branches", "1",
        "--model-out", bench / "better.toml",
        "--report", bench / "report.html", "--json", "-",
    ).json  # fmt: skip


class TestRecordWithAModel:
    def test_the_rig_obeys_it(self, bench):
        recording = open_recording(bench / "thesis.h5")
        drive = Readings(recording).voltage
        lag = recording.displacement_delay - recording.displacement_skew
        for model, close in ((HIDDEN, True), (replace(HIDDEN, effects=()), False)):
            said = model.simulate(drive, lag).displacement
            rms = float(np.sqrt(np.mean((recording.displacement - said) ** 2)))
            assert (rms < 1.2 * recording.noise_floor) is close

    def test_a_film_is_no_actuator(self, tmp_path):
        answer = dearig(
            "record", "thesis", "--model", film_model(tmp_path / "m.toml"), "--out",
            tmp_path / "o.h5",
        )  # fmt: skip
        assert answer.code == 2
        assert "of a bare film, which a voltage does not move" in answer.err

    def test_only_sim_takes_one(self, tmp_path):
        model = thesis_model(tmp_path / "m.toml")
        answer = dearig(
            "record", "thesis", "--model", model, "--rig", "sim:7", "--out", tmp_path / "o.h5"
        )
        assert answer.code == 2
        assert "'sim:7' has a film of its own; only sim takes a model" in answer.err
        assert names(tmp_path) == {"m.toml"}


class TestSearch:
    @pytest.mark.deep
    @pytest.mark.slow
    def test_the_hidden_effect_is_found_and_proved_on_untouched_recordings(self, diagnosed, bench):
        assert diagnosed["verdict"] == "explained"
        (step,) = diagnosed["steps"]
        assert "amplifier" in (step["family"], *step["indistinguishable_from"])
        noise = diagnosed["noise_floor_um"]
        before = diagnosed["baseline"]["validation"]["rms_um"]
        after = diagnosed["final"]["validation"]["rms_um"]
        assert before > 2.0 * noise
        assert after < 1.15 * noise
        assert diagnosed["residual_after"]["is_noise"]
        assert diagnosed["records"]["train"] == ["thesis"]
        check(bench / "report.html")

    @pytest.mark.deep
    @pytest.mark.slow
    def test_the_better_model_goes_through_everything(self, diagnosed, bench, tmp_path):
        model = load_model(bench / "better.toml")
        assert model.history["verdict"] == "explained"
        assert model.model.effects
        (train,) = model.history["train"]
        assert train["sha256"] == open_recording(bench / "thesis.h5").sha256
        rows = done(
            "validate", bench / "better.toml", bench / "thesis.h5", bench / "validation-a-0.6.h5",
            "--json", "-",
        ).json["recordings"]  # fmt: skip
        assert [r["role"] for r in rows] == ["train", "validation"]
        by_record = diagnosed["final"]["validation_by_record"]
        assert rows[1]["rms_um"] == pytest.approx(by_record["validation-a-0.6"]["rms_um"])
        done(
            "simulate", bench / "better.toml", "--drive", bench / "validation-a-0.6.h5", "--out",
            tmp_path / "p.h5",
        )  # fmt: skip
        measured = open_recording(bench / "validation-a-0.6.h5")
        said = open_recording(tmp_path / "p.h5").displacement
        rms = np.sqrt(np.mean((measured.displacement - said) ** 2))
        assert rms < 3.0 * measured.noise_floor  # of the averaging of the laser it knows nothing
        done(
            "record", "validation-b-6.0", "--model", bench / "better.toml", "--rig-file",
            bench / "rig.toml", "--out", tmp_path / "again.h5",
        )  # fmt: skip
        (row,) = done(
            "validate", bench / "better.toml", tmp_path / "again.h5", "--json", "-"
        ).json["recordings"]  # fmt: skip
        assert row["rms_um"] < 1.2 * row["noise_floor_um"]

    @pytest.mark.slow
    def test_where_nothing_is_missing_it_says_so(self, bench, tmp_path):
        out = tmp_path / "m.toml"
        found = done(
            "diagnose", bench / "clean.h5", "--branches", "1", "--model-out", out, "--json", "-"
        ).json
        assert found["verdict"] == "nothing_missing"
        assert found["steps"] == []
        assert found["final"]["validation"] is None
        assert found["experiment"] is None
        assert load_model(out).model.effects == ()

    @pytest.mark.slow
    def test_films(self, tmp_path):
        for name, rate, seed in (("a", 0.1, 1), ("b", 0.05, 2)):
            done(
                "import",
                film_csv(tmp_path / f"{name}.csv", rate, seed),
                "--out",
                tmp_path / f"{name}.h5",
            )
        found = done(
            "diagnose", tmp_path / "a.h5", "--validate", tmp_path / "b.h5", "--branches", "1",
            "--report", tmp_path / "r.html", "--json", "-",
        ).json  # fmt: skip
        assert found["verdict"] == "nothing_missing"
        assert found["final"]["validation"]["rms_kPa"] < 1.3 * found["noise_floor_kPa"]
        assert "films" in found["experiment_words"]
        check(tmp_path / "r.html")


class TestOutputs:
    def test_json_and_words_do_not_mix(self, bench, monkeypatch):
        instead(monkeypatch, finding())
        answer = done("diagnose", bench / "thesis.h5", "--json", "-")
        assert answer.json["format"] == "dearig-diagnosis/1"
        assert "Residual explained; by which effect these data cannot tell" in answer.err

    def test_an_interruption_keeps_what_was_found(self, bench, tmp_path, monkeypatch):
        def search(records, base, *, progress, stop, thorough, others, constraints):
            assert not stop()
            signal.raise_signal(signal.SIGINT)
            assert stop()
            return finding(rivals=(), interrupted=True)

        monkeypatch.setattr(app_diagnose, "diagnose", search)
        answer = dearig(
            "diagnose", bench / "thesis.h5", "--json", tmp_path / "d.json",
            "--report", tmp_path / "r.html", "--model-out", tmp_path / "m.toml",
        )  # fmt: skip
        assert answer.code == 130
        assert answer.err.splitlines()[-1].startswith("dearig: interrupted: the results found")
        assert strict_json((tmp_path / "d.json").read_text())["interrupted"] is True
        assert names(tmp_path) == {"d.json", "r.html", "m.toml"}
        assert load_model(tmp_path / "m.toml").history["interrupted"] is True
        assert "The search was stopped" in check(tmp_path / "r.html").words

    @pytest.mark.parametrize("words", [(), ("--thorough",)])
    def test_a_search_is_as_thorough_as_it_is_asked_to_be(self, bench, monkeypatch, words):
        asked = []

        def search(records, base, *, progress, stop, thorough, others, constraints):
            asked.append(thorough)
            return NAMED

        monkeypatch.setattr(app_diagnose, "diagnose", search)
        done("diagnose", bench / "thesis.h5", *words, "--json", "-")
        assert asked == [bool(words)]

    def test_the_second_interruption_ends_at_once(self, bench, tmp_path, monkeypatch):
        def search(records, base, *, progress, stop, thorough, others, constraints):
            signal.raise_signal(signal.SIGINT)
            signal.raise_signal(signal.SIGINT)
            raise AssertionError("it went on")

        monkeypatch.setattr(app_diagnose, "diagnose", search)
        answer = dearig("diagnose", bench / "thesis.h5", "--json", tmp_path / "d.json")
        assert (answer.code, answer.err) == (130, "dearig: interrupted\n")
        assert names(tmp_path) == set()

    def test_a_recording_that_the_model_cannot_follow_loses_nothing(self, bench, monkeypatch):
        # it cannot carry the load
        broken = replace(HIDDEN, network=Network(Spring(0.0)), effects=())
        instead(monkeypatch, finding(baseline=stage(broken, 2e-6), rivals=()))
        found = done(
            "diagnose", bench / "thesis.h5", "--validate", bench / "validation-a-0.6.h5",
            "--json", "-",
        ).json  # fmt: skip
        assert found["baseline"]["validation"] is None
        assert found["final"]["validation"]["rms_um"] > 0.0
        assert "left out of the validation errors" in " ".join(found["quality"])


class TestRig:
    def diagnose(self, bench: Path, out: Path, *more: str) -> dict:
        return done(
            "diagnose", "--rig", "sim:7", "--rig-file", bench / "rig.toml", "--out", out,
            "--json", "-", *more,
        ).json  # fmt: skip

    def test_it_records_experiments_until_no_rival_is_left(self, bench, tmp_path, monkeypatch):
        far = replace(RIVAL, effects=(("amplifier lag", (("time_constant", 0.05),)),))
        seen = instead(monkeypatch, replace(OPEN, rivals=(("amplifier", far),)), NAMED)
        found = self.diagnose(bench, tmp_path / "d", "--experiments", "3")
        assert seen == [1, 2]
        assert names(tmp_path / "d") == {
            "thesis.h5", "experiment-1.h5", "validation-a-0.6.h5", "validation-b-7.0.h5",
            "report.html", "model.toml",
        }  # fmt: skip
        assert found["records"] == {
            "train": ["thesis", "experiment-1"],
            "validation": ["validation-a-0.6", "validation-b-7.0"],
        }
        assert "its recording, experiment-1.h5, was added" in found["performed"][0]
        run = open_recording(tmp_path / "d" / "experiment-1.h5")
        assert run.provenance["simulated"]
        assert parse_sequence(run.sequence_toml, "x", Path()).sequence.name in found["performed"][0]

    @pytest.mark.deep
    def test_no_more_than_was_asked_for(self, bench, tmp_path, monkeypatch):
        far = replace(RIVAL, effects=(("amplifier lag", (("time_constant", 0.05),)),))
        doubt = replace(OPEN, rivals=(("amplifier", far),))
        seen = instead(monkeypatch, doubt, doubt)
        found = self.diagnose(bench, tmp_path / "d", "--experiments", "1")
        assert seen == [1, 2]
        assert found["experiment"]["separates"] == ["sensor_lag", "amplifier"]
        assert parse_sequence(found["experiment"]["sequence"], "x", Path())

    def test_own_recordings_take_the_place_of_its_own(self, bench, tmp_path, monkeypatch):
        instead(monkeypatch, NAMED)
        found = self.diagnose(
            bench, tmp_path / "d", str(bench / "thesis.h5"),
            "--validate", str(bench / "validation-a-0.6.h5"),
        )  # fmt: skip
        assert names(tmp_path / "d") == {"report.html", "model.toml"}
        assert found["records"] == {"train": ["thesis"], "validation": ["validation-a-0.6"]}

    def test_an_interrupted_search_records_no_more(self, bench, tmp_path, monkeypatch):
        instead(monkeypatch, replace(OPEN, interrupted=True))
        answer = dearig(
            "diagnose", "--rig", "sim:7", "--rig-file", bench / "rig.toml", "--out", tmp_path / "d"
        )
        assert answer.code == 130
        assert names(tmp_path / "d") == {"thesis.h5", "report.html", "model.toml"}

    @pytest.mark.parametrize(
        ("at", "ends", "code", "interrupted"),
        mostly_deep(
            [
                pytest.param("experiment-1", SafetyStop("too far"), 3, False, id="trip"),
                pytest.param(
                    "experiment-1",
                    InstrumentFault("the card does not answer"),
                    4,
                    False,
                    id="fault",
                ),
                pytest.param("experiment-1", DiskFault("the disk is full"), 4, False, id="disk"),
                pytest.param(
                    "validation-b-7.0", Interrupted("ramped down"), 130, True, id="interrupted"
                ),
            ],
            kept=["trip"],
        ),
    )
    def test_what_ends_a_run_loses_nothing_of_what_was_found(
        self, bench, tmp_path, monkeypatch, ends, code, interrupted, at
    ):
        far = replace(RIVAL, effects=(("amplifier lag", (("time_constant", 0.05),)),))
        instead(monkeypatch, replace(OPEN, rivals=(("amplifier", far),)), NAMED)
        self.end(monkeypatch, at, ends)
        answer = dearig(
            "diagnose", "--rig", "sim:7", "--rig-file", bench / "rig.toml", "--out", tmp_path / "d",
            "--json", tmp_path / "d.json",
        )  # fmt: skip
        assert answer.code == code
        assert "the results found before that were kept" in answer.err.splitlines()[-1]
        kept = strict_json((tmp_path / "d.json").read_text())
        assert kept["interrupted"] is interrupted
        assert f"Recording ended before all runs were made: {ends}" in kept["notes"]
        assert kept["steps"]
        validation = kept["records"]["validation"]
        assert validation == (["validation-a-0.6"] if at.startswith("validation") else [])
        assert (
            "Recording ended before all runs were made"
            in check(tmp_path / "d" / "report.html").words
        )
        assert load_model(tmp_path / "d" / "model.toml").model.effects

    @pytest.mark.parametrize(
        ("ends", "at", "code"),
        [
            (SafetyStop("the film broke down"), "thesis", 3),
            (NotSafe("the voltage may still be up"), "experiment-1", 4),
            (NotSafe("the voltage may still be up"), "validation-a-0.6", 4),
        ],
    )
    def test_what_is_not_safe_or_is_the_first_run_ends_at_once(
        self, bench, tmp_path, monkeypatch, ends, at, code
    ):
        far = replace(RIVAL, effects=(("amplifier lag", (("time_constant", 0.05),)),))
        instead(monkeypatch, replace(OPEN, rivals=(("amplifier", far),)), NAMED)
        self.end(monkeypatch, at, ends)
        answer = dearig(
            "diagnose", "--rig", "sim:7", "--rig-file", bench / "rig.toml", "--out", tmp_path / "d"
        )
        assert (answer.code, answer.err.splitlines()[-1]) == (code, f"dearig: {ends}")
        assert "report.html" not in names(tmp_path / "d")

    @staticmethod
    def end(monkeypatch, at: str, error: Exception) -> None:
        """Have the run whose recording is named ``at`` end with ``error``."""
        record = app_diagnose.record

        def ending(loaded, address, settings, path, options, **more):
            if path.stem == at:
                raise error
            return record(loaded, address, settings, path, options, **more)

        monkeypatch.setattr(app_diagnose, "record", ending)
