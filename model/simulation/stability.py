"""Static stretch under a constant voltage, up to the voltage at which the film pulls in.

With relaxed branches only the equilibrium spring holds the load and the field, so each stretch has
one voltage, V^2 = (S(lam) - F)/(eps/Z^2 a(lam)), and the film is stable while it grows with lam:
pull-in is the first maximum of V along that curve (Zhao and Suo, 2007).
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from dearig.model.coefficients import ELECTRIC, FORCE, HELD, KIND, LOCKING, MODULUS
from dearig.model.errors import ModelError
from dearig.model.film.network import HEAD, nominal_pull, nominal_pull_slope, shape_at
from dearig.model.kinematics import electric, electric_slope, strain_and_pull
from dearig.model.simulation.actuator import Actuator

__all__ = ["pull_in_voltage", "static_stretch"]

_STRETCH_MAX = 100.0  # as in the kernel: beyond any elastomer
_POINTS = 4000  # along the curve: its maximum and a Gent spring's stiffening may lie close together
_FLAT = 0.1  # d ln V^2/d ln lam at the end of the curve, below which it approaches a limit


def pull_in_voltage(actuator: Actuator) -> float | None:
    """Largest voltage in V with a stable static stretch, branches relaxed, on the way up from 0 V.

    None where the voltage grows all the way to the locking stretch: such a film stiffens before it
    can run away. Without locking, a voltage that only approaches a limit has that limit (held in
    width, neo-Hookean, unloaded: Z sqrt(mu_0/eps)). Raises ``ModelError`` where the load has no
    rest state.
    """
    c = actuator.coefficients()
    stretch = _last_stable(c, actuator.rest())
    return None if stretch is None else _voltage(c, stretch)


def static_stretch(actuator: Actuator, voltage: float) -> float:
    """Stable stretch under the load and a constant ``voltage`` in V, branches relaxed.

    Raises ``ModelError`` beyond the pull-in voltage, and where the load has no rest state.
    """
    if not math.isfinite(voltage):
        raise ModelError(f"voltage = {voltage!r} V must be a finite number")
    c = actuator.coefficients()
    low = actuator.rest()
    last = _last_stable(c, low)
    high = _end(c) if last is None else last
    if last is not None and abs(voltage) > _voltage(c, last):
        raise ModelError(
            f"no stable stretch at {voltage * 1e-3:.6g} kV: the film pulls in at "
            f"{_voltage(c, last) * 1e-3:.6g} kV"
        )
    return _bisect(lambda lam: _voltage(c, lam) < abs(voltage), low, high)


def _pull(c: np.ndarray, lam: float) -> tuple[float, float]:
    """Stress in Pa that the field has to hold at stretch ``lam``, and its slope."""
    spring = (int(c[HELD]), int(c[HEAD + KIND]), shape_at(c, HEAD), c[HEAD + LOCKING], lam)
    modulus = c[HEAD + MODULUS]
    return modulus * nominal_pull(*spring) - c[FORCE], modulus * nominal_pull_slope(*spring)


def _voltage(c: np.ndarray, lam: float) -> float:
    """Voltage in V that balances stretch ``lam``, 0 where the load alone stretches further."""
    stress, _ = _pull(c, lam)
    return math.sqrt(max(stress, 0.0) / (c[ELECTRIC] * electric(int(c[HELD]), lam)))


def _growth(c: np.ndarray, lam: float) -> float:
    """D(ln V^2)/d(ln lam) times the stress that the field holds, in Pa: positive where stable."""
    held = int(c[HELD])
    stress, slope = _pull(c, lam)
    if math.isinf(slope):
        return math.inf
    return lam * (slope - stress * electric_slope(held, lam) / electric(held, lam))


def _end(c: np.ndarray) -> float:
    """Locking stretch of the equilibrium spring, or the largest stretch that counts."""
    held, locking = int(c[HELD]), c[HEAD + LOCKING]

    def unlocked(lam: float) -> bool:
        strain, _ = strain_and_pull(held, lam * lam, 1.0 / (lam * lam))
        return bool(strain < locking)

    return _STRETCH_MAX if unlocked(_STRETCH_MAX) else _bisect(unlocked, 1.0, _STRETCH_MAX)


def _last_stable(c: np.ndarray, rest: float) -> float | None:
    """Stretch at the first maximum of the voltage, or None where it grows to the end."""
    end = _end(c)
    # towards locking everything happens within little stretch: half of the points gather there
    gathered = end - (end - rest) * np.geomspace(1.0, 1e-9, _POINTS // 2)
    stretch = np.union1d(np.geomspace(rest, end, _POINTS // 2), gathered)
    stretch = stretch[(stretch >= rest) & (stretch < end)]
    growing = np.array([_growth(c, lam) > 0.0 for lam in stretch])
    if growing.all():
        last = float(stretch[-1])
        flat = end >= _STRETCH_MAX and _growth(c, last) < _FLAT * _pull(c, last)[0]
        return last if flat else None
    first = int(np.argmin(growing))
    below = float(stretch[max(first - 1, 0)])
    return _bisect(lambda lam: _growth(c, lam) > 0.0, below, float(stretch[first]))


def _bisect(inside: Callable[[float], bool], low: float, high: float) -> float:
    """Last number from ``low`` on for which ``inside`` still holds; it fails at ``high``."""
    while True:
        middle = 0.5 * (low + high)
        if middle in (low, high):
            return low
        if inside(middle):
            low = middle
        else:
            high = middle
