"""The truth's effects one by one: carried on exactly, integrated exactly, and what they claim."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from scipy import signal
from scipy.integrate import solve_ivp

from dearig.model.film.material import TABLE_3, THESIS_FILM, THESIS_LOAD
from dearig.sim_backend.truth import film
from dearig.sim_backend.truth import kernels as loops
from dearig.sim_backend.truth.effects import end_stop, interference, loose_contact, sudden, thermal
from dearig.sim_backend.truth.film import NO_COURSE, FilmNumbers, Hidden
from dearig.sim_backend.truth.plant import TruthPlant
from dearig.sim_backend.truth.supply import Supply
from tests.deep import one_of_each
from tests.sim_backend.truth.test_cases import FORMS

NUMBERS = FilmNumbers.of(THESIS_FILM, THESIS_LOAD, TABLE_3)
ROWS = ("displacement", "velocity", "heating")
CURRENTS = ("output", "voltage", "charge", "step", "charging", "conduction")


def drawn(form, seed=0):
    return form(np.random.default_rng(seed), THESIS_LOAD)


def lobes(rate, seconds, hertz=0.7, peak=8000.0):
    time = np.arange(round(seconds * rate) + 1) / rate
    return time, peak * np.abs(np.sin(np.pi * hertz * time))


@pytest.mark.parametrize(
    ("family", "form"), one_of_each(FORMS, lambda p: (p.id.split("-")[0], p.values[0]))
)
def test_carrying_on_is_the_same_as_going_through(family, form):
    time, voltage = lobes(250.0, 11.0)
    plant = TruthPlant.at_rest(NUMBERS, (drawn(form),))
    whole, _ = plant.advance(time, voltage, True)
    pieces = []
    for first, last in ((0, 1), (1, 700), (700, 1801), (1801, time.size - 1)):
        # what will be put out at the last node is not known yet, and must not matter
        known = voltage[first : last + 1].copy()
        known[-1] = known[-2]
        unused, _ = plant.advance(time[first : last + 1], known, True)
        motion, plant = plant.advance(time[first : last + 1], known, True)
        np.testing.assert_array_equal(motion.displacement, unused.displacement)
        pieces.append(motion)
    for row in ROWS:
        parts = [getattr(piece, row)[:-1] for piece in pieces[:-1]]
        joined = np.concatenate([*parts, getattr(pieces[-1], row)])
        np.testing.assert_array_equal(joined, getattr(whole, row))
    for row in CURRENTS:
        parts = [getattr(piece.electricity, row) for piece in pieces]
        np.testing.assert_array_equal(
            np.concatenate(parts, axis=-1), getattr(whole.electricity, row)
        )


def edges(rate=1000.0, seconds=0.3):
    """A rise in 20 ms, a fast sine and a fall: held, so that every node has a corner."""
    time = np.arange(round(seconds * rate) + 1) / rate
    level = np.clip(np.minimum(time - 0.02, seconds - 0.06 - time) / 0.02, 0.0, 1.0)
    return time, level * (6500.0 + 1500.0 * np.sin(2.0 * np.pi * 6.0 * time))


def oracle(numbers, time, voltage, pieces):
    """Displacement in m by DOP853 over each of ``pieces`` of every interval."""
    rest = film.rest_stretch(numbers)
    state = numbers.at_rest(rest)
    y, memory = state.y.copy(), state.memory.copy()
    body, springs, slipping = numbers.body(rest), numbers.springs(), numbers.slipping()
    stretch = [rest]
    for k in range(time.size - 1):

        def slope(t, y, v=voltage[k]):
            dy = np.empty_like(y)
            film._derivative(
                body, numbers.hidden, springs, slipping, memory, y, v, *NO_COURSE[:3], dy
            )
            return dy

        knots = np.linspace(time[k], time[k + 1], pieces + 1)
        for start, end in itertools.pairwise(knots):
            found = solve_ivp(slope, (start, end), y, "DOP853", rtol=1e-9, atol=1e-12)
            assert found.success
            y = found.y[:, -1]
            moved = y[0] - memory[film._START]
            memory[film._SLIPPED :] = np.clip(
                memory[film._SLIPPED :] + moved, -slipping[0], slipping[0]
            )
            memory[film._START] = y[0]
            memory[film._LARGEST] = max(memory[film._LARGEST], y[0])
            if numbers.hidden.further.heal_time and memory[film._LARGEST] > y[0]:
                left = math.exp(-(end - start) / numbers.hidden.further.heal_time)
                memory[film._LARGEST] = y[0] + (memory[film._LARGEST] - y[0]) * left
        stretch.append(y[0])
    return (np.array(stretch) - rest) * numbers.length


ON_FILM = [p for p in FORMS if drawn(p.values[1]).on_film is not None]


# m: what slips within micrometres, or sets in within a small rate, is as exact as the steps of both
COARSER = {"maxwell_slip": 0.3e-6, "makkar": 0.2e-6}


@pytest.mark.parametrize(("family", "form"), one_of_each(ON_FILM, lambda p: p.values[0]))
def test_the_film_is_integrated_to_a_twentieth_of_a_micrometre(family, form):
    time, voltage = edges()
    numbers = drawn(form, 1).on_film(NUMBERS)
    # memory changes between steps: the oracle gets shorter ones
    hidden = numbers.hidden
    remembers = numbers.stops or hidden.damage or hidden.further.roxburgh or hidden.further.simo
    expected = oracle(numbers, time, voltage, 4 if remembers else 1)
    motion, _ = TruthPlant.at_rest(numbers).advance(time, voltage, True)
    assert np.abs(motion.displacement - expected).max() < COARSER.get(form.__name__, 0.05e-6)
    assert np.ptp(expected) > 3e-4


def _form(name):
    (form,) = [p.values[1] for p in FORMS if p.values[1].__name__ == name]
    return form


def everything():
    """A film with an effect of every kind in it that acts within the equation of motion."""
    numbers = NUMBERS
    names = "ladder hopping with_strain with_field broad first_loading ageing self_heating iwan"
    for name in f"{names} bouc_wen hung mixed elasto_plastic end_stop hanger".split():
        numbers = drawn(_form(name), 2).on_film(numbers)
    return numbers.hiding(friction_easing=1.3)


def test_everything_at_once_is_integrated_as_well():
    time, voltage = edges(seconds=0.2)
    numbers = everything()
    expected = oracle(numbers, time, voltage, 4)
    motion, _ = TruthPlant.at_rest(numbers).advance(time, voltage, True)
    assert np.abs(motion.displacement - expected).max() < 0.05e-6


@pytest.mark.deep
def test_its_own_steps_have_converged():
    time, voltage = lobes(1000.0, 3.0)
    for family, form in (p.values for p in ON_FILM):
        numbers = drawn(form, 3).on_film(NUMBERS)
        coarse = TruthPlant.at_rest(numbers).advance(time, voltage, True)[0].displacement
        finer = replace(numbers, step=numbers.step / 6.0)
        fine = TruthPlant.at_rest(finer).advance(time, voltage, True)[0].displacement
        assert np.abs(fine - coarse).max() < 0.02e-6, (family, form.__name__)


@pytest.mark.parametrize("kind", ["bouc_wen", "iwan", "lognormal_stops", "coleman_hodgdon"])
def test_a_rate_independent_loop_stays_when_run_slowly(kind):
    """On a film without relaxation, up and down differ by as much at a fifth of the speed."""
    elastic = replace(NUMBERS, moduli=NUMBERS.moduli[:1], limits=NUMBERS.limits[:1], times=())
    plant = TruthPlant.at_rest(drawn(_form(kind), 4).on_film(elastic))
    widths = []
    for hertz in (0.5, 0.1):
        time, voltage = lobes(2000.0 * hertz, 2.0 / hertz, hertz)
        x = plant.advance(time, voltage, True)[0].displacement
        peak = time.size // 4 + time.size // 2
        up, down = x[time.size // 2 : peak], x[peak + 1 :][::-1]
        widths.append(np.abs(down[: up.size] - up[: down.size]).max())
    assert widths[0] > 1e-6
    assert widths[1] == pytest.approx(widths[0], rel=0.1)


def test_elastic_bristles_hold_what_lugre_lets_creep():
    """A swinging force below breakaway moves the load on with LuGre, and not without its slip."""
    time = np.arange(8001) * 1e-3
    elastic = replace(NUMBERS, moduli=NUMBERS.moduli[:1], limits=NUMBERS.limits[:1], times=())
    voltage = np.sqrt(2.4e6 + 0.6e6 * np.sin(2.0 * np.pi * 4.0 * time)) * np.minimum(time, 1.0)
    moved = {}
    for share in (0.0, 0.8):
        stuck = elastic.hiding(
            friction=1500.0,
            friction_static=1500.0,
            friction_reach=2e-4,
            friction_damping=5.0,
            friction_elastic=share,
        )
        x = TruthPlant.at_rest(stuck).advance(time, voltage, True)[0].displacement
        moved[share] = abs(x[7000:].mean() - x[2000:3000].mean())
    assert moved[0.0] > 1e-6
    assert moved[0.8] < 0.02 * moved[0.0]


@pytest.mark.parametrize(
    ("form", "left"),
    [("lugre", math.exp(-4.0)), ("tustin", math.exp(-2.0)), ("oiled", 1.0 / 5.0)],
)
def test_what_eases_with_speed_is_lost_as_the_law_says(form, left):
    hidden = drawn(_form(form), 3).on_film(NUMBERS).hidden
    level = hidden.friction + left * (hidden.friction_static - hidden.friction)
    bent = level / hidden.friction * hidden.friction_reach
    # at twice the rate of its law, bristles bent like that bend no further
    stress, speed = film._bristles(hidden, bent, 2.0 * hidden.friction_stribeck)
    assert stress == pytest.approx(level, rel=1e-12)
    assert speed == pytest.approx(0.0, abs=1e-12 * hidden.friction_stribeck)


def test_electrode_charges_as_a_capacitor_does():
    """A film too heavy to move: one section charges with R C, the ladder with its own matrix."""
    heavy = replace(NUMBERS, inertia=1e9)
    time = np.arange(41) * 1e-3
    voltage = np.full(time.size, 5000.0)
    c = heavy.capacitance * film.rest_stretch(heavy) ** 2
    for hidden, matrix in (
        (Hidden(ladder_1=4e7), [[-1.0 / (4e7 * c)]]),
        (
            Hidden(ladder_1=3e7, ladder_2=5e7),
            [
                [-2.0 / c * (1 / 3e7 + 1 / 5e7), 2.0 / c / 5e7],
                [2.0 / c / 5e7, -2.0 / c / 5e7],
            ],
        ),
    ):
        plant = TruthPlant.at_rest(replace(heavy, hidden=hidden))
        _, after = plant.advance(time, voltage, True)
        values, vectors = np.linalg.eig(np.array(matrix))
        start = np.full(values.size, -5000.0)
        gap = vectors @ (np.exp(values * time[-1]) * np.linalg.solve(vectors, start))
        sections = after.state.y[film._SECTION_1 :][: values.size]
        np.testing.assert_allclose(sections, 5000.0 + gap, rtol=1e-6)


def test_polarisation_follows_late_and_in_full():
    time = np.arange(2001) * 1e-3
    shares, times = np.array([0.1, 0.2]), np.array([0.05, 0.3])
    effective = np.empty(time.size)
    slow, held = np.zeros(2), np.full(time.size, 100.0)
    bound, creep = np.empty((2, 2, time.size))
    ends = np.stack((held, held))
    loops.polarise(time, held, ends, shares, times, slow, effective, bound, creep)
    late = (shares[:, None] * np.exp(-(time + 5e-4) / times[:, None])).sum(axis=0)
    np.testing.assert_allclose(effective[:-1] ** 2, 1e4 * (1.0 - late[:-1]), rtol=1e-4)
    missing = shares[:, None] * np.exp(-time / times[:, None])
    polarised, rate = 1.0 - missing.sum(axis=0), (missing / times[:, None]).sum(axis=0)
    for end, nodes in enumerate((slice(None, -1), slice(1, None))):
        np.testing.assert_allclose(bound[end, :-1], 100.0 * polarised[nodes], rtol=1e-10)
        np.testing.assert_allclose(creep[end, :-1], 100.0 * rate[nodes], rtol=1e-9)
    np.testing.assert_allclose(slow, 100.0 * (1.0 - np.exp(-2.0 / times)), rtol=1e-12)


def test_slew_is_a_straight_line_up_to_the_command():
    time = np.arange(11) * 1e-3
    effective, starts = np.empty((2, 11))
    end = loops.limit_slew(time, np.full(11, 50.0), 1e4, 0.0, effective, starts)
    assert end == 50.0
    np.testing.assert_allclose(starts, np.minimum(10.0 * np.arange(11), 50.0))
    middle = np.array([5.0, 15.0, 25.0, 35.0, 45.0])
    np.testing.assert_allclose(effective[:5], np.sqrt(middle**2 + 100.0 / 12.0))
    np.testing.assert_array_equal(effective[5:], 50.0)


def test_second_order_amplifier_is_the_textbooks():
    time = np.arange(301) * 1e-3
    w, d = 60.0, 0.6
    output, effective, starts = np.zeros(2), np.empty(time.size), np.empty(time.size)
    voltage = np.full(time.size, 1000.0)
    loops.lag_voltage(time, voltage, w, d, output, effective, starts)
    _, step = signal.step(signal.TransferFunction([w * w], [1.0, 2.0 * d * w, w * w]), T=time)
    np.testing.assert_allclose(effective[:-1], 500.0 * (step[1:] + step[:-1]), atol=1e-6)
    np.testing.assert_allclose(starts, 1000.0 * step, atol=1e-6)
    assert output[0] == pytest.approx(1000.0 * step[-1], abs=1e-6)


def motion(rate=1000.0, seconds=1.0):
    time = np.arange(round(rate * seconds) + 1) / rate
    omega = 2.0 * np.pi * 5.0
    return time, np.stack((1.0 - np.cos(omega * time), omega * np.sin(omega * time))) * 1e-3


def test_moving_average_is_the_mean_of_what_was():
    time, rows = motion()
    window, omega = 0.0237, 2.0 * np.pi * 5.0
    out = np.empty_like(rows)
    loops.moving_average(time, rows, 0, window, out)
    begin = np.maximum(time - window, 0.0)
    area = 1e-3 * (time - begin - (np.sin(omega * time) - np.sin(omega * begin)) / omega)
    np.testing.assert_allclose(out[0], area / window, atol=1e-10)
    np.testing.assert_allclose(np.gradient(out[0], time)[50:-50], out[1, 50:-50], atol=1e-4)


def test_low_pass_is_two_lags():
    time, rows = motion()
    tau = 0.02
    expected = signal.lsim(
        signal.TransferFunction([1.0], [tau * tau, 2.0 * tau, 1.0]), rows[0], time
    )[1]
    out = rows.copy()
    loops.low_pass(time, out, tau, np.zeros(2))
    # it takes the first lag's output for straight between nodes, too
    np.testing.assert_allclose(out[0], expected, atol=1.5e-7)
    np.testing.assert_allclose(np.gradient(out[0], time)[2:-2], out[1, 2:-2], atol=2e-4)


def test_the_stand_sways_by_its_own_equation():
    time, rows = motion()
    w, d, g, omega = 2.0 * np.pi * 6.0, 0.04, 0.8, 2.0 * np.pi * 5.0

    def slope(t, s):
        pushed = g * 1e-3 * omega**2 * math.cos(omega * t)
        return [s[1], -2.0 * d * w * s[1] - w * w * s[0] - pushed]

    expected = solve_ivp(slope, (0.0, 1.0), [0.0, 0.0], t_eval=time, rtol=1e-10, atol=1e-14)
    out = np.empty_like(rows)
    loops.sway(time, rows, w, d, g, np.zeros(2), out)
    np.testing.assert_allclose(out[0], expected.y[0], atol=1e-8)
    np.testing.assert_allclose(out[1], expected.y[1], atol=1e-6)


def test_a_stop_is_felt_where_it_is_and_not_before():
    time, voltage = lobes(1000.0, 3.0)
    plain, _ = TruthPlant.at_rest(NUMBERS).advance(time, voltage, True)
    stopped = drawn(end_stop.end_stop).on_film(NUMBERS)
    touched, _ = TruthPlant.at_rest(stopped).advance(time, voltage, True)
    travel = stopped.hidden.stop_travel * stopped.length
    first = int(np.argmax(plain.displacement > travel))
    assert first > 0
    np.testing.assert_array_equal(plain.displacement[:first], touched.displacement[:first])
    assert touched.displacement.max() < plain.displacement.max() - 1e-5


@pytest.mark.parametrize("form", [sudden.load_slips, sudden.electrode_tears, sudden.mount_slips])
def test_what_gives_way_does_so_at_one_moment(form):
    time, voltage = lobes(500.0, 12.0)
    plain, _ = TruthPlant.at_rest(NUMBERS).advance(time, voltage, True)
    given, _ = TruthPlant.at_rest(NUMBERS, (drawn(form),)).advance(time, voltage, True)
    differs = np.flatnonzero(given.displacement != plain.displacement)
    assert 4.5 <= time[differs[0]] <= 10.6
    assert np.all(np.diff(differs) == 1)


def test_a_torn_electrode_has_less_charge_and_the_amplifier_gets_none_back():
    time, voltage = lobes(500.0, 12.0)
    effect = drawn(sudden.electrode_tears)
    torn, _ = TruthPlant.at_rest(NUMBERS, (effect,)).advance(time, voltage, True)
    electricity = torn.electricity
    start, end = electricity.charge
    held = voltage[:-1] > 100.0
    capacitance = (start / np.where(held, voltage[:-1], 1.0))[held]
    drop = 1.0 - np.exp(np.diff(np.log(capacitance)).min())
    lost = float(effect.description.split("%")[0].split()[-1]) / 100.0
    assert drop == pytest.approx(lost, rel=0.1)
    missing = np.append(0.0, end[:-1]) + electricity.step - start
    moment = np.argmax(missing)
    assert missing[moment] == pytest.approx(lost * end[moment - 1], rel=1e-3)
    assert np.abs(np.delete(missing, moment)).max() < 1e-9 * start.max()


def test_a_loose_contact_opens_below_where_it_closes():
    effect = drawn(loose_contact.loose_contact, 6)
    rise = np.linspace(0.0, 5000.0, 501)
    voltage = np.concatenate((rise, rise[::-1]))
    time = np.arange(voltage.size) * 1e-3
    passed = effect.on_voltage(time, Supply(voltage, voltage, voltage), None)[0].pull
    on = np.flatnonzero(passed)
    closes, opens = voltage[on[0]], voltage[on[-1]]
    words = effect.description.split()
    assert closes == pytest.approx(float(words[4]), abs=11.0)
    assert opens == pytest.approx(float(words[9]), abs=11.0)
    np.testing.assert_array_equal(passed[on], voltage[on])
    assert np.all(np.diff(on) == 1)


@pytest.mark.parametrize("form", [thermal.room, thermal.self_heating])
def test_a_thermometer_sees_the_warming(form):
    time, voltage = lobes(250.0, 20.0)
    warm, _ = TruthPlant.at_rest(NUMBERS, (drawn(form),)).advance(time, voltage, True)
    assert warm.heating[0] == 0.0
    assert warm.heating[-1] > 0.02
    assert np.diff(warm.heating).min() > -0.01 * warm.heating.max()


def test_mains_stand_in_the_spectrum_with_their_third_harmonic():
    time = np.arange(20001) * 1e-3
    effect = drawn(interference.mains)
    still, _ = TruthPlant.at_rest(NUMBERS, (effect,)).advance(time, np.zeros(time.size), True)
    frequency, power = signal.periodogram(still.displacement, 1000.0, "hann")
    two = frequency[signal.find_peaks(power, power.max() * 1e-4)[0]]
    assert np.min(np.abs(two[0] - np.array([50.0, 60.0]))) < 0.1
    np.testing.assert_allclose(two[-1], 3.0 * two[0], atol=0.2)


def test_every_stage_gives_the_velocity_of_its_displacement():
    """The laser draws a cubic through both: they must belong together."""
    time, voltage = lobes(2000.0, 3.0)
    for _, form in (p.values for p in FORMS):
        effect = drawn(form)
        if effect.on_motion is None:
            continue
        seen, _ = TruthPlant.at_rest(NUMBERS, (effect,)).advance(time, voltage, True)
        rate = np.gradient(seen.displacement, time)[4:-4]
        scale = np.abs(seen.velocity).max()
        assert np.abs(rate - seen.velocity[4:-4]).max() < 0.03 * scale, form.__name__


@pytest.mark.parametrize("seed", range(8))
def test_the_equation_of_motion_is_the_one_that_is_written(seed):
    """Term by term from the docstrings, in a state drawn by chance."""
    # One piece: the terms of one equation.
    numbers, generator = everything(), np.random.default_rng(seed)
    h, rest = numbers.hidden, film.rest_stretch(numbers)
    state = numbers.at_rest(rest)
    y, memory = state.y, state.memory
    sizes = [0.01, 0.05, h.friction_reach * 0.9, 0.9, 3e3, 3e3, 0.5, 0.2, 0.1, 0.01, 0.3]
    y[: len(sizes)] += np.array(sizes) * generator.uniform(-1.0, 1.0, len(sizes))
    y[film._PATH] = abs(y[film._PATH])
    y[film._BRANCH :] = generator.normal(0.0, 0.01, len(numbers.times))
    memory[film._LARGEST] = rest + 0.004
    memory[film._SLIPPED :] = generator.uniform(-1.0, 1.0, 12) * [s[0] for s in numbers.stops]
    voltage, pull, area, stiffness = 7000.0, 1.002, 0.97, 0.995
    dy = np.empty_like(y)
    film._derivative(
        numbers.body(rest),
        h,
        numbers.springs(),
        numbers.slipping(),
        memory,
        y,
        voltage,
        pull,
        area,
        stiffness,
        dy,
    )
    lam, rate, bristle, bouc, v1, v2, warm, warm_2, path, u, u_rate = y[: film._BRANCH]
    away, z = lam - rest, y[film._BRANCH :]

    # v + R I(v) = V by bisection
    low, high = 0.0, voltage
    for _ in range(60):
        v = 0.5 * (low + high)
        current = h.leak_conductance / (h.leak_hopping * lam) * math.sinh(h.leak_hopping * lam * v)
        low, high = (v, high) if v + h.leak_series * current < voltage else (low, v)
    square = 0.5 * (v1**2 + v2**2)
    field = 1.0 / (1.0 + h.permittivity_field * square * lam**2)
    strain = away / h.permittivity_reach
    gained = 1.0 + h.permittivity_strain * strain / math.hypot(1.0, strain)
    stress = numbers.pull * pull + area * numbers.electric * field * gained * square * lam

    stress -= h.drag * rate + h.drag_quadratic * rate * abs(rate)
    level = 1.0 + (h.friction_static / h.friction - 1.0) * math.exp(
        -(abs(rate / h.friction_stribeck) ** h.friction_easing)
    )
    steady = h.friction_reach * level
    slip = np.interp(abs(bristle) / steady, [h.friction_elastic, 1.0], [0.0, 1.0])
    slip = math.sin(0.5 * math.pi * slip) ** 2 if bristle * rate > 0.0 else 0.0
    bending = rate * (1.0 - slip * abs(bristle) / steady)
    stress -= h.friction * bristle / h.friction_reach + h.friction_damping * bending
    stress -= h.bouc * bouc
    for (reach, modulus), slipped in zip(numbers.stops, memory[film._SLIPPED :], strict=True):
        stress -= modulus * np.clip(slipped + lam - memory[film._START], -reach, reach)
    if away > h.stop_travel:
        contact = h.stop_stiffness * (away - h.stop_travel) ** 1.5
        stress -= max(contact * (1.0 + h.stop_damping * rate), 0.0)

    q = ((max(memory[film._LARGEST], lam) - rest) / h.damage_reach) ** h.damage_exponent
    whole = 1.0 - h.damage * q / (1.0 + q) - h.ageing * math.log(1.0 + path / h.ageing_reach)
    stiffness *= 1.0 + h.heat_stiffness * warm

    def gent(modulus, limit, e):
        return modulus * (e - e**-3) / (1.0 - (e**2 + e**-2 - 2.0) / limit)

    stress -= stiffness * whole * gent(numbers.moduli[0], numbers.limits[0], lam)
    flows = []
    for i, time in enumerate(numbers.times, start=1):
        xi = lam / math.exp(z[i - 1])
        stress -= stiffness * gent(numbers.moduli[i], numbers.limits[i], lam / xi) / xi
        # the thesis's flow of xi, from which z = ln(lam/xi) changes by lam'/lam - xi'/xi
        chain = 1.0 - (lam**2 / xi**2 + xi**2 / lam**2 - 2.0) / numbers.limits[i]
        slope = -((xi / lam) ** 2 - (lam / xi) ** 2) / time / chain
        flows.append(rate / lam - slope / xi)
    back = h.second_frequency**2 * u + 2.0 * h.second_damping * h.second_frequency * u_rate
    stress += h.second_inertia * back

    c = numbers.capacitance * lam**2 / 2.0
    into, on = (v - v1) / h.ladder_1, (v1 - v2) / h.ladder_2
    exchange = (warm - warm_2) / h.heat_time
    opening = 1.0 - h.bouc_share + h.bouc_share * np.sign(rate * bouc)
    expected = [
        rate,
        stress / numbers.inertia,
        bending,
        rate / h.bouc_reach * (1.0 - abs(bouc) ** h.bouc_exponent * opening),
        (into - on) / c - 2.0 * v1 * rate / lam,
        on / c - 2.0 * v2 * rate / lam,
        h.heat * v**2 - exchange,
        h.heat_share * exchange - warm_2 / h.heat_time_2,
        abs(rate),
        u_rate,
        -stress / numbers.inertia - back,
        *flows,
    ]
    np.testing.assert_allclose(dy, expected, rtol=1e-9, atol=1e-9)
