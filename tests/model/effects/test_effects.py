"""Every effect: at its neutral values nothing, elsewhere what its physics says.

One piece: a short test for each effect, on the same films.
"""

import functools
import math
import os
import shutil
import subprocess
import sys
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from dearig.model import kernel
from dearig.model.compiled.generated import generated_module
from dearig.model.effects import (
    EFFECTS,
    MEMORY,
    NEUTRAL,
    PARAMETER_COUNT,
    PLACES,
    SENSOR_MEMORY,
    assembly,
)
from dearig.model.errors import ModelError
from dearig.model.film.material import THESIS_FILM
from dearig.model.simulation.actuator import Drive, at_rest, initial_state
from dearig.model.simulation.strip import Strip
from dearig.sim_backend.model_plant import ModelPlant
from tests.deep import mostly_deep, one_of_each
from tests.tools.effect_cases import (
    BOTH,
    BY_STRETCH,
    BY_VOLTAGE,
    STRIP,
    THESIS,
    numbers,
    pulled,
    with_effect,
)
from tests.tools.effect_oracle import (
    Film,
    bouc_wen,
    curve_of,
    extra,
    follow,
    limited,
    spectrum,
    steps_at,
    weights_of,
)
from tests.tools.effect_plugin import FEW

LENGTH = THESIS_FILM.length
OF_SENSOR = [n for n in BY_VOLTAGE if EFFECTS[n].acts_on == "sensor"]
OF_FILM = [n for n in BY_VOLTAGE if n not in OF_SENSOR]


class Course:
    """Lobes of 6 and 8 kV, one second each, then 7 kV that come within 20 ms; it gets warmer."""

    breaks = (0.0, 1.0, 1.49, 1.51, 2.0, 2.1, 2.12)
    end = 2.4
    temperature, humidity = 2.0, -0.1  # of the room at the start

    def __call__(self, t):
        if t < 2.0:
            return (6e3 if t < 1.0 else 8e3) * math.sin(math.pi * (t % 1.0))
        return 7e3 * limited((t - 2.1) / 0.02, 0.0, 1.0)

    def warmth(self, t):
        return 0.1 * t

    def moisture(self, t):
        return 0.02 * t

    @functools.cache  # noqa: B019  (there is one course)
    def drive(self, rate, finer=1):
        """Sampled at ``rate``, or straight between these samples in ``finer`` steps."""
        time = np.arange(round(self.end * rate) + 1) / rate
        volts = np.array([self(t) for t in time])
        fine = np.arange(round(self.end * rate) * finer + 1) / (rate * finer)
        return Drive(
            fine, np.interp(fine, time, volts), warmth=self.warmth(fine),
            moisture=self.moisture(fine), temperature=self.temperature, humidity=self.humidity,
        )  # fmt: skip


COURSE = Course()


def measured(model):
    """What ``model`` shows on the test's course: displacement in m, or stress in Pa."""
    answer = model.simulate(*pulled()) if isinstance(model, Strip) else None
    answer = answer or model.simulate(COURSE.drive(500.0))
    assert answer.ok, answer.status_text
    return answer.stress if isinstance(model, Strip) else answer.displacement


@functools.cache
def baseline(driven):
    return measured(STRIP if driven == "stretch" else THESIS)


def base_of(driven):
    return STRIP if driven == "stretch" else THESIS


# --- where they are


@pytest.mark.parametrize("name", EFFECTS)
def test_the_module_names_its_hooks_and_nothing_else(name):
    hooks = set(assembly.HOOKS)
    public = set(PLACES[name].module.__all__)
    assert hooks & public
    assert public - {"EFFECT"} <= hooks


def test_places_do_not_overlap():
    columns = [PLACES[n].column(e, p.name) for n, e in EFFECTS.items() for p in e.parameters]
    assert columns == list(range(columns[0], columns[0] + PARAMETER_COUNT))
    assert NEUTRAL.shape == (PARAMETER_COUNT,)
    for of_sensor, size in ((False, MEMORY), (True, SENSOR_MEMORY)):
        places = [(PLACES[n], e) for n, e in EFFECTS.items()]
        there = [(p, e) for p, e in places if hasattr(p.module, "sense") == of_sensor]
        assert [p.memory + i for p, e in there for i in range(e.memory)] == list(range(size))


