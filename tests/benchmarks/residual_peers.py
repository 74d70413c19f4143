"""What else one would put on a model's residual: black boxes and sparse regression, run freely.

Each peer learns the residual of the baseline at a low rate, of which a few settings are tried: what
predicts the last third of every training record best, after a fit to the first two thirds, is
fitted to all of it. In every prediction it stands alone: no measured value is fed back, and the
residual starts at 0, as the film does.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from typing import Any

import numpy as np

__all__ = ["PEERS", "Course", "Peer", "missing", "predicted"]

_FULL = 8e3  # V
_MM = 1e-3
_RUNAWAY = 100.0  # of the residual's own size
_ROWS = 600  # that a Gaussian process can take in seconds


@dataclass(frozen=True)
class Course:
    """One record: ``time`` s, ``voltage`` V, ``base`` (what the baseline predicts) and its
    ``residual`` (measured less predicted) m, (N,) each."""

    time: np.ndarray
    voltage: np.ndarray
    base: np.ndarray
    residual: np.ndarray

    def slow(self, rate: float) -> Course:
        """Means over intervals of about 1/``rate`` s."""
        every = max(1, round(1.0 / (rate * float(np.median(np.diff(self.time))))))
        rows = self.time.size // every

        def mean(values: np.ndarray) -> np.ndarray:
            return values[: rows * every].reshape(rows, every).mean(axis=1)

        return Course(*(mean(v) for v in (self.time, self.voltage, self.base, self.residual)))

    def first(self, rows: int) -> Course:
        """The first ``rows`` samples."""
        return Course(self.time[:rows], self.voltage[:rows], self.base[:rows], self.residual[:rows])

    @property
    def electric(self) -> np.ndarray:
        """Voltage squared, 1 at 8 kV (N,)."""
        return (self.voltage / _FULL) ** 2

    @property
    def rate(self) -> np.ndarray:
        """Of the baseline's displacement, mm/s (N,)."""
        return np.gradient(self.base / _MM, self.time)


#: From a course to its predicted residual in m (N,), shorter or not finite where it ran away.
Predictor = Callable[[Course], np.ndarray]


@dataclass(frozen=True)
class Peer:
    """``fit(courses, scale, **setting)`` learns the residual, which has the size ``scale`` m.

    ``package`` is what must be installed: its name for ``pip`` and for ``import``. ``about`` says
    which settings are tried.
    """

    name: str
    package: tuple[str, str]
    about: str
    fit: Callable[..., Predictor]
    settings: tuple[tuple[float, dict[str, Any]], ...]


def missing(peer: Peer) -> str:
    """What to install for ``peer``; empty when it is there."""
    return "" if find_spec(peer.package[1]) else peer.package[0]


def predicted(peer: Peer, train: Sequence[Course], others: Sequence[Course]) -> list[np.ndarray]:
    """Residuals of ``others`` in m as ``peer`` predicts them from ``train``; NaN for a runaway."""
    with warnings.catch_warnings():
        # of priors at their bounds and of integrators that give up: what comes of it is judged
        warnings.simplefilter("ignore")
        rate, setting = min(peer.settings, key=lambda s: _held_out(peer, train, *s))
        slow = [course.slow(rate) for course in train]
        predictor = peer.fit(slow, _scale(slow), **setting)
        return [_free(predictor, course, rate) for course in others]


