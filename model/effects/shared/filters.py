"""Responses of lags, limits and yielding elements over a step of any length, without stiffness.

All are exact except the loop of Bouc and Wen, which has no closed form for a general power.
"""

from __future__ import annotations

import math

from dearig.model.compiled.jit import jit

__all__ = [
    "along_cubic",
    "bent",
    "bristles_slip",
    "lagged",
    "low_pass",
    "moved_along",
    "slewed",
    "slid",
    "switched",
    "swung",
    "wound",
    "wound_on",
]

_SMALL = 0.1
_SWITCHING = 0.02  # s: long enough for a fit to find the moment
_WINDING = 0.25  # reaches over the power, a step: within 3e-5 of the yield stress
_SHORT = 0.05  # of the value, travel times power: the series is within 3e-5
_NEARLY_ALL = 10.0  # cotangent: beyond it the approximation holds for any travel
_NEAR_ALL = 0.02  # of the same angle: all but 4e-4 slip
_LITTLE = 0.1  # of that angle, a travel: the series is within 1e-5
_ALL_SLIP = 1e6  # cotangent: bristles do not bend further
_ENOUGH = 30.0  # reaches, after which it is far beyond that
_YIELDED = 1.0 - 1e-6  # of the yield stress: the loop has saturated


@jit
def lagged(before: float, start: float, end: float, h: float, tau: float) -> float:
    """Output after ``h`` s of q' = (x - q)/tau, q(0) = ``before``, x from ``start`` to ``end``."""
    s = h / tau
    if s < _SMALL:
        # Pade's approximation: within 1.3e-7 of the change of x, a tenth of an exponential's time
        even, odd = 1.0 + s * s / 12.0, 0.5 * s
        left = (even - odd) / (even + odd)
        mean = 1.0 / (even + odd)
    else:
        left = math.exp(-s)
        mean = (1.0 - left) / s
    return end - (end - start) * mean + (before - start) * left


@jit
def _cubic(x0: float, u0: float, x1: float, u1: float, h: float) -> tuple[float, float]:
    """Second derivative at the start, and third, of the cubic through positions and rates."""
    rise = x1 - x0 - u0 * h
    bend = (u1 - u0) * h
    return (6.0 * rise - 2.0 * bend) / (h * h), (6.0 * bend - 12.0 * rise) / (h * h * h)


@jit
def low_pass(
    before: float, x0: float, u0: float, x1: float, u1: float, h: float, tau: float
) -> float:
    """Output after ``h`` s of r' = (x - r)/tau for the cubic x(t) through positions and rates."""
    a, b = _cubic(x0, u0, x1, u1, h)
    at_start = x0 - tau * (u0 - tau * (a - tau * b))
    at_end = x1 - tau * (u1 - tau * (a + b * h - tau * b))
    return at_end + (before - at_start) * math.exp(-h / tau)


@jit
def along_cubic(
    x0: float, u0: float, x1: float, u1: float, h: float, at: float
) -> tuple[float, float]:
    """Integral from the start until ``at`` s of the cubic as above, and its value there."""
    a, b = _cubic(x0, u0, x1, u1, h)
    integral = at * (x0 + at * (u0 / 2.0 + at * (a / 6.0 + at * b / 24.0)))
    return integral, x0 + at * (u0 + at * (a / 2.0 + at * b / 6.0))


@jit
def moved_along(
    x0: float, u0: float, x1: float, u1: float, h: float, at: float
) -> tuple[float, float]:
    """Position and rate after ``at`` s on the cubic as above."""
    a, b = _cubic(x0, u0, x1, u1, h)
    return x0 + at * (u0 + at * (a / 2.0 + at * b / 6.0)), u0 + at * (a + at * b / 2.0)


@jit
def swung(
    w0: float, v0: float, e0: float, e1: float, h: float, omega: float, damping: float
) -> tuple[float, float]:
    """Position and rate after ``h`` s of w'' = -2 z om w' - om^2 (w - e), e from e0 to e1."""
    slope = (e1 - e0) / h
    shift = -2.0 * damping / omega * slope
    z, v = w0 - e0 - shift, v0 - slope
    alpha = damping * omega
    beta = omega * math.sqrt(max(1.0 - damping * damping, 1e-6))
    left, c, s = math.exp(-alpha * h), math.cos(beta * h), math.sin(beta * h)
    q = (v + alpha * z) / beta
    z1 = left * (z * c + q * s)
    v1 = left * (beta * (q * c - z * s)) - alpha * z1
    return e1 + shift + z1, slope + v1


@jit
def slewed(before: float, start: float, end: float, h: float, most: float) -> float:
    """Output after ``h`` s that follows x from ``start`` to ``end`` at a slope of ``most`` or less.

    An output that is behind goes towards x at full slope, meets it, and follows as well as it can.
    """
    gap = before - start
    slope = (end - start) / h if h > 0.0 else 0.0
    left = h
    if gap != 0.0:
        closing = most + math.copysign(1.0, gap) * slope
        if abs(gap) >= closing * h:
            return before - math.copysign(most * h, gap)
        left = h - abs(gap) / closing
    return end + (min(max(slope, -most), most) - slope) * left


@jit
def slid(z: float, travel: float, reach: float) -> float:
    """Return the strain of a yielding element after ``travel``: from ``z`` towards +-``reach``."""
    end = math.copysign(reach, travel)
    return end + (z - end) * math.exp(-abs(travel) / reach)


