"""What is said of a residual: noise is called noise, and what is put into it is found."""

from __future__ import annotations

import functools
import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import kstest

from dearig.model.residual.signature import signatures
from dearig.model.verdict import REJECTED_BELOW
from tests.tools.engine import (
    NOISE,
    PLAIN,
    STRIP,
    film_record_of,
    made_fit,
    masked,
    record_of,
    thesis_drive,
)

SEEDS = 200


@functools.cache
def record(periods=1):
    return record_of(PLAIN, thesis_drive(periods=periods))


def noise(seed, size=None):
    return NOISE * np.random.default_rng(seed).standard_normal(size or record().time.size)


def look(residual, of=None):
    of = of or record()
    base = STRIP if hasattr(of, "stretch") else PLAIN
    (found,) = signatures([of], made_fit([of], base, residual))
    return found


def named(signature, quantity):
    (found,) = (d for d in signature.dependences if d.quantity == quantity)
    return found


@functools.cache
def of_noise():
    return [look(noise(seed)) for seed in range(SEEDS)]


def correlated(seed, along):
    """AR(1) of the noise's size."""
    rng = np.random.default_rng(seed)
    out = np.empty(record().time.size)
    state = 0.0
    for i in range(out.size):
        state = along * state + math.sqrt(1.0 - along**2) * rng.standard_normal()
        out[i] = state
    return NOISE * out


# --- noise


@pytest.mark.parametrize("test", ["ljung_box_p", "runs_p"])
def test_probabilities_of_white_noise_are_uniform(test):
    p = np.array([getattr(s, test) for s in of_noise()])
    assert kstest(p, "uniform").pvalue > 0.01
    assert np.count_nonzero(p < 0.05) < 0.1 * SEEDS


def test_noise_is_called_noise():
    assert sum(s.is_noise for s in of_noise()) >= 0.99 * SEEDS
    for s in of_noise():
        assert s.rms == pytest.approx(NOISE, rel=0.1)
        assert s.correlation_time == pytest.approx(0.01, rel=0.5)
        assert "only noise is left" in s.words[0] or not s.is_noise
        assert s.noise == NOISE


def test_a_line_of_the_size_of_noise_is_not_called_noise():
    line = 0.4 * math.sqrt(2.0) * NOISE * np.sin(2.0 * math.pi * 9.0 * record().time)
    found = look(math.sqrt(1.0 - 0.4**2) * noise(3) + line)
    assert found.rms == pytest.approx(NOISE, rel=0.05)
    assert not found.is_noise
    words = ", ".join(found.words)
    assert "only noise is left" not in words
    share, _, rest = words.partition(" % of its power is not white noise")
    assert 8 <= int(share.rpartition(" ")[2]) <= 18
    assert float(rest.rpartition("peaks at ")[2].removesuffix(" Hz")) == pytest.approx(9.0, abs=0.5)


def test_its_spectrum_is_flat_at_the_floor():
    density = np.mean([s.density for s in of_noise()], axis=0)
    floor = of_noise()[0].floor_density
    assert floor == pytest.approx(2.0 * NOISE**2 * 0.01)
    # the last line is of half the width
    np.testing.assert_allclose(density[1:-1], floor, rtol=0.15)
    assert of_noise()[0].frequency[-1] == pytest.approx(50.0)


def test_noise_depends_on_nothing():
    shares = [d.explained for s in of_noise() for d in s.dependences]
    assert np.mean(shares) < 0.005
    assert np.max(shares) < 0.04
    loops = np.array([s.loading_less_unloading for s in of_noise()])
    # means of about thirty readings a bin, a dozen bins
    assert np.sqrt(np.mean(loops**2)) < 0.15 * NOISE
    assert abs(loops.mean()) < 0.02 * NOISE


def test_correlated_noise_is_not_white():
    for seed in range(20):
        s = look(correlated(seed, 0.7))
        assert s.ljung_box_p < 1e-12
        assert s.runs_p < 1e-12
        # (1 + 0.7)/(1 - 0.7) samples
        assert s.correlation_time == pytest.approx(0.0567, rel=0.5)


def test_runs_ask_for_too_few_changes_of_sign_only():
    alternating = NOISE * (-1.0) ** np.arange(record().time.size)
    s = look(alternating)
    assert s.runs_p > 0.99
    assert s.ljung_box_p < 1e-12


def test_what_is_called_noise_is_denied_by_no_test():
    for seed in range(10):
        for along in (0.0, 0.03, 0.1, 0.3):
            s = look(correlated(seed, along))
            # one of three tests, of which the least counts three times
            least = min(s.ljung_box_p, s.runs_p)
            assert not (s.is_noise and least < REJECTED_BELOW / 3.0)
            assert s.noise_p is not None
            assert s.is_noise or s.noise_p < REJECTED_BELOW or s.rms > NOISE
    assert not any(look(correlated(seed, 0.3)).is_noise for seed in range(10))


def test_noise_as_coloured_as_the_readings_at_rest_is_noise():
    found = []
    for seed in range(20):
        at_rest = np.where(np.arange(record().time.size) < 400, 1.0, 0.0) * correlated(seed, 0.4)
        moved = np.where(at_rest == 0.0, record().displacement, at_rest)
        still = replace(record(), displacement=moved, lead_in=400)
        found.append(look(correlated(seed + 100, 0.4), still))
        assert not look(correlated(seed, 0.95), still).is_noise
    assert sum(s.is_noise for s in found) >= 18
    assert all(min(s.ljung_box_p, s.runs_p) > 1e-4 for s in found if s.is_noise)


def test_too_much_noise_is_not_the_noise():
    assert not look(1.3 * noise(1)).is_noise
    assert look(0.9 * noise(1)).is_noise


