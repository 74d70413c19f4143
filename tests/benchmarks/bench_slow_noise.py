"""How often 1/f noise is read from lead-ins of 2 s, and taken for it what is none.

Run as ``python -m tests.benchmarks.bench_slow_noise``. Noises are those of the simulated laser, at
200 Hz: white, 1/f of the same RMS in addition, and white with the slope of a drift of four noises
over the lead-in. Each is read from one lead-in and from four, as a diagnosis with three validation
recordings has them.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable

import numpy as np

from dearig.model.diagnosis.settings import DiagnosisSettings
from dearig.model.fitting.slow_noise import pink_density
from dearig.model.readings.records import ActuatorRecord
from dearig.model.simulation.actuator import Drive
from dearig.sim_backend.laser_noise import LaserNoise

_STEP = 5e-3  # s
_READINGS = 401


def at_rest(noise: np.ndarray) -> ActuatorRecord:
    """Return a record that is its lead-in, and one sample more."""
    time = _STEP * np.arange(noise.size + 1)
    voltage = np.append(np.zeros(noise.size), 1.0)
    reading = np.append(noise, 0.0)
    return ActuatorRecord("rest", Drive(time, voltage), reading, 1.0, lead_in=noise.size)


def of_laser(kind: str, rng: np.random.Generator) -> np.ndarray:
    """Return noise (N,) of the laser, in units of its white part."""
    laser = LaserNoise(kind, _STEP)
    white = rng.standard_normal(_READINGS)
    return laser.shape(white, _READINGS, rng, laser.start(rng))[0]


def drifting(rng: np.random.Generator) -> np.ndarray:
    """Return white noise (N,) on a slope."""
    return of_laser("white", rng) + 4.0 * rng.standard_normal() * np.linspace(-0.5, 0.5, _READINGS)


def main() -> None:
    """Count, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=400, help="of each noise [400]")
    given = parser.parse_args()
    settings, rng = DiagnosisSettings(), np.random.default_rng(0)
    noises: dict[str, Callable[[], np.ndarray]] = {
        "white": lambda: of_laser("white", rng),
        "white and 1/f": lambda: of_laser("pink", rng),
        "white and a drift": lambda: drifting(rng),
    }
    print("| noise | 1/f noise read from one lead-in | from four |\n|---|---|---|")
    for name, noise in noises.items():
        shares = []
        for lead_ins in (1, 4):
            read = [
                pink_density(
                    [at_rest(noise()) for _ in range(lead_ins)], settings.odds, settings.alike
                )
                for _ in range(given.cases)
            ]
            shares.append(np.mean(np.array(read) > 0.0))
        print(f"| {name} | {shares[0]:.0%} | {shares[1]:.0%} |", flush=True)


if __name__ == "__main__":
    main()
