"""Records that a model made, for the tests of the diagnosis: a film of one branch, and quick."""

from __future__ import annotations

import functools
from collections.abc import Sequence as Several
from dataclasses import replace

import numpy as np

from dearig.model import kernel
from dearig.model.diagnosis.fits import Fit
from dearig.model.effects import EFFECTS, EffectValues
from dearig.model.film.material import THESIS_FILM, THESIS_LOAD, Branch, Network, Spring
from dearig.model.fitting.parameters import FitLayout
from dearig.model.fitting.problem import Problem
from dearig.model.fitting.slow_noise import WhitenedProblem
from dearig.model.readings.records import ActuatorRecord, FilmRecord, Record
from dearig.model.simulation.actuator import Actuator, Drive
from dearig.model.simulation.excitation import Sequence
from dearig.model.simulation.strip import Strip

NOISE = 1e-6
ONE = Network.gent((45e3, 60e3), (1e4, 1e4), (0.4,))
PLAIN = Actuator(THESIS_FILM, THESIS_LOAD, ONE)
STRIP = Strip(Network(Spring(40e3, 60.0), (Branch(Spring(30e3, 80.0), 2.0),)))
FILM_NOISE = 20.0


def effect(name: str, **numbers: float) -> EffectValues:
    """One effect as models take it."""
    return ((name, tuple(numbers.items())),)


@functools.cache
def thesis_drive(rate: float = 100.0, periods: int = 1) -> Drive:
    """The thesis's excitation, straight between samples."""
    return Drive(*Sequence.thesis(periods=periods).sample(rate))


def record_of(
    model: Actuator, drive: Drive | None = None, seed: int = 0, noise: float = NOISE
) -> ActuatorRecord:
    """What ``model`` shows on the thesis's excitation, with noise."""
    drive = drive or thesis_drive()
    answer = model.simulate(drive)
    assert answer.ok, answer.status_text
    rng = np.random.default_rng(seed)
    noisy = answer.displacement + noise * rng.standard_normal(drive.time.size)
    return ActuatorRecord("made", drive, noisy, noise)


def pink_noise(rng: np.random.Generator, n: int, density: float) -> np.ndarray:
    """Noise (n,) at 100 Hz of density p/f in m^2/Hz between a period and half the rate."""
    f = np.fft.rfftfreq(8 * n, 0.01)
    size = np.zeros(f.size)
    size[1:] = np.sqrt(density / f[1:] * 8 * n / 0.02)
    turned = np.exp(2j * np.pi * rng.random(f.size))
    return np.fft.irfft(size * turned, 8 * n)[:n]


def film_record_of(model: Strip, seed: int = 0, noise: float = FILM_NOISE) -> FilmRecord:
    """A strip pulled, let go fast, pulled further, held, and let go."""
    time = np.linspace(0.0, 40.0, 801)
    corners = [0.0, 5.0, 6.0, 12.0, 20.0, 30.0, 31.0, 40.0]
    stretch = np.interp(time, corners, [1.0, 1.5, 1.05, 1.05, 1.9, 1.9, 1.05, 1.05])
    answer = model.simulate(time, stretch)
    assert answer.ok, answer.status_text
    rng = np.random.default_rng(seed)
    noisy = answer.stress + noise * rng.standard_normal(time.size)
    return FilmRecord("strip", time, stretch, noisy, noise)


def typical(name: str) -> tuple[str, tuple[tuple[str, float], ...]]:
    """The effect ``name`` with numbers that would be noticed."""
    numbers = EFFECTS[name].parameters
    return name, tuple((p.name, min(max(p.typical, p.bounds[0]), p.bounds[1])) for p in numbers)


def posed(
    model: Actuator, record: Record, fidelity: int = kernel.CAREFUL
) -> tuple[Problem, np.ndarray, np.ndarray]:
    """A problem, ``model``'s coordinates (d,) and which are free (d,): all but locking limits."""
    layout = FitLayout(model)
    free = np.ones(layout.size, dtype=bool)
    free[layout.column("J")] = False
    problem = Problem([record], layout, workers=1, fidelity=fidelity)
    return problem, layout.coordinates(layout.initial()), free


def made_fit(records: Several[Record], model: Actuator | Strip, residual: np.ndarray) -> Fit:
    """A fit in which measured less model is ``residual`` (N,), whatever the records say."""
    layout = FitLayout(model)
    problem = WhitenedProblem(records, layout, workers=1)
    start = layout.coordinates(layout.initial())
    over = np.where(np.isfinite(problem.sigma), -residual / problem.sigma, 0.0)
    held = np.zeros(layout.size, dtype=bool)
    empty = np.zeros((over.size, 0))
    return Fit(problem, start, held, float(np.mean(over**2)), over, empty)


def masked(record: ActuatorRecord, bad: np.ndarray) -> ActuatorRecord:
    """``record`` whose readings ``bad`` (N,) are rubbish, and marked as such."""
    rubbish = np.where(bad, 5e-3, record.displacement)
    return replace(record, displacement=rubbish, valid=~bad)
