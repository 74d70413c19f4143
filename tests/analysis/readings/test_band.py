"""Bands on predictions: their parts against draws and made errors, and what a model file says."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dearig.analysis.outcomes import Comparison
from dearig.analysis.readings.band import (
    TRAINING,
    PredictionBand,
    band_of,
    covariance_of,
    prediction_table,
)
from dearig.config.modelfile import ModelFile, load_model, save_model
from dearig.model.fitting import prediction
from dearig.model.fitting.parameters import FitLayout
from dearig.model.fitting.prediction import parameter_deviation
from dearig.model.readings.measures import errors
from dearig.model.readings.records import FilmRecord
from dearig.model.simulation.actuator import Drive
from dearig.model.simulation.strip import Strip
from dearig.report.as_json import outcome_json
from dearig.report.figures.recordings import comparison_figure
from dearig.report.made import made_now
from dearig.report.pages.html import band_caption
from dearig.report.stored import restored, stored
from tests.tools.command import FILM_NETWORK
from tests.tools.engine import PLAIN, record_of
from tests.tools.reports import actuator_comparison, validate_outcome

NAMES = ("mu_0", "mu_1", "T_1")
NOISE = 1e-6


def covariance() -> np.ndarray:
    """Errors of half a per cent; the moduli are known by their sum ten times better."""
    layout = FitLayout(PLAIN)
    size = 5e-3 * layout.initial()[[layout.names.index(name) for name in NAMES]]
    correlation = np.array([[1.0, -0.99, 0.2], [-0.99, 1.0, -0.2], [0.2, -0.2, 1.0]])
    return correlation * np.outer(size, size)


def short_drive() -> Drive:
    """A lobe and a step, 2 s in all."""
    time = np.arange(400) * 5e-3
    voltage = np.where(time < 1.0, 6e3 * np.sin(np.pi * np.clip(time, 0.0, 1.0)), 5e3)
    return Drive(time, np.where(time < 1.8, voltage, 0.0), hold=True)


def model_file(**history) -> ModelFile:
    table = {"names": list(NAMES), "matrix": covariance().tolist()}
    return ModelFile("made", PLAIN, {"covariance": table, **history})


def test_the_part_of_the_parameters_is_the_spread_of_draws_from_the_covariance() -> None:
    drive, layout = short_drive(), FitLayout(PLAIN)
    places = [layout.names.index(name) for name in NAMES]
    rng = np.random.default_rng(4)
    drawn = []
    for step in rng.multivariate_normal(np.zeros(3), covariance(), size=400):
        values = layout.initial()
        values[places] += step
        drawn.append(layout.model(values).simulate(drive).displacement)
    spread = np.std(drawn, axis=0)
    told = parameter_deviation(record_of(PLAIN, drive), PLAIN, NAMES, covariance())
    # a standard deviation of 400 draws is known to 3.5 %; where a ring passes the first order
    # through 0 the second is left
    rms = float(np.sqrt(np.mean(spread**2)))
    assert float(np.sqrt(np.mean(told**2))) == pytest.approx(rms, rel=0.1)
    assert np.max(np.abs(told - spread)) < 0.15 * spread.max()


def test_a_long_record_is_computed_in_parts_with_the_same_result(monkeypatch) -> None:
    record = record_of(PLAIN, short_drive())
    whole = parameter_deviation(record, PLAIN, NAMES, covariance())
    monkeypatch.setattr(prediction, "_PASS_BYTES", 1)
    np.testing.assert_allclose(
        parameter_deviation(record, PLAIN, NAMES, covariance()), whole, rtol=1e-4, atol=1e-12
    )
    monkeypatch.setattr(prediction, "_KEPT_BYTES", 2 * 8 * 3 * whole.size // 4)
    fewer = parameter_deviation(record, PLAIN, NAMES, covariance())
    np.testing.assert_allclose(fewer[::2], whole[::2], rtol=1e-4, atol=1e-12)
    assert fewer.size == whole.size


def test_the_stress_of_a_film_has_a_band_too() -> None:
    strip = Strip(FILM_NETWORK)
    time = np.linspace(0.0, 10.0, 200)
    stretch = 1.0 + 0.1 * time
    pulled = strip.simulate(time, stretch).stress
    file = ModelFile("film", strip, {"covariance": {"names": ["mu_0"], "matrix": [[300.0**2]]}})
    band = band_of(file, (time, stretch), pulled)
    assert band is not None
    more = Strip(
        replace(strip.network, equilibrium=replace(strip.network.equilibrium, modulus=30300.0))
    )
    np.testing.assert_allclose(
        band.parameters, np.abs(more.simulate(time, stretch).stress - pulled), rtol=1e-2, atol=1.0
    )
    record = FilmRecord("", time, stretch, pulled, 1.0)
    assert np.array_equal(parameter_deviation(record, strip, ("mu_9",), np.eye(1)), np.zeros(200))


def test_a_band_has_the_width_of_its_independent_parts() -> None:
    band = PredictionBand(np.full(10, 3e-6), noise=4e-6, law=12e-6, zero=84e-6)
    np.testing.assert_allclose(band.half_width, 1.959964 * 85e-6, rtol=2e-3)
    # noise alone averages out
    noisy = PredictionBand(np.zeros(10), noise=4e-6, law=0.0)
    np.testing.assert_allclose(noisy.of_means(4), np.full(2, 1.959964 * 2e-6), rtol=1e-6)
    np.testing.assert_allclose(
        band.of_means(4), 1.959964 * np.sqrt(3**2 + 2**2 + 12**2 + 84**2) * 1e-6, rtol=1e-6
    )
    error = 3.0 * 4e-6 * np.array([0, 0, 0, 1, 0, 0, 0, 0, 0, np.nan])
    assert noisy.inside(error) == pytest.approx(8 / 9)


def judged(law: float = 0.0, seed: int = 3, **changes) -> Comparison:
    """A recording whose error is noise, and a ``law`` as a share of the RMS of the response."""
    plain = actuator_comparison("other", "validation")
    rms = float(np.sqrt(np.mean(plain.model**2)))
    rng = np.random.default_rng(seed)
    measured = plain.model + NOISE * rng.standard_normal(plain.model.size)
    measured += law * rms * np.sqrt(2.0) * np.sin(3.0 * plain.time)
    return replace(plain, measured=measured, errors=errors(measured, plain.model), **changes)


def test_the_error_of_the_law_is_what_validation_shows_above_the_other_parts() -> None:
    train = [judged(seed=1)]
    for law in (0.0, 0.02):
        table = prediction_table(train, [judged(law)], NOISE)
        assert table["law_error_pct"] == pytest.approx(100.0 * law, abs=0.1)
        assert (table["law_error_of"], table["law_error_from"]) == ("validation", ["other"])
    rms = float(np.sqrt(np.mean(train[0].model ** 2)))
    explained = PredictionBand(np.full(train[0].time.size, 0.02 * rms), NOISE, 0.0)
    table = prediction_table(train, [judged(0.02, band=explained)], NOISE)
    assert table["law_error_pct"] < 0.3
    assert prediction_table([judged(0.02)], (), NOISE)["law_error_of"] == TRAINING


def test_a_model_file_carries_what_its_bands_need(tmp_path: Path) -> None:
    table = prediction_table([judged(seed=1)], [judged(0.02)], NOISE)
    save_model(tmp_path / "m.toml", "made", PLAIN, model_file(prediction=table).history)
    drive = short_drive()
    response = PLAIN.simulate(drive).displacement
    band, again = (
        band_of(file, drive, response)
        for file in (model_file(prediction=table), load_model(tmp_path / "m.toml"))
    )
    assert band is not None
    assert again is not None
    np.testing.assert_allclose(again.half_width, band.half_width)
    assert band.noise == pytest.approx(NOISE)
    rms = float(np.sqrt(np.mean(response**2)))
    assert band.law == pytest.approx(0.02 * rms, rel=0.05)
    assert again.law_from == ("other",)
    # a step is more than what the lobes of the training showed
    assert again.beyond is not None
    assert again.beyond.bands


GOOD = {
    "noise_um": 1.0, "law_error_pct": 1.0, "law_error_of": "validation", "law_error_from": ["a"],
}  # fmt: skip
FALLING = {
    "voltage_kV": 8.0, "displacement_um": [0.0, 1.0], "edges_Hz": [1.0, 0.5],
    "energies_over_noise": [1.0],
}  # fmt: skip


@pytest.mark.parametrize(
    "table",
    [3, {}, {**GOOD, "noise_um": "x"}, {**GOOD, "law_error_pct": -1.0}, {**GOOD, "shown": FALLING}],
    ids=["a number", "empty", "words", "negative", "edges that fall"],
)
def test_a_file_that_was_damaged_says_nothing_of_noise_and_law(table) -> None:
    drive = short_drive()
    band = band_of(model_file(prediction=table), drive, PLAIN.simulate(drive).displacement)
    assert band is not None
    assert (band.noise, band.law, band.law_of, band.beyond) == (0.0, 0.0, "", None)
    assert band.parameters.max() > 0.0


def test_without_a_covariance_there_is_no_band() -> None:
    drive = short_drive()
    assert band_of(ModelFile("bare", PLAIN), drive, np.zeros(drive.time.size)) is None
    # a drift of the training recordings is not in the model that predicts
    names = ["mu_0", "linear drift: rate"]
    table = {"names": names, "matrix": [[4.0, 1.0], [1.0, 9.0]]}
    found = covariance_of(ModelFile("drifting", PLAIN, {"covariance": table}))
    assert found is not None
    assert (found[0], found[1].tolist()) == (("mu_0",), [[4.0]])


def test_figure_caption_and_json_have_the_band() -> None:
    c = judged(0.02)
    band = PredictionBand(np.full(c.time.size, 2e-6), NOISE, 3e-6, "validation", ("a", "b"))
    banded = replace(c, band=band)
    names = [t.get_text() for t in comparison_figure(banded).axes[2].get_legend().get_texts()]
    assert names == ["95 % band", "± noise floor, 1.00 µm"]
    share = 100.0 * band.inside(c.measured - c.model)
    said = band_caption(banded)
    assert f"it holds {share:.3g} %"[:12] in said
    assert "parameters 2.00 µm RMS, noise 1.00 µm, law 3.00 µm, by the errors on a and b" in said
    assert band_caption(c) == ""
    outcome = replace(validate_outcome(), comparisons=(banded, c))
    numbers = outcome_json(outcome)["recordings"]
    assert numbers[1]["band"] is None
    assert numbers[0]["band"]["inside_pct"] == pytest.approx(share)
    assert numbers[0]["band"]["law_um"] == pytest.approx(3.0)
    again = restored(stored((outcome,), made_now()), "x").outcomes[0]
    np.testing.assert_array_equal(again.comparisons[0].band.half_width, band.half_width)


def test_a_law_that_is_from_the_training_alone_is_said_to_be() -> None:
    c = judged()
    band = PredictionBand(np.zeros(c.time.size), NOISE, 0.0, TRAINING, ("a",))
    assert "to which the model was fitted: on others it may be larger" in band_caption(
        replace(c, band=band)
    )
    unknown = PredictionBand(np.zeros(c.time.size), NOISE, 0.0)
    assert "the error of the law is not known" in band_caption(replace(c, band=unknown))
