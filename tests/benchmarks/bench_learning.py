"""What each number of the learning is worth: learning with it changed, on films that are known.

Run as ``python -m tests.benchmarks.bench_learning``. The thesis's model learns on films that have
one effect more, with noise of 1 um; some readings drift, are coarse, stuck or missing, have spikes,
or a slip in one run. Printed are the errors of the film itself after five runs, over the noise.
Each variant changes one number of ``LearningSettings``: how many films come nearer to the path by a
quarter of the noise or more, and how many are farther, the most by which, and which film that is.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from dearig.model.control import Learner, LearningSettings
from dearig.model.simulation.actuator import Actuator, Drive
from tests.tools.effect_cases import THESIS, numbers, with_effect
from tests.tools.targets import path, task

NOISE = 1e-6  # m
RUNS = 5
LEAST = 0.25  # noises: a change that counts
#: Spoils a reading (N,) m of a run with its number.
Spoil = Callable[[np.ndarray, int, np.random.Generator], np.ndarray]


@dataclass(frozen=True)
class Case:
    """A film with an effect of so many typical sizes; ``seconds`` is the length of the path."""

    effect: str
    size: float = 3.0
    spoil: Spoil | None = None
    seconds: float = 4.0

    @property
    def name(self) -> str:
        """Effect and what spoils the readings."""
        return self.effect + (f", {self.spoil.__name__.strip('_')}" if self.spoil else "")


def _slip(reading: np.ndarray, run: int, _: np.random.Generator) -> np.ndarray:
    reading[reading.size // 2 :] += 6e-6 * (run == 1)
    return reading


def _drift(reading: np.ndarray, _: int, generator: np.random.Generator) -> np.ndarray:
    return reading + np.cumsum(generator.normal(0.0, 0.05e-6, reading.size))


def _coarse(reading: np.ndarray, _run: int, _: np.random.Generator) -> np.ndarray:
    return 6e-6 * np.round(reading / 6e-6)


def _spikes(reading: np.ndarray, _: int, generator: np.random.Generator) -> np.ndarray:
    at = generator.integers(0, reading.size - 3, 6)
    reading[at] += 30e-6
    reading[at + 1] += 20e-6
    return reading


def _stuck(reading: np.ndarray, _: int, generator: np.random.Generator) -> np.ndarray:
    at = int(generator.integers(reading.size // 4, reading.size // 2))
    reading[at : at + 60] = reading[at]
    return reading


def _gaps(reading: np.ndarray, _: int, generator: np.random.Generator) -> np.ndarray:
    at = int(generator.integers(0, reading.size // 3))
    reading[at : at + round(0.4 * reading.size)] = np.nan
    return reading


CASES = (
    Case("slow branch"),
    Case("slow branch", 20.0, seconds=6.0),
    Case("leakage"),
    Case("linear drag", 5.0),
    Case("load inertia", 1.0),
    Case("load inertia", 3.0),
    Case("sensor lag", 3.0),
    Case("strain-dependent permittivity"),
    Case("dry friction"),
    Case("elastoplastic hysteresis"),
    Case("leakage", spoil=_slip),
    Case("slow branch", spoil=_drift),
    Case("leakage", spoil=_coarse),
    Case("leakage", spoil=_spikes),
    Case("leakage", spoil=_stuck),
    Case("leakage", spoil=_gaps),
    Case("leakage", 0.2),
)
PLAIN = LearningSettings()
VARIANTS: dict[str, LearningSettings] = {
    "significant 0.5": replace(PLAIN, significant=0.5),
    "significant 4": replace(PLAIN, significant=4.0),
    "usable 0": replace(PLAIN, usable=0.0),
    "usable 0.9": replace(PLAIN, usable=0.9),
    "contraction 0.4": replace(PLAIN, contraction=0.4),
    "contraction 0.99": replace(PLAIN, contraction=0.99),
    "ratio 1": replace(PLAIN, ratio_max=1.0, phase_max_deg=0.0),
    "ratio any": replace(PLAIN, ratio_max=100.0, phase_max_deg=180.0),
    "ratio_octaves 0.5": replace(PLAIN, ratio_octaves=0.5),
    "ratio_octaves 2": replace(PLAIN, ratio_octaves=2.0),
    "octaves 0.5": replace(PLAIN, octaves=0.5),
    "octaves 1": replace(PLAIN, octaves=1.0),
    "octaves 4": replace(PLAIN, octaves=4.0),
    "step_backs 1": replace(PLAIN, step_backs=1),
    "step_backs any": replace(PLAIN, step_backs=99),
    "spike 3": replace(PLAIN, spike=3.0),
    "no spike, no jump": replace(PLAIN, spike=1e9),
    "spike_readings 3": replace(PLAIN, spike_readings=3),
    "stuck never": replace(PLAIN, moved=1e9),
    "moved 0": replace(PLAIN, moved=0.0),
    "released never": replace(PLAIN, released_s=1e3),
    "released_part 0.2": replace(PLAIN, released_part=0.2),
    "jump_s 0.1": replace(PLAIN, jump_s=0.1),
    "jump_apart 2": replace(PLAIN, jump_apart=2),
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--variants", help="some of them, separated by commas")
    given = parser.parse_args()
    chosen = given.variants.split(",") if given.variants else list(VARIANTS)
    plain = np.array([_left(case, PLAIN) for case in CASES]) / NOISE
    left = ", ".join(f"{case.name} {error:.2f}" for case, error in zip(CASES, plain, strict=True))
    print(f"As it is: {left}.\n")
    print("| changed | nearer | farther | most farther | film |\n|---|---|---|---|---|", flush=True)
    for name in chosen:
        errors = np.array([_left(case, VARIANTS[name]) for case in CASES]) / NOISE
        more = errors - plain
        worst = int(np.argmax(more))
        where = CASES[worst].name if more[worst] > LEAST else ""
        print(
            f"| {name} | {np.count_nonzero(more < -LEAST)} | {np.count_nonzero(more > LEAST)} | "
            f"{more[worst]:.2f} | {where} |",
            flush=True,
        )


def _left(case: Case, settings: LearningSettings) -> float:
    """Return the RMS error in m of the film itself under the voltage after so many runs."""
    generator = np.random.default_rng(0)
    truth = with_effect(THESIS, case.effect, numbers(case.effect, case.size))
    learner = Learner(THESIS, task(path(seconds=case.seconds)), settings=settings)
    for run in range(RUNS):
        reading = _moved(truth, learner) + NOISE * generator.standard_normal(learner.voltage.size)
        if case.spoil is not None:
            reading = case.spoil(reading, run, generator)
        learner.learn(reading, NOISE)
    error = (learner.first.reference - _moved(truth, learner))[learner.first.reachable]
    return float(np.sqrt(np.mean(error**2)))


def _moved(truth: Actuator, learner: Learner) -> np.ndarray:
    answer = truth.simulate(Drive(learner.first.time, learner.voltage, hold=True))
    return answer.displacement if answer.ok else np.full(learner.voltage.size, np.inf)


if __name__ == "__main__":
    main()
