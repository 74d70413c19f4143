"""Present run of the rig: its number, its start, and the faults that are timed from it."""

from __future__ import annotations

import math

from dearig.sim_backend.daqmx.card.state import CardState
from dearig.sim_backend.faults import Fault, FaultKind, FaultPlan

__all__ = ["RigRun"]


class RigRun:
    """Run of the rig with ``faults``: from the start of its inputs on, with the film at rest."""

    def __init__(self, state: CardState, faults: FaultPlan) -> None:
        self._state = state
        self._faults = faults
        self._number = 0
        self._fired: set[Fault] = set()
        self.start: float | None = None  # s; None before the sample clock runs
        self.readings = 0  # of inputs without a clock
        self.laser: tuple[int, float] | None = None  # counts and range of the last reading

    def begin(self) -> int:
        """Begin a new run, whose clock does not run yet; returns its number."""
        number = self._number
        self._number += 1
        self.start = None
        self._fired.clear()
        return number

    def clock_runs(self, since: float | None) -> None:
        """Note that the sample clock runs ``since`` s, unless it did before."""
        if self.start is None:
            self.start = since

    def _elapsed(self, now: float) -> float:
        """Return the time in s since the present run's sample clock started; negative before."""
        return -1.0 if self.start is None else now - self.start

    def underflow_tick(self, at: float, rate: float) -> float | None:
        """Return the first tick of a generation from ``at`` s on at ``rate`` Hz that fails."""
        since = at if self.start is None else self.start
        faults = self._faults.of(FaultKind.AO_UNDERFLOW)
        ticks = [math.ceil((since + fault.at - at) * rate) for fault in faults]
        return min((tick for tick in ticks if tick > 0), default=None)

    def overflows(self, now: float) -> bool:
        """Return True once the plan has the input buffer overflow."""
        elapsed = self._elapsed(now)
        return any(fault.at <= elapsed for fault in self._faults.of(FaultKind.AI_OVERFLOW))

    def active(self, kind: FaultKind) -> Fault | None:
        """Return an active fault of ``kind``, timed from the start of the run's clock, or None."""
        with self._state.present() as now:
            elapsed = self._elapsed(now)
        return next((f for f in self._faults.of(kind) if f.at <= elapsed < f.end), None)

    def fires(self, kind: FaultKind) -> Fault | None:
        """Return a fault of ``kind`` that is due, once in a run, or None."""
        with self._state.present() as now:
            elapsed = self._elapsed(now)
            for fault in self._faults.of(kind):
                if fault.at <= elapsed and fault not in self._fired:
                    self._fired.add(fault)
                    return fault
            return None
