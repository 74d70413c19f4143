"""Generator B's laws against the formulas of their sources."""

import math

import numpy as np
import pytest
from scipy import signal
from scipy.integrate import solve_ivp

from dearig.model.film.material import TABLE_3, THESIS_FILM, THESIS_LOAD
from dearig.sim_backend.truth import generator_b_laws
from dearig.sim_backend.truth import kernels as loops
from dearig.sim_backend.truth.film import FilmNumbers, rest_stretch
from dearig.sim_backend.truth.generator_b import dielectric, electric, film, load, sensor
from dearig.sim_backend.truth.generator_b.spectrum import asymmetric, stretched_exponential
from dearig.sim_backend.truth.generator_b_laws import Second
from dearig.sim_backend.truth.plant import TruthPlant
from dearig.sim_backend.truth.supply import Supply

NUMBERS = FilmNumbers.of(THESIS_FILM, THESIS_LOAD, TABLE_3)
REST = rest_stretch(NUMBERS)


def drawn(form, seed=0):
    return form(np.random.default_rng(seed), THESIS_LOAD)


def law(form, seed=0):
    return drawn(form, seed).on_film(NUMBERS).hidden.further


def stress(s, lam=REST, rate=0.0, state=(0.0, 0.0, 0.0)):
    """Stress in Pa against the motion, and the slopes of the states."""
    slopes = np.full(generator_b_laws.STATES, np.nan)
    found = generator_b_laws.added_stress(s, np.array(state), 0, lam, rate, REST, slopes)
    return found, slopes


def test_nothing_is_added_without_a_law():
    found, slopes = stress(generator_b_laws.NOTHING, REST + 0.01, 0.1)
    assert found == 0.0
    assert not slopes.any()
    assert generator_b_laws.wholeness(generator_b_laws.NOTHING, 1.4, REST, REST) == 1.0
    assert generator_b_laws.healed(generator_b_laws.NOTHING, 1.4, REST, 9.0) == 1.4
    assert generator_b_laws.permittivity_factor(generator_b_laws.NOTHING, 64e6, 1.3, REST) == 1.0
    assert generator_b_laws.fastest_decay(generator_b_laws.NOTHING, 0.5) == 0.0


@pytest.mark.parametrize("seed", range(3))
def test_perzyna_flows_with_the_power_of_what_is_beyond_the_threshold(seed):
    s = law(film.perzyna, seed)
    reach = s.flow_yield / s.flow_spring
    for part in (0.5, 1.0, 1.5, 3.0):
        found, slopes = stress(s, state=(part * reach, 0.0, 0.0))
        assert found == pytest.approx(part * s.flow_yield / REST)
        flow = s.flow_rate * max(part - 1.0, 0.0) ** s.flow_exponent
        assert slopes[0] == pytest.approx(-flow, abs=1e-12)


def test_bodner_and_partom_flow_at_any_stress_but_hardly_below_some():
    s = law(film.bodner_partom)
    strain = s.flow_yield / s.flow_spring
    _, at_its_stress = stress(s, state=(-strain, 0.0, 0.0))
    assert at_its_stress[0] == pytest.approx(s.flow_limit * math.exp(-0.5))
    _, below = stress(s, state=(0.1 * strain, 0.0, 0.0))
    assert 0.0 < -below[0] < 1e-3 * s.flow_limit


def test_what_is_drawn_is_what_a_steady_pull_gives():
    # the element bears the drawn stress at a hundredth of the limiting rate
    s, rate = law(film.bodner_partom, 3), 0.01 * law(film.bodner_partom, 3).flow_limit
    steady = solve_ivp(
        lambda _, y: [rate - generator_b_laws._flow(s, s.flow_spring * y[0])],
        (0.0, 20.0 * s.flow_yield / s.flow_spring / rate),
        [0.0],
        "Radau",
    ).y[0, -1]
    words = drawn(film.bodner_partom, 3).description
    expected = float(words.split("at some ")[1].split(" Pa")[0])
    assert s.flow_spring * steady / 1.2 == pytest.approx(expected, rel=0.02)


def test_a_branch_flows_with_a_power_of_its_stress_and_slows_down():
    s = law(film.bergstrom_boyce)
    _, fresh = stress(s, REST * math.exp(0.01), state=(0.0, 0.01, 0.0))
    held = s.chain_spring * math.sinh(0.02)
    assert fresh[1] == pytest.approx(-s.chain_rate * (held / s.chain_stress) ** s.chain_exponent)
    _, flowed = stress(s, REST * math.exp(0.11), state=(0.0, 0.01, 0.0))
    assert 0.0 < -flowed[1] < -fresh[1]


