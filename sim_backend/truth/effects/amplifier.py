"""Amplifier whose output differs from the command; ``monitored`` says if its monitor shows it.

``offset``: a constant voltage, from the output stage. ``saturation``: the algebraic sigmoid
v/(1 + (v/v_s)^n)^(1/n). ``slew``: a straight line where the command is faster. ``second_order``:
y'' + 2 d w y' + w^2 (y - v) = 0, a control loop that is slow because its supply is weak.
"""

from __future__ import annotations

import math

import numpy as np

from dearig.model.film.material import Load
from dearig.sim_backend.truth import kernels as loops
from dearig.sim_backend.truth.effect import SupplyStage, TruthEffect
from dearig.sim_backend.truth.sampling import either_sign, log_uniform
from dearig.sim_backend.truth.supply import Supply

__all__ = ["offset", "saturation", "second_order", "slew"]

_OFFSET = (12.0, 500.0)  # V
_LOST = (0.005, 0.15)  # share lost at 8 kV
_LOBE = 25e3  # V/s, fastest rise of 8 kV at 1 Hz
_SHORT = (0.09, 0.62)  # slew limit, as a share of that
_DELAY = (3.5e-3, 120e-3)  # s behind a steady rise


def _stage(stage: SupplyStage, words: str) -> TruthEffect:
    return TruthEffect(family="amplifier", acts_on="amplifier", description=words, on_voltage=stage)


def offset(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw a constant offset of the output."""
    volts = either_sign(generator) * log_uniform(generator, *_OFFSET)

    def stage(time: np.ndarray, supply: Supply, carry: object) -> tuple[Supply, object]:  # noqa: ARG001
        return supply.mapped(lambda v: v + volts), carry

    return _stage(stage, f"the output has an offset of {volts:.3g} V")


def saturation(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw an output that saturates at high voltage."""
    lost = log_uniform(generator, *_LOST)
    exponent = generator.uniform(2.5, 8.0)
    at = 8000.0 / ((1.0 - lost) ** -exponent - 1.0) ** (1.0 / exponent)

    def law(v: np.ndarray) -> np.ndarray:
        return np.asarray(v / (1.0 + np.abs(v / at) ** exponent) ** (1.0 / exponent))

    def stage(time: np.ndarray, supply: Supply, carry: object) -> tuple[Supply, object]:  # noqa: ARG001
        return supply.mapped(law), carry

    return _stage(stage, f"the output is {lost:.2%} too low at 8 kV (exponent {exponent:.2g})")


def slew(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw an output with a limited slew rate."""
    fastest = _LOBE * (1.0 - log_uniform(generator, *_SHORT))

    def stage(time: np.ndarray, supply: Supply, carry: object) -> tuple[Supply, object]:
        v, starts, effective = supply.pull, np.empty(time.size), np.empty(time.size)
        output = float(np.asarray(0.0 if carry is None else carry))
        output = loops.limit_slew(time, v, fastest, output, effective, starts)
        return supply.following(effective, starts), output

    return _stage(stage, f"the output changes by no more than {fastest / 1e3:.3g} kV/s")


def second_order(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw an output that lags and overshoots slightly."""
    delay = log_uniform(generator, *_DELAY)
    damping = generator.uniform(0.5, 0.95)
    frequency = 2.0 * damping / delay

    def stage(time: np.ndarray, supply: Supply, carry: object) -> tuple[Supply, object]:
        v, starts, effective = supply.pull, np.empty(time.size), np.empty(time.size)
        state = np.zeros(2) if carry is None else np.array(carry)
        loops.lag_voltage(time, v, frequency, damping, state, effective, starts)
        return supply.following(effective, starts), state

    hertz = frequency / (2.0 * math.pi)
    return _stage(stage, f"the output follows at {hertz:.3g} Hz (damping ratio {damping:.2f})")
