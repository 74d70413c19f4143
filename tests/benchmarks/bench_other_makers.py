"""Rigs of a third maker: forms that neither generator of the simulated rigs has.

Run as ``python -m tests.benchmarks.bench_other_makers [--forms magnet,guide] [--seed 1] [--train
rich]``. Each form is a rig with a film of its own, integrated by a plain loop of fourth-order
Runge-Kutta steps of 0.1 ms that shares nothing with the model but its numbers. It is recorded at
1 kHz with 1.06 um of noise, as the blind test's rigs are, and diagnosed from its displacement
alone. A line has what is hidden, what is named, and errors over the noise: of training, and of
three recordings that no fit used (lobes of one frequency, lobes of one height, steps), with the
baseline and with what was found.
"""

from __future__ import annotations

import argparse
import math
import time as clock
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numba import njit
from scipy.signal import lfilter

from dearig.config.rigfile import RigFile
from dearig.config.sequencefile import load_sequence
from dearig.model.diagnosis.run import diagnose
from dearig.model.film.material import TABLE_3
from dearig.model.readings.records import ActuatorRecord, counted
from dearig.model.simulation.actuator import Actuator, Drive
from dearig.sim_backend.truth.cases import draw
from dearig.sim_backend.truth.film import FilmNumbers, rest_stretch
from dearig.sim_backend.truth.sampling import either_sign, log_uniform
from tests.benchmarks.bench_ablation import _error
from tests.blind.play import MODES, VALIDATION

RATE, NOISE = 1000.0, 1.06e-6  # Hz, m
_PARTS = 10  # steps of the integration in a sample
_STATES = 8  # stretch, rate, three branches, and three of the form

Draw = np.random.Generator
Curve = Callable[[np.ndarray, np.ndarray], np.ndarray]  # of time and values (N,)


@dataclass(frozen=True)
class Form:
    """One hidden form: the number of its term in ``_slopes``, and what that takes.

    ``stops`` (2, K) are reaches and stiffnesses of elements that yield; ``on_voltage`` and
    ``on_reading`` change what the film and the reader see.
    """

    term: int = 0
    p: tuple[float, ...] = ()
    stops: np.ndarray = field(default_factory=lambda: np.zeros((2, 0)))
    on_voltage: Curve | None = None
    on_reading: Curve | None = None


(
    PLAIN, LOSS_HEATING, DEBYE, STORED_CHARGE, BERGSTROM_BOYCE, GAUGE, BLEEDER, ABSORBING_LEAK,
    HEATED_PERMITTIVITY, MAGNET, DRAG, QUARTIC, GUIDE, NORTON,
) = range(14)  # fmt: skip