def test_drags_and_friction_are_their_formulas():
    for rate in (-0.2, -1e-3, 0.0, 1e-4, 0.05):
        s = law(load.carreau)
        thinned = (1.0 + (rate / s.carreau_rate) ** 2) ** ((s.carreau_exponent - 1.0) / 2.0)
        assert stress(s, rate=rate)[0] == pytest.approx(s.carreau * thinned * rate)
        s = law(load.naumann)
        more = 1.0 + 0.15 * abs(rate / s.naumann_rate) ** 0.687
        assert stress(s, rate=rate)[0] == pytest.approx(s.naumann * more * rate)
        s = law(load.makkar)
        rise, fall = math.tanh(rate / s.makkar_rise), math.tanh(rate / s.makkar_fall)
        expected = s.makkar * (rise + s.makkar_excess * (rise - fall))
        assert stress(s, rate=rate)[0] == pytest.approx(expected)


def test_a_drag_by_a_power_below_one_is_that_within_the_lobes():
    s = law(load.ostwald)
    slow, fast = (stress(s, rate=r)[0] for r in (0.03, 0.06))
    assert math.log2(fast / slow) == pytest.approx(s.carreau_exponent, abs=0.01)


def test_the_loops_centre_line_is_where_no_loop_is_left():
    s = law(film.coleman_hodgdon)
    away = 0.5 * s.duhem_width
    centre = s.duhem_level * math.tanh(0.5)
    for way in (-1.0, 1.0):
        _, slopes = stress(s, REST + away, way, (0.0, 0.0, centre))
        assert slopes[2] == pytest.approx(way / s.duhem_reach)


def test_softening_is_by_the_largest_energy_and_heals():
    s = law(film.ogden_roxburgh)
    lam, farthest = REST + 0.01, REST + 0.025
    energy = generator_b_laws._strain(farthest) - generator_b_laws._strain(lam)
    assert energy == pytest.approx(0.5 * (farthest**2 + farthest**-2 - lam**2 - lam**-2))
    whole = generator_b_laws.wholeness(s, farthest, lam, REST)
    assert whole == pytest.approx(1.0 - s.roxburgh * math.erf(energy / s.roxburgh_width))
    left = generator_b_laws.healed(s, farthest, lam, 0.5 * s.heal_time) - lam
    assert left == pytest.approx(0.015 * math.exp(-0.5))
    assert generator_b_laws.healed(s, lam, farthest, 1.0) == farthest
    s = law(film.simo)
    energy = generator_b_laws._strain(farthest) - generator_b_laws._strain(REST)
    whole = generator_b_laws.wholeness(s, farthest, REST, REST)
    assert whole == pytest.approx(1.0 - s.simo * (1.0 - math.exp(-energy / s.simo_strain)))


def test_permittivities_are_their_formulas():
    square, lam = 7e3**2, 1.22
    s = law(dielectric.johnson)
    found = generator_b_laws.permittivity_factor(s, square, lam, REST)
    assert found == pytest.approx((1.0 + 3.0 * s.johnson * square * lam**2) ** (-1.0 / 3.0))
    s = law(dielectric.booth)
    u = math.sqrt(square * lam**2 / s.booth_square)
    langevin = 1.0 / math.tanh(u) - 1.0 / u
    found = generator_b_laws.permittivity_factor(s, square, lam, REST)
    assert found == pytest.approx(1.0 - s.booth * (1.0 - 3.0 * langevin / u))
    # no jump where the series takes over
    edge = 1e-4 * s.booth_square / lam**2
    below, above = (
        generator_b_laws.permittivity_factor(s, edge * f, lam, REST) for f in (0.999, 1.001)
    )
    assert above == pytest.approx(below, abs=1e-7)


@pytest.mark.parametrize("exponent", [0.35, 0.5, 0.75])
def test_terms_follow_the_stretched_exponential(exponent):
    weights, times = stretched_exponential(exponent)
    assert weights.sum() == pytest.approx(1.0)
    t = np.geomspace(3e-3, 10.0, 50)
    np.testing.assert_allclose(
        np.exp(-t[:, None] / times) @ weights, np.exp(-(t**exponent)), atol=0.01
    )


@pytest.mark.parametrize(("a", "b"), [(0.5, 0.3), (0.7, 0.5), (0.85, 0.7)])
def test_terms_follow_havriliak_and_negami(a, b):
    weights, times = asymmetric(a, b)
    for omega in (0.05, 1.0, 20.0):
        found = np.sum(weights / (1.0 + 1j * omega * times))
        assert abs(found - (1.0 + (1j * omega) ** a) ** -b) < 0.04


def test_amplifiers_lose_what_they_say():
    for form, sign in ((electric.tanh_stage, 1.0), (electric.intercept, None)):
        effect = drawn(form, 2)
        full = np.array([8000.0])
        out = effect.on_voltage(np.zeros(1), Supply(full, full, full), None)[0].pull
        said = [float(w.strip("%")) / 100.0 for w in effect.description.split() if "%" in w]
        lost = said[0] if sign else -sum(said)
        assert out[0] == pytest.approx(8000.0 * (1.0 - lost), abs=8.0)


