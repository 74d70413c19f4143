"""What recordings ask of a model and show of it: made films whose ring one record excites only."""

from __future__ import annotations

import functools

import numpy as np
import pytest

from dearig.config.sequencefile import load_sequence
from dearig.model.diagnosis.excitation import (
    BANDS,
    LEVELS,
    PredictedRun,
    excitation,
    range_of,
    shown_by,
)
from dearig.model.film.material import TABLE_3, THESIS_FILM, THESIS_LOAD
from dearig.model.simulation.actuator import Actuator, Drive
from dearig.model.verdict import TOLERANCE
from tests.blind.play import VALIDATION

NOISE = 1e-6
STEP = 5e-3
EDGES = VALIDATION[-1]  # steps whose rise is quick enough for the film to ring
FILM = Actuator(THESIS_FILM, THESIS_LOAD, TABLE_3)
# the same ring, damped: half-sine lobes move it by a fifth of the noise, and steps by more than it
DAMPED = Actuator(THESIS_FILM, THESIS_LOAD, TABLE_3, (("linear drag", (("drag", 30.0),)),))


@functools.cache
def motion(sequence: str, model: Actuator = FILM, scale: float = 1.0) -> PredictedRun:
    """What ``model`` makes of a ``sequence``, its voltage scaled."""
    time, voltage = load_sequence(sequence).sample(1.0 / STEP)
    answer = model.simulate(Drive(time, scale * voltage, hold=True))
    assert answer.ok, answer.status_text
    return PredictedRun(sequence, STEP, scale * voltage, answer.displacement, NOISE)


def error(sequence: str, truth: Actuator, seed: int = 0, scale: float = 1.0) -> np.ndarray:
    """Measured less what ``FILM`` predicts, of a film that is ``truth``."""
    left = motion(sequence, truth, scale).response - motion(sequence, FILM, scale).response
    return left + NOISE * np.random.default_rng(seed).standard_normal(left.size)


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def test_a_gain_is_known_to_what_least_squares_leaves_of_it() -> None:
    """Equation (10), against fits of the two components of a gain to many noises."""
    time = np.arange(4000) * STEP
    shown = PredictedRun(
        "tone", STEP, np.zeros(4000), 0.2 * NOISE * np.sin(2.0 * np.pi * 30.0 * time), NOISE
    )
    rng = np.random.default_rng(3)
    both = np.column_stack([np.sin(2.0 * np.pi * 30.0 * time), np.cos(2.0 * np.pi * 30.0 * time)])
    gains = [
        np.linalg.lstsq(0.2 * both, rng.standard_normal(time.size), rcond=None)[0]
        for _ in range(400)
    ]
    asked = excitation([shown], shown, np.zeros(time.size))
    (band,) = (b for b in asked.bands if b.low <= 30.0 < b.high)
    assert band.known == pytest.approx(rms(np.linalg.norm(gains, axis=1)), rel=0.05)
    assert band.asked == pytest.approx(0.2 / np.sqrt(2.0), rel=1e-3)


def test_a_ring_that_only_validation_excites_is_not_determined() -> None:
    lobes, edges = error("thesis", DAMPED), error(EDGES, DAMPED)
    assert rms(lobes) < 1.05 * NOISE
    assert rms(edges) > TOLERANCE * NOISE
    asked = excitation([motion("thesis")], motion(EDGES), edges)
    assert asked.open_rms > TOLERANCE
    assert asked.cause == BANDS
    # the ring of this film: where its response to steps has a peak above the lobes' frequencies
    x = np.abs(np.fft.rfft(motion(EDGES).response - np.mean(motion(EDGES).response)))
    frequency = np.fft.rfftfreq(motion(EDGES).response.size, STEP)
    ring = frequency[np.argmax(np.where(frequency > 30.0, x, 0.0))]
    assert any(b.low <= ring < b.high for b in asked.undetermined)
    assert min(b.low for b in asked.undetermined) > 10.0


def test_what_training_has_excited_is_no_excuse() -> None:
    asked = excitation([motion("thesis"), motion("rich")], motion(EDGES), error(EDGES, DAMPED))
    assert asked.undetermined == ()
    assert asked.cause == ""
    assert asked.open_rms < 0.1
    for lobes in VALIDATION[:-1]:
        assert excitation([motion("thesis")], motion(lobes), error(lobes, DAMPED)).cause == ""


