"""A diagnosis says what its validation recordings ask and its training recordings do not show."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dearig.acquisition.plan import plan
from dearig.analysis.experiment import with_excitation
from dearig.analysis.outcomes import Comparison, DiagnoseOutcome, Evaluation
from dearig.config.rigfile import RigFile
from dearig.config.sequencefile import parse_sequence
from dearig.drivers.settings import CardSettings
from dearig.model.diagnosis.excitation import PredictedRun
from dearig.model.readings.measures import errors
from dearig.model.simulation.actuator import Drive
from dearig.report.as_json import diagnosis_json
from dearig.report.text.diagnosis import headline, summary
from tests.model.diagnosis.test_excitation import DAMPED, EDGES, FILM, NOISE, STEP, error, motion
from tests.report.pages.test_diagnosis import left
from tests.tools.diagnosis import STEP as FOUND
from tests.tools.diagnosis import diagnose_outcome, film_diagnosis, finding

SLOW = RigFile(card=CardSettings(sample_rate_Hz=1.0 / STEP))
SURE = replace(FOUND, indistinguishable_from=())


def comparison(sequence: str, role: str, truth=DAMPED, seed: int = 0) -> Comparison:
    """``FILM`` next to the recording of a film that is ``truth``."""
    made = motion(sequence)
    measured = made.response + error(sequence, truth, seed)
    time = np.arange(measured.size) * STEP
    return Comparison(
        name=f"{Path(sequence).stem}.h5", kind="actuator", role=role, time=time, drive=made.drive,
        measured=measured, model=made.response, errors=errors(measured, made.response),
        noise=NOISE, quiet_count=400,
    )  # fmt: skip


def outcome(*train: str, truth=DAMPED, **changes) -> DiagnoseOutcome:
    """A diagnosis that has explained recordings of ``train``, judged on quick steps."""
    after = Evaluation(
        (),
        tuple(comparison(name, "train", truth) for name in train),
        (comparison(EDGES, "validation", truth, 1),),
    )
    found = finding(steps=(SURE,), rivals=())
    made = diagnose_outcome(
        stands=(after, after),
        finding=replace(found, final=replace(found.final, model=FILM)),
        experiment=None,
        **changes,
    )
    return with_excitation(made, SLOW)


def test_edges_that_training_lacks_are_said_first() -> None:
    found = outcome("thesis")
    assert found.verdict == "partly_explained"
    assert found.judgement.reasons == ("validation", "excitation")
    assert headline(found).startswith("Not determined by these recordings")
    said = " ".join(summary(found)[:3])
    assert "ramped-steps.h5 asks for motion that the training recordings do not determine" in said
    assert "100 Hz" in said
    assert f"A recording of {found.determining.name!r}" in said


def test_the_proposed_record_passes_the_gate_and_would_show_it() -> None:
    found = outcome("thesis")
    loaded = parse_sequence(found.determining.sequence, "x", Path())
    waveform = plan(loaded, SLOW).admitted()
    time = np.arange(waveform.samples) / waveform.rate
    assert found.determining.seconds == pytest.approx(waveform.duration)
    moved = FILM.simulate(Drive(time, waveform.window(), hold=True)).displacement
    more = PredictedRun("more", 1.0 / waveform.rate, waveform.window(), moved, NOISE)
    (asked,) = found.undetermined
    assert asked.after(more).undetermined == ()
    # what is determined is not asked for
    assert outcome("thesis", "rich").determining is None


def test_what_training_shows_is_an_error_of_the_model() -> None:
    found = outcome("thesis", "rich")
    assert found.judgement.reasons == ("validation",)
    assert headline(found) == "Training recordings explained, validation recordings not"
    assert diagnosis_json(found)["excitation"]["determined"] is True


def test_the_uncertainty_of_the_parameters_is_no_error_of_the_model_either() -> None:
    found = outcome("thesis", "rich", prediction_errors=(5.0 * NOISE,))
    assert found.judgement.reasons == ("validation", "excitation")
    assert "within what the uncertainty of the fitted parameters allows" in " ".join(summary(found))


def test_what_the_parameters_own_error_explains_is_no_missing_effect() -> None:
    clean = left("nothing_missing", 2.7, steps=())
    allowed = replace(clean, prediction_errors=(2.5 * NOISE, 0.0))
    assert allowed.verdict == "nothing_missing"
    assert headline(allowed) == "No missing effect found"
    assert "uncertainty of the fitted parameters is large enough" in summary(allowed)[0]
    assert replace(clean, prediction_errors=(2.0 * NOISE, 0.0)).judgement.reasons == ("validation",)
    # next to an effect that was found, the error is the model's
    found = replace(left("explained", 2.7, steps=(SURE,)), prediction_errors=(9.0, 9.0))
    assert found.verdict == "partly_explained"


def test_a_verdict_says_how_far_it_was_tested() -> None:
    found = outcome("thesis", truth=FILM)
    assert found.verdict == "explained"
    assert found.undetermined == ()
    said = next(s for s in summary(found) if s.startswith("The validation recordings test this"))
    assert "up to 8.00 kV, edges of 36.7 kV/s and motion at" in said
    assert said.endswith("100 Hz; it is not known beyond.")


def test_the_json_has_all_of_it() -> None:
    found = outcome("thesis")
    told = diagnosis_json(found)["excitation"]
    assert told["determined"] is False
    assert told["tested"]["voltage_kV"] == 8.0
    (record,) = told["records"]
    assert record["record"] == "ramped-steps.h5"
    assert record["error_share"] > 0.5
    assert record["not_determined"][-1]["to_Hz"] == pytest.approx(100.0)
    assert told["record"]["sequence"] == found.determining.sequence
    assert told["record"]["open_over_noise"] < 0.57
    assert diagnosis_json(diagnose_outcome())["excitation"] is None


def test_films_are_as_they_were() -> None:
    film = film_diagnosis()
    assert with_excitation(film, SLOW) is film


def test_a_model_that_is_not_written_is_not_kept_quiet(monkeypatch: pytest.MonkeyPatch) -> None:
    found, better = left("explained", 1.0, steps=(SURE,)), "are predicted better without it"
    assert better not in " ".join(summary(found))
    monkeypatch.setattr(type(found), "recommends_final", False)
    assert better in " ".join(summary(found))


def test_what_does_not_look_like_noise_is_not_called_noise() -> None:
    found = left("explained", 1.0, steps=(SURE,))
    assert summary(found)[0].endswith("only noise is left.")
    unlike = tuple(replace(s, is_noise=False) for s in found.finding.after)
    doubted = replace(found, finding=replace(found.finding, after=unlike))
    assert summary(doubted)[0].endswith("what is left is as small as the noise.")