@jit
def bristles_slip(z: float, elastic: float) -> float:
    """Part of the travel by which bristles bent to ``z`` along it slip, after Dupont and others.

    ``z`` and ``elastic``, up to which nothing slips, are fractions of the deflection of full slip.
    """
    if z <= elastic:
        return 0.0
    if z >= 1.0:
        return 1.0
    return 0.5 - 0.5 * math.cos(math.pi * (z - elastic) / (1.0 - elastic))


@jit
def _hastened(w: float, a: float) -> float:
    return (1.0 + a * math.atan2(1.0, w) * w * w) / (1.0 + a * w)


@jit
def _cotangent(w: float, h: float, a: float) -> float:
    return w * math.exp(h) + math.expm1(h) / a


@jit
def bent(z: float, travel: float, reach: float, elastic: float) -> float:
    """Deflection of bristles after ``travel`` one way: z' = 1 - slip z/``reach`` along it.

    Where they begin to slip, z = reach (1 - a x) with cos(x)^2 of slip, and w = cot(x) would obey
    w' = w + 1/a if x cos(x) were sin(x): it does at a rate that is nearly one, as is used here.
    """
    way = math.copysign(1.0, travel)
    z *= way / reach
    left = abs(travel) / reach
    free = elastic - z
    if free >= left:
        return way * reach * (z + left)
    if free > 0.0:
        z = elastic
        left -= free
    a = 2.0 / math.pi * (1.0 - elastic)
    # the common case while sliding
    if z > 1.0 - _NEAR_ALL * a:
        return way * reach * (1.0 + (z - 1.0) * math.exp(-left))
    if left < _LITTLE * a:
        angle = 2.0 * (z - elastic) / a
        slip = 0.5 - 0.5 * math.cos(angle)
        more, bend = math.sin(angle) / a, 2.0 * math.cos(angle) / (a * a)
        rate, slope = 1.0 - slip * z, -slip - more * z
        second = slope * slope - rate * (2.0 * more + bend * z)
        return way * reach * (z + left * rate * (1.0 + left / 2.0 * (slope + left / 3.0 * second)))
    w = 1.0 / math.tan((1.0 - z) / a)
    while left > 0.0 and w < _ALL_SLIP:
        h = min(left, _ENOUGH if w > _NEARLY_ALL else a)
        start = _hastened(w, a)
        middle = _hastened(_cotangent(w, 0.5 * h * start, a), a)
        middle = _hastened(_cotangent(w, 0.25 * h * (start + middle), a), a)
        end = _hastened(_cotangent(w, h * middle, a), a)
        w = _cotangent(w, h * (start + 4.0 * middle + end) / 6.0, a)
        left -= h
    return way * reach * (1.0 - a * math.atan2(1.0, w))


@jit
def _winds(b: float, exponent: float, asymmetry: float) -> float:
    bent: float = abs(b) ** exponent
    return 1.0 - bent * (1.0 - asymmetry + math.copysign(asymmetry, b))


@jit
def wound(b: float, travel: float, exponent: float, asymmetry: float) -> float:
    """Bouc and Wen's loop, -1 to 1, from ``b`` after ``travel`` one way, in reaches.

    b' = 1 - |b|^n (1 - s + s sign(b)) along the travel, by Runge and Kutta's steps of fourth order
    on either side of b = 0, where the law has a corner.
    """
    way = math.copysign(1.0, travel)
    b *= way
    left = abs(travel)
    longest = _WINDING / max(exponent, 1.0)
    # a loop that has saturated stays so
    while left > 0.0 and b < _YIELDED:
        h = min(left, longest)
        k1 = _winds(b, exponent, asymmetry)
        if b < 0.0 <= b + h * k1:
            # Simpson's rule for the travel to 0
            middle = _winds(0.5 * b, exponent, asymmetry)
            h = -b / 6.0 * (1.0 / k1 + 4.0 / middle + 1.0)
            if h <= left:
                b = 0.0
                left -= h
                continue
            h = left
        k2 = _winds(b + 0.5 * h * k1, exponent, asymmetry)
        k3 = _winds(b + 0.5 * h * k2, exponent, asymmetry)
        k4 = _winds(b + h * k3, exponent, asymmetry)
        b += h / 6.0 * (k1 + 2.0 * (k2 + k3) + k4)
        left -= h
    return way * min(b, 1.0)


@jit
def wound_on(b: float, power: float, travel: float, exponent: float, asymmetry: float) -> float:
    """As ``wound``, with ``power`` = |b|^exponent known: by a series where that is enough."""
    way = math.copysign(1.0, travel)
    b *= way
    h = abs(travel)
    if not max(exponent, 1.0) * h < _SHORT * abs(b):
        return way * wound(b, h, exponent, asymmetry)
    straight = 1.0 if b > 0.0 else 1.0 - 2.0 * asymmetry
    slope = 1.0 - straight * power
    bend = -straight * exponent * power / b
    more = bend * bend + slope * bend * (exponent - 1.0) / b
    return way * min(b + h * slope * (1.0 + h / 2.0 * (bend + h / 3.0 * more)), 1.0)


@jit
def switched(since: float) -> float:
    """Return 0 before and 1 after the moment ``since`` s ago, linear in between."""
    return min(max(since / _SWITCHING + 0.5, 0.0), 1.0)
