"""The places of the equations where an effect takes part: names, arguments and values of hooks.

A hook is a compiled function (``dearig.model.compiled.jit.jit``) in the module of an effect. It
takes ``(c, k, m, j)`` and the arguments below. ``c`` is the coefficient vector; the effect's
parameters are ``c[k]``, ``c[k + 1]``, ... in the order of ``EFFECT.parameters``. ``m`` is the
state; the effect's own state variables are ``m[j]``, ... ``m[j + EFFECT.memory - 1]``. They are 0
at rest. A hook makes no arrays, changes no coefficient and no other effect's state.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

__all__ = ["FASTEST", "HOOKS", "Hook"]

#: 1/s: the largest rate of stretch of a film, at a fast edge of the voltage.
FASTEST = 0.5


class Hook(NamedTuple):
    """Arguments of a hook after ``c, k, m, j``, and how the values of several effects combine.

    ``combine`` is ``sum``, ``product``, ``sums`` (of each of two values), the names of the
    arguments that one effect hands on to the next, or empty where the value is not used.
    """

    arguments: str
    combine: str

    @property
    def values(self) -> int:
        """Number of values that the hook returns; 0 if what it returns is not used."""
        return 0 if not self.combine else 2 if self.combine in ("sums", "start, end") else 1


#: Symbols: ``lam`` stretch, ``rate`` its rate in 1/s, ``t`` s since the record began, ``lam0`` the
#: stretch at the beginning of the step, ``since`` s after that, ``h`` s length of the step,
#: ``warmth`` K above the temperature of the start, ``moisture`` the relative humidity above that of
#: the start (0 to 1), ``field2`` V^2 the voltage squared at the film.
#:
#: * ``at_rest``: factor on the network's nominal stress before the record begins. The stretch at
#:   rest follows from it; ``soften`` must begin with the same factor.
#: * ``breathe``: carries the state along by ``h`` s in the air of the room; called once for each
#:   sample, before its steps.
#: * ``inertia`` kg/m: added to the coefficient of lam'' in the motion equation.
#: * ``supply`` V, V: the voltage at the film when that before it goes from ``start`` to ``end`` V
#:   in ``h`` s; carries the state along. ``lam`` and ``rate`` are those amid the step. With
#:   ``h`` = 0 it returns the voltage now, and changes no state.
#: * ``polarise`` V^2, V^2: what a slow dielectric adds to the voltage squared at ``start`` and
#:   ``end``; state and ``h`` = 0 as in ``supply``.
#: * ``permittivity``: factor on the Maxwell stress, and on the charge.
#: * ``charge`` V: what the effect adds to the voltage ``voltage`` at the film in the charge
#:   Q = C (V + ...), besides its ``polarise`` and ``permittivity``. From these the charge follows
#:   without a hook, since the Maxwell stress is D E: Q = C V_E^2/V. Needed only where the charge is
#:   another mean over the film than the force.
#: * ``conduct`` A: the current that the film or its frame conducts at ``voltage`` V, where it
#:   follows from the parameters.
#: * ``drop`` V: the part of the supplied voltage that a conducted current drops in series with the
#:   film at ``voltage`` V, where the resistance in series is not known: the current is that
#:   over the resistance, which a record of the current tells.
#: * ``soften``: factor on the network's nominal stress.
#: * ``stress`` Pa: added to the network's nominal stress, positive where it pulls the film together
#:   (a drag is positive while the film grows), at ``lam`` and ``rate``. It is called several times
#:   a step, with the state at the beginning of the step, and must not change it.
#: * ``stiffness`` Pa, Pa s: the derivatives d stress/d lam and d stress/d rate of that ``stress``,
#:   with its sign; ``README.md`` says at which state. Without it, numeric derivatives are taken. An
#:   effect whose stress depends on neither sets ``stiffness = None``.
#: * ``commit``: carries the state of ``stress``, ``soften`` and ``permittivity`` from the beginning
#:   of a step (at ``lam0``) to its end (at ``lam``, ``rate``).
#: * ``measured_stress`` Pa: what a load cell reads when the film's stress is ``sigma`` Pa.
#: * ``sense`` m: what the sensor reads at displacement ``x`` m and velocity ``u`` m/s, ``dt`` s
#:   after the reading before; carries the state along. An effect with this hook has no other.
HOOKS: Mapping[str, Hook] = MappingProxyType(
    {
        "at_rest": Hook("", "product"),
        "breathe": Hook("warmth, moisture, h", ""),
        "inertia": Hook("", "sum"),
        "supply": Hook("t, start, end, h, lam, rate", "start, end"),
        "polarise": Hook("start, end, h", "sums"),
        "permittivity": Hook("lam, field2", "product"),
        "charge": Hook("voltage", "sum"),
        "conduct": Hook("t, voltage, lam", "sum"),
        "drop": Hook("voltage", "sum"),
        "soften": Hook("lam, since, t, warmth", "product"),
        "stress": Hook("lam, rate, lam0, since, t", "sum"),
        "stiffness": Hook("lam, rate", "sums"),
        "commit": Hook("lam, rate, lam0, h, t", ""),
        "measured_stress": Hook("sigma", "sigma"),
        "sense": Hook("t, dt, x, u", "x"),
    }
)
