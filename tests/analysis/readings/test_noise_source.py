"""One noise for a recording, wherever it is shown, and where it is from."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dearig.analysis.outcomes import noise_from, pooled_noise, pooled_over_noise
from dearig.analysis.readings.compare import compare
from dearig.analysis.readings.record import Readings, noise_texts
from dearig.model.film.material import THESIS_FILM, THESIS_LOAD, Network
from dearig.model.simulation.actuator import Actuator
from dearig.recording import RunMetadata, import_file, open_recording
from dearig.recording.reading.recording import Recording
from dearig.recording.reading.summary import describe, describe_rows
from dearig.report.as_json import outcome_json
from dearig.report.text.sentences import identify_summary
from dearig.report.text.tables import error_table
from tests.tools.recordings import Clock
from tests.tools.reports import actuator_comparison, identify_outcome

NOISE = 2e-6
MODEL = Actuator(THESIS_FILM, THESIS_LOAD, Network.gent((60e3,), (1e4,), ()))


def recorded(
    folder: Path,
    rest: float,
    dropout: bool = False,
    travel: float = 1e-4,
    step: float = 0.0,
    at: float = 0.0,
    swing: float = 0.0,
) -> Recording:
    """A slow rise of the voltage after ``rest`` s at 0 V, read at 100 Hz.

    ``travel`` m at 10 kV are read from a rest ``at`` m in steps of ``step`` m. The load swings
    by ``swing`` m.
    """
    time = np.arange(400) / 100.0
    volts = np.where(time < rest, 0.0, 2000.0 * (time - rest) + 1.0)
    read = travel * (volts / 1e4) ** 2 + NOISE * np.random.default_rng(3).standard_normal(time.size)
    if dropout:
        read[20:22] += 3e-3
    read = read + swing * np.sin(2.0 * np.pi * 1.7 * time)
    if step:
        read = step * np.round((read + at) / step)
    path, out = folder / "in.csv", folder / "run.h5"
    rows = (f"{t},{v},{1e3 * d}" for t, v, d in zip(time, volts, read, strict=True))
    path.write_text("\n".join(["time_s,voltage_V,displacement_mm", *rows]), "utf-8")
    import_file(path, out, metadata=RunMetadata(), overwrite=True, now=Clock())
    return open_recording(out)


@pytest.mark.parametrize(
    ("rest", "source"),
    [(1.0, "lead-in"), (0.05, "second differences"), (0.0, "second differences")],
)
def test_info_fits_and_comparisons_agree(tmp_path: Path, rest: float, source: str) -> None:
    run = recorded(tmp_path, rest)
    told, compared = describe(run), compare(Readings(run), MODEL, "train")
    assert told["noise_floor_m"] == Readings(run).record.noise == compared.noise
    assert told["noise_floor_m"] == pytest.approx(NOISE, rel=0.2)
    assert told["noise_from"] == compared.noise_source == noise_from([compared]) == source
    row, sentences = dict(describe_rows(run))["noise floor"], noise_texts([Readings(run)])
    if source == "lead-in":
        assert "over 101 samples at 0 V" in row
        assert sentences == []
    else:
        assert "from second differences" in row
        assert row.partition(", ")[2] in sentences[0]


@pytest.mark.parametrize("at", [0.0, 4e-6, 6e-6])
def test_coarse_readings_tell_neither_noise_nor_zero_at_rest(tmp_path: Path, at: float) -> None:
    step = 6.0 * NOISE
    run = recorded(tmp_path, 2.0, travel=1e-2, step=step, at=at)
    record, compared = Readings(run).record, compare(Readings(run), MODEL, "train")
    assert record.noise == compared.noise == describe(run)["noise_floor_m"]
    assert record.noise == pytest.approx(np.hypot(NOISE, step / np.sqrt(12.0)), rel=0.15)
    # rounded alike, they are not 200 readings of the zero
    assert record.valid is not None
    assert not record.valid[: record.lead_in].any()
    assert record.valid[record.lead_in :].all()
    np.testing.assert_allclose(record.displacement, compared.measured, atol=1e-12)
    true = 1e-2 * (record.drive.voltage / 1e4) ** 2
    moving = slice(record.lead_in, None)
    off = float(np.mean(record.displacement[moving] - true[moving]))
    # 200 readings of 4 um have a mean to 0.3 um, and the zero is known to a part of the noise
    assert abs(off) < 0.6 * NOISE
    row, sentences = dict(describe_rows(run))["noise floor"], noise_texts([Readings(run)])
    assert "in steps larger than their noise" in row
    assert "the zero of displacement is known to a part of a step only" in sentences[0]


def test_what_moves_slowly_at_rest_is_said(tmp_path: Path) -> None:
    still = recorded(tmp_path, 2.0)
    assert noise_texts([Readings(still)]) == []
    swinging = recorded(tmp_path, 2.0, swing=6.0 * NOISE)
    (sentence,) = noise_texts([Readings(swinging)])
    # a swing of 12 um is 8.5 um RMS
    assert "the readings at rest move slowly, by 8." in sentence
    assert "in addition to a noise of 2." in sentence
    assert compare(Readings(swinging), MODEL, "train").moves_at_rest
    assert not compare(Readings(still), MODEL, "train").moves_at_rest


def test_readings_that_are_not_used_are_not_in_the_noise(tmp_path: Path) -> None:
    run = recorded(tmp_path, 1.0, dropout=True)
    assert Readings(run).record.noise == compare(Readings(run), MODEL, "train").noise
    assert Readings(run).record.noise == pytest.approx(NOISE, rel=0.2)


def test_prose_table_and_json_give_one_noise_and_one_error() -> None:
    loud = actuator_comparison(name="loud.h5", noise=3e-6)
    outcome = identify_outcome(train=(actuator_comparison(noise=1e-6), loud), validation=())
    noise, over = pooled_noise(outcome.train), pooled_over_noise(outcome.train)
    found = outcome_json(outcome)
    assert found["noise_floor_um"] == pytest.approx(noise * 1e6)
    assert found["residual_over_noise"] == pytest.approx(over)
    assert noise == pytest.approx(5**0.5 * 1e-6)
    alone = identify_outcome(train=(loud,), validation=())
    cell = error_table("x", (loud,)).rows[0].cells[-1]
    assert float(cell) == pytest.approx(outcome_json(alone)["residual_over_noise"], rel=0.01)
    said = " ".join(identify_summary(alone))
    assert "noise floor is 3.00" in said


@pytest.mark.parametrize(
    ("p", "told"),
    [
        (1e-6, "The model is rejected: noise as that at rest leaves such a residual with p = 1e"),
        (3e-3, "seldom leaves (p = 0.003): too often to reject the model, too seldom to trust it"),
        (0.3, "which noise as that at rest does not exclude (p = 0.3)"),
    ],
)
def test_a_residual_above_the_noise_is_told_by_its_probability(p: float, told: str) -> None:
    outcome = identify_outcome()
    (train, *_) = outcome.train
    louder = replace(train, noise=train.errors.rms / 2.0, noise_source="lead-in")
    louder.__dict__["misfit_p"] = p
    assert told in " ".join(identify_summary(replace(outcome, train=(louder,))))