@njit
def _slopes(y, v, dv, film, springs, term, p, rest, dy):
    """One piece: the equation of motion, term by term (y: see ``_STATES``)."""
    lam, rate = y[0], y[1]
    away, capacitance = lam - rest, film[3] * lam * lam
    dy[:] = 0.0
    at_film, square, stiff = v, v * v, 1.0
    if term == GAUGE:
        dy[5] = (v - y[5]) / (p[0] * math.exp(p[1] * away) * capacitance) - 2.0 * rate / lam * y[5]
        at_film = y[5]
    elif term == BLEEDER:
        dy[5] = ((v - y[5]) / p[0] - y[5] / p[1]) / capacitance - 2.0 * rate / lam * y[5]
        at_film = y[5]
    elif term == ABSORBING_LEAK:
        dy[6] = (abs(v) / 8e3 - y[6]) / p[2]
        leak = p[1] * (1.0 + p[3] * (abs(v) / 8e3 - y[6])) * (abs(y[5]) * lam / 9.6e3) ** p[4]
        dy[5] = ((v - y[5]) / p[0] - leak * y[5]) / capacitance - 2.0 * rate / lam * y[5]
        at_film = y[5]
    elif term == STORED_CHARGE:
        dy[6] = (p[0] * p[2] * math.tanh(v / p[2]) - y[6]) / p[1]
        at_film = v - y[6] + p[3]
    square = at_film * at_film
    if term == DEBYE:
        dy[6] = (v - y[6]) / p[1]
        square = v * ((1.0 - p[0]) * v + p[0] * y[6])
    elif term == LOSS_HEATING:
        dy[6] = p[0] * abs(v * dv) - y[6] / p[1]
        stiff = 1.0 + p[2] * y[6]
    elif term == HEATED_PERMITTIVITY:
        dy[6] = p[0] * v * v - (y[6] - y[7]) / p[1]
        dy[7] = 0.2 * (y[6] - y[7]) / p[1] - y[7] / p[2]
        square *= 1.0 + p[3] * y[6]
    elif term == QUARTIC:
        square *= 1.0 + p[0] * (v * lam / 9.6e3) ** 4
    stress = film[1] + film[2] * square * lam
    if term == MAGNET:
        stress -= p[0] * (math.exp(-away / p[1]) - 1.0)
    elif term == GUIDE:
        stress -= p[0] * (1.0 + away / p[1]) * math.tanh(rate / p[2])
    elif term == DRAG:
        stress -= p[0] * math.copysign(abs(rate) ** p[1], rate)
    elif term == BERGSTROM_BOYCE:
        pull = p[0] * (math.log(lam / rest) - y[5])
        flow = p[1] * (abs(pull) / p[2]) ** p[3] / (0.02 + abs(y[5])) ** p[4]
        dy[5] = math.copysign(flow, pull)
        stress -= pull / lam
    elif term == NORTON:
        pull = p[0] * (math.log(lam / rest) - y[5])
        beyond = max(abs(pull) - p[2], 0.0)
        dy[5] = math.copysign(p[1] * (beyond / p[2]) ** p[3], pull)
        stress -= pull / lam
    squared = lam * lam
    gent = 1.0 - (squared + 1.0 / squared - 2.0) / springs[1, 0]
    stress -= stiff * springs[0, 0] * (lam - 1.0 / (squared * lam)) / gent
    for i in range(1, springs.shape[1]):
        e = math.exp(y[1 + i])
        squared = e * e
        gent = 1.0 - (squared + 1.0 / squared - 2.0) / springs[1, i]
        flow = (squared - 1.0 / squared) / gent
        stress -= stiff * springs[0, i] * flow / lam
        dy[1 + i] = rate / lam - flow / springs[2, i] * e / lam
    dy[0], dy[1] = rate, stress / film[0]


@njit
def _stretched(time, voltage, film, springs, term, p, stops, rest):
    """Stretch (N,) at the samples, under a voltage that is held between them."""
    n, out, y = time.size, np.empty(time.size), np.zeros(_STATES)
    y[0] = rest
    k = np.zeros((4, _STATES))
    slipped, load, last = np.zeros(stops.shape[1]), film[1], rest
    for i in range(n):
        out[i] = y[0]
        if i == n - 1:
            break
        h = (time[i + 1] - time[i]) / _PARTS
        rise = (voltage[i + 1] - voltage[max(i - 1, 0)]) / (time[i + 1] - time[max(i - 1, 0)])
        for _ in range(_PARTS):
            film[1] = load
            for j in range(slipped.size):
                moved = slipped[j] + y[0] - last
                slipped[j] = min(max(moved, -stops[0, j]), stops[0, j])
                film[1] -= stops[1, j] * slipped[j]
            last = y[0]
            v = voltage[i]
            _slopes(y, v, rise, film, springs, term, p, rest, k[0])
            _slopes(y + 0.5 * h * k[0], v, rise, film, springs, term, p, rest, k[1])
            _slopes(y + 0.5 * h * k[1], v, rise, film, springs, term, p, rest, k[2])
            _slopes(y + h * k[2], v, rise, film, springs, term, p, rest, k[3])
            y = y + h / 6.0 * (k[0] + 2.0 * k[1] + 2.0 * k[2] + k[3])
    return out


def _lagging(time: np.ndarray, values: np.ndarray, by: float) -> np.ndarray:
    left = math.exp(-(time[1] - time[0]) / by)
    out, _ = lfilter([1.0 - left], [1.0, -left], values, zi=[left * values[0]])
    return np.asarray(out)


def _averaged(time: np.ndarray, x: np.ndarray, window: float, late: float) -> np.ndarray:
    area = np.concatenate(([0.0], np.cumsum(0.5 * (x[1:] + x[:-1]) * np.diff(time))))

    def until(at: np.ndarray) -> np.ndarray:
        return np.interp(at, time, area) + np.minimum(at - time[0], 0.0) * x[0]

    return (until(time - late) - until(time - late - window)) / window


def _of_reading(change: Curve) -> Form:
    return Form(on_reading=change)