@pytest.mark.deep
def test_effects_beyond_the_last_bit_share_it_and_act_alone(monkeypatch):
    monkeypatch.setattr(assembly, "_LAST_BIT", 3)
    monkeypatch.setattr(assembly, "_OF_EFFECT", assembly._bits())
    few = generated_module("dearig.model.effects.assembled_of_four_bits", assembly._text())
    for name in ("linear drag", "dry friction"):
        c = with_effect(THESIS, name, numbers(name)).coefficients()
        at = (np.ones(MEMORY), 1.4, 0.3, 1.39, 1e-3, 0.5)
        assert assembly.active(c) != few.active(c) == 1 << 3
        alone = assembly.stress(assembly.active(c), c, *at)
        assert alone != 0.0
        assert few.stress(few.active(c), c, *at) == alone


@functools.cache
def bits_of_all() -> dict[str, tuple[int, int]]:
    """Return who acts where one effect does, in the motion and in the reading."""
    driven = [n for n, e in EFFECTS.items() if "voltage" in e.drives]
    made = {n: with_effect(THESIS, n, numbers(n)).coefficients() for n in driven}
    return {n: (assembly.active(c), assembly.active_sensors(c)) for n, c in made.items()}


@pytest.mark.parametrize("name", [n for n, e in EFFECTS.items() if "voltage" in e.drives])
def test_each_effect_is_one_bit_of_who_acts(name):
    on, of_sensor = bits_of_all()[name]
    sensed = hasattr(PLACES[name].module, "sense")
    assert (of_sensor if sensed else on).bit_count() == 1
    assert (on if sensed else of_sensor) == 0
    # more effects than bits: those that share the last one are called for the hooks of all
    shared = [n for n, bits in bits_of_all().items() if bits == (on, of_sensor)]
    for hook, mask in assembly.HOOK_BITS.items():
        there = any(getattr(PLACES[n].module, hook, None) is not None for n in shared)
        assert bool((of_sensor if hook == "sense" else on) & mask) == there
    assert bool(on & assembly.HYSTERETIC) == EFFECTS[name].is_hysteretic


def test_who_makes_the_reading_wrong_leaves_the_motion_alone():
    # the two remember apart
    for place in PLACES.values():
        others = set(assembly.HOOKS) - {"sense"}
        assert not (hasattr(place.module, "sense") and others & set(place.module.__all__))


def test_values_that_no_effect_has():
    for effects, message in (
        ((("magic", ()),), "'magic' is not one of"),
        ((("linear drag", ()),), "lacks drag: it takes the parameters drag"),
        (
            (("linear drag", (("drag", 1.0), ("drug", 1.0))),),
            "does not know drug: it takes the parameters drag",
        ),
        ((("linear drag", (("drag", -1.0),)),), "drag = -1.0 Pa s must lie between 0 and"),
        ((("linear drag", (("drag", math.nan),)),), "drag = nan Pa s must lie between 0 and"),
        ((("slack", (("looseness", 0.5),)),), "not one of films driven by voltage"),
    ):
        with pytest.raises(ModelError, match=message):
            replace(THESIS, effects=effects)
    with pytest.raises(ModelError, match="not one of films driven by stretch"):
        replace(STRIP, effects=(("sensor lag", (("time_constant", 0.1),)),))


# --- at their neutral values


@pytest.mark.parametrize(("name", "driven"), BOTH)
def test_neutral_is_the_baseline_bit_for_bit(name, driven):
    effect = EFFECTS[name]
    neutral = {p.name: p.neutral for p in effect.amplitudes}
    for end in (0, 1):
        shapes = {p.name: p.bounds[end] for p in effect.shape_parameters}
        model = with_effect(base_of(driven), name, neutral | shapes)
        np.testing.assert_array_equal(measured(model), baseline(driven))


@pytest.mark.parametrize("driven", ["voltage", "stretch"])
def test_all_of_them_neutral_at_once(driven):
    names = BY_STRETCH if driven == "stretch" else BY_VOLTAGE
    effects = tuple((n, tuple(numbers(n, 0.0).items())) for n in names)
    model = replace(base_of(driven), effects=effects)
    np.testing.assert_array_equal(measured(model), baseline(driven))


