"""Starts of a film's fit: what is read is not the network's stress where the model has effects."""

from __future__ import annotations

import numpy as np
import pytest

from dearig.model.effects import EffectValues
from dearig.model.film.material import Branch, Network, Spring
from dearig.model.fitting.parameters import FitLayout
from dearig.model.fitting.problem import Problem
from dearig.model.fitting.search import film_starts
from dearig.model.simulation.strip import Strip
from tests.tools.engine import effect, film_record_of

NETWORK = Network(Spring(20e3), (Branch(Spring(80e3), 0.6), Branch(Spring(30e3), 8.0)))


@pytest.mark.parametrize(
    "effects",
    [
        effect("slack", looseness=1.0),  # the strip pushes and nothing is read for 15 of 40 s
        effect("linear drag", drag=3e4),
        effect("Mullins softening", softening=0.4, width=0.2),
    ],
)
def test_the_best_start_has_the_springs_behind_an_effect(effects: EffectValues) -> None:
    strip = Strip(NETWORK, effects=effects)
    problem = Problem([film_record_of(strip)], FitLayout(strip), workers=1)
    layout = problem.layout
    best = film_starts(problem, lambda *_: None, stiffening=False, starts=1)
    values = dict(zip(layout.names, layout.values(best[0]), strict=True))
    # relaxation times are on a grid, each 1.7 times the one before
    assert values["T_1"] == pytest.approx(0.6, rel=0.7)
    assert values["T_2"] == pytest.approx(8.0, rel=0.7)
    for place, spring in enumerate(NETWORK.springs):
        assert values[f"mu_{place}"] == pytest.approx(spring.modulus, rel=0.3)
    # a search that takes what is read for the stress of the springs leaves more
    neutral = Strip(NETWORK)
    without = Problem([film_record_of(strip)], FitLayout(neutral), workers=1)
    plain = film_starts(without, lambda *_: None, stiffening=False, starts=1)
    row = np.append(plain[0], best[0][plain[0].size :])
    assert problem.costs(best)[0] < 0.5 * problem.costs(row[None])[0]