def _double_lag(r: Draw) -> Form:
    a, b = log_uniform(r, 3e-3, 25e-3), log_uniform(r, 2e-3, 10e-3)
    return _of_reading(lambda t, x: _lagging(t, _lagging(t, x, a), b))


def _late_average(r: Draw) -> Form:
    window, late = log_uniform(r, 8e-3, 40e-3), log_uniform(r, 3e-3, 15e-3)
    return _of_reading(lambda t, x: _averaged(t, x, window, late))


def _delay(r: Draw) -> Form:
    late = log_uniform(r, 4e-3, 30e-3)
    return _of_reading(lambda t, x: np.interp(t - late, t, x))


def _fringes(r: Draw) -> Form:
    size, period, phase = log_uniform(r, 5e-6, 5e-5), r.uniform(4e-4, 1.5e-3), r.uniform(0.0, 6.28)
    return _of_reading(
        lambda _, x: x + size * (np.sin(2.0 * np.pi * x / period + phase) - np.sin(phase))
    )


def _dead_zone(r: Draw) -> Form:
    zone = log_uniform(r, 30.0, 300.0)
    gain = 8e3 / (8e3 - zone)
    return Form(on_voltage=lambda _, v: gain * np.sign(v) * np.maximum(np.abs(v) - zone, 0.0))


def _droop(r: Draw) -> Form:
    time, share = log_uniform(r, 10.0, 60.0), r.uniform(0.02, 0.2)
    return Form(on_voltage=lambda t, v: v - share * _lagging(t, v, time))


def _iwan(r: Draw) -> Form:
    middle, spread = log_uniform(r, 1e-3, 8e-3), r.uniform(0.5, 1.2)
    reaches = np.exp(r.normal(math.log(middle), spread, 30))
    return Form(stops=np.stack((reaches, np.full(30, log_uniform(r, 2e3, 2e4) / 30.0))))


def _term(term: int, *ranges: Callable[[Draw], float]) -> Callable[[Draw], Form]:
    return lambda r: Form(term, tuple(float(one(r)) for one in ranges))


def _log(low: float, high: float) -> Callable[[Draw], float]:
    return lambda r: log_uniform(r, low, high)


def _even(low: float, high: float) -> Callable[[Draw], float]:
    return lambda r: float(r.uniform(low, high))


def _always(value: float) -> Callable[[Draw], float]:
    return lambda _: value


def _signed(low: float, high: float) -> Callable[[Draw], float]:
    return lambda r: either_sign(r) * log_uniform(r, low, high)


#: By name: families that a name may be of, and how a rig is drawn.
FORMS: dict[str, tuple[str, Callable[[Draw], Form]]] = {
    "nothing": ("none", lambda _: Form()),
    "two lags": ("sensor_lag", _double_lag),
    "late average": ("sensor_lag", _late_average),
    "delay": ("sensor_lag", _delay),
    "fringes": ("sensor_nonlinearity", _fringes),
    "dead zone": ("amplifier", _dead_zone),
    "droop": ("amplifier or dielectric_relaxation", _droop),
    "many sliders": ("rate_independent_hysteresis", _iwan),
    # warming for each V^2, time, change of moduli per K
    "loss heating": (
        "thermal", _term(LOSS_HEATING, _log(1e-9, 8e-9), _log(10.0, 40.0), _signed(0.008, 0.02)),
    ),
    "Debye": ("dielectric_relaxation", _term(DEBYE, _log(0.02, 0.15), _log(0.05, 2.0))),
    "stored charge": (
        "dielectric_relaxation",
        _term(STORED_CHARGE, _log(0.01, 0.06), _log(0.2, 3.0), _even(4e3, 9e3), _even(-60.0, 60.0)),
    ),
    "power-law flow": (
        "viscoplasticity or creep",
        _term(
            BERGSTROM_BOYCE, _log(3e3, 2e4), _log(0.01, 0.1), _log(80.0, 300.0), _even(2.0, 5.0),
            _even(0.0, 0.5),
        ),
    ),
    "flow beyond a yield": (
        "viscoplasticity",
        _term(NORTON, _log(5e3, 3e4), _log(0.005, 0.1), _log(50.0, 250.0), _even(1.0, 3.0)),
    ),
    "strained electrode": (
        "electrode_resistance", _term(GAUGE, _log(1e7, 6e7), _even(100.0, 250.0)),
    ),
    "bleeder": (
        "electrode_resistance or leakage", _term(BLEEDER, _log(4e7, 2e8), _log(2e8, 4e9)),
    ),
    "absorbing leak": (
        "leakage",
        _term(
            ABSORBING_LEAK, _always(2e6), _log(1.5e-9, 2.5e-8), _log(0.5, 5.0),
            _even(0.5, 3.0), _even(0.0, 3.0),
        ),
    ),
    "heated permittivity": (
        "thermal",
        _term(
            HEATED_PERMITTIVITY, _log(4e-9, 4e-8), _log(3.0, 15.0), _log(40.0, 200.0),
            _signed(0.004, 0.006),
        ),
    ),
    "magnet": ("unknown", _term(MAGNET, _signed(30.0, 300.0), _log(0.004, 0.02))),
    "guide": (
        "friction or drag", _term(GUIDE, _log(10.0, 60.0), _even(0.01, 0.05), _always(2e-3)),
    ),
    "power-law drag": ("drag", _term(DRAG, _log(100.0, 600.0), _even(0.4, 1.6))),
    "quartic permittivity": ("permittivity", _term(QUARTIC, _signed(0.02, 0.15))),
}  # fmt: skip


