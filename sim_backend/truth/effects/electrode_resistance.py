"""Resistance of the carbon electrodes, through which the film charges with a delay.

``ladder``: the electrode as a line of two sections, each with half the film's present capacitance
C = C0 lam^2. The sections lie side by side, so the Maxwell stress is that of the mean of their
squared voltages. ``percolating``: one section whose resistance grows as exp(g (lam - lam_rest)),
like that of carbon particles that lose contact.
"""

from __future__ import annotations

import math

import numpy as np

from dearig.model.film.material import Load
from dearig.sim_backend.truth.effect import TruthEffect
from dearig.sim_backend.truth.film import FilmNumbers
from dearig.sim_backend.truth.sampling import log_uniform

__all__ = ["ladder", "percolating"]

_LADDER = (20e6, 4.5e8)  # ohm from end to end
_PERCOLATING = (11e6, 2.6e8)  # ohm
_RATIO = (0.4, 2.5)  # of the sections' resistances
_GAUGE = (8.0, 30.0)


def ladder(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw a line of two sections."""
    whole = log_uniform(generator, *_LADDER)
    ratio = log_uniform(generator, *_RATIO)
    first, second = whole / (1.0 + ratio), whole * ratio / (1.0 + ratio)

    def on_film(numbers: FilmNumbers) -> FilmNumbers:
        # the faster of the two charging rates; a stretched film is slower
        a, b = 1.0 / first, 1.0 / second
        fastest = (a + 2.0 * b + math.sqrt(a * a + 4.0 * b * b)) / numbers.capacitance
        return numbers.stepping(2.0 / fastest).hiding(ladder_1=first, ladder_2=second)

    return TruthEffect(
        family="electrode_resistance",
        acts_on="electrode",
        description=f"electrode of two sections, {first / 1e6:.3g} and {second / 1e6:.3g} Mohm",
        on_film=on_film,
    )


def percolating(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw one section whose resistance grows with stretch."""
    resistance = log_uniform(generator, *_PERCOLATING)
    gauge = log_uniform(generator, *_GAUGE)

    def on_film(numbers: FilmNumbers) -> FilmNumbers:
        return numbers.stepping(resistance * numbers.capacitance).hiding(
            ladder_1=resistance, ladder_gauge=gauge
        )

    return TruthEffect(
        family="electrode_resistance",
        acts_on="electrode",
        description=(
            f"electrode of {resistance / 1e6:.3g} Mohm that grows by {gauge:.3g} % for each per "
            f"cent of stretch"
        ),
        on_film=on_film,
    )
