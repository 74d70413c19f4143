"""Amplifier, electrode and leakage, by generator B.

Amplifier. ``tanh_stage``: V_0 tanh(v/V_0), a differential pair (Gray and Meyer, Analysis and Design
of Analog Integrated Circuits, 1977). ``slewing_pair``: dv_o/dt = S tanh((v - v_o)/(S tau)), the
same pair charging its compensation (Solomon, IEEE J. Solid-State Circuits 9, 1974): first order
for small steps, a slew limit for large ones. ``intercept``: v (1 - a (v/V)^2 + b (v/V)^4), a
polynomial as of an intercept point (Kundert, Accurate and Rapid Measurement of IP2 and IP3, 2002).

Electrode. ``measured_gauge``: R_0 (1 + a x + b x^2) in the change of stretch x (O'Brien, Calius,
Inamura, Xie and Anderson, Appl. Phys. A 100, 2010). ``contacts``: i = V_0/R sinh(dv/V_0), tunnels
between particles (Simmons, J. Appl. Phys. 34, 1963).

Leakage. ``trap_filled``: I = G v (1 + (v lam/V_0)^l), ohmic below and limited by space charge with
exponentially distributed traps above (Mark and Helfrich, J. Appl. Phys. 33, 1962).
"""

from __future__ import annotations

import numpy as np

from dearig.model.film.material import Load
from dearig.sim_backend.truth import kernels as loops
from dearig.sim_backend.truth.effect import SupplyStage, TruthEffect
from dearig.sim_backend.truth.film import FilmNumbers
from dearig.sim_backend.truth.sampling import either_sign, log_uniform
from dearig.sim_backend.truth.supply import Supply

__all__ = ["contacts", "intercept", "measured_gauge", "slewing_pair", "tanh_stage", "trap_filled"]

_FULL = 8000.0  # V; sizes are compared there
_LOST = (0.006, 0.15)  # share lost at 8 kV
_DELAY = (3.5e-3, 80e-3)  # s behind a slow rise
_SLEW = (18e3, 60e3)  # V/s; a lobe of 8 kV at 1 Hz rises by 25 kV/s
_RESISTANCE = (1.5e7, 2.5e8)  # ohm
_SERIES = (1e6, 3e6)  # ohm
_LEAK = (25.0, 500.0)  # V lost at 8 kV
_STRETCH = 1.2  # about that of the thesis's film


def _amplifier(stage: SupplyStage, words: str) -> TruthEffect:
    return TruthEffect(family="amplifier", acts_on="amplifier", description=words, on_voltage=stage)


def tanh_stage(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw a hyperbolic tangent that loses a share at 8 kV."""
    lost = log_uniform(generator, *_LOST)
    # tanh(x)/x = 1 - lost by Newton's method from the first two terms of its series
    x = float(np.sqrt(3.0 * lost))
    for _ in range(20):
        x -= (np.tanh(x) - (1.0 - lost) * x) / (1.0 / np.cosh(x) ** 2 - (1.0 - lost))
    at = _FULL / x

    def stage(time: np.ndarray, supply: Supply, carry: object) -> tuple[Supply, object]:  # noqa: ARG001
        return supply.mapped(lambda v: at * np.tanh(v / at)), carry

    return _amplifier(stage, f"the output is a tanh, {lost:.2%} too low at 8 kV")


def intercept(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw a polynomial of third and fifth order."""
    third = either_sign(generator) * log_uniform(generator, *_LOST)
    fifth = third * generator.uniform(-0.5, 0.5)

    def law(v: np.ndarray) -> np.ndarray:
        u2 = (v / _FULL) ** 2
        return np.asarray(v * (1.0 - third * u2 + fifth * u2 * u2))

    def stage(time: np.ndarray, supply: Supply, carry: object) -> tuple[Supply, object]:  # noqa: ARG001
        return supply.mapped(law), carry

    return _amplifier(
        stage, f"the output is a polynomial with {-third:.2%} and {fifth:.2%} at 8 kV"
    )


def slewing_pair(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw a first-order output whose slope saturates."""
    delay = log_uniform(generator, *_DELAY)
    slew = log_uniform(generator, *_SLEW)

    def stage(time: np.ndarray, supply: Supply, carry: object) -> tuple[Supply, object]:
        v, starts, effective = supply.pull, np.empty(time.size), np.empty(time.size)
        output = float(np.asarray(0.0 if carry is None else carry))
        output = loops.follow_pair(time, v, slew, delay, output, effective, starts)
        return supply.following(effective, starts), output

    return _amplifier(
        stage,
        f"the output follows within {delay * 1e3:.3g} ms, by no more than {slew / 1e3:.3g} kV/s",
    )


def _electrode(words: str, resistance: float, **numbers: float) -> TruthEffect:
    def on_film(film: FilmNumbers) -> FilmNumbers:
        # contacts conduct up to some ten times better under the largest gap
        return film.stepping(0.2 * resistance * film.capacitance).obeying(
            contact=resistance, **numbers
        )

    return TruthEffect(
        family="electrode_resistance", acts_on="electrode", description=words, on_film=on_film
    )


def measured_gauge(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw a resistance that is a parabola in the stretch."""
    resistance = log_uniform(generator, *_RESISTANCE)
    slope = generator.uniform(-5.0, 20.0)
    bend = generator.uniform(0.0, 600.0)
    return _electrode(
        f"electrode of {resistance / 1e6:.3g} Mohm (1 + {slope:.3g} x + {bend:.3g} x^2)",
        resistance,
        contact_slope=slope,
        contact_bend=bend,
    )


def contacts(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw contacts that conduct better under a larger voltage."""
    resistance = log_uniform(generator, *_RESISTANCE)
    voltage = log_uniform(generator, 200.0, 1500.0)
    return _electrode(
        f"electrode of {resistance / 1e6:.3g} Mohm whose contacts tunnel beyond {voltage:.3g} V",
        resistance,
        contact_voltage=voltage,
    )


def trap_filled(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw ohmic conduction that crosses over to a power of the voltage."""
    series = log_uniform(generator, *_SERIES)
    current = log_uniform(generator, *_LEAK) / series
    exponent = generator.uniform(1.5, 5.0)
    crossover = generator.uniform(0.3, 0.9) * _FULL * _STRETCH
    ohmic = current / _FULL / (1.0 + (_FULL * _STRETCH / crossover) ** exponent)

    def on_film(film: FilmNumbers) -> FilmNumbers:
        return film.hiding(leak_series=series, leak_conductance=ohmic).obeying(
            trap_voltage=crossover, trap_exponent=exponent
        )

    return TruthEffect(
        family="leakage",
        acts_on="electrode",
        description=(
            f"leakage of {current * 1e6:.3g} uA at 8 kV, ohmic up to "
            f"{crossover / _STRETCH / 1e3:.2g} kV and by the power {exponent + 1.0:.2f} above"
        ),
        on_film=on_film,
    )