def records(name: str, seed: int, train: str) -> tuple[list[ActuatorRecord], list[ActuatorRecord]]:
    """Training and validation recordings of the rig of ``seed`` with the form ``name``."""
    r = np.random.default_rng((seed, list(FORMS).index(name)))
    rig = RigFile()
    network = draw(int(r.integers(2**31)), rig.as_film(), rig.as_load(), "clean").network
    numbers = FilmNumbers.of(rig.as_film(), rig.as_load(), network)
    form, rest = FORMS[name][1](r), rest_stretch(numbers)
    found = []
    for sequence in (*MODES[train], *VALIDATION):
        time, voltage = load_sequence(sequence).sample(RATE)
        applied = voltage if form.on_voltage is None else form.on_voltage(time, voltage)
        film = np.array((numbers.inertia, numbers.pull, numbers.electric, numbers.capacitance))
        stretch = _stretched(
            time, applied, film, numbers.springs(), form.term,
            np.array((*form.p, *[0.0] * (6 - len(form.p)))), form.stops, rest,
        )  # fmt: skip
        x = (stretch - rest) * numbers.length
        x = x if form.on_reading is None else form.on_reading(time, x)
        if not np.isfinite(x).all():
            raise ValueError(f"{name}, seed {seed}: the film fails under {sequence}")
        lead_in = int(np.argmax(voltage != 0.0))
        read = counted(x + r.normal(0.0, NOISE, x.size), lead_in)
        drive = Drive(time, voltage, hold=True)
        found.append(ActuatorRecord(sequence, drive, read, NOISE, lead_in=lead_in))
    split = len(MODES[train])
    return found[:split], found[split:]


def line(name: str, seed: int, train: str) -> str:
    """Diagnose one rig, and return its line."""
    fitted, others = records(name, seed, train)
    rig = RigFile()
    began = clock.process_time()
    result = diagnose(
        fitted, Actuator(rig.as_film(), rig.as_load(), TABLE_3), workers=1, others=others
    )
    seconds = clock.process_time() - began
    before, after = (stage.for_others or stage.model for stage in (result.baseline, result.final))
    named = " + ".join(effect for effect, _ in after.effects) or "nothing"
    family, probability = result.families[0]
    errors = [f"{_error(after, fitted) / NOISE:.2f}"] + [
        f"{_error(before, [one]) / NOISE:.2f} -> {_error(after, [one]) / NOISE:.2f}"
        for one in others
    ]
    cells = [
        name,
        FORMS[name][0],
        f"{named} ({family} {probability:.2f})",
        *errors,
        f"{seconds:.0f}",
    ]
    return f"| {' | '.join(cells)} |"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--forms", default="", help="these, such as magnet,guide")
    parser.add_argument("--seed", type=int, default=1, help="of the rigs [1]")
    parser.add_argument("--train", choices=MODES, default="thesis", help="recordings [thesis]")
    given = parser.parse_args()
    print("| hidden | family | named | training | lobes | lobes of one height | steps | s |")
    print("|---|" + "---|" * 7)
    for name in given.forms.split(",") if given.forms else FORMS:
        print(line(name, given.seed, given.train), flush=True)


if __name__ == "__main__":
    main()
