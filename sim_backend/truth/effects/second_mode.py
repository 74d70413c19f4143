"""Second mode: another weakly damped oscillator. In no family.

``hanger``: part of the load hangs on its own spring, u'' + 2 d w u' + w^2 u = -x'', and pulls on
the film with m (w^2 u + 2 d w u'). ``frame``: the load shakes the sensor's stand, which follows the
same equation times a coupling; its displacement adds to the reading.
"""

from __future__ import annotations

import math

import numpy as np

from dearig.model.film.material import Load
from dearig.sim_backend.truth import kernels as loops
from dearig.sim_backend.truth.effect import TruthEffect
from dearig.sim_backend.truth.film import FilmNumbers
from dearig.sim_backend.truth.sampling import log_uniform

__all__ = ["frame", "hanger"]

_HANGER_HERTZ = (3.0, 5.0)
_HANGER_DAMPING = (0.005, 0.03)
_MASS = (0.5, 1.0)  # of the load
_FRAME_HERTZ = (3.0, 12.0)
_FRAME_DAMPING = (0.04, 0.1)
_COUPLING = (0.4, 2.0)  # times the square of the frequency in 5 Hz


def hanger(generator: np.random.Generator, load: Load) -> TruthEffect:
    """Draw a mass on a spring below the film."""
    hertz = log_uniform(generator, *_HANGER_HERTZ)
    damping = log_uniform(generator, *_HANGER_DAMPING)
    mass = load.mass * log_uniform(generator, *_MASS)

    def on_film(numbers: FilmNumbers) -> FilmNumbers:
        return numbers.hiding(
            second_inertia=mass * numbers.length / numbers.section,
            second_frequency=2.0 * math.pi * hertz,
            second_damping=damping,
        )

    return TruthEffect(
        family="unknown",
        acts_on="load",
        description=(
            f"{mass * 1e3:.3g} g of the load hang on a spring of {hertz:.3g} Hz (damping ratio "
            f"{damping:.2g})"
        ),
        on_film=on_film,
    )


def frame(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw a stand that the load shakes."""
    hertz = log_uniform(generator, *_FRAME_HERTZ)
    damping = log_uniform(generator, *_FRAME_DAMPING)
    coupling = log_uniform(generator, *_COUPLING) * (hertz / 5.0) ** 2
    frequency = 2.0 * math.pi * hertz

    def on_motion(time: np.ndarray, rows: np.ndarray, carry: object) -> tuple[np.ndarray, object]:
        state = np.array((coupling * rows[0, 0], 0.0)) if carry is None else np.array(carry)
        swaying = np.empty_like(rows)
        loops.sway(time, rows, frequency, damping, coupling, state, swaying)
        return rows + swaying, state

    return TruthEffect(
        family="unknown",
        acts_on="sensor",
        description=(
            f"the sensor's stand is shaken at {hertz:.3g} Hz (damping ratio {damping:.2g}, "
            f"coupling {coupling:.2g})"
        ),
        on_motion=on_motion,
    )
