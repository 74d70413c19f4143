"""What is told of a diagnosis: the page, the terminal and the JSON say the same, and all of it."""

from __future__ import annotations

import json
import math
import re
from dataclasses import replace

import numpy as np
import pytest

from dearig.cli.terminal import diagnosis_tables
from dearig.formulas import as_text, mathml
from dearig.model import verdict as verdicts
from dearig.model.effects import EFFECTS
from dearig.model.fitting import Estimate
from dearig.report.as_json import diagnosis_json
from dearig.report.figures.diagnosis import (
    bars_figure,
    before_after_figure,
    dependence_figure,
    missing_figures,
    residual_time_figure,
    spectra_figure,
)
from dearig.report.pages.diagnosis import write_diagnosis_report
from dearig.report.text.diagnosis import (
    HEADLINES,
    headline,
    summary,
    warnings,
)
from dearig.report.text.diagnosis_tables import (
    before_after_table,
    dropped_effects,
    pooled_errors,
    ranking_table,
    rankings,
    thesis_before_after_table,
)
from dearig.report.text.numbers import significant
from tests.cli.test_terminal import shown
from tests.report.pages.test_page import check
from tests.tools.diagnosis import (
    EXPERIMENT,
    ROUND,
    STEP,
    diagnose_outcome,
    electric_outcome,
    film_diagnosis,
    finding,
    nothing_missing,
)
from tests.tools.reports import NOISE, actuator_comparison
from tests.tools.sketches import sketched

OUTCOMES = {
    "explained": diagnose_outcome(),
    "nothing missing": nothing_missing(),
    "a film": film_diagnosis(),
    "with channels": electric_outcome(),
}
MEASURES_UM = {"rms_um", "nrmse_pct", "e_rms_thesis_pct", "e_m_thesis_pct", "max_um"}
MEASURES_KPA = {"rms_kPa", "nrmse_pct", "e_rms_thesis_pct", "e_m_thesis_pct", "max_kPa"}


@pytest.fixture(scope="module", params=list(OUTCOMES))
def page(request, tmp_path_factory):
    path = tmp_path_factory.mktemp("page") / "report.html"
    outcome = OUTCOMES[request.param]
    with pytest.MonkeyPatch.context() as patch:
        if request.param != "with channels":  # which has every picture that the others have
            patch.setattr("dearig.report.pages.html.svg", sketched)
        assert write_diagnosis_report(outcome, path) == path
    assert path.stat().st_size < 3_000_000
    return outcome, check(path)


def test_no_model_of_a_film_is_asked_to_reach_the_noise():
    outcome = film_diagnosis()
    for verdict, words in (
        ("explained", "With it, only noise, or 0.5 % of the largest stress, is left."),
        ("nothing_missing", "down to the noise, or 0.5 % of the largest stress, and "),
    ):
        told = summary(replace(outcome, finding=replace(outcome.finding, verdict=verdict)))
        assert words in told[0]
    assert summary(diagnose_outcome())[0].endswith("With it, only noise is left.")
    assert "down to the noise, and no effect that was tried" in summary(nothing_missing())[0]