@pytest.mark.parametrize(("name", "driven"), BOTH)
def test_the_typical_size_would_be_noticed(name, driven):
    found = measured(with_effect(base_of(driven), name, numbers(name)))
    # a micrometre is the sensor's noise; one pascal is nothing, films need larger sizes
    least = 1e-6 if driven == "voltage" else 1.0
    if name == "temperature" or EFFECTS[name].family == "drift":
        least = 0.2e-6  # these take more than two seconds
    assert np.abs(found - baseline(driven)).max() >= least


# --- against the physics written once more

# um that kernel and oracle may differ by, at five times the typical size: as measured, rounded up
SPLITTING = {
    "dry friction": 0.3,  # a turning point within a step
    "general friction": 0.3,  # the same
    "thinning drag": 0.4,  # steep at rest: the drag changes most at a turning point
    "general drag": 0.4,  # the same
    "easing friction": 0.8,  # the same, and it squeals: what a step does grows
    "elastoplastic friction": 0.8,  # the same
    "ageing": 0.15,  # softens by the path at the beginning of the step
    "leakage": 0.15,  # loses by the stretch amid the step
    "hopping leakage": 0.15,  # the same
    "space-charge leakage": 0.3,  # the same, by its third power and more
    "fading leakage": 0.3,  # the same
}


# the oracle carries the states in Python: the suite has the effects with the fewest
@pytest.mark.parametrize(
    "name",
    one_of_each(
        sorted(OF_FILM, key=lambda name: EFFECTS[name].memory),
        lambda name: (EFFECTS[name].family, EFFECTS[name].acts_on),
    ),
)
def test_against_the_oracle(name):
    film = Film(THESIS)
    values = numbers(name, 5.0)
    drive = COURSE.drive(1000.0)
    effect = extra(name, values, film, COURSE)
    compared = slice(None, None, 5)  # the oracle's states between its steps are dear
    expected = follow(film, COURSE, drive.time[compared], effect)
    found = with_effect(THESIS, name, values).simulate(drive)
    assert found.ok, found.status_text
    error = np.abs(found.stretch[compared] - expected).max() * LENGTH
    assert error < SPLITTING.get(name, 0.1) * 1e-6


@pytest.mark.parametrize("name", OF_FILM)
def test_the_thesis_sampling_is_fine_enough(name):
    # 10 ms, against the same straight pieces of voltage in steps of a quarter of a millisecond
    model = with_effect(THESIS, name, numbers(name, 3.0))
    coarse, fine = (model.simulate(COURSE.drive(100.0, n)).stretch for n in (1, 40))
    # a film that squeals multiplies what a step does
    error = 0.7e-6 if "excess" in dict(model.effects[0][1]) else 0.2e-6
    # steep at rest: turning points within a sample
    error = 0.4e-6 if name == "general drag" else error
    assert np.abs(coarse - fine[::40]).max() * LENGTH < error


# --- what a sensor makes of a motion that is known exactly


def moved(t):
    """Position, rate and acceleration of something that swings, in m and s."""
    w = 2.0 * math.pi * 3.0
    x = 6e-4 * (1.0 - np.cos(w * t)) + 1e-4 * t
    return x, 6e-4 * w * np.sin(w * t) + 1e-4


def read(name, values, time):
    c = with_effect(THESIS, name, values).coefficients()
    shown, rate = moved(time)
    shown = shown.copy()
    kernel.read_sensor(c, time, shown, rate, np.zeros(SENSOR_MEMORY))
    return shown


def mean_of(start, end):
    """Mean position between two times, which are arrays; it was at rest before 0."""
    w = 2.0 * math.pi * 3.0

    def integral(t):
        t = np.maximum(t, 0.0)
        return 6e-4 * (t - np.sin(w * t) / w) + 0.5e-4 * t**2

    return (integral(end) - integral(start)) / (end - start)


def shown_by_averaging(p, time):
    return mean_of(time - p["window"], time)


def shown_by_ages(p, time):
    edges = p["delay"] + p["age"] * np.array([0.0, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0])
    shares = [p[f"share_{i}"] for i in range(1, 7)]
    means = [mean_of(time - b, time - a) for a, b in pairwise(edges)]
    return (1.0 - sum(shares)) * moved(time)[0] + sum(
        w * m for w, m in zip(shares, means, strict=True)
    )


