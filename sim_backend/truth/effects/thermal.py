"""Warming of the film; all its moduli change with temperature.

``self_heating``: losses in proportion to the square of the voltage warm the film, which warms frame
and air around it: two bodies, two exponentials. Rubber elasticity stiffens by 1/T, a filled network
softens, so either sign occurs. ``room``: a lamp or a heater in the room, a power law of the time
since the start, A (1 - (1 + t/t_0)^-p). ``weathered``: moduli follow the room of the simulated rig
by an Arrhenius law, from recording to recording. A thermometer near the film measures each of them.
"""

from __future__ import annotations

import numpy as np

from dearig.model.film.material import Load
from dearig.sim_backend.plant import Air
from dearig.sim_backend.truth.effect import TruthEffect
from dearig.sim_backend.truth.film import COURSE_HEATING, COURSE_STIFFNESS, FilmNumbers
from dearig.sim_backend.truth.sampling import log_uniform

__all__ = ["room", "self_heating", "weathered"]

_PER_KELVIN = (-0.006, 0.0034)
_HEAT = (0.02, 0.25)  # K/s under 5 kV
_ROOM = (0.1, 3.5)  # K, final warming
_ACTIVATION = (300.0, 900.0)  # K, energy over the gas constant
_KELVIN, _REFERENCE = 273.15, 296.15  # K; films have the numbers of their data at 23 degC


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


def weathered(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw moduli exp(E/R (1/T - 1/T_0)) that follow the temperature of the room."""
    kelvin = log_uniform(generator, *_ACTIVATION)
    text = f"moduli fall by {kelvin / _REFERENCE**2:.2%}/K about 23 degC"

    def stiffness(celsius: np.ndarray) -> np.ndarray:
        return np.exp(kelvin * (1.0 / (celsius + _KELVIN) - 1.0 / _REFERENCE))

    def in_room(air: Air) -> TruthEffect:
        start = float(stiffness(air.temperature(np.zeros(1)))[0])

        def on_course(time: np.ndarray, rows: np.ndarray) -> np.ndarray:
            rows[COURSE_STIFFNESS] *= stiffness(air.temperature(time)) / start
            return rows

        return TruthEffect(
            "thermal", "environment", text, in_room=in_room,
            on_film=lambda numbers: numbers.stiffened(start), on_course=on_course,
        )  # fmt: skip

    return TruthEffect("thermal", "environment", text, in_room=in_room)