class TestPage:
    def test_the_verdict_stands_on_top(self, page):
        outcome, read = page
        top = read.words.index(headline(outcome))
        assert top < read.words.index("Error before and after")

    def test_no_curve_stands_there_for_a_law_with_a_name(self, page):
        assert "The form that was found." not in page[1].words

    def test_errors_before_and_after_of_every_recording(self, page):
        outcome, read = page
        scale = 1e6 if outcome.kind == "actuator" else 1e-3
        for stand in (outcome.before, outcome.after):
            for c in (*stand.train, *stand.validation):
                assert significant(c.errors.rms * scale) in read.cells
                assert significant(c.errors.max * scale) in read.cells
                assert significant(c.errors.e_m_thesis_pct) in read.cells
                if outcome.kind == "actuator":
                    assert significant(c.errors.e_rms_thesis_pct) in read.cells

    def test_evidence_and_rivals(self, page):
        outcome, read = page
        for step in outcome.finding.steps:
            for sentence in step.evidence:
                assert sentence[1:] in read.words
            for e in step.estimates:
                assert e.name.replace("_", " ") in read.cells
        for family in (f for s in outcome.finding.steps for f in s.indistinguishable_from):
            assert f"Evidence against: {family} would explain these data equally well" in read.words
        for candidate in (c for r in outcome.finding.rounds for c in r.candidates):
            assert candidate.effect in read.cells

    def test_the_experiment_with_its_sequence(self, page):
        outcome, read = page
        assert outcome.experiment_text.rstrip(".") in read.words
        there = "[[segment]]" in read.words
        assert there == (outcome.experiment is not None)

    def test_roles_and_measures_are_explained(self, page):
        outcome, read = page
        for words in ("Data have three separate roles", "How to read the errors", "RMS / noise"):
            assert words in read.words
        assert ("not normalised" in read.words) == (outcome.kind == "actuator")


class TestWords:
    def test_every_verdict_has_its_sentence(self):
        for verdict in (
            verdicts.NOTHING_MISSING, verdicts.EXPLAINED, verdicts.PARTLY_EXPLAINED,
            verdicts.UNEXPLAINED,
        ):  # fmt: skip
            assert verdict in HEADLINES
            steps = () if verdict == "nothing_missing" else (STEP,)
            said = summary(diagnose_outcome(finding=finding(verdict=verdict, steps=steps)))
            assert len(said[0]) > 40

    def test_the_numbers_of_the_summary(self):
        outcome = diagnose_outcome()
        before, after = (
            pooled_errors(outcome.before.validation),
            pooled_errors(outcome.after.validation),
        )
        words = " ".join(summary(outcome))
        first, last = significant(before.rms * 1e6), significant(after.rms * 1e6)
        assert f"falls from {first} to {last}" in words
        assert "cannot separate sensor lag from amplifier" in words

    def test_without_untouched_recordings_it_says_so(self):
        assert "No validation recordings were given" in " ".join(summary(nothing_missing()))

    def test_an_interruption_is_told(self):
        words = " ".join(summary(diagnose_outcome(finding=finding(interrupted=True))))
        assert "The search was stopped" in words

    def test_a_search_that_ended_within_its_first_round_says_how_far_it_came(self):
        early = finding(interrupted=True, rounds=())
        assert early.steps
        assert "all effects were tried" in headline(diagnose_outcome(finding=early))
        assert "is the best so far" in " ".join(summary(diagnose_outcome(finding=early)))
        nothing = replace(early, steps=())
        assert "any effect was tried" in headline(diagnose_outcome(finding=nothing))
        assert "there is no result yet" in " ".join(summary(diagnose_outcome(finding=nothing)))

    def test_quality_and_notes_are_warnings(self):
        said = warnings(diagnose_outcome(finding=finding(notes=("it was odd",))))
        assert said == (
            "train.h5: the sensor is clipped at 0.7 mm from sample 400 (4 s) on.", "It was odd.",
        )  # fmt: skip

    def test_what_was_chosen_and_dropped(self):
        assert dropped_effects(diagnose_outcome()) == ""
        other = replace(ROUND, chosen="load inertia")
        said = dropped_effects(diagnose_outcome(finding=finding(rounds=(other, ROUND))))
        assert said.startswith(
            "load inertia was the best single effect but is not in the final model"
        )


def left(verdict: str, over: float, **changes):
    """A diagnosis whose first validation recording keeps ``over`` times its noise."""
    outcome = diagnose_outcome(finding=finding(verdict=verdict, **changes))
    first, *others = outcome.after.validation
    much = replace(first, errors=replace(first.errors, rms=over * first.noise))
    after = replace(outcome.after, validation=(much, *others))
    return replace(outcome, stands=(outcome.before, after))