def shown_by_lag(p, time):
    return solve_ivp(
        lambda t, y: [(moved(t)[0] - y[0]) / p["time_constant"]],
        (0.0, time[-1]), [0.0], t_eval=time, method="DOP853", rtol=1e-10, atol=1e-14,
    ).y[0]  # fmt: skip


def shown_by_two_lags(p, time):
    tau = p["time_constant"]
    return solve_ivp(
        lambda t, y: [(moved(t)[0] - y[0]) / tau, (y[0] - y[1]) / tau],
        (0.0, time[-1]), [0.0, 0.0], t_eval=time, method="DOP853", rtol=1e-10, atol=1e-14,
    ).y[1]  # fmt: skip


def lines(p, t, harmonic, number):
    turn = 2.0j * math.pi * p["frequency"] * t
    first = (p["cosine"] - 1j * p["sine"]) * np.exp(turn)
    more = (p[f"{harmonic}_cosine"] - 1j * p[f"{harmonic}_sine"]) * np.exp(number * turn)
    return moved(t)[0] + (first + more).real


def shown_by_walk(p, t):
    way = [0.0, *p.values()]
    walked = np.polynomial.chebyshev.chebval(t / 15.0 - 1.0, way)
    return moved(t)[0] + walked - np.polynomial.chebyshev.chebval(-1.0, way)


SHOWN = {
    "linear drift": lambda p, t: moved(t)[0] + p["drift"] * t,
    "mains interference": lambda p, t: lines(p, t, "third", 3.0),
    "vibration": lambda p, t: lines(p, t, "second", 2.0),
    "general sensor curve": lambda p, t: (
        moved(t)[0]
        + np.array(
            [
                curve_of(
                    x,
                    weights_of(p, "error"),
                    steps_at([i * p["travel"] / 8.0 for i in range(10)], 1),
                )
                for x in moved(t)[0]
            ]
        )
    ),
    "general sensor lag": shown_by_ages,
    "sensor averaging": shown_by_averaging,
    "sensor delay": lambda p, t: moved(np.maximum(t - p["delay"], 0.0))[0],
    "sensor bend": lambda p, t: moved(t)[0] + p["cubic"] * moved(t)[0] ** 3,
    "sensor clipping": lambda p, t: np.where(
        moved(t)[0] < p["knee"],
        moved(t)[0],
        p["knee"] + (1.0 - p["flattening"]) * (moved(t)[0] - p["knee"]),
    ),
    "sensor curvature": lambda p, t: moved(t)[0] * (1.0 + p["quadratic"] * moved(t)[0]),
    "sensor lag": shown_by_lag,
    "sensor ripple": lambda p, t: (
        moved(t)[0]
        + p["sine"] * np.sin(2.0 * np.pi * moved(t)[0] / p["period"])
        + p["cosine"] * (1.0 - np.cos(2.0 * np.pi * moved(t)[0] / p["period"]))
    ),
    "sensor saturation": lambda p, t: np.where(
        moved(t)[0] < p["knee"],
        moved(t)[0],
        p["knee"]
        + (moved(t)[0] - p["knee"]) / (1.0 + p["inverse_range"] * (moved(t)[0] - p["knee"])),
    ),
    "settling drift": lambda p, t: (
        moved(t)[0] + p["drift"] * (1.0 - np.exp(-t / p["time_constant"]))
    ),
    "slowing drift": lambda p, t: (
        moved(t)[0]
        + p["drift"]
        * (np.power(1.0 + t / p["onset"], p["exponent"]) - 1.0)
        / (np.power(1.0 + 30.0 / p["onset"], p["exponent"]) - 1.0)
    ),
    "swinging load": lambda p, t: (
        moved(t)[0]
        - p["cosine"]
        + np.exp(-t / p["decay_time"])
        * np.real((p["cosine"] - 1j * p["sine"]) * np.exp(2j * np.pi * p["frequency"] * t))
    ),
    "sensor double lag": shown_by_two_lags,
    "fitful drift": shown_by_walk,
    "sudden change of reading": lambda p, t: (
        moved(t)[0] + p["jump"] * np.clip((t - p["moment"]) / 0.02 + 0.5, 0.0, 1.0)
    ),
}


