"""A hidden effect: its name for the score, and the place of the signal path it acts on."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from dearig.model.material import Load
from dearig.sim_backend.truth.film import FilmNumbers

__all__ = ["Course", "Draw", "Stage", "TruthEffect"]

#: One step of a signal path, carried from call to call: ``stage(time, rows, carry)`` returns the
#: changed rows and what to hand it the next time. ``carry`` is None in the first call of a run, and
#: is never changed in place: a run may be taken up again from it. Rows are copies. Node 0 of a call
#: is the last node of the one before; a voltage at the last node stands for nothing yet (it holds
#: from there on), so no carry may depend on it.
Stage = Callable[[np.ndarray, np.ndarray, object], tuple[np.ndarray, object]]

#: What depends on the time since the run's start alone: ``course(time, rows)`` returns the changed
#: rows (4, N), which start as ``film.NO_COURSE``. Rows are copies.
Course = Callable[[np.ndarray, np.ndarray], np.ndarray]


@dataclass(frozen=True)
class TruthEffect:
    """One hidden effect of a simulated rig.

    ``family`` is one of the diagnosis's families, or ``unknown`` for what is in none of them;
    ``description`` says form and size. It acts through one or more of

    * ``on_film``: changes the numbers of the equation of motion;
    * ``on_course``: changes the load, the pull of the voltage or the stiffness as time goes by;
    * ``on_voltage``: a stage on the voltage (N,) V that reaches the film, held from node to node;
    * ``on_motion``: a stage on what the sensor sees, rows (2, N): displacement m, velocity m/s.

    ``redrawn`` draws it for another run, where a part of it differs from run to run.
    """

    family: str
    acts_on: str
    description: str
    on_film: Callable[[FilmNumbers], FilmNumbers] | None = None
    on_course: Course | None = None
    on_voltage: Stage | None = None
    on_motion: Stage | None = None
    redrawn: Callable[[np.random.Generator], TruthEffect] | None = None


#: Draws one effect in one form for a film under the load.
Draw = Callable[[np.random.Generator, Load], TruthEffect]