SURE = replace(STEP, indistinguishable_from=())


class TestHeadline:
    """The headline says no more than the numbers, in every place alike."""

    def test_a_validation_error_above_the_noise_is_said_first(self):
        for verdict, steps in (("explained", (SURE,)), ("nothing_missing", ())):
            outcome = left(verdict, 2.7, steps=steps)
            assert outcome.verdict == "partly_explained"
            assert headline(outcome) == "Training recordings explained, validation recordings not"
            said = summary(outcome)[0]
            assert "validation-0.h5 keeps 2.70 times its noise" in said
            assert "only noise" not in " ".join(summary(outcome))
            assert diagnosis_json(outcome)["verdict"] == "partly_explained"
            assert diagnosis_json(outcome)["verdict_reasons"] == ["validation"]
        assert left("explained", 1.14, steps=(SURE,)).verdict == "explained"

    def test_what_the_error_of_the_parameters_explains_is_said_of_training_alone(self):
        outcome = left("nothing_missing", 2.7, steps=())
        own = tuple(4.0 * c.noise for c in outcome.after.validation)
        outcome = replace(outcome, prediction_errors=own)
        assert outcome.verdict == "nothing_missing"
        told = " ".join(summary(outcome))
        assert "the uncertainty of the fitted parameters is large enough to explain it" in told
        assert "explains the training recordings down to the noise" in told

    def test_what_moves_before_the_voltage_is_not_called_nothing(self):
        still = left("nothing_missing", 1.0, steps=())
        assert still.verdict == "nothing_missing"
        (train,) = still.after.train
        swing = 8.0 * NOISE * np.sin(2.0 * np.pi * 1.5 * train.time[:100])
        measured = train.measured.copy()
        measured[:100] = swing + NOISE * np.random.default_rng(1).standard_normal(100)
        moving = replace(train, measured=measured, noise=6.0 * NOISE, quiet_count=100)
        outcome = replace(still, stands=(replace(still.after, train=(moving,)),))
        assert diagnosis_json(outcome)["verdict_reasons"] == ["rest"]
        assert headline(outcome).startswith("Nothing found, but the readings at rest move")
        assert "move slowly before the voltage" in " ".join(summary(outcome))

    def test_a_recording_that_the_model_cannot_follow_is_not_explained(self):
        outcome = diagnose_outcome(not_compared=("fast",))
        assert outcome.verdict == "partly_explained"
        assert "cannot follow fast" in summary(outcome)[0]

    def test_without_events_it_is_the_other_error_that_counts(self):
        outcome = left("explained", 4.2, steps=(SURE,))
        jumped, other = outcome.after.validation
        steady = replace(jumped, rms_without_events=1.02 * jumped.noise)
        after = replace(outcome.after, validation=(steady, other))
        found = replace(outcome, stands=(outcome.before, after))
        assert found.verdict == "explained"
        # and the prediction as it is comes first
        words = " ".join(summary(found))
        assert "Without slow noise, drift and events of each recording" in words
        assert "Without slow noise" not in " ".join(summary(outcome))

    def test_an_error_that_does_not_change_is_not_said_to_fall(self):
        outcome = left("explained", 6.1, steps=(SURE,))
        same = replace(outcome, stands=(outcome.after, outcome.after))
        shown = significant(pooled_errors(outcome.after.validation).rms * 1e6)
        assert f"the error stays {shown}" in " ".join(summary(same))
        clean = diagnose_outcome()
        worse = replace(clean, stands=(clean.after, clean.before))
        assert "the error rises from" in " ".join(summary(worse))

    def test_what_does_not_help_on_untouched_recordings_is_not_named(self):
        clean = left("explained", 6.1, steps=(SURE,))
        for rises in (False, True):
            worse = tuple(
                replace(c, errors=replace(c.errors, rms=(1.3 if rises else 1.0) * c.errors.rms))
                for c in clean.before.validation
            )
            after = replace(clean.after, validation=worse)
            gain = -300.0 if rises else 0.0
            outcome = replace(clean, stands=(clean.before, after), gain=gain)
            assert outcome.verdict == "not_confirmed"
            assert not outcome.recommends_final
            assert headline(outcome) == HEADLINES["not_confirmed"]
            told = " ".join(summary(outcome))
            assert "no effect is named" in told
            assert "is that without it" in told
            found = diagnosis_json(outcome)
            assert (found["verdict"], found["recommended"]) == ("not_confirmed", "baseline")
            first = found["families"][0]
            assert (first["family"], first["probability"]) == ("unknown", 1.0)

    def test_a_model_that_cannot_follow_an_untouched_recording_is_not_recommended(self):
        clean = diagnose_outcome(finding=finding(steps=(SURE,)))
        first = clean.after.validation[0]
        outcome = replace(
            clean, not_compared=(first.name,), gain=-math.inf,
            stands=(clean.before, replace(clean.after, validation=clean.after.validation[1:])),
        )  # fmt: skip
        assert outcome.verdict == "not_confirmed"
        assert not outcome.recommends_final

    def test_a_rising_cross_validation_error_is_said(self):
        stage = finding().final
        worse = replace(stage, selection_rms=72e-6)
        outcome = diagnose_outcome(finding=finding(final=worse))
        assert outcome.verdict == "partly_explained"
        assert "cross-validation error rises" in headline(outcome)
        assert "to 72.0 \N{MICRO SIGN}m" in summary(outcome)[0]

    def test_it_never_contradicts_that_the_data_cannot_tell(self):
        assert "these data cannot tell" in headline(diagnose_outcome())
        assert headline(left("explained", 1.0, steps=(SURE,))) == "Residual explained"

    def test_without_validation_it_says_so(self):
        assert headline(nothing_missing()).endswith("; no validation recording was given")

    def test_a_stopped_search_never_says_that_nothing_is_missing(self):
        clean = nothing_missing()
        rounds = (ROUND,)
        stopped = replace(clean, finding=replace(clean.finding, interrupted=True, rounds=rounds))
        assert stopped.verdict == "partly_explained"
        assert stopped.status == "stopped"
        told = f"{headline(stopped)} {' '.join(summary(stopped))}"
        assert "No missing effect found so far: not every effect was tried" in told
        assert "It is not known whether an effect is missing" in told
        assert diagnosis_json(stopped)["status"] == "stopped"

    def test_a_search_that_ended_at_its_budget_says_so(self):
        clean = nothing_missing()
        outcome = replace(clean, finding=replace(clean.finding, status="budget"))
        assert outcome.status == "budget"
        assert "computing budget" in headline(outcome)