@pytest.mark.parametrize("size", [1.0, 5.0])
@pytest.mark.parametrize("name", OF_SENSOR)
def test_sensors_against_the_exact_motion(name, size):
    time = np.arange(2001) * 1e-3
    values = numbers(name, size)
    # between samples a cubic goes through positions and rates: 3 Hz at 1 kHz leaves picometres
    np.testing.assert_allclose(
        read(name, values, time), SHOWN[name](values, time), rtol=0.0, atol=1e-11
    )


# --- films


def steps_of(name, p, time, stretch):
    """Stress of the effect (N,) at samples of a stretch that is straight in between, in Pa."""
    rest = stretch[0]
    rate = np.diff(stretch, prepend=rest) / np.diff(time, prepend=time[0] - 1.0)
    if name == "linear drag":
        return p["drag"] * rate
    if name == "distributed hysteresis":
        z, out = np.zeros(24), []
        ends = p["reach"] * ((np.arange(24) + 0.5) / 24.0) ** p["spread"]
        for travel in np.diff(stretch, prepend=rest):
            z = np.clip(z + travel, -ends, ends)
            out.append(p["stiffness"] * z.mean())
        return np.array(out)
    if name == "elastoplastic hysteresis":
        # along each straight piece, in the length of the path
        z, out = 0.0, []
        for travel in np.diff(stretch, prepend=rest):
            if travel:
                way = math.copysign(1.0, travel)
                z = solve_ivp(
                    lambda _, y, way=way: [bouc_wen(way, y[0], p["exponent"], p["asymmetry"])],
                    (0.0, abs(travel) / p["reach"]), [z],
                    method="DOP853", rtol=1e-10, atol=1e-13,
                ).y[0, -1]  # fmt: skip
            out.append(p["yield_stress"] * z)
        return np.array(out)
    # branches of what creeps, from sample to sample: the strip rests at a stretch of 1
    moduli, times = spectrum(name, p)
    q, out = np.zeros(len(times)), [0.0]
    for t0, t1, lam0, speed in zip(time, time[1:], stretch, rate[1:], strict=False):
        q = solve_ivp(
            lambda t, y, t0=t0, lam0=lam0, speed=speed: (
                (math.log(lam0 + speed * (t - t0)) - y) / times / (lam0 + speed * (t - t0))
            ),
            (t0, t1), q, method="LSODA", rtol=1e-8, atol=1e-12,
        ).y[:, -1]  # fmt: skip
        lam = lam0 + speed * (t1 - t0)
        out.append(float(np.sum(moduli * (math.log(lam) - q))) / lam)
    return np.array(out)


@pytest.mark.parametrize("size", mostly_deep([1.0, 20.0], [20.0]))
@pytest.mark.parametrize(
    "name",
    [
        "linear drag",
        "distributed hysteresis",
        "elastoplastic hysteresis",
        "slow branch",
        "broad creep",
        "power-law creep",
    ],
)
def test_stresses_in_films_against_direct_evaluation(name, size):
    values = numbers(name, size)
    found = measured(with_effect(STRIP, name, values)) - baseline("stretch")
    expected = steps_of(name, values, *pulled())
    assert np.abs(expected).max() > 10.0
    # what creeps takes the logarithm for straight within a sample, and the mean stretch there for
    # its rate; Bouc and Wen's loop takes its steps to 2e-5
    error = 1e-4 if EFFECTS[name].family == "creep" else 2e-6
    error = 2e-5 if name == "elastoplastic hysteresis" else error
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=error * np.abs(expected).max())


def test_elements_that_yield_follow_the_parabola_of_infinitely_many():
    # Rayleigh's law: thresholds lie evenly up to the reach
    values = numbers("distributed hysteresis", reach=0.5, spread=1.0)
    stretch = np.concatenate([np.linspace(1.0, 1.5, 501), np.linspace(1.5, 0.5, 1001)[1:]])
    time = 0.01 * np.arange(stretch.size)
    strip = with_effect(STRIP, "distributed hysteresis", values)
    found = strip.simulate(time, stretch).stress - STRIP.simulate(time, stretch).stress
    way = stretch[:501] - 1.0
    up = values["stiffness"] * (way - way**2 / (2.0 * 0.5))
    # on the way back the same, twice as large in both directions, as Masing has it
    back = 1.5 - stretch[500:]
    down = up[-1] - values["stiffness"] * (back - back**2 / (4.0 * 0.5))
    expected = np.concatenate([up, down[1:]])
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-3 * up[-1])


