"""Identification, validation, prediction and diagnosis as a notebook uses them."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import dearig
from dearig.api.rows import Parameter, Rows
from tests.tools.diagnosis import diagnose_outcome
from tests.tools.reports import identify_outcome

from .conftest import SLOW_RIG


class TestIdentify:
    def test_it_fits_a_recording_or_its_path(self, run, fit) -> None:
        assert fit.model.kind == "actuator"
        assert len(fit.model.model.network.branches) == 2
        again = dearig.identify([run.path], branches=2, intervals=False)
        assert again.parameters["mu_0"].value == pytest.approx(fit.parameters["mu_0"].value)

    def test_parameters_go_to_pandas(self, fit) -> None:
        import pandas as pd

        stiffness = fit.parameters["mu_0"]
        assert stiffness.unit == "Pa"
        assert stiffness.low95 < stiffness.value < stiffness.high95
        frame = fit.parameters.to_pandas()
        assert frame.loc["mu_0", "value"] == stiffness.value
        assert list(pd.DataFrame(fit.parameters)["name"]) == list(frame.index)
        with pytest.raises(KeyError, match="'mu_9' is not one of mu_0, mu_1"):
            fit.parameters["mu_9"]

    def test_errors_are_in_the_units_of_the_field(self, run, fit) -> None:
        errors = fit.errors[run.name]
        assert (errors.role, errors.unit) == ("train", "um")
        assert errors.noise_floor == pytest.approx(1.0, abs=0.3)
        assert errors.rms < 20.0

    def test_it_is_saved_as_model_numbers_and_report(self, fit, tmp_path: Path) -> None:
        path = fit.save(tmp_path / "model.toml")
        assert dearig.Model.open(path).model == fit.model.model
        numbers = json.loads(fit.save(tmp_path / "fit.json").read_text(encoding="utf-8"))
        assert numbers["format"].startswith("dearig-identification/")
        assert "<html" in fit.to_html(tmp_path / "fit.html").read_text(encoding="utf-8")
        with pytest.raises(dearig.InputError, match=r"end the name in \.toml for the model"):
            fit.save(tmp_path / "fit.txt")

    def test_it_shows_itself(self, fit) -> None:
        html = fit._repr_html_()
        for part in ("Identification: ", "95 % interval", "<svg"):
            assert part in html
        assert "RMS" in repr(fit)
        assert "mu_0" in fit.parameters._repr_html_()
        assert "branch 2" in fit.model._repr_html_()

    @pytest.mark.parametrize("what", ["overview", "parameters", "residual", "short-thesis"])
    def test_each_of_its_figures_is_drawn(self, fit, what: str) -> None:
        assert fit.plot(what).axes

    def test_a_figure_that_it_has_not_is_refused_with_those_it_has(self, fit) -> None:
        with pytest.raises(dearig.InputError, match="overview, parameters, residual, short-thesis"):
            fit.plot("branches")

    def test_parameters_are_stated_by_a_mapping_or_a_file(self, run, tmp_path: Path) -> None:
        stated = {"mu_0_kPa": {"fixed": 46}, "T_1_s": {"low": 0.1, "high": 0.5}}
        path = tmp_path / "known.toml"
        path.write_text("mu_0_kPa.fixed = 46\nT_1_s = {low = 0.1, high = 0.5}\n", encoding="utf-8")
        for given in (stated, path, str(path)):
            found = dearig.identify(run, branches=1, intervals=False, parameters=given)
            assert found.parameters["mu_0"].value == 46e3
            assert found.parameters["mu_0"].stated == {"fixed": 46e3}
            assert 0.1 <= found.parameters["T_1"].value <= 0.5
            assert found.parameters["J_0"].stated is None
        with pytest.raises(dearig.InputError, match="ends in its unit, mu_0_kPa") as told:
            dearig.identify(run, parameters={"mu_0": {"fixed": 46}})
        assert told.value.__notes__ == ["see the argument parameters"]

    def test_nothing_to_fit_is_refused(self) -> None:
        with pytest.raises(dearig.InputError, match="no recording is given"):
            dearig.identify([])

    def test_nothing_is_printed(self, run, capfd: pytest.CaptureFixture[str]) -> None:
        told: list[float] = []
        dearig.identify(
            run, branches=1, intervals=False, progress=lambda _, part: told.append(part)
        )
        assert told
        assert capfd.readouterr() == ("", "")


class TestValidate:
    @pytest.mark.deep
    def test_a_model_a_result_or_a_file_is_compared(self, run, fit, tmp_path: Path) -> None:
        other = dearig.record("validation-a-1.0", seed=2, rig_file=SLOW_RIG)
        path = fit.save(tmp_path / "m.toml")
        found = [dearig.validate(model, other) for model in (fit, fit.model, path)]
        assert len({result.errors[0].rms for result in found}) == 1
        assert found[0].errors[0].role == "validation"
        both = dearig.validate(fit, [run, other])
        assert [e.role for e in both.errors] == ["train", "validation"]
        assert "used to fit this model" in repr(both)
        assert "<svg" in both._repr_html_()
        assert both.plot("residual").axes
        numbers = json.loads(both.save(tmp_path / "v.json").read_text(encoding="utf-8"))
        assert numbers["format"].startswith("dearig-validation/")
        assert both.to_html(tmp_path / "v.html").is_file()
        with pytest.raises(dearig.InputError, match=r"in \.json for all numbers"):
            both.save(tmp_path / "v.toml")

    def test_what_is_no_model_is_refused(self, run) -> None:
        with pytest.raises(TypeError, match=r"a path, a dearig\.Model or a result"):
            dearig.validate(7, run)  # type: ignore[arg-type]


class TestSimulate:
    def test_a_sequence_and_a_recording_of_it_are_predicted_alike(self, run, fit) -> None:
        sequence = dearig.Sequence("short thesis").thesis(periods=1)
        planned = dearig.simulate(fit, sequence, rig_file=SLOW_RIG)
        followed = dearig.simulate(fit, run)
        assert planned.time.shape == followed.time.shape
        # one is linear between samples, the other held by the converter
        assert np.max(np.abs(planned.response - followed.response)) < 20e-6
        assert np.std(run.displacement - followed.response) < 20e-6

    def test_a_prediction_is_a_table_a_figure_and_a_file(self, fit, tmp_path: Path) -> None:
        made = dearig.simulate(fit, "validation-a-1.0", rig_file=SLOW_RIG)
        frame = made.to_pandas()
        units = frame.attrs["units"]
        assert (units["voltage_command"], units["displacement"]) == ("V", "m")
        np.testing.assert_array_equal(frame["displacement"], made.response)
        again = dearig.open(made.save(tmp_path / "p.h5"))
        np.testing.assert_array_equal(again.displacement, made.response)
        assert made.save(tmp_path / "p.csv").read_text().startswith("time_s,voltage_V,disp")
        html = made._repr_html_()
        for part in ("true field", "pull-in", "<svg"):
            assert part in html
        assert made.to_html(tmp_path / "p.html").is_file()

    def test_a_prediction_has_its_band_as_arrays_and_in_its_files(
        self, run, fit, tmp_path: Path
    ) -> None:
        made = dearig.simulate(fit, run)
        assert made.band is not None
        half = made.band.half_width
        np.testing.assert_allclose(made.high95 - made.low95, 2.0 * half)
        assert made.band.noise == pytest.approx(fit.errors[run.name].noise_floor * 1e-6, rel=1e-6)
        assert made.band.law_of == "training"
        # of what was fitted, by noise and law together
        assert np.mean(np.abs(run.displacement - made.response) <= half) > 0.9
        again = dearig.open(made.save(tmp_path / "p.h5")).to_pandas()
        np.testing.assert_array_equal(again["displacement_low95"], made.low95)
        np.testing.assert_array_equal(again["displacement_sd_parameters"], made.band.parameters)
        head = made.save(tmp_path / "p.csv").read_text().splitlines()[0].split(",")
        assert head[3:] == [
            "displacement_low95_mm", "displacement_high95_mm", "displacement_sd_parameters_mm",
            "displacement_sd_noise_mm", "displacement_sd_law_mm",
        ]  # fmt: skip
        assert "95 % band of a reading." in made._repr_html_()
        assert len(made.plot().axes) == 3
        bare = dearig.simulate(fit, run, band=False)
        assert (bare.band, bare.low95, bare.high95) == (None, None, None)


class TestDiagnose:
    """Of a result that is made by hand: the search itself has tests of its own."""

    @pytest.fixture
    def found(self) -> dearig.DiagnoseResult:
        return dearig.DiagnoseResult(diagnose_outcome())

    def test_it_says_what_was_found(self, found) -> None:
        assert found.verdict == "explained"
        assert found.effects == tuple(s.effect for s in found.outcome.finding.steps)
        assert {p.effect for p in found.parameters} == set(found.effects)
        before, after = found.errors_before, found.errors
        assert [e.name for e in before] == [e.name for e in after]
        assert all(b.rms > a.rms for b, a in zip(before, after, strict=True))

    def test_the_experiment_that_it_proposes_can_be_played(self, found) -> None:
        assert found.experiment is not None
        assert found.experiment.duration_s > 0.0

    def test_it_shows_itself_and_is_saved(self, found, tmp_path: Path) -> None:
        html = found._repr_html_()
        assert found.headline in html
        assert "<svg" in html
        assert found.plot("train.h5").axes
        assert dearig.Model.open(found.save(tmp_path / "m.toml")).name == found.model.name
        numbers = json.loads(found.save(tmp_path / "d.json").read_text(encoding="utf-8"))
        assert numbers["format"] == "dearig-diagnosis/1"
        assert found.to_html(tmp_path / "d.html").is_file()

    def test_recordings_that_are_too_short_are_refused(self) -> None:
        lobe = dearig.Sequence("lobe").half_sine(amplitude_kV=3.0, frequency_Hz=1.0)
        run = dearig.record(lobe, rig_file=SLOW_RIG)
        with pytest.raises(dearig.InputError, match="too few to tell one effect from another"):
            dearig.diagnose(run)
        with pytest.raises(dearig.InputError, match="both to fit and to validate"):
            dearig.diagnose(run, validate=run)


def test_a_table_of_parameters_has_the_digits_of_the_intervals():
    resistance = Parameter("resistance", 48.654e6, "ohm", 48.51e6, 48.79e6, determined=True)
    page = Rows([resistance])._repr_html_()
    for shown in ("4.865", "4.851", "4.879"):
        assert f"{shown} \N{MULTIPLICATION SIGN} 10\N{SUPERSCRIPT SEVEN}" in page


def test_residuals_and_covariance_are_arrays() -> None:
    outcome = diagnose_outcome()
    found = dearig.DiagnoseResult(outcome)
    (train,) = outcome.after.train
    time, residual = found.residual(train.name)
    np.testing.assert_array_equal(time, train.time)
    np.testing.assert_array_equal(residual, train.measured - train.model)
    with pytest.raises(dearig.InputError, match="no recording 'x' in this result; it has"):
        found.residual("x")
    fitted = dearig.IdentifyResult(identify_outcome())
    assert fitted.covariance.shape == (len(fitted.covariance_names),) * 2
    assert fitted.residual("train.h5")[1].shape == fitted.residual("train.h5")[0].shape