class TestPooled:
    def test_over_all_samples(self):
        runs = [actuator_comparison(seed=1), actuator_comparison(seed=2, rate=40.0)]
        every = np.concatenate([c.measured - c.model for c in runs])
        found = pooled_errors(runs)
        assert found.rms == pytest.approx(math.sqrt(np.mean(every**2)), rel=1e-12)
        assert found.max == np.abs(every).max()
        assert found.samples == every.size
        span = max(c.measured.max() for c in runs) - min(c.measured.min() for c in runs)
        assert found.nrmse_pct == pytest.approx(100.0 * found.rms / span)
        assert found.e_rms_thesis_pct == pytest.approx(found.rms * 1e5)
        model = max(c.model.max() for c in runs) - min(c.model.min() for c in runs)
        assert found.e_m_thesis_pct == pytest.approx(100.0 * found.max / model)

    def test_of_one_it_is_that_ones(self):
        one = actuator_comparison()
        found = pooled_errors([one])
        assert found.rms == pytest.approx(one.errors.rms, rel=1e-12)
        assert found.nrmse_pct == pytest.approx(one.errors.nrmse_pct)
        assert found.peak_pct == pytest.approx(one.errors.peak_pct)
        assert found.e_m_thesis_pct == pytest.approx(one.errors.e_m_thesis_pct)

    def test_of_none_there_is_none(self):
        assert pooled_errors([]) is None