def _held_out(peer: Peer, train: Sequence[Course], rate: float, setting: dict[str, Any]) -> float:
    """Mean square error over the last third of ``train`` after a fit to the rest, or inf."""
    slow = [course.slow(rate) for course in train]
    parts = [course.first(2 * course.time.size // 3) for course in slow]
    predictor = peer.fit(parts, _scale(parts), **setting)
    total = 0.0
    for course, part in zip(slow, parts, strict=True):
        error = course.residual - _free(predictor, course, rate)
        total += float(np.mean(error[part.time.size :] ** 2))
    return total if math.isfinite(total) else math.inf


def _free(predictor: Predictor, course: Course, rate: float) -> np.ndarray:
    slow = course.slow(rate)
    found = predictor(slow)
    if found.shape != slow.time.shape or not np.isfinite(found).all():
        return np.full(course.time.size, np.nan)
    return np.interp(course.time, slow.time, found)


def _scale(courses: Sequence[Course]) -> float:
    return float(np.sqrt(np.mean(np.concatenate([c.residual for c in courses]) ** 2)))


def _narx(courses: Sequence[Course], scale: float, lags: int, feedback: bool) -> Predictor:
    from sysidentpy.basis_function import Polynomial  # type: ignore[import-not-found]
    from sysidentpy.model_structure_selection import FROLS  # type: ignore[import-not-found]
    from sysidentpy.parameter_estimation import LeastSquares  # type: ignore[import-not-found]

    def inputs(course: Course) -> np.ndarray:
        return np.column_stack([course.electric, course.base / _MM])

    model = FROLS(
        order_selection=True,
        n_info_values=20,
        ylag=lags,
        xlag=[list(range(1, lags + 1))] * 2,
        info_criteria="bic",
        estimator=LeastSquares(unbiased=feedback),
        basis_function=Polynomial(degree=2),
        model_type="NARMAX" if feedback else "NFIR",
    )
    # one row after the other: records end and begin at rest, so the joins are of a few samples
    x = np.vstack([inputs(course) for course in courses])
    model.fit(X=x, y=np.concatenate([c.residual for c in courses])[:, None] / scale)

    def predict(course: Course) -> np.ndarray:
        rest = np.zeros((course.time.size, 1))
        with np.errstate(all="ignore"):
            found = np.asarray(model.predict(X=inputs(course), y=rest), dtype=np.float64)
        found = found.ravel()
        found[np.abs(found) > _RUNAWAY] = np.nan
        return found * scale

    return predict


def _gaussian_process(courses: Sequence[Course], scale: float, seed: int) -> Predictor:
    from sklearn.gaussian_process import GaussianProcessRegressor  # type: ignore[import-not-found]
    from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel  # type: ignore[import-not-found]

    def inputs(course: Course) -> np.ndarray:
        return np.column_stack([course.base / _MM, course.rate, course.voltage / _FULL])

    x = np.vstack([inputs(course) for course in courses])
    y = np.concatenate([c.residual for c in courses]) / scale
    rows = np.random.default_rng(seed).permutation(y.size)[:_ROWS]
    spread = np.std(x, axis=0)
    model = GaussianProcessRegressor(
        ConstantKernel(1.0) * RBF(np.ones(3)) + WhiteKernel(0.1), random_state=seed
    )
    model.fit(x[rows] / spread, y[rows])
    return lambda course: np.asarray(model.predict(inputs(course) / spread)) * scale


def _sparse_dynamics(
    courses: Sequence[Course], scale: float, degree: int, threshold: float
) -> Predictor:
    def inputs(course: Course) -> np.ndarray:
        return np.column_stack([course.electric, course.base / _MM, course.rate])

    model = _sindy(degree, threshold)
    model.fit(
        [c.residual[:, None] / scale for c in courses],
        t=[c.time - c.time[0] for c in courses],
        u=[inputs(c) for c in courses],
    )

    def runs_away(t: float, x: np.ndarray) -> float:
        return float(_RUNAWAY - abs(x[0]))

    runs_away.terminal = True  # type: ignore[attr-defined]
    # in units of the residual's own size
    how = {"method": "LSODA", "rtol": 1e-3, "atol": 1e-3, "events": runs_away}

    def predict(course: Course) -> np.ndarray:
        time, given = course.time - course.time[0], inputs(course)

        def at(t: float) -> np.ndarray:
            return np.array([[np.interp(t, time, column) for column in given.T]])

        found = model.simulate(np.zeros(1), time, u=at, integrator_kws=how)
        return np.asarray(found, dtype=np.float64).ravel() * scale

    return predict


def _sparse_static(
    courses: Sequence[Course], scale: float, degree: int, threshold: float
) -> Predictor:
    def inputs(course: Course) -> np.ndarray:
        return np.column_stack([course.electric, course.base / _MM, course.rate])

    model = _sindy(degree, threshold)
    model.fit(
        [inputs(c) for c in courses],
        t=[c.time - c.time[0] for c in courses],
        # a column for each input is expected; the residual is what each is to follow
        x_dot=[np.repeat(c.residual[:, None] / scale, 3, axis=1) for c in courses],
    )
    return lambda course: np.asarray(model.predict(inputs(course)))[:, 0] * scale


def _sindy(degree: int, threshold: float) -> Any:
    import pysindy  # type: ignore[import-not-found]

    return pysindy.SINDy(
        optimizer=pysindy.STLSQ(threshold=threshold, alpha=1e-3, normalize_columns=True),
        feature_library=pysindy.PolynomialLibrary(degree=degree),
        differentiation_method=pysindy.SmoothedFiniteDifference(),
    )


def _sparse(
    courses: Sequence[Course], scale: float, dynamic: bool, degree: int, threshold: float
) -> Predictor:
    fit = _sparse_dynamics if dynamic else _sparse_static
    return fit(courses, scale, degree, threshold)


PEERS = (
    Peer(
        "NARX",
        ("sysidentpy", "sysidentpy"),
        "sysidentpy: polynomials of degree 2 in voltage^2, baseline displacement and past output, "
        "terms by FROLS and BIC; 25 or 50 Hz, 2 or 5 lags, with feedback (noise model by extended "
        "least squares) or without (NFIR)",
        _narx,
        tuple(
            (rate, {"lags": lags, "feedback": feedback})
            for rate in (25.0, 50.0)
            for lags in (2, 5)
            for feedback in (True, False)
        ),
    ),
    Peer(
        "Gaussian process",
        ("scikit-learn", "sklearn"),
        "scikit-learn: squared exponential with a length for each of baseline displacement, its "
        f"rate and voltage, plus white noise, by likelihood on {_ROWS} samples; 25 or 50 Hz",
        _gaussian_process,
        ((25.0, {"seed": 0}), (50.0, {"seed": 0})),
    ),
    Peer(
        "SINDy",
        ("pysindy", "pysindy"),
        "pysindy at 25 Hz: the residual, or its rate of change, as polynomials of degree 1, 2 (and "
        "3, of the residual) in voltage^2, baseline displacement, its rate (and the residual); "
        "smoothed differences, STLSQ with two thresholds",
        _sparse,
        tuple(
            (25.0, {"dynamic": dynamic, "degree": degree, "threshold": threshold})
            for dynamic, degrees in ((False, (1, 2, 3)), (True, (1, 2)))
            for degree in degrees
            for threshold in (0.3, 3.0)
        ),
    ),
)