def test_a_pair_that_slews_is_its_equation():
    time, slew, delay = np.arange(81) * 1e-3, 4e4, 8e-3
    voltage = np.where(time < 0.04, 900.0, -100.0)
    effective, starts = np.empty((2, time.size))
    end = loops.follow_pair(time, voltage, slew, delay, 0.0, effective, starts)
    exact = solve_ivp(
        lambda t, y: slew * np.tanh(((900.0 if t < 0.04 else -100.0) - y) / slew / delay),
        (0.0, 0.08), [0.0], "DOP853", time, rtol=1e-10, atol=1e-9, max_step=1e-3,
    ).y[0]  # fmt: skip
    assert end == starts[-1]
    np.testing.assert_allclose(starts, exact, atol=0.5)


def motion(rate=1000.0, seconds=1.0):
    time = np.arange(round(rate * seconds) + 1) / rate
    omega = 2.0 * np.pi * 5.0
    return time, np.stack((1.0 - np.cos(omega * time), omega * np.sin(omega * time))) * 1e-3


@pytest.mark.parametrize("age", [0.3e-3, 7.7e-3, 0.04])
def test_a_delayed_reading_is_the_earlier_one(age):
    time, rows = motion()
    out = np.empty_like(rows)
    loops.delayed(time, rows, 0, age, out)
    then = np.maximum(time - age, 0.0)
    np.testing.assert_allclose(out[0], 1e-3 * (1.0 - np.cos(10.0 * np.pi * then)), atol=1e-10)


def test_a_butterworth_filter_is_the_textbooks():
    time, rows = motion()
    omega = 60.0
    out = np.empty_like(rows)
    loops.second_order(time, rows, omega, math.sqrt(0.5), np.zeros(2), out)
    b, a = signal.butter(2, omega, analog=True)
    fine = np.linspace(0.0, 1.0, 20001)
    _, expected, _ = signal.lsim((b, a), 1e-3 * (1.0 - np.cos(10.0 * np.pi * fine)), fine)
    np.testing.assert_allclose(out[0], expected[::20], atol=2e-8)


def test_a_walk_spreads_with_the_root_of_time():
    time = np.array([0.0, 6.25, 25.0])
    walks = np.array(
        [
            sensor._walk(1e-5, np.random.default_rng(seed)).on_motion(time, np.zeros((2, 3)), None)[
                0
            ][0]
            for seed in range(400)
        ]
    )
    np.testing.assert_allclose(walks.std(axis=0), [0.0, 5e-6, 1e-5], rtol=0.15)


def test_a_levers_energy_is_kept():
    """Without springs' losses: the work of the load goes into the lever and the springs."""
    elastic = FilmNumbers.of(THESIS_FILM, THESIS_LOAD, TABLE_3)
    elastic = load.lever(np.random.default_rng(1), THESIS_LOAD).on_film(elastic)
    plant = TruthPlant.at_rest(
        type(elastic)(
            **{
                **vars(elastic),
                "moduli": elastic.moduli[:1],
                "times": (),
                "limits": elastic.limits[:1],
            }
        )
    )
    time = np.arange(4001) * 2.5e-4
    x = plant.advance(time, np.full(time.size, 5000.0), True)[0].displacement
    # swings between rest and one and the same turning point, again and again
    peaks = x[signal.find_peaks(x)[0]]
    assert peaks.size >= 4
    np.testing.assert_allclose(peaks, peaks[0], rtol=2e-4)
    assert x[signal.find_peaks(-x)[0]].max() < 1e-3 * peaks[0]


def test_trapped_charge_leaks_ohmically_and_then_by_a_power():
    hidden = drawn(electric.trap_filled).on_film(NUMBERS).hidden
    s = hidden.further
    for v in (1e-2 * s.trap_voltage, s.trap_voltage, 3.0 * s.trap_voltage):
        current, slope = generator_b_laws.trap_leak(s, hidden.leak_conductance, v, 1.0)
        expected = hidden.leak_conductance * v * (1.0 + (v / s.trap_voltage) ** s.trap_exponent)
        assert current == pytest.approx(expected)
        nearby, _ = generator_b_laws.trap_leak(s, hidden.leak_conductance, 1.0001 * v, 1.0)
        assert slope == pytest.approx((nearby - current) / (1e-4 * v), rel=1e-3)


def test_defaults_of_a_law_are_none():
    assert Second() == generator_b_laws.NOTHING
    assert NUMBERS.at_rest(REST).y.size + generator_b_laws.STATES == (
        NUMBERS.obeying(naumann=1.0).at_rest(REST).y.size
    )