def test_the_spring_pot_relaxes_by_a_power_of_time():
    values = numbers("power-law creep", exponent=0.2)
    time = np.concatenate([[0.0, 1e-6], np.geomspace(0.1, 100.0, 60)])
    stretch = np.where(time > 0.0, 1.02, 1.0)
    found = with_effect(STRIP, "power-law creep", values).simulate(time, stretch).stress
    step = math.log(1.02) / 1.02
    found = (found - STRIP.simulate(time, stretch).stress)[2:] / (step * values["modulus"])
    # but for what slower branches would carry, which is a constant here
    assert 0.5 < np.ptp(time[2:] ** -0.2) < 1.2
    assert np.ptp(found - time[2:] ** -0.2) < 0.03


def test_broad_creep_without_a_power_goes_with_the_logarithm_of_time():
    values = numbers("broad creep", relaxation_time=1.0, exponent=0.0)
    time = np.concatenate([[0.0, 1e-6], np.geomspace(2.0, 100.0, 60)])
    stretch = np.where(time > 0.0, 1.02, 1.0)
    found = with_effect(STRIP, "broad creep", values).simulate(time, stretch).stress
    step = math.log(1.02) / 1.02
    found = (found - STRIP.simulate(time, stretch).stress)[2:] / (step * values["modulus"])
    line = np.polyfit(np.log(time[2:]), found, 1)
    assert line[0] == pytest.approx(-2.0 / math.log(10.0), rel=0.05)
    np.testing.assert_allclose(found, np.polyval(line, np.log(time[2:])), atol=0.15)


def test_softening_in_films_against_direct_evaluation():
    _, stretch = pulled()
    plain = baseline("stretch")
    strain = stretch**2 + 2.0 / stretch - 3.0
    p = numbers("Mullins softening", 50.0)
    most = np.maximum.accumulate(strain)
    part = (most - strain) / (p["width"] * (most + 1e-3))
    found = measured(with_effect(STRIP, "Mullins softening", p))
    np.testing.assert_allclose(found, plain * (1.0 - p["softening"] * np.tanh(part)), rtol=1e-9)
    p = numbers("ageing", 50.0)
    path = np.cumsum(np.abs(np.diff(stretch, prepend=stretch[0])))
    wanted = plain * (1.0 - p["softening"] * (1.0 - np.exp(-path / p["path"])))
    found = measured(with_effect(STRIP, "ageing", p))
    # softened by the path up to the sample before
    np.testing.assert_allclose(found[1:], wanted[1:], rtol=1.1 * p["softening"] * 0.012 / p["path"])


def test_a_slack_strip_does_not_push():
    # unloaded at once, after the branch has flowed
    time = np.array([0.0, 1.0, 200.0, 201.0, 400.0])
    stretch = np.array([1.0, 1.8, 1.8, 1.0, 1.0])
    plain = STRIP.simulate(time, stretch).stress
    assert plain[3] < -1e3
    for looseness in (0.5, 1.0):
        p = {"looseness": looseness}
        found = with_effect(STRIP, "slack", p).simulate(time, stretch).stress
        np.testing.assert_allclose(
            found, np.where(plain > 0.0, plain, (1.0 - looseness) * plain), atol=1e-9
        )


# --- in pieces


@pytest.mark.parametrize("name", BY_VOLTAGE)
def test_a_run_in_two_pieces_is_the_run(name):
    model = with_effect(THESIS, name, numbers(name, 2.0))
    drive = COURSE.drive(500.0)
    whole = model.simulate(drive).displacement
    c = model.coefficients()
    _, rest = at_rest(c, drive)
    for cut in (333, 757, 1055):
        y, memory = initial_state(c, rest), np.zeros(SENSOR_MEMORY)
        joined = np.zeros(drive.time.size)
        for part in (slice(0, cut + 1), slice(cut, drive.time.size)):
            time = drive.time[part]
            stretch, rate = np.zeros(time.size), np.zeros(time.size)
            status, _, _ = kernel.drive_by_voltage(
                c, time, drive.voltage[part], drive.ends[part],
                np.ascontiguousarray(drive.air[:, part]), y, stretch, rate,
            )  # fmt: skip
            assert status == kernel.OK
            shown = (stretch - rest) * LENGTH
            kernel.read_sensor(c, time, shown, rate * LENGTH, memory)
            if cut in (time.size - 1, part.start):
                joined[part] = shown
        np.testing.assert_allclose(joined, whole, rtol=0.0, atol=0.05e-6)