class TestTables:
    def test_a_row_of_all_together(self):
        outcome = diagnose_outcome()
        table = before_after_table(
            "x", outcome.before.validation, outcome.after.validation, "actuator"
        )
        assert [r.cells[0] for r in table.rows] == ["validation-0.h5", "validation-1.h5", "all"]
        first, last = (
            pooled_errors(outcome.before.validation),
            pooled_errors(outcome.after.validation),
        )
        assert table.rows[-1].cells[1:3] == (
            significant(first.rms * 1e6), significant(last.rms * 1e6),
        )  # fmt: skip
        assert table.rows[-1].cells[5] == significant(first.rms / NOISE)
        theirs = thesis_before_after_table(
            "x", outcome.before.train, outcome.after.train, "actuator"
        )
        assert len(theirs.rows) == 1
        assert {len(r.cells) for r in (*table.rows, *theirs.rows)} == {7}

    def test_ranking(self):
        kept = ("sensor lag",)
        whole, brief = ranking_table(ROUND, kept), ranking_table(ROUND, kept, 3)
        assert len(whole.rows) == len(ROUND.candidates)
        assert [r.cells[-1] for r in brief.rows] == ["chosen", "nearly as good", "less probable"]
        assert "9 more candidates are worse" in brief.note
        assert whole.rows[0].detail == ROUND.candidates[0].note
        assert [r.mark for r in brief.rows] == [True, False, False]

    def test_an_effect_that_the_final_model_lacks_is_not_marked_as_chosen(self):
        other = replace(STEP, effect="load inertia", family="load_inertia")
        outcome = diagnose_outcome(finding=finding(steps=(other,)))
        first, _ = rankings(outcome)
        assert not any(row.mark or "chosen" in row.cells for row in first.rows)
        assert first.rows[0].cells[-1] == "replaced later"
        candidates = diagnosis_json(outcome)["rounds"][0]["candidates"]
        assert not any(c["kept"] for c in candidates)

    @pytest.mark.parametrize("encoding", ["utf-8", "ascii"])
    @pytest.mark.parametrize("width", [100, 80, 44, 24])
    @pytest.mark.parametrize("name", OUTCOMES)
    def test_the_terminal_shows_it_in_any_width(self, name, width, encoding):
        text = shown(diagnosis_tables(OUTCOMES[name]), width, encoding)
        assert max(map(len, text.splitlines())) <= width
        assert HEADLINES[OUTCOMES[name].verdict].split()[0] in text

    def test_nothing_is_cut_off_at_80_columns(self):
        text = shown(diagnosis_tables(diagnose_outcome()), 80)
        for words in ("Fitted parameters of sensor lag", "0.00910 to 0.00990", "nearly as good"):
            assert words in text


