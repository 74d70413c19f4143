"""The functions exp, phi_1, phi_2 and phi_3 of a matrix, by which exponential methods step.

phi_j(x) = sum of x^n/(n + j)! over n >= 0: phi_0 = exp, phi_1(x) = (e^x - 1)/x.
"""

from __future__ import annotations

import numpy as np

from dearig.model.compiled.jit import jit

__all__ = ["double_phi", "fill_phi"]

_TERMS = 12  # of the Taylor series: for a norm of 0.5 they leave 0.5^12/12! = 5e-13 of phi_0
_ORDERS = 4  # phi_0 .. phi_3


@jit
def _multiply(a: np.ndarray, b: np.ndarray, out: np.ndarray) -> None:
    """Write the product of two 3 by 3 matrices into ``out``."""
    for i in range(3):
        for j in range(3):
            out[i, j] = a[i, 0] * b[0, j] + a[i, 1] * b[1, j] + a[i, 2] * b[2, j]


@jit
def double_phi(phi: np.ndarray, room: np.ndarray) -> None:
    """Turn ``phi`` (4, 3, 3), the functions of a matrix, in place into those of its double.

    2^j phi_j(2x) = phi_0(x) phi_j(x) + sum of phi_i(x)/(j - i)! over i = 1 .. j (Hochbruck and
    Ostermann, Acta Numerica 19, 2010). ``room`` is (3, 3).
    """
    half = 0.125
    for j in range(3, -1, -1):
        _multiply(phi[0], phi[j], room)
        weight = 1.0
        for i in range(j, 0, -1):
            for m in range(3):
                for n in range(3):
                    room[m, n] += weight * phi[i, m, n]
            weight /= j - i + 1
        for m in range(3):
            for n in range(3):
                phi[j, m, n] = room[m, n] * half
        half *= 2.0


@jit
def fill_phi(a: np.ndarray, doublings: int, room: np.ndarray, phi: np.ndarray) -> None:
    """Fill ``phi`` (4, 3, 3) with exp and phi_1 .. phi_3 of ``a`` (3, 3) times 2^``doublings``.

    The Taylor series of ``a``, whose norm should be 0.5 at most, then doubled. ``room`` is
    (2, 3, 3).
    """
    power, product = room[0], room[1]
    phi[:] = 0.0
    power[:] = 0.0
    power[0, 0] = power[1, 1] = power[2, 2] = 1.0
    factorial = 1.0
    for n in range(_TERMS):
        below = factorial
        for j in range(_ORDERS):
            part = 1.0 / below
            for m in range(3):
                for i in range(3):
                    phi[j, m, i] += power[m, i] * part
            below *= n + j + 1
        _multiply(power, a, product)
        for m in range(3):
            for i in range(3):
                power[m, i] = product[m, i]
        factorial *= n + 1
    for _ in range(doublings):
        double_phi(phi, product)