def test_no_residual_at_all():
    s = look(np.zeros(record().time.size))
    assert (s.rms, s.ljung_box_p, s.is_noise) == (0.0, 1.0, True)
    assert all(d.explained == 0.0 for d in s.dependences)


# --- what is put into it


def test_a_dependence_on_displacement_is_found():
    x = record().displacement
    made = 4e-6 * np.sin(2.0 * math.pi * x / x.max())
    s = look(made + noise(3))
    share = np.var(made) / (np.var(made) + NOISE**2)
    d = named(s, "displacement")
    assert d.explained == pytest.approx(share, abs=0.03)
    # bins are as fine as a 24th of the range
    known = np.isfinite(d.loading)
    assert known.sum() > 20
    expected = 4e-6 * np.sin(2.0 * math.pi * d.at * 1e-3 / x.max())
    np.testing.assert_allclose(d.loading[known], expected[known], atol=1.1e-6)
    assert abs(s.loading_less_unloading) < 0.3e-6
    assert not s.is_noise
    # nothing else says as much, bar what goes with the displacement
    assert d.explained == max(e.explained for e in s.dependences)
    assert any("depends on displacement alone" in w for w in s.words)


@pytest.mark.parametrize("quantity", ["voltage squared", "rate", "time"])
def test_a_dependence_is_ascribed_to_its_quantity(quantity):
    of = record()
    answer = PLAIN.simulate(of.drive)
    along = {
        "voltage squared": of.drive.voltage**2,
        "rate": answer.rate,
        "time": of.time,
    }[quantity]
    wave = 5.0 * NOISE * np.sin(3.0 * along / np.max(np.abs(along)))
    s = look(wave + noise(4, wave.size))
    share = np.var(wave) / (np.var(wave) + NOISE**2)
    found = {d.quantity: d.explained for d in s.dependences}
    assert max(found, key=found.get) == quantity
    assert found[quantity] == pytest.approx(share, abs=0.04)
    assert any(f"depends on {quantity} alone" in w for w in s.words)


@pytest.mark.parametrize("size", [5e-6, -5e-6])
def test_a_loop_is_found(size):
    rate = PLAIN.simulate(record().drive).rate
    loop = 0.5 * size * np.sign(np.where(np.abs(rate) > 0.02 * np.abs(rate).max(), rate, 0.0))
    s = look(loop + noise(5))
    assert s.loading_less_unloading == pytest.approx(size, rel=0.1)
    d = named(s, "displacement")
    assert np.nanmean(d.loading) * size > 0.0 > np.nanmean(d.unloading) * size
    side = "higher" if size > 0.0 else "lower"
    assert any(f"um {side} on loading than on unloading" in w for w in s.words)


@pytest.mark.parametrize("size", [2e-6, 10e-6])
def test_a_change_from_the_first_period_to_the_second_is_found(size):
    of = record(periods=2)
    half = 2.0 + (of.time[-1] - 3.0) / 2.0
    made = np.where(of.time > half, size, 0.0)
    s = look(made + noise(6, of.time.size), of)
    assert s.first_less_repeats == pytest.approx(size, rel=0.1)
    assert any("the second period differs from the first" in w for w in s.words)
    assert look(noise(7, of.time.size), of).first_less_repeats < 0.4e-6
    # without a second period there is nothing to compare
    assert math.isnan(look(noise(8)).first_less_repeats)


@pytest.mark.parametrize("frequency", [7.3, 31.0])
def test_a_line_is_found(frequency):
    t = record().time
    s = look(3.0 * NOISE * np.sin(2.0 * math.pi * frequency * t) + noise(9))
    width = s.frequency[1] - s.frequency[0]
    assert s.frequency[np.argmax(s.density)] == pytest.approx(frequency, abs=width)
    # all of its power, above the floor
    power = float(np.sum(s.density - s.floor_density) * width)
    assert power == pytest.approx(4.5 * NOISE**2, rel=0.15)
    (words,) = (w for w in s.words if "its spectrum has a line" in w)
    said = float(words.split(" at ")[1].split(" Hz")[0])
    assert said == pytest.approx(frequency, abs=width)


# --- records


def test_each_record_has_its_own_part():
    a, b = record(), replace(record_of(PLAIN, seed=1, noise=3e-6), name="other")
    residual = np.concatenate([noise(1), 4.0 * noise(2)])
    found = signatures([a, b], made_fit([a, b], PLAIN, residual))
    assert [s.record for s in found] == ["made", "other"]
    np.testing.assert_allclose(found[0].residual, noise(1), rtol=1e-12)
    np.testing.assert_allclose(found[1].residual, 4.0 * noise(2), rtol=1e-12)
    assert [s.is_noise for s in found] == [True, False]


def test_readings_that_must_not_be_used_count_for_nothing():
    bad = np.random.default_rng(10).random(record().time.size) < 0.5
    of = masked(record(), bad)
    s = look(1.3 * noise(11), of)
    # of those that are left: half of nothing would look like less than noise
    assert s.rms == pytest.approx(1.3 * NOISE, rel=0.05)
    assert not s.is_noise
    assert np.all(s.residual[bad] == 0.0)
    s = look(noise(12), of)
    assert s.is_noise
    assert s.rms == pytest.approx(NOISE, rel=0.05)


def test_films_are_looked_at_in_their_own_quantities():
    of = film_record_of(STRIP)
    rng = np.random.default_rng(13)
    white = of.noise * rng.standard_normal(of.time.size)
    s = look(white, of)
    assert [d.quantity for d in s.dependences] == ["stretch", "rate of stretch", "stress", "time"]
    assert s.is_noise
    s = look(white + 30.0 * of.noise * (of.stretch - 1.4) ** 2, of)
    assert named(s, "stretch").explained > 0.8
    assert "kPa RMS" in s.words[0]
