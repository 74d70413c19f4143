"""Warming of the film; all its moduli change with temperature.

``self_heating``: losses in proportion to the square of the voltage warm the film, which warms frame
and air around it: two bodies, two exponentials. Rubber elasticity stiffens by 1/T, a filled network
softens, so either sign occurs. ``room``: a lamp or a heater in the room, a power law of the time
since the start, A (1 - (1 + t/t_0)^-p). A thermometer near the film measures either.
"""

from __future__ import annotations

import numpy as np

from dearig.model.material import Load
from dearig.sim_backend.truth.effect import TruthEffect
from dearig.sim_backend.truth.film import COURSE_HEATING, COURSE_STIFFNESS, FilmNumbers
from dearig.sim_backend.truth.sampling import log_uniform

__all__ = ["room", "self_heating"]

_PER_KELVIN = (-0.006, 0.0034)
_HEAT = (0.02, 0.25)  # K/s under 5 kV
_ROOM = (0.1, 3.5)  # K, final warming


def _coefficient(generator: np.random.Generator) -> float:
    """Draw the change of moduli per K: of a filled network or ideal rubber, within a third."""
    return float(generator.choice(_PER_KELVIN) * generator.uniform(0.67, 1.0))


def self_heating(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw warming by the film's losses."""
    heat = log_uniform(generator, *_HEAT)
    time, time_2 = log_uniform(generator, 4.0, 15.0), log_uniform(generator, 40.0, 200.0)
    share = generator.uniform(0.05, 0.4)
    coefficient = _coefficient(generator)

    def on_film(numbers: FilmNumbers) -> FilmNumbers:
        return numbers.hiding(
            heat=heat / 5000.0**2,
            heat_time=time,
            heat_share=share,
            heat_time_2=time_2,
            heat_stiffness=coefficient,
        )

    return TruthEffect(
        family="thermal",
        acts_on="environment",
        description=(
            f"the film warms by {heat * 1e3:.3g} mK/s under 5 kV (time constants {time:.2g} and "
            f"{time_2:.3g} s); moduli change by {coefficient:.2%}/K"
        ),
        on_film=on_film,
    )


def room(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw warming from outside."""
    end = log_uniform(generator, *_ROOM)
    time, power = log_uniform(generator, 3.0, 15.0), generator.uniform(0.4, 1.2)
    coefficient = _coefficient(generator)

    def on_course(t: np.ndarray, rows: np.ndarray) -> np.ndarray:
        warming = end * (1.0 - (1.0 + t / time) ** -power)
        rows[COURSE_STIFFNESS] *= 1.0 + coefficient * warming
        rows[COURSE_HEATING] += warming
        return rows

    return TruthEffect(
        family="thermal",
        acts_on="environment",
        description=(
            f"the room warms by {end:.3g} K from {time:.2g} s on (power {power:.2f}); moduli "
            f"change by {coefficient:.2%}/K"
        ),
        on_course=on_course,
    )
