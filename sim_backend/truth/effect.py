"""Hidden effect: its name for the score, and its place in the signal path."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from dearig.model.film.material import Load
from dearig.sim_backend.plant import Air
from dearig.sim_backend.truth.film import FilmNumbers
from dearig.sim_backend.truth.supply import Supply

__all__ = ["Course", "Draw", "Stage", "SupplyStage", "TruthEffect"]

#: One step of the sensor's path, with a state between calls: ``stage(time, rows, carry)`` returns
#: the changed rows and the next ``carry``. ``carry`` is None in the first call of a run. It is
#: never changed in place, because a run may continue from it again. Rows are copies. Node 0 of a
#: call is the last node of the previous one.
Stage = Callable[[np.ndarray, np.ndarray, object], tuple[np.ndarray, object]]

#: One step from the amplifier to the film: ``stage(time, supply, carry)`` returns the changed
#: supply, with ``carry`` as in ``Stage``. A voltage at the last node holds from there on only, so
#: the next ``carry`` must not depend on it.
SupplyStage = Callable[[np.ndarray, Supply, object], tuple[Supply, object]]

#: A change that depends only on the time since the run's start: ``course(time, rows)`` returns the
#: changed rows (5, N), which start as ``film.NO_COURSE``. Rows are copies.
Course = Callable[[np.ndarray, np.ndarray], np.ndarray]


@dataclass(frozen=True)
class TruthEffect:
    """Hidden effect of a simulated rig.

    ``family`` is one of the diagnosis's families, or ``unknown`` for an effect in none of them.
    ``description`` states form and size. The effect acts through one or more of

    * ``on_film``: changes the numbers of the equation of motion;
    * ``on_course``: changes the load, the Maxwell stress or the stiffness with time;
    * ``on_voltage``: a stage of the supply of the film;
    * ``on_motion``: a stage on what the sensor sees, rows (2, N): displacement m, velocity m/s.

    ``seen`` is True where the amplifier's voltage monitor shows what the effect does to its output.
    ``redrawn`` draws the effect for another run, where a part of it differs between runs;
    ``in_room`` gives it for a run in some air, where it follows from that.
    """

    family: str
    acts_on: str
    description: str
    on_film: Callable[[FilmNumbers], FilmNumbers] | None = None
    on_course: Course | None = None
    on_voltage: SupplyStage | None = None
    on_motion: Stage | None = None
    redrawn: Callable[[np.random.Generator], TruthEffect] | None = None
    in_room: Callable[[Air], TruthEffect] | None = None
    seen: bool = False


#: Function that draws one form of an effect for a film under the load.
Draw = Callable[[np.random.Generator, Load], TruthEffect]
