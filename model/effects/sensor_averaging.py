"""Moving average of the sensor over a window that nobody declared.

The average over w s has the transfer function (1 - exp(-s w))/(s w); 1/(1 + s w/2 + (s w)^2/12)
agrees with it to the third order in s w, and needs two numbers of memory whatever the window, and
two for the position and the rate at the reading before.
"""

from __future__ import annotations

from model.effects.description import Effect, Parameter
from model.filters import averaged
from model.jit import jit

__all__ = ["EFFECT", "sense"]

EFFECT = Effect(
    name="sensor averaging",
    family="sensor_lag",
    acts_on="sensor",
    words="the reading is the mean over the time just gone: late, and rounded at corners",
    parameters=(Parameter("window", "s", (0.0, 2.0), "over which the sensor averages", 1e-2, 0.0),),
    memory=4,
)


@jit
def sense(c, k, m, j, t, dt, x, u):
    if dt > 0.0:
        m[j], m[j + 1] = averaged(m[j], m[j + 1], m[j + 2], m[j + 3], x, u, dt, c[k])
    m[j + 2], m[j + 3] = x, u
    return m[j]
