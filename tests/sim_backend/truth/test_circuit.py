"""The circuit of the hidden films against the same laws written out again and solved by SciPy."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import odeint
from scipy.interpolate import CubicHermiteSpline
from scipy.optimize import brentq

from dearig.model.film.material import TABLE_3, THESIS_FILM, THESIS_LOAD
from dearig.sim_backend.truth import cases
from dearig.sim_backend.truth.effects import electrode_resistance, leakage, loose_contact
from dearig.sim_backend.truth.effects import permittivity as of_a
from dearig.sim_backend.truth.film import FilmNumbers, rest_stretch
from dearig.sim_backend.truth.generator_b import dielectric as of_b
from dearig.sim_backend.truth.generator_b import electric
from dearig.sim_backend.truth.plant import TruthPlant
from dearig.sim_backend.truth.plumbing import relaxing

NUMBERS = FilmNumbers.of(THESIS_FILM, THESIS_LOAD, TABLE_3)
REST = rest_stretch(NUMBERS)
HEAVY = replace(NUMBERS, inertia=1e12)  # too heavy to move


def drawn(form, seed=0):
    return form(np.random.default_rng(seed), THESIS_LOAD)


def lobe(rate=1000.0, seconds=0.7, peak=8000.0):
    time = np.arange(round(seconds * rate) + 1) / rate
    return time, peak * np.sin(np.pi * time / seconds) ** 2


def followed(effects, time, voltage, numbers=NUMBERS):
    """The electricity, and the stretch at the ends of all intervals (2, M)."""
    motion, _ = TruthPlant.at_rest(numbers, effects).advance(time, voltage, True)
    stretch = REST + motion.displacement / numbers.length
    return motion.electricity, np.stack((stretch[:-1], stretch[1:])), motion


# m in um at 0.4 s and 2.9 s, computed before the circuit was one: what a rig hides, and how its
# film moves by it, must never change. Clean films, each electrical form, and pairs of them.
MOVED = {
    ("first", 2): (679.402369799, 407.076211350),
    ("first", 12): (566.641673142, 588.574726679),
    ("first", 16): (570.870925900, 678.045677300),
    ("first", 20): (633.044278023, 633.182527226),
    ("first", 23): (588.529551663, 360.528252316),
    ("first", 30): (515.803068484, 230.858499347),
    ("first", 41): (716.473411081, 791.418488144),
    ("first", 43): (613.100327843, 285.418740358),
    ("first", 50): (604.482733756, 406.014931873),
    ("first", 71): (620.723455711, 487.522055936),
    ("first", 82): (487.460610403, 251.843782830),
    ("first", 114): (687.930687166, 737.014468117),
    ("first", 121): (663.645998950, 508.714035509),
    ("first", 141): (688.989861825, 780.713593527),
    ("first", 295): (471.785567376, 600.966422051),
    ("first", 679): (466.162165162, 323.160179311),
    ("first", 757): (531.456024281, 450.195117990),
    ("first", 1065): (713.092139354, 745.587999512),
    ("first", 1327): (685.849747052, 800.028188714),
    ("first", 1712): (451.061022465, 155.163778365),
    ("second", 8): (1049.482658632, 656.949506570),
    ("second", 12): (566.184241263, 588.305147974),
    ("second", 23): (587.189457185, 358.576851795),
    ("second", 41): (690.443803164, 836.413814559),
    ("second", 43): (676.111058572, 338.114253569),
    ("second", 50): (583.322676166, 416.900188823),
    ("second", 71): (622.242282206, 487.732951931),
    ("second", 82): (495.134576864, 258.440295116),
    ("second", 114): (695.941573213, 715.425135584),
    ("second", 323): (485.495122445, 485.289495778),
    ("second", 295): (545.606794525, 608.635113754),
    ("second", 757): (537.007127891, 448.464863745),
    ("second", 850): (480.342393316, 220.409121065),
    ("second", 1327): (693.714133566, 811.131280389),
    ("second", 1724): (683.701151658, 495.457473770),
}


def test_films_of_old_seeds_move_as_they_did():
    time = np.arange(3001) * 1e-3
    voltage = 8000.0 * np.abs(np.sin(np.pi * 0.7 * time))
    for (generator, seed), expected in MOVED.items():
        case = cases.draw(seed, THESIS_FILM, THESIS_LOAD, generator=generator)
        motion, _ = case.plant().advance(time, voltage, True)
        np.testing.assert_allclose(
            motion.displacement[[400, 2900]] * 1e6, expected, atol=1e-6, err_msg=f"{seed}"
        )


def resistance(hidden, lam):
    """Of the first section in ohm, by the docstrings of the forms."""
    away, further = lam - REST, hidden.further
    if further.contact:
        return further.contact * (
            1.0 + further.contact_slope * away + further.contact_bend * away**2
        )
    return hidden.ladder_1 * math.exp(hidden.ladder_gauge * away)


def through(hidden, gap, lam):
    """Current in A through the first section across ``gap`` V."""
    r, scale = resistance(hidden, lam), hidden.further.contact_voltage
    return scale * math.sinh(gap / scale) / r if scale else gap / r


@pytest.mark.parametrize(
    "form",
    [
        electrode_resistance.ladder,
        electrode_resistance.percolating,
        electric.measured_gauge,
        electric.contacts,
    ],
)
def test_an_electrode_passes_the_current_of_its_own_circuit(form):
    """The charges of the sections are the state here, along the stretch of the film."""
    effect = drawn(form, 3)
    time, voltage = lobe()
    found, _, motion = followed((effect,), time, voltage)
    h = effect.on_film(NUMBERS).hidden
    stretch = CubicHermiteSpline(
        time, REST + motion.displacement / NUMBERS.length, motion.velocity / NUMBERS.length
    )
    sections = 2 if h.ladder_2 else 1

    def slope(t, q, v):
        lam = float(stretch(t))
        u = q * sections / (NUMBERS.capacitance * lam**2)
        into = through(h, v - u[0], lam)
        if sections == 1:
            return [into]
        on = (u[0] - u[1]) / (h.ladder_2 * math.exp(h.ladder_gauge * (lam - REST)))
        return [into - on, on]

    q = np.zeros(sections)
    charges, currents = np.zeros((2, time.size - 1)), np.zeros((2, time.size - 1))
    for k, v in enumerate(voltage[:-1]):
        charges[0, k], currents[0, k] = q.sum(), sum(slope(time[k], q, v))
        span = (time[k], time[k + 1])
        q = odeint(slope, q, span, args=(v,), tfirst=True, rtol=1e-8, atol=1e-15)[1]
        charges[1, k], currents[1, k] = q.sum(), sum(slope(time[k + 1], q, v))
    np.testing.assert_allclose(found.charge, charges, atol=1e-5 * charges.max())
    np.testing.assert_allclose(found.charging, currents, atol=1e-4 * np.abs(currents).max())
    assert np.abs(found.step).max() < 1e-12 * charges.max()  # nothing passes at once
    assert found.charging.max() > 3e-6
    np.testing.assert_array_equal(found.conduction, 0.0)


def test_a_slow_electrode_is_an_exponential():
    numbers = HEAVY.hiding(ladder_1=4e7)
    time = np.arange(60) * 1e-3
    found, _, _ = followed((), time, np.full(time.size, 5000.0), numbers)
    tau = 4e7 * NUMBERS.capacitance * REST**2
    np.testing.assert_allclose(
        found.charging[0], 5000.0 / 4e7 * np.exp(-time[:-1] / tau), rtol=1e-6
    )


def test_a_lagging_dielectric_absorbs_current():
    """A step on a film that does not move: each part of the polarisation is an exponential."""
    shares, times = np.array([0.05, 0.1, 0.08]), np.array([2e-6, 0.02, 0.3])
    time = np.arange(401) * 1e-3
    found, _, _ = followed((relaxing(shares, times, ""),), time, np.full(401, 5000.0), HEAVY)
    full = NUMBERS.capacitance * REST**2 * 5000.0
    slow, late = shares[1:, None], np.exp(-time / times[1:, None])
    np.testing.assert_allclose(found.charge[0], full * (1.0 - (slow * late).sum(axis=0)[:-1]))
    np.testing.assert_allclose(found.charge[1], full * (1.0 - (slow * late).sum(axis=0)[1:]))
    absorbed = full * (slow / times[1:, None] * late).sum(axis=0)
    np.testing.assert_allclose(found.charging[0], absorbed[:-1], rtol=1e-6)
    np.testing.assert_allclose(found.charging[1], absorbed[1:], rtol=1e-6)
    assert found.step[0] == pytest.approx(full * (1.0 - shares[1:].sum()))
    assert np.abs(found.step[1:]).max() < 1e-12 * full


def conducted(h, v, lam):
    """Current in A through the film, by the docstrings of the forms."""
    g, further = h.leak_conductance, h.further
    if h.leak_hopping:
        k = h.leak_hopping * lam
        return g / k * math.sinh(k * v)
    if h.leak_space:
        return g * v**2 * lam**4 / h.leak_space
    if h.leak_tunnel:
        return g * v**2 / h.leak_tunnel * math.exp(-h.leak_tunnel / (v * lam))
    if further.trap_voltage:
        return g * v * (1.0 + (v * lam / further.trap_voltage) ** further.trap_exponent)
    return g * v * math.exp(h.leak_frenkel * math.sqrt(v * lam))


@pytest.mark.parametrize(
    "form",
    [
        leakage.poole_frenkel,
        leakage.hopping,
        leakage.space_charge,
        leakage.tunnelling,
        electric.trap_filled,
    ],
)
def test_a_leak_is_a_steady_current_through_film_and_resistance(form):
    effect = drawn(form, 5)
    h = effect.on_film(NUMBERS).hidden
    time = np.arange(11) * 1e-3
    for volts in (2000.0, -3000.0, 8000.0):
        held = np.full(time.size, volts)
        found, _, _ = followed((effect,), time, held, HEAVY)

        def gained(v):
            return v + h.leak_series * conducted(h, v, REST)

        size = abs(volts)
        v = brentq(lambda v, size=size: gained(v) - size, 1e-6, size, xtol=1e-9)
        sign = math.copysign(1.0, volts)
        np.testing.assert_allclose(found.voltage, sign * v, rtol=1e-9)
        np.testing.assert_allclose(
            found.conduction, sign * conducted(h, v, REST), rtol=1e-6, atol=1e-15
        )
        np.testing.assert_allclose(found.charge, NUMBERS.capacitance * REST**2 * sign * v)
        np.testing.assert_allclose(found.charging, 0.0, atol=1e-13)
    assert found.lag == pytest.approx(h.leak_series * NUMBERS.capacitance * REST**2)


def eps(h, v, lam):
    """Factor on the permittivity, by the docstrings of the forms."""
    away, field2, further = lam - REST, (v * lam) ** 2, h.further
    if h.permittivity_strain:
        u = away / h.permittivity_reach
        return 1.0 + h.permittivity_strain * u / np.sqrt(1.0 + u**2)
    if h.permittivity_field:
        return 1.0 / (1.0 + h.permittivity_field * field2)
    if further.johnson:
        return (1.0 + 3.0 * further.johnson * field2) ** (-1.0 / 3.0)
    if further.booth:
        u = np.maximum(np.sqrt(field2 / further.booth_square), 1e-3)
        return 1.0 - further.booth * (1.0 - 3.0 / u * (1.0 / np.tanh(u) - 1.0 / u))
    return 1.0 + further.peak_slope * away + further.peak_bend * away**2


@pytest.mark.parametrize(
    "form", [of_a.with_strain, of_a.with_field, of_b.booth, of_b.johnson, of_b.peaked]
)
def test_the_charge_has_the_permittivity_that_pulls_the_film(form):
    effect = drawn(form, 4)
    h = effect.on_film(NUMBERS).hidden
    time, voltage = lobe()
    found, lam, _ = followed((effect,), time, voltage)
    expected = NUMBERS.capacitance * lam**2 * eps(h, voltage[:-1], lam) * voltage[:-1]
    np.testing.assert_allclose(found.charge, expected, rtol=1e-6, atol=1e-15)
    before = np.append(0.0, expected[1, :-1])
    np.testing.assert_allclose(found.step, expected[0] - before, atol=1e-13)
    mean = np.diff(expected, axis=0)[0] / np.diff(time)
    np.testing.assert_allclose(found.charging.mean(axis=0), mean, atol=0.03 * np.abs(mean).max())


def test_pairs_of_electrical_effects_charge_the_film_by_both():
    """What either does to the charge adds up, to second order in their sizes."""
    time, voltage = lobe(seconds=1.5)
    electrode, film = drawn(electrode_resistance.percolating, 8), drawn(of_a.with_field, 1)
    slow, leak = relaxing(np.array([0.05]), np.array([0.1]), ""), drawn(leakage.hopping, 2)

    middle = np.flatnonzero(voltage[:-1] > 2000.0)

    def flow(*effects):
        found, _, _ = followed(effects, time, voltage)
        return found.charge[1, middle]

    plain = flow()
    for pair in ((electrode, film), (electrode, slow), (slow, film), (leak, slow), (leak, film)):
        sizes = [flow(effect) / plain for effect in pair]
        both, product = flow(*pair) / plain, sizes[0] * sizes[1]
        first, second = (np.abs(size - 1.0).max() for size in sizes)
        # the field law goes with the square of the voltage
        assert np.abs(both - product).max() < 2.0 * first * second
        assert np.abs(both - 1.0).max() > 0.5 * max(first, second)


def test_a_loose_contact_draws_its_charge_when_it_closes_and_returns_none():
    effect = drawn(loose_contact.loose_contact, 6)
    rise = np.linspace(0.0, 5000.0, 501)
    voltage = np.concatenate((rise, rise[::-1], [0.0]))
    time = np.arange(voltage.size) * 1e-3
    found, _, _ = followed((effect,), time, voltage)
    on = np.flatnonzero(found.voltage[0])
    assert found.step[on[0]] == pytest.approx(found.charge[0, on[0]])
    assert np.argmax(found.step) == on[0]
    opened = on[-1] + 1
    assert found.step[opened] == 0.0 == found.charge[0, opened]
    np.testing.assert_array_equal(found.output[0], voltage[:-1])