def test_an_error_at_slow_motion_is_not_laid_to_the_edges() -> None:
    stiff = Actuator(
        THESIS_FILM, THESIS_LOAD, TABLE_3, (("sensor lag", (("time_constant", 0.1),)),)
    )
    asked = excitation([motion("thesis")], motion(EDGES), error(EDGES, stiff))
    assert asked.undetermined
    assert asked.share < 0.1
    assert asked.cause == ""


def test_another_recording_shows_it() -> None:
    asked = excitation([motion("thesis")], motion(EDGES), error(EDGES, DAMPED))
    after = asked.after(motion("rich"))
    together = excitation([motion("thesis"), motion("rich")], motion(EDGES), error(EDGES, DAMPED))
    assert after.open_rms == pytest.approx(together.open_rms, rel=1e-9)
    assert after.undetermined == ()
    assert asked.after(motion(VALIDATION[0])).undetermined


def test_a_voltage_above_that_of_training() -> None:
    low = motion("thesis", FILM, 0.6)
    high = motion(VALIDATION[0])
    wrong = NOISE * np.random.default_rng(1).standard_normal(high.response.size)
    wrong[np.abs(high.drive) > 0.7 * np.max(high.drive)] += 5.0 * NOISE
    assert excitation([low], high, wrong).cause == LEVELS
    assert excitation([low, high], high, wrong).above == 0.0


def test_a_displacement_beyond_that_of_training() -> None:
    slow, quick = motion(VALIDATION[0]), motion(VALIDATION[1])
    wrong = NOISE * np.random.default_rng(1).standard_normal(slow.response.size)
    far = slow.response > np.max(quick.response) + 2.0 * NOISE
    wrong[far] += 5.0 * NOISE
    # the same voltage, held for longer
    higher = PredictedRun("quick", STEP, np.full_like(quick.drive, 8e3), quick.response, NOISE)
    assert excitation([higher], slow, wrong).cause == LEVELS
    assert excitation([higher, slow], slow, wrong).above == 0.0


def test_readings_that_must_not_be_used_do_not_count() -> None:
    edges = error(EDGES, DAMPED)
    holes = edges.copy()
    holes[-200:-100] = np.nan
    plain, holed = (excitation([motion("thesis")], motion(EDGES), e) for e in (edges, holes))
    assert holed.cause == plain.cause == BANDS
    for one, other in zip(plain.bands, holed.bands, strict=True):
        assert other.excess == pytest.approx(one.excess, abs=0.02)


def test_how_far_recordings_test_a_model() -> None:
    lobes, edges = (
        range_of([motion(VALIDATION[0])]),
        range_of([motion(n) for n in VALIDATION]),
    )
    assert lobes.high < 20.0 < edges.high
    assert edges.voltage == 8000.0
    # 5.5 kV in 0.15 s
    assert edges.rate == pytest.approx(5500.0 / 0.15, rel=1e-3)
    assert lobes.rate < edges.rate


def test_what_goes_beyond_training_is_known_without_an_error() -> None:
    shown = shown_by([motion("thesis")])
    assert shown.beyond(motion("validation-b-7.0")) is None
    edges = shown.beyond(motion(EDGES))
    assert edges is not None
    found = excitation([motion("thesis")], motion(EDGES), error(EDGES, DAMPED))
    assert [b.low for b in edges.bands] == pytest.approx([b.low for b in found.undetermined])
    # half a per cent farther, by more than the noise
    assert float(np.max(motion("validation-a-1.0").response)) > shown.high + NOISE
    assert shown.beyond(motion("validation-a-1.0")) is None
    louder = shown.beyond(motion("thesis", scale=1.2))
    assert louder is not None
    assert louder.levels


def test_what_is_sampled_faster_than_training_is_beyond_it() -> None:
    shown = shown_by([motion("thesis")])
    fast = motion("thesis")
    time = np.arange(4 * fast.response.size) * STEP / 4.0
    tone = 30.0 * NOISE * np.sin(2.0 * np.pi * 150.0 * time)
    twice = PredictedRun("fast", STEP / 4.0, np.repeat(fast.drive, 4), tone, NOISE)
    beyond = shown.beyond(twice)
    assert beyond is not None
    assert beyond.bands[-1].high == pytest.approx(2.0 / STEP)