class TestJson:
    @pytest.mark.parametrize("name", OUTCOMES)
    def test_the_contract(self, name):
        outcome = OUTCOMES[name]
        found = json.loads(json.dumps(diagnosis_json(outcome), allow_nan=False))
        film = outcome.kind == "film"
        plain = MEASURES_KPA if film else MEASURES_UM
        measures = plain | {f"rms_without_events_{'kPa' if film else 'um'}"}
        assert found["format"] == "dearig-diagnosis/1"
        assert found["verdict"] == outcome.verdict
        assert found["status"] == "complete"
        assert found["noise_floor_kPa" if film else "noise_floor_um"] > 0.0
        assert found["baseline"]["model"] == "thesis"
        for stand in (found["baseline"], found["final"]):
            assert stand["train"].keys() == measures
            if found["records"]["validation"]:
                assert stand["validation"].keys() == measures
                assert list(stand["validation_by_record"]) == found["records"]["validation"]
            else:
                assert stand["validation"] is None
                assert stand["validation_by_record"] is None
        assert len(found["steps"]) == len(outcome.finding.steps)
        for step in found["steps"]:
            assert step.keys() == {
                "effect", "family", "acts_on", "parameters", "train", "selection", "validation",
                "indistinguishable_from", "evidence", "nearest_named", "curve", "law", "says",
            }  # fmt: skip
            assert step["train"].keys() == measures
            assert step["selection"].keys() == plain
            for p in step["parameters"]:
                assert {"name", "value", "unit", "ci95"} <= p.keys()
                assert len(p["ci95"]) == 2
        assert found["residual_after"].keys() == {"is_noise", "signature"}
        assert (found["experiment"] is None) == (outcome.experiment is None)
        assert (found["unnamed"] is None) == (outcome.finding.unnamed is None)
        assert found["seconds"] == 12.3

    def test_its_numbers_are_those_of_the_outcome(self):
        outcome = diagnose_outcome()
        found = diagnosis_json(outcome)
        last = pooled_errors(outcome.after.validation)
        assert found["final"]["validation"]["rms_um"] == pytest.approx(last.rms * 1e6)
        assert found["steps"][0]["validation"] == found["final"]["validation"]
        # as errors are counted, with what the zero of each fit adds to the training error
        step, stage = found["steps"][0], outcome.finding.steps[0].stage
        zero = step["train"]["rms_um"] ** 2 - (1e6 * stage.train_rms) ** 2
        assert step["selection"]["rms_um"] ** 2 == pytest.approx((1.1 * 1.02) ** 2 + zero)
        assert found["steps"][0]["parameters"][0]["ci95"] == [9.1e-3, 9.9e-3]
        assert found["experiment"]["sequence"] == EXPERIMENT.sequence
        assert found["experiment"]["separates"] == ["sensor_lag", "amplifier"]
        assert found["residual_after"]["is_noise"] is True
        assert found["rounds"][0]["candidates"][1]["behind"] == 2.5

    def test_plain_keys_stand_beside_the_older_ones(self):
        found = diagnosis_json(diagnose_outcome())
        for signature in found["residual_before"].values():
            assert signature["remarks"] == signature["words"]
        for candidate in found["rounds"][0]["candidates"]:
            assert candidate["predicted_share"] == candidate["promised"]
            assert candidate["explained_share"] == candidate["gained"]
            assert candidate["criterion_behind_best"] == candidate["behind"]


class TestGeneralLaw:
    """A form without a name is told by its curve, and by the named law that is nearest."""

    @staticmethod
    def outcome():
        weights = {f"error_{i}": 3e-6 * i for i in range(1, 9)} | {"travel": 4e-4}
        step = replace(
            finding().steps[0], effect="general sensor curve", family="sensor_nonlinearity",
            estimates=tuple(Estimate(n, "m", v, v, v, True) for n, v in weights.items()),
            nearest="sensor curvature",
        )  # fmt: skip
        return diagnose_outcome(finding=finding(steps=(step,)))

    def test_in_json(self):
        (step,) = diagnosis_json(self.outcome())["steps"]
        assert step["nearest_named"] == "sensor curvature"
        curve = step["curve"]
        assert curve["values"][-1] == pytest.approx(3.0 * 36, rel=1e-6)
        assert len(curve["axis"]) == len(curve["values"])
        assert (curve["axis_label"], curve["values_label"]) == (
            "position (mm)", "error of the reading (um)",
        )  # fmt: skip
        (named,) = diagnosis_json(diagnose_outcome())["steps"]
        assert named["curve"] is named["nearest_named"] is None

    def test_in_the_report(self, tmp_path):
        page = write_diagnosis_report(self.outcome(), tmp_path / "r.html").read_text("utf-8")
        assert "The form that was found." in page


