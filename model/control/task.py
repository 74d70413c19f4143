"""The displacement that a film is to follow, with the limits of the voltage."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dearig.model.control.limits import VoltageLimits
from dearig.model.errors import ModelError

__all__ = ["BANDWIDTH", "TrackingTask"]

#: Hz: what is faster in a target is taken off. A loaded film rings at 7 Hz and a bare one at 70 Hz;
#: beyond, the voltage that follows a path grows with the square of the frequency.
BANDWIDTH = 25.0

#: Part of the sample rate that a band reaches at most: the low-pass ends at twice its edge, which
#: stays a little below half of the rate.
_OF_RATE = 0.2


@dataclass(frozen=True, eq=False)
class TrackingTask:
    """A displacement to follow, and what holds for every voltage that is computed for it.

    Parameters
    ----------
    target : (N,) array
        Displacement from the loaded rest state in m, at ``rate`` Hz.
    limits : VoltageLimits
        Every voltage stays within them, whatever the target asks for.
    lead_in, tail : int
        Samples at the begin and at the end in which the voltage is 0 V and nothing is followed.
    lag : float
        Known age of a reading in s.
    bandwidth : float
        Frequency in Hz above which the target is smoothed.

    Raises
    ------
    ModelError
        For a target that is not a row of finite numbers, or that has nothing between its ends.
    """

    target: np.ndarray
    rate: float
    limits: VoltageLimits
    lead_in: int = 0
    tail: int = 0
    lag: float = 0.0
    bandwidth: float = BANDWIDTH

    def __post_init__(self) -> None:
        target = np.asarray(self.target, dtype=np.float64)
        if target.ndim != 1 or target.size < 4 or not np.isfinite(target).all():
            raise ModelError("a target is a row of at least 4 finite displacements")
        if self.lead_in + self.tail > target.size - 2:
            raise ModelError("a target has samples between its lead-in and its tail")
        object.__setattr__(self, "target", target)

    @property
    def samples(self) -> int:
        """Number N of samples."""
        return self.target.size

    @property
    def time(self) -> np.ndarray:
        """Time (N,) in s."""
        return np.arange(self.samples) / self.rate

    @property
    def inside(self) -> np.ndarray:
        """True (N,) between lead-in and tail."""
        at = np.arange(self.samples)
        return (at >= self.lead_in) & (at < self.samples - self.tail)

    @property
    def edge(self) -> float:
        """Frequency in Hz up to which the target is followed at this rate."""
        return min(self.bandwidth, _OF_RATE * self.rate)
