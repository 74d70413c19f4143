"""How an effect describes itself."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

__all__ = [
    "ACTS_ON",
    "COMMON_SYMBOLS",
    "FAMILIES",
    "Curve",
    "Effect",
    "EffectValues",
    "Law",
    "Parameter",
    "faults_of",
]

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
    "viscoplasticity",
    "humidity",
    "unknown",
)

#: Effects of a model with their values: ((name, ((parameter, value), ...)), ...).
EffectValues = tuple[tuple[str, tuple[tuple[str, float], ...]], ...]


class Curve(NamedTuple):
    """The shape that a general law has found, for a report.

    ``axis`` (N,) and ``values`` (N,) in the units of their labels. A label is a quantity with its
    unit, such as "stretch rate (1/s)".
    """

    axis: np.ndarray
    values: np.ndarray
    axis_label: str
    values_label: str


#: Symbols that equations of effects share, in LaTeX, and what each means.
COMMON_SYMBOLS: tuple[tuple[str, str], ...] = (
    (r"\lambda", "stretch, length over L_1"),
    (r"\lambda_0", "stretch at rest"),
    (r"\dot{\lambda}", "rate of stretch in 1/s"),
    (r"\delta", "change of stretch from rest"),
    (r"\sigma", "nominal stress that pulls the film together, in Pa"),
    (r"\sigma_0", "the same of the model's springs and branches alone"),
    (r"\sigma_E", "Maxwell stress that stretches the film, in Pa"),
    (r"\sigma_M", "the same of the model: eps (V/Z)^2 lambda with the width held"),
    ("V", "voltage at the film"),
    (
        "U",
        "voltage before this effect: the command, or that behind the effects before",
    ),
    ("V_E", "voltage that counts in the Maxwell stress, in place of V"),
    ("E", "true field in the film"),
    ("z", "thickness of the film as it is"),
    ("Z", "thickness of the film before it is stretched; Z/z = lambda with the width held"),
    ("L_1", "length of the film before it is stretched"),
    ("L_2", "width of the film"),
    ("C", "capacitance of the film"),
    ("C_0", "capacitance of the film before it is stretched"),
    ("F", "load"),
    (r"\rho", "density of the film"),
    ("x", "displacement before this effect, in m"),
    ("r", "reading of the sensor, in m"),
    ("h", "relative humidity of the room, 0 to 1"),
    ("t", "time since the recording began"),
)


@dataclass(frozen=True)
class Law:
    """The equations of an effect, for a person.

    Parameters
    ----------
    equations
        Each in LaTeX, without delimiters. They say what the hooks compute.
    symbols
        Symbol of each parameter of the effect in LaTeX, in the order of its parameters.
    source
        The publication of the law, or what an elementary law is called.
    where
        Further symbols with their meaning: those that are neither a parameter's nor in
        ``COMMON_SYMBOLS``, and those that mean something else here.
    """

    equations: tuple[str, ...]
    symbols: tuple[str, ...]
    source: str
    where: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True)
class Parameter:
    """One parameter of an effect, in SI ``unit``, within ``bounds``.

    An *amplitude* has a ``neutral`` value; the effect vanishes while all its amplitudes are
    neutral. A *shape parameter* (a relaxation time, a threshold) has none (None).

    Parameters
    ----------
    name, unit, meaning
        For model files, reports and the window. ``meaning`` completes "the ``name`` is ...".
    bounds
        Values that a model may have.
    typical
        A value with a noticeable effect: the scale of a fit's steps.
    neutral
        Value at which an amplitude vanishes.
    starts
        Values from which a fit starts. A shape parameter needs them; an amplitude without them
        starts at the values that the regression finds.
    logarithmic
        Fitted as the logarithm.
    relative_to
        What ``starts`` are fractions of: the largest ``displacement`` or ``voltage`` of the
        records. ``duration``: starts are spread over the records; ``spectrum``: the strongest line
        of the residual is a start too; ``slope``: the parameter is the inverse of a voltage slope,
        starts are fractions of the time in which the voltage is steeper.
    fit_within
        Narrower bounds for fits. A model may have values that no measurement is explained by.
    """

    name: str
    unit: str
    bounds: tuple[float, float]
    meaning: str
    typical: float
    neutral: float | None = None
    starts: tuple[float, ...] = ()
    logarithmic: bool = False
    relative_to: str = ""
    fit_within: tuple[float, float] | None = None

    @property
    def fit_bounds(self) -> tuple[float, float]:
        """The bounds of a fit: ``fit_within``, or ``bounds``."""
        return self.fit_within or self.bounds


@dataclass(frozen=True)
class Effect:
    """A physical effect: its name, family, place in the signal path, parameters and state.

    Parameters
    ----------
    name
        Unique among all effects; it stands in model files.
    family
        One of ``FAMILIES``.
    acts_on
        One of ``ACTS_ON``.
    summary
        One sentence for a person: what the effect does to the film or the reading.
    parameters
        The amplitudes come first.
    memory
        Number of state variables of the effect; they are 0 at rest.
    drives
        Measurements for which the effect makes sense: under ``voltage``, under an imposed
        ``stretch``.
    is_hysteretic
        The effect depends on the path between turning points. The integrator then resolves every
        turning point of a film that rings, even those of less than a tenth of a micrometre.
    is_reproducible
        False for an event of one recording that is not a property of the rig, as a jump of the
        sensor. No other recording is predicted with it.
    is_general
        The effect is the general law of its family: linear in its amplitudes, non-negative weights
        on a fixed grid of shapes, with a ``curve``.
    fitted_shapes
        Names of shape parameters of a general law that fits move: the others place its grid, and
        are held.
    curve
        For a general law: a function of the parameters' values by name that returns the ``Curve``
        that they describe.
    needs
        What recordings must have besides voltage and displacement: ``temperature`` during each, or
        ``temperatures`` or ``humidity`` of several recordings that differ in it. Empty for most.
    law
        Its equations with the symbols of its parameters, and their source. Every effect of this
        project has one; another distribution's effect without one is listed without an equation.
    drift_basis
        For a drift of the reading that is linear in the amplitudes and different in every
        recording: a function of times (N,) s that returns what a unit of each amplitude adds to the
        reading, (N, amplitudes). Each recording then has amplitudes of its own
        (``dearig.model.fitting.drift``).
    """

    name: str
    family: str
    acts_on: str
    summary: str
    parameters: tuple[Parameter, ...]
    memory: int = 0
    drives: tuple[str, ...] = field(default=("voltage",))
    is_hysteretic: bool = False
    is_reproducible: bool = True
    is_general: bool = False
    fitted_shapes: tuple[str, ...] = ()
    curve: Callable[[Mapping[str, float]], Curve] | None = None
    drift_basis: Callable[[np.ndarray], np.ndarray] | None = None
    needs: str = ""
    law: Law | None = None

    @property
    def amplitudes(self) -> tuple[Parameter, ...]:
        """The parameters that have a neutral value."""
        return tuple(p for p in self.parameters if p.neutral is not None)

    @property
    def shape_parameters(self) -> tuple[Parameter, ...]:
        """The parameters that have no neutral value."""
        return tuple(p for p in self.parameters if p.neutral is None)


_RELATIVE_TO = ("", "displacement", "voltage", "duration", "spectrum", "slope")
_DRIVES = ("voltage", "stretch")
_NEEDS = ("", "temperature", "temperatures", "humidity")


def faults_of(effect: object, *, with_law: bool = False) -> list[str]:
    """Return what is wrong with the description of an effect, in sentences; none if all is well.

    ``with_law``: its equations are required, as they are of every effect of this project.
    """
    if not isinstance(effect, Effect):
        return ["it has no EFFECT of the class dearig.model.effects.Effect"]
    faults = list(_faults(effect))
    if effect.law is not None:
        faults += _law_faults(effect, effect.law)
    elif with_law:
        faults.append("it has no law: its equations, the symbols of its parameters, their source")
    return faults


def _law_faults(effect: Effect, law: Law) -> Iterator[str]:
    if not law.equations or not all(law.equations):
        yield "its law has no equation"
    if not law.source:
        yield "its law has no source"
    if len(law.symbols) != len(effect.parameters):
        yield (
            f"its law has {len(law.symbols)} symbols for {len(effect.parameters)} parameters: it "
            f"needs one for each, in their order"
        )
    if len(set(law.symbols)) < len(law.symbols):
        yield f"two parameters have one symbol in its law: {', '.join(law.symbols)}"


def _faults(effect: Effect) -> Iterator[str]:
    for value, known, what in (
        (effect.family, FAMILIES, "family"),
        (effect.acts_on, ACTS_ON, "acts_on"),
    ):
        if value not in known:
            yield f"its {what} {value!r} is not one of {', '.join(known)}"
    if not effect.name or not effect.summary:
        yield "it needs a name and a summary"
    if not effect.drives or not set(effect.drives) <= set(_DRIVES):
        yield f"its drives {effect.drives} are not some of {', '.join(_DRIVES)}"
    if effect.needs not in _NEEDS:
        yield f"its needs {effect.needs!r} is not one of {', '.join(_NEEDS[1:])}, or empty"
    names = [p.name for p in effect.parameters]
    if len(set(names)) < len(names):
        yield f"two of its parameters have one name: {', '.join(names)}"
    if not effect.amplitudes:
        yield "it has no amplitude: a parameter with a neutral value"
    if effect.parameters != effect.amplitudes + effect.shape_parameters:
        yield "its amplitudes do not come before its shape parameters"
    if effect.is_general != (effect.curve is not None):
        yield "it needs a curve if it is a general law, and has none otherwise"
    if effect.memory < 0:
        yield f"its memory of {effect.memory} is negative"
    for parameter in effect.parameters:
        for fault in _parameter_faults(parameter):
            yield f"its parameter {parameter.name!r} {fault}"


def _parameter_faults(p: Parameter) -> Iterator[str]:
    low, high = p.bounds
    if not -math.inf < low < high < math.inf:
        yield f"has bounds ({low}, {high}) that are not finite and increasing"
        return
    if not p.meaning:
        yield "has no meaning"
    if not 0.0 < p.typical <= high - low:
        yield f"has a typical value {p.typical} that is not positive, or wider than its bounds"
    if p.relative_to not in _RELATIVE_TO:
        yield f"is relative to {p.relative_to!r}, which is not one of {', '.join(_RELATIVE_TO)}"
    if p.logarithmic and low <= 0.0:
        yield f"is logarithmic, but its lower bound {low} is not positive"
    if p.neutral is None and not p.starts:
        yield "is a shape parameter without starts"
    is_fraction = p.relative_to in ("voltage", "displacement", "duration", "slope")
    least, most = (0.0, 1.0) if is_fraction else p.bounds
    if not all(least <= start <= most for start in p.starts):
        yield f"has starts {p.starts} outside {least} to {most}"
    if p.neutral is not None and not low <= p.neutral <= p.neutral + p.typical <= high:
        yield f"has a neutral value {p.neutral}, or that and {p.typical} more, outside its bounds"
    inner, outer = p.fit_bounds
    if not low <= inner < outer <= high:
        yield f"has fit_within ({inner}, {outer}) outside its bounds"