class TestFigures:
    def test_before_and_after_are_drawn_with_the_noise(self):
        outcome = diagnose_outcome()
        before, after = outcome.before.validation[0], outcome.after.validation[0]
        figure = before_after_figure(before, after)
        _, both, first, last = figure.axes
        assert [t.get_text() for t in both.get_legend().get_texts()] == [
            "measured", "before", "after",
        ]  # fmt: skip
        for ax, comparison in ((first, before), (last, after)):
            floors = sorted(line.get_ydata()[0] for line in ax.lines if len(line.get_ydata()) == 2)
            assert floors == pytest.approx([-1.0, 0.0, 1.0])
            curve = max(ax.lines, key=lambda line: len(line.get_ydata())).get_ydata()
            error = (comparison.measured - comparison.model) * 1e6
            assert np.max(curve) == pytest.approx(error.max())

    def test_the_residual_separates_loading_from_unloading(self):
        signature = finding().before[0]
        dependence = signature.dependences[0]
        figure = dependence_figure(dependence, "actuator")
        (ax,) = figure.axes
        drawn = {line.get_label(): line.get_ydata() for line in ax.lines}
        np.testing.assert_allclose(drawn["loading"], dependence.loading * 1e6)
        np.testing.assert_allclose(drawn["unloading"], dependence.unloading * 1e6)
        assert ax.get_xlabel() == "Voltage squared (kV\N{SUPERSCRIPT TWO})"

    def test_the_spectrum_has_its_floor(self):
        found = finding()
        (ax,) = spectra_figure(found.before[0], found.after[0], "actuator").axes
        (floor,) = [line for line in ax.lines if line.get_label() == "noise floor"]
        assert floor.get_ydata()[0] == pytest.approx(math.sqrt(found.before[0].floor_density) * 1e6)

    def test_alone_the_residual_has_one_panel(self):
        found = finding()
        assert len(residual_time_figure(found.before[0], None, "actuator").axes) == 1
        assert len(residual_time_figure(found.before[0], found.after[0], "actuator").axes) == 2

    def test_missing_stress_against_what_drives(self):
        missing = finding().missing_before[0]
        names = [name for name, _ in missing_figures(missing, "actuator")]
        assert names == ["stretch", "voltage squared", "rate"]
        assert [n for n, _ in missing_figures(missing, "film")] == ["stretch", "rate"]

    def test_bars(self):
        outcome = diagnose_outcome()
        pairs = list(zip(outcome.before.validation, outcome.after.validation, strict=True))
        (ax,) = bars_figure(pairs, "actuator").axes
        widths = [p.get_width() for p in ax.patches]
        stands = (outcome.before, outcome.after)
        wanted = [c.errors.rms * 1e6 for stand in stands for c in stand.validation]
        assert widths == pytest.approx(wanted)


def test_losing_candidates_are_folded_after_the_figures(page):
    outcome, found = page
    folded = re.search(r"Candidates that explain less \(\d+\)", found.words)
    if not outcome.finding.rounds[0].candidates:
        assert not folded
        return
    assert folded
    assert "details" in found.seen
    assert found.words.index("Measurement and model on validation") < found.words.index("Effects")


def test_each_effect_that_is_named_is_defined_where_it_stands(tmp_path):
    outcome = diagnose_outcome()
    path = write_diagnosis_report(outcome, tmp_path / "report.html")
    page = path.read_text(encoding="utf-8")
    law = EFFECTS["sensor lag"].law
    assert mathml(law.equations[0]) in page
    assert "time constant, of the low-pass, in s" in page
    assert f"Source: {law.source}." in page
    told = shown(diagnosis_tables(outcome))
    assert as_text(law.equations[0]) in told
    assert "time constant, of the low-pass, in s" in told
    (step,) = diagnosis_json(outcome)["steps"]
    assert step["law"]["equations"] == list(law.equations)
