"""Cross-validation over segments of time without a fit for each segment."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

__all__ = ["left_out"]

_SEGMENTS = 10  # of time, each predicted by a fit to the others
_RIDGE = 1e-3  # of a parameter's own curvature, so that no segment alone determines it


def left_out(residuals: np.ndarray, jacobian: np.ndarray, reach: np.ndarray) -> np.ndarray:
    """Return residuals over noise (N,) of each segment of time, predicted by a fit to all others.

    ``residuals`` (N,) and their ``jacobian`` (N, P) are at the optimum; ``reach`` (P,) is the most
    that a parameter may change. The fit without a segment is the linear one about the optimum:
    exact where the model is linear over the change that a segment makes, and that is small where a
    segment is one of many. Rows of the ``jacobian`` beyond the N-th are of other data, which are
    never left out.
    """
    edges = np.linspace(0, residuals.size, _SEGMENTS + 1).astype(int)
    out = residuals.copy()
    normal = jacobian.T @ jacobian
    scale = np.sqrt(np.maximum(np.diag(normal), 1e-300))
    for low, high in pairwise(edges):
        part, r = jacobian[low:high], residuals[low:high]
        rest = (normal - part.T @ part) / np.outer(scale, scale)
        w, q = np.linalg.eigh(rest)
        inverse = (q / (np.maximum(w, 0.0) + _RIDGE)) @ q.T
        # at the optimum the gradient of the others is minus that of the segment
        step = np.clip(inverse @ ((part.T @ r) / scale) / scale, -reach, reach)
        out[low:high] = r + part @ step
    return out
