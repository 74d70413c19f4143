"""Models, values and drives that the tests of every effect share."""

from dataclasses import replace

import numpy as np
import pytest

from dearig.model.effects import EFFECTS
from dearig.model.film.material import TABLE_3, THESIS_FILM, THESIS_LOAD, Branch, Network, Spring
from dearig.model.simulation.actuator import Actuator
from dearig.model.simulation.strip import Strip
from tests.tools.effect_oracle import limited

THESIS = Actuator(THESIS_FILM, THESIS_LOAD, TABLE_3)
STRIP = Strip(Network(Spring(40e3, 60.0), (Branch(Spring(30e3, 80.0), 2.0),)))
BY_VOLTAGE = [n for n, e in EFFECTS.items() if "voltage" in e.drives]
BY_STRETCH = [n for n, e in EFFECTS.items() if "stretch" in e.drives]

MOMENT = 1.5  # s, of an effect that happens at a moment


def numbers(name, size=1.0, **given):
    """Values of an effect: ``size`` times the typical sizes, shapes at their first start."""
    values = {}
    for p in EFFECTS[name].parameters:
        value = p.typical if p.neutral is None else p.neutral + size * p.typical
        if p.starts and p.neutral is None and p.relative_to in ("", "spectrum"):
            value = p.starts[0]
        elif p.name == "moment":
            value = MOMENT
        values[p.name] = given.get(p.name, limited(value, *p.bounds))
    return values


def with_effect(base, name, values):
    return replace(base, effects=((name, tuple(values.items())),))


def pulled(samples=400):
    """Time, stretch of a strip: up, down, up further, held, and down fast."""
    time = np.linspace(0.0, 40.0, samples + 1)
    corners = [0.0, 5.0, 10.0, 12.0, 20.0, 38.0, 40.0]
    return time, np.interp(time, corners, [1.0, 1.5, 1.1, 1.1, 1.9, 1.9, 1.05])


def cases(*driven):
    return [
        pytest.param(name, d, id=f"{name}, {d}")
        for d in driven
        for name in (BY_STRETCH if d == "stretch" else BY_VOLTAGE)
    ]


BOTH = cases("voltage", "stretch")
