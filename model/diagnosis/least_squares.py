"""Least squares of the regression: within bounds, between nodes, and along certain directions."""

from __future__ import annotations

import math

import numpy as np
import scipy  # loads its parts when they are first used, which a run may never do

__all__ = ["bounded", "lagrange", "well_determined"]

_WELL = 1e-2  # of the largest: directions along which the parent is straight over a step


def lagrange(t: float) -> np.ndarray:
    """Return the weights (4,) of cubic interpolation at ``t`` between nodes 0, 1, 2, 3."""
    return np.array(
        [
            -(t - 1.0) * (t - 2.0) * (t - 3.0) / 6.0,
            t * (t - 2.0) * (t - 3.0) / 2.0,
            -t * (t - 1.0) * (t - 3.0) / 2.0,
            t * (t - 1.0) * (t - 2.0) / 6.0,
        ]
    )


def bounded(
    triangle: np.ndarray,
    inside: np.ndarray,
    outside: np.ndarray,
    d_inside: np.ndarray,
    d_outside: np.ndarray,
    low: np.ndarray,
    high: np.ndarray,
) -> tuple[np.ndarray, float]:
    """Return a (k,) with low <= a <= high and the norm of the misfit, with moduli of any size >= 0.

    It minimises |triangle mu - inside - d_inside a|^2 + |outside + d_outside a|^2 over mu >= 0 and
    a; where that leaves the bounds, a is clipped and the moduli follow.
    """
    springs, k = triangle.shape[1], low.size
    both = np.column_stack([d_outside, outside])
    corner = np.asarray(np.linalg.qr(both, mode="r"))
    two_sided = low < 0.0
    d_in = np.hstack([-d_inside, d_inside[:, two_sided]])
    d_out = np.hstack([-corner[:, :k], corner[:, :k][:, two_sided]])
    rows = np.zeros((triangle.shape[0] + corner.shape[0], springs + d_in.shape[1]))
    rows[: triangle.shape[0], :springs] = triangle
    rows[: triangle.shape[0], springs:] = d_in
    rows[triangle.shape[0] :, springs:] = d_out
    scale = np.linalg.norm(rows, axis=0)
    scale[scale == 0.0] = 1.0
    wanted = np.concatenate([inside, corner[:, k]])
    found, left = scipy.optimize.nnls(rows / scale, wanted, maxiter=30 * scale.size)
    found = found / scale
    a = found[springs : springs + k].copy()
    a[two_sided] -= found[springs + k :]
    held = np.clip(a, low, high)
    if np.array_equal(held, a):
        return a, float(left)
    _, in_springs = scipy.optimize.nnls(triangle, inside + d_inside @ held)
    return held, math.hypot(in_springs, float(np.linalg.norm(corner[:, k] + corner[:, :k] @ held)))


def well_determined(jacobian: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return directions (M, w) of the readings that are well determined, and the inverse (f, w)."""
    scale = np.maximum(np.linalg.norm(jacobian, axis=0), 1e-300)
    u, s, vt = np.linalg.svd(jacobian / scale, full_matrices=False)
    used = s > _WELL * s[0]
    return u[:, used], (vt[used] / s[used, None]).T / scale[:, None]