@pytest.mark.parametrize("name", BY_VOLTAGE)
def test_a_simulated_rigs_film_goes_on_where_it_was(name):
    model = with_effect(THESIS, name, numbers(name, 2.0))
    drive = COURSE.drive(1000.0)
    at_once, _ = ModelPlant.at_rest(model).advance(drive.time, drive.voltage, True)
    plant, joined = ModelPlant.at_rest(model), np.zeros(drive.time.size)
    for start in range(0, drive.time.size - 1, 500):
        part = slice(start, min(start + 501, drive.time.size))
        motion, plant = plant.advance(drive.time[part], drive.voltage[part], True)
        assert motion.fault is None
        joined[part] = motion.displacement
    np.testing.assert_allclose(joined, at_once.displacement, rtol=0.0, atol=0.05e-6)


# --- one more

NEW = """
from dearig.model.effects.description import Effect, Parameter
from dearig.model.compiled.jit import jit

__all__ = ["EFFECT", "stress"]

EFFECT = Effect(
    name="constant pull", family="unknown", acts_on="load", summary="pulls, always",
    parameters=(Parameter("pull", "Pa", (-1e4, 1e4), "taken from the load", 10.0, 0.0),),
    drives=("voltage", "stretch"),
)


@jit
def stress(c, k, m, j, lam, rate, lam0, since, t):
    return c[k]
"""
USE = """
import numpy as np
from dearig.model.effects import EFFECTS
from dearig.model.effects import assembly
from dearig.model.simulation.excitation import Sequence
from dearig.model.simulation.strip import Strip
from dearig.model.film.material import Network, Spring
assert "constant pull" in EFFECTS, list(EFFECTS)
network, time = Network(Spring(4e4, 60.0)), np.linspace(0.0, 1.0, 5)
pulled = Strip(network, effects=(("constant pull", (("pull", 250.0),)),))
more = pulled.simulate(time, 1.0 + time).stress - Strip(network).simulate(time, 1.0 + time).stress
print(more.tolist())
c = pulled.coefficients()
print(assembly.stress(assembly.active(c), c, np.zeros(500), 1.1, 0.0, 1.1, 0.0, 0.0))
"""


@pytest.mark.parametrize("compiled", mostly_deep([False, True], [False]))
def test_an_effect_is_one_file(compiled, tmp_path):
    package = Path(assembly.__file__).parents[1]
    (tmp_path / "dearig").mkdir()
    (tmp_path / "dearig" / "__init__.py").touch()
    copy = tmp_path / "dearig" / "model"
    shutil.copytree(package, copy, ignore=shutil.ignore_patterns("__pycache__"))
    (copy / "effects" / "library" / "mechanical" / "constant_pull.py").write_text(
        NEW, encoding="utf-8"
    )
    environment = {
        **os.environ,
        "PYTHONPATH": str(tmp_path),
        "NUMBA_CACHE_DIR": str(tmp_path / "cache"),
        "NUMBA_DISABLE_JIT": "0" if compiled else "1",
    }
    # compiled, one hook of few effects is enough: the kernels take half a minute
    use = USE
    if compiled:
        few = FEW.replace('("linear_drag"', '("constant_pull", "linear_drag"')
        use = few + "\n".join(line for line in USE.splitlines() if "more" not in line)
    done = subprocess.run(
        [sys.executable, "-c", use],
        cwd=tmp_path, env=environment, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    *stresses, hook = done.stdout.splitlines()
    assert float(hook) == 250.0
    if not compiled:
        assert stresses == ["[250.0, 250.0, 250.0, 250.0, 250.0]"]


@pytest.mark.parametrize("name", ["easing friction", "elastoplastic friction"])
def test_a_friction_that_extends_the_dry_one_may_do_all_that_it_does(name):
    # soft bristles ring slowly: a tenth of critical damping is 5 ms there
    simple = EFFECTS["dry friction"].parameters
    for number, same in zip(EFFECTS[name].parameters, simple, strict=False):
        assert (number.name, number.bounds) == (same.name, same.bounds)
