"""How an effect describes itself."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

__all__ = ["ACTS_ON", "FAMILIES", "Effect", "EffectValues", "Parameter"]

#: The places of the signal path where an effect can act.
ACTS_ON = (
    "amplifier",
    "electrode",
    "dielectric",
    "film stress",
    "inertia",
    "load",
    "sensor",
    "environment",
)

#: What an effect can be a kind of. ``slack`` is of film strips only, which cannot push.
FAMILIES = (
    "load_inertia",
    "drag",
    "friction",
    "rate_independent_hysteresis",
    "electrode_resistance",
    "leakage",
    "dielectric_relaxation",
    "permittivity",
    "creep",
    "softening",
    "thermal",
    "drift",
    "sensor_lag",
    "sensor_nonlinearity",
    "amplifier",
    "interference",
    "slack",
    "unknown",
)

#: Effects of a model with their values: ((name, ((parameter, value), ...)), ...).
EffectValues = tuple[tuple[str, tuple[tuple[str, float], ...]], ...]


@dataclass(frozen=True)
class Parameter:
    """One number of an effect, in SI ``unit``, within ``bounds``.

    ``neutral`` is the value at which the effect vanishes, of a size; a shape (a relaxation time, a
    threshold) has no such value and is None there. ``typical`` is a value that would be noticed:
    the scale on which a fit steps. ``starts`` are the values from which a fit sets out, of a shape;
    a size starts where the residual says, or has them where that says little. With ``part_of``
    displacement or voltage they are parts of the largest one in the records; with duration the
    start is sought along the records, with spectrum also where the residual's spectrum is highest.
    With slope they are of a size that is the inverse of a slope of the voltage: parts of the time
    in which the voltage is steeper.
    ``logarithmic`` numbers are sought by ratios. A fit stays within ``sought``, where that is
    given: a model may have more of a number than a measurement is ever explained by.
    """

    name: str
    unit: str
    bounds: tuple[float, float]
    meaning: str
    typical: float
    neutral: float | None = None
    starts: tuple[float, ...] = ()
    logarithmic: bool = False
    part_of: str = ""
    sought: tuple[float, float] | None = None

    @property
    def fitted(self) -> tuple[float, float]:
        """The range in which a fit seeks it."""
        return self.sought or self.bounds


@dataclass(frozen=True)
class Effect:
    """A physical effect: its name, its family, where it acts, its numbers, what it remembers.

    The sizes come first among ``parameters``: while all of them are neutral, the effect is skipped.
    ``memory`` is how many numbers of the kernel's state are its own; they are 0 at rest. ``drives``
    says for which measurements it makes sense: under ``voltage``, under an imposed ``stretch``.
    ``turns`` is True where what it does follows the path from turning point to turning point, so
    that those of a film that rings must not be missed: of a force not even a tenth of a micrometre.
    ``recurs`` is False for what happens in one recording and is no property of the rig: nothing
    says that another recording has it too, or when. ``relaxes`` is True of what relaxes as the
    network's branches do, its first two numbers being a modulus and a relaxation time: while it is
    missing, branches stand in for it. ``refines`` names an effect that this one does more closely:
    it is sought only where that one leads and leaves more than noise. ``ways`` is of an effect that
    goes another way in each recording, and adds to the reading what is linear in its sizes: at
    times (N,) s what each of them adds by itself, (N, sizes). Of several recordings each has sizes
    of its own then (``dearig.model.fitting.drift``).
    ``words`` is one sentence for a person: what the effect is and what betrays it.
    """

    name: str
    family: str
    acts_on: str
    words: str
    parameters: tuple[Parameter, ...]
    memory: int = 0
    drives: tuple[str, ...] = field(default=("voltage",))
    turns: bool = False
    recurs: bool = True
    relaxes: bool = False
    refines: str = ""
    ways: Callable[[np.ndarray], np.ndarray] | None = None

    @property
    def sizes(self) -> tuple[Parameter, ...]:
        """The numbers at whose neutral values the effect vanishes."""
        return tuple(p for p in self.parameters if p.neutral is not None)

    @property
    def shapes(self) -> tuple[Parameter, ...]:
        """The other numbers."""
        return tuple(p for p in self.parameters if p.neutral is None)
