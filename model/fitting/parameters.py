"""Free parameters of a model: names, bounds, coordinates, and places in the coefficient vector."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from dearig.model.coefficients import (
    CAPACITANCE,
    ELECTRIC,
    FORCE,
    HELD,
    KIND,
    LIMIT,
    LOCKING,
    MODULUS,
    RATE,
    SHAPE,
    WIDTH,
)
from dearig.model.effects import EFFECTS, PLACES, EffectValues, Parameter, any_hysteretic
from dearig.model.errors import ModelError
from dearig.model.film.material import Branch, Network, Spring
from dearig.model.film.network import HEAD, nominal_pull, shape_at
from dearig.model.simulation.actuator import Actuator
from dearig.model.simulation.strip import Strip
from dearig.model.springs import LIMIT as LIMIT_NAME
from dearig.model.springs import SPRING_LAWS, SPRINGS, ShapeParameter, locking_strain

__all__ = [
    "NORMAL_95",
    "THESIS_RANGES",
    "Constraint",
    "Contribution",
    "Estimate",
    "FitLayout",
    "FreeParameter",
    "GivenValue",
]

#: Search ranges of the thesis's Algorithm 1: moduli Pa, limits J, relaxation times s.
THESIS_RANGES = {"mu": (0.0, 8e6), "J": (0.0, 9e8), "T": (0.0, 3e6)}

#: Standard deviations of a normal distribution within which 95 % lie.
NORMAL_95 = 1.959963984540054

# Lower ends for logarithmic coordinates; below, a spring or branch has no measurable influence.
_FLOOR = {"mu": 1e-2, "T": 1e-6}
# Increments of films in common steps, relative: of one-sided differences, whose error is about half
# of them, and of central ones. Rounding adds some 1e-11 over the increment.
_SPRINGS_ONE_SIDED, _SPRINGS_CENTRAL = 1e-5, 1e-4
_LIMITS_IN_COMMON = 10.0  # times that: limits hardly change a reading
_EFFECTS_IN_COMMON = 0.1  # of those of films in steps of their own
_PERMITTIVITY_RANGE = (1.0, 100.0)  # relative: of vacuum, and above that of any elastomer


@dataclass(frozen=True)
class Constraint:
    """What is stated of the parameter ``name`` before a fit, in SI units; None where nothing is.

    The parameter is ``fixed`` at a value, or fitted between ``low`` and ``high``, with a Gaussian
    prior of that ``mean`` and standard deviation ``sd``. Raises ``ModelError`` for statements that
    contradict each other.
    """

    name: str
    fixed: float | None = None
    low: float | None = None
    high: float | None = None
    mean: float | None = None
    sd: float | None = None

    def __post_init__(self) -> None:
        """Refuse what cannot be meant."""
        numbers = (self.fixed, self.low, self.high, self.mean, self.sd)
        if not all(math.isfinite(n) for n in numbers if n is not None):
            raise ModelError("a value is not a finite number")
        if all(n is None for n in numbers):
            raise ModelError("nothing is stated of it")
        if self.fixed is not None and any(n is not None for n in numbers[1:]):
            raise ModelError("it is fixed, so it has neither bounds nor a prior")
        if self.low is not None and self.high is not None and self.low >= self.high:
            raise ModelError("its lower bound is not below its upper bound")
        if (self.mean is None) != (self.sd is None):
            raise ModelError("a prior has a mean and a standard deviation")
        if self.sd is not None and self.sd <= 0.0:
            raise ModelError("the standard deviation of its prior is not above 0")
        if self.mean is not None and not self.allows(self.mean):
            raise ModelError("the mean of its prior is outside of its bounds")

    @property
    def is_bounded(self) -> bool:
        """Whether an end of its range is stated."""
        return self.low is not None or self.high is not None

    def allows(self, value: float) -> bool:
        """Whether ``value`` is within the bounds."""
        return (self.low is None or value >= self.low) and (self.high is None or value <= self.high)


@dataclass(frozen=True)
class FreeParameter:
    """One free parameter.

    ``kind`` is mu, J, T or ``shape`` of spring ``index`` (0 is the equilibrium spring),
    ``permittivity``, or ``effect``: then it is parameter ``index`` of the effect ``effect``. J and
    ``shape`` are parameter ``place`` of the strain energy ``law``. ``constraint`` is what is stated
    of it. Raises ``ModelError`` where that is outside of what a fit allows.
    """

    kind: str
    index: int
    effect: str = ""
    law: str = ""
    place: int = 0
    constraint: Constraint | None = None

    def __post_init__(self) -> None:
        """Refuse a constraint that no fit can meet."""
        stated = self.constraint
        if stated is None:
            return
        least, most = self.search_range
        inside = [v for v in (stated.fixed, stated.low, stated.high, stated.mean) if v is not None]
        if any(not least <= v <= most for v in inside):
            raise ModelError(
                f"{self.name} is stated outside of what a fit allows, {least:g} to {most:g} "
                f"{self.unit}".rstrip()
            )

    @property
    def parameter(self) -> Parameter | ShapeParameter:
        """Description of the parameter by its effect or its strain energy."""
        if self.kind == "effect":
            return EFFECTS[self.effect].parameters[self.index]
        return SPRING_LAWS[self.law].parameters[self.place]

    @property
    def is_shape(self) -> bool:
        """Whether it is a number of a strain energy: a locking limit, an exponent, a share."""
        return self.kind in ("J", "shape")

    @property
    def name(self) -> str:
        """mu_0, J_0, T_1, ..., or effect and parameter, as in ``linear drag: drag``."""
        if self.kind == "effect":
            return f"{self.effect}: {self.parameter.name}"
        if self.is_shape:
            return f"{SPRING_LAWS[self.law].parameters[self.place].symbol}_{self.index}"
        if self.kind == "permittivity":
            return self.kind
        return f"{self.kind}_{self.index}"

    @property
    def unit(self) -> str:
        """SI unit, empty for a pure number."""
        if self.kind == "effect":
            return EFFECTS[self.effect].parameters[self.index].unit
        return {"mu": "Pa", "T": "s"}.get(self.kind, "")

    @property
    def search_range(self) -> tuple[float, float]:
        """Range of a fit where nothing is stated."""
        if self.kind in ("effect", "J", "shape"):
            return self.parameter.fit_bounds
        if self.kind == "permittivity":
            return _PERMITTIVITY_RANGE
        return _FLOOR[self.kind], THESIS_RANGES[self.kind][1]

    @property
    def bounds(self) -> tuple[float, float]:
        """Range of a fit; both ends are the value of a fixed parameter."""
        return self.within(self.search_range)

    def within(self, span: tuple[float, float]) -> tuple[float, float]:
        """Return the stated bounds, and the ends of ``span`` where none are stated.

        Where the stated bounds are outside of ``span``, the range of a fit is in its place.
        """
        stated = self.constraint
        if stated is None:
            return span
        if stated.fixed is not None:
            return stated.fixed, stated.fixed
        low = span[0] if stated.low is None else stated.low
        high = span[1] if stated.high is None else stated.high
        if low < high:
            return low, high
        least, most = self.search_range
        return (least, high) if stated.low is None else (low, most)

    @property
    def is_fixed(self) -> bool:
        """Whether it is stated, not fitted."""
        return self.constraint is not None and self.constraint.fixed is not None

    @property
    def open_ends(self) -> tuple[float, float]:
        """Ends of an interval that the data leave open: the stated bounds, or those of the law."""
        low, high = self.search_range if self.kind == "effect" else (0.0, math.inf)
        stated = self.constraint
        if stated is None:
            return low, high
        return low if stated.low is None else stated.low, (
            high if stated.high is None else stated.high
        )

    @property
    def logarithmic(self) -> bool:
        """Whether the coordinate is the logarithm."""
        if self.kind in ("effect", "J", "shape"):
            return self.parameter.logarithmic
        return self.kind in ("T", "permittivity")

    @property
    def typical(self) -> float:
        """Scale of a fit's steps; 0 for moduli, times and locking limits."""
        return self.parameter.typical if self.kind in ("effect", "shape") else 0.0

    @property
    def column(self) -> int:
        """Index in the coefficient vector (a relaxation time is stored as its inverse)."""
        if self.kind == "effect":
            return PLACES[self.effect].at + self.index
        if self.kind == "permittivity":
            return ELECTRIC
        at = {"mu": MODULUS, "J": LIMIT, "T": RATE}.get(self.kind)
        if at is None:
            at = SHAPE + self.place - SPRING_LAWS[self.law].has_limit
        return HEAD + WIDTH * self.index + at


@dataclass(frozen=True)
class Estimate:
    """Estimate of one parameter: ``value`` and its 95 % interval ``low`` .. ``high``.

    An end of the interval that the data leave open is 0 or infinite. ``determined`` is False when
    the interval is so wide that the value should not be quoted; ``note`` then says so in words.
    ``free`` is False for a parameter that follows from others (mu_0 of a measured rest length).
    ``at_bound`` is True for a value at an end of its search range: the data may ask for more.
    ``systematic`` is its standard uncertainty by those of the film, the load and the scalings, 0
    where none are known; ``low`` and ``high`` do not contain it. ``constraint`` is what was stated
    of it before the fit; a fixed one is not ``free``, and both ends are its value.
    """

    name: str
    unit: str
    value: float
    low: float
    high: float
    determined: bool
    note: str = ""
    free: bool = True
    at_bound: bool = False
    systematic: float = 0.0
    constraint: Constraint | None = None

    @property
    def is_fixed(self) -> bool:
        """Whether the value was stated, not fitted."""
        return self.constraint is not None and self.constraint.fixed is not None

    @property
    def combined(self) -> tuple[float, float]:
        """The 95 % interval with the uncertainty of what was given; open ends stay open."""
        ends = []
        for end, sign in ((self.low, -1.0), (self.high, 1.0)):
            is_open = not math.isfinite(end) or (end == 0.0 and self.value > 0.0)
            width = math.hypot(end - self.value, NORMAL_95 * self.systematic)
            moved = self.value + sign * width
            # what noise cannot make negative, a given value cannot either
            ends.append(end if is_open else max(moved, 0.0) if self.low >= 0.0 else moved)
        return ends[0], ends[1]


@dataclass(frozen=True)
class GivenValue:
    """A value that is given, not fitted, and its relative standard uncertainty.

    ``name`` is a field of the film, ``mass``, or ``voltage`` or ``displacement`` for the scaling
    of these channels.
    """

    name: str
    relative: float


@dataclass(frozen=True)
class Contribution:
    """Shifts in SI units of the fitted parameters ``names``, by one standard uncertainty."""

    given: GivenValue
    names: tuple[str, ...]
    shifts: tuple[float, ...]


class FitLayout:
    """Free parameters of a model: moduli, limits, times, as in the thesis, then those of effects.

    ``base`` carries everything that is not free. A fit moves in *coordinates*: moduli as they are,
    limits and times as logarithms. The data fix sums of moduli long before their parts, and such
    valleys are straight only while the moduli stay linear; times and limits spread over decades.
    ``times`` narrows the range of the relaxation times, in s. With ``permittivity`` the relative
    permittivity of an actuator's film is free too; a fit of one record hardly tells it from a
    common factor of all moduli.

    ``constraints`` are what is stated of parameters; those of parameters that the model lacks have
    no part. A fixed parameter has a coordinate, with both bounds at its value (``fixed``), so that
    nothing moves it; fits leave it out. Stated bounds go before ``times``.
    """

    def __init__(
        self,
        base: Actuator | Strip,
        times: tuple[float, float] | None = None,
        permittivity: bool = False,
        constraints: Sequence[Constraint] = (),
    ) -> None:
        self.base = base
        self.constraints = tuple(constraints)
        self.network = base.network
        self.held = base.film.held if isinstance(base, Actuator) else base.held
        self._c = base.coefficients()
        self._rest = None
        if isinstance(base, Actuator) and base.load.rest_length is not None:
            self._rest = base.load.rest_length / base.film.length
        springs = self.network.springs
        quantities = (
            *(FreeParameter("mu", i) for i in range(len(springs)) if i or self._rest is None),
            *_shapes(springs),
            *(FreeParameter("T", i) for i in range(1, len(springs))),
            *((FreeParameter("permittivity", 0),) if permittivity else ()),
            *(
                FreeParameter("effect", i, name)
                for name, _ in base.effects
                for i in range(len(EFFECTS[name].parameters))
            ),
        )
        stated = {c.name: c for c in constraints}
        self.quantities: tuple[FreeParameter, ...] = tuple(
            replace(q, constraint=stated.get(q.name)) for q in quantities
        )
        self._columns = np.array([q.column for q in self.quantities])
        self._log = np.array([q.logarithmic for q in self.quantities])
        self._typical = np.array([q.typical for q in self.quantities])
        bounds = np.array(
            [
                q.within(times) if times is not None and q.kind == "T" else q.bounds
                for q in self.quantities
            ]
        )
        #: (d,) bool: parameters that are stated, not fitted
        self.fixed = np.array([q.is_fixed for q in self.quantities], dtype=bool)
        self._stated = np.where(self.fixed, bounds[:, 0], 0.0)
        priors = [(j, q.constraint) for j, q in enumerate(self.quantities) if q.constraint]
        self._priors = [
            (j, c.mean, c.sd) for j, c in priors if c.mean is not None and c.sd is not None
        ]
        self.lower, self.upper = self.coordinates(bounds[:, 0]), self.coordinates(bounds[:, 1])

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the free parameters in order."""
        return tuple(q.name for q in self.quantities)

    @property
    def size(self) -> int:
        """Number of free parameters."""
        return len(self.quantities)

    @property
    def priors(self) -> np.ndarray:
        """Indices of the parameters that have a prior, (k,)."""
        return np.array([j for j, _, _ in self._priors], dtype=int)

    def prior_rows(self, values: np.ndarray) -> np.ndarray:
        """Return how far ``values`` (P, d) are from the priors, in standard deviations: (P, k)."""
        rows = [(values[:, j] - mean) / sd for j, mean, sd in self._priors]
        return np.array(rows).reshape(len(rows), values.shape[0]).T

    def column(self, kind: str) -> np.ndarray:
        """Indices of the free parameters of one kind."""
        return np.array([i for i, q in enumerate(self.quantities) if q.kind == kind], dtype=int)

    @property
    def shapes(self) -> np.ndarray:
        """Which free parameters are numbers of strain energies, limits included, (d,) bool."""
        return np.array([q.is_shape for q in self.quantities], dtype=bool)

    def coordinates(self, values: np.ndarray) -> np.ndarray:
        """Return coordinates (..., d) of natural ``values`` (..., d)."""
        return np.where(self._log, np.log(np.maximum(values, 1e-300)), values)

    def values(self, x: np.ndarray) -> np.ndarray:
        """Return natural values (..., d) at coordinates ``x`` (..., d)."""
        found = np.where(self._log, np.exp(np.where(self._log, x, 0.0)), x)
        # a logarithm and back may round
        return np.where(self.fixed, self._stated, found)

    def reach(self, x: np.ndarray) -> np.ndarray:
        """Return the largest step (d,) from ``x`` in each coordinate for which linearity holds.

        A factor of 20 for a time or a limit; the sum of all moduli for a modulus; for a parameter
        of an effect ten times its typical value, or its own value.
        """
        moduli = x[self.column("mu")]
        effects = np.maximum(10.0 * self._typical, np.abs(x))
        linear = np.where(
            self._typical > 0.0, effects, max(float(moduli.sum()), 1.0) if moduli.size else 1.0
        )
        return np.where(self._log, 3.0, linear)

    def differences(
        self, x: np.ndarray, in_common: bool = False, central: bool = False
    ) -> np.ndarray:
        """Steps (d,) for difference quotients at coordinates ``x``.

        Of films that are simulated ``in_common`` steps they are shorter: such films differ by no
        noise of their own steps. There ``central`` differences take longer ones than one-sided.
        """
        # effects have kinks, so differences must be wide enough to cross them; with hysteresis a
        # small shift of a turning point changes the ringing after it
        springs = 1e-3 if self.base.effects else 1e-4
        if any_hysteretic(self.base.effects):
            springs = 3e-3
        shorter, limits = 1.0, 1.0
        if in_common:
            springs = _SPRINGS_CENTRAL if central else _SPRINGS_ONE_SIDED
            shorter, limits = _EFFECTS_IN_COMMON, _LIMITS_IN_COMMON
        moduli = springs * np.maximum(np.abs(x), 1e-3 * self.reach(x))
        # but not across an instant or a spectral line
        placed = [
            q.kind == "effect"
            and EFFECTS[q.effect].parameters[q.index].relative_to in ("duration", "spectrum")
            for q in self.quantities
        ]
        sizes = np.maximum(np.where(placed, 0.0, 1e-3 * np.abs(x)), 0.02 * self._typical)
        sizes *= np.where(placed, 1.0, shorter)
        linear = np.where(self._typical > 0.0, sizes, moduli)
        logarithmic = np.where(self.shapes, springs * limits, springs)
        logarithmic = np.where(self._typical > 0.0, 2e-2 * shorter, logarithmic)
        return np.where(self._log, logarithmic, linear)

    def initial(self) -> np.ndarray:
        """Return natural values (d,) of the base, inside the bounds."""
        values = self._c[self._columns].copy()
        rates = self.column("T")
        values[rates] = self.network.times
        if isinstance(self.base, Actuator):
            values[self.column("permittivity")] = self.base.film.permittivity
        return self.values(np.clip(self.coordinates(values), self.lower, self.upper))

    def padded(self, network: Network) -> np.ndarray:
        """Return coordinates (d,) of ``network``, padded with weak branches.

        The added branches relax at the geometric mean of the others, where a weak branch changes
        little and its time can move in either direction.
        """
        springs, times = list(network.springs), list(network.times)
        logarithms = [math.log(max(t, _FLOOR["T"])) for t in times]
        middle = math.exp(sum(logarithms) / len(logarithms)) if times else 1.0
        while len(springs) < len(self.network.springs):
            last, own = springs[-1], self.network.springs[len(springs)]
            like = last if last.kind == own.kind else own
            springs.append(replace(like, modulus=1e-3 * last.modulus))
            times.append(middle)
        branches = tuple(Branch(s, t) for s, t in zip(springs[1:], times, strict=True))
        other = Network(springs[0], branches)
        return np.clip(
            self.coordinates(FitLayout(replace(self.base, network=other)).initial()),
            self.lower,
            self.upper,
        )

    def coefficients(self, values: np.ndarray) -> np.ndarray:
        """Kernel coefficients (P, C) of a population ``values`` (P, d), natural, no logarithms."""
        values = np.atleast_2d(values)
        c = np.tile(self._c, (values.shape[0], 1))
        c[:, self._columns] = values
        if isinstance(self.base, Actuator):
            for j in self.column("permittivity"):
                ratio = values[:, j] / self.base.film.permittivity
                c[:, ELECTRIC] = ratio * self._c[ELECTRIC]
                c[:, CAPACITANCE] = ratio * self._c[CAPACITANCE]
        rates = self._columns[self.column("T")]
        c[:, rates] = 1.0 / np.maximum(c[:, rates], 1e-9)
        for j in self.column("J"):
            k = HEAD + WIDTH * self.quantities[j].index
            kind = int(self._c[k + KIND])
            shape = c[:, k + LIMIT : k + SHAPE + 3]
            alike = bool((shape == shape[0]).all())
            c[:, k + LOCKING] = [
                locking_strain(kind, shape_at(row, k)) for row in (c[:1] if alike else c)
            ]
        if self._rest is not None:
            for row in c:
                pull = nominal_pull(
                    int(row[HELD]), int(row[HEAD + KIND]), shape_at(row, HEAD),
                    row[HEAD + LOCKING], self._rest,
                )  # fmt: skip
                row[HEAD + MODULUS] = row[FORCE] / pull
        return c

    def build(self, values: np.ndarray) -> Network:
        """Return the network with the free parameters at natural ``values`` (d,)."""
        c = self.coefficients(values)[0]
        springs = [_spring(c, k) for k in range(HEAD, c.size, WIDTH)]
        times = [float(1.0 / c[k + RATE]) for k in range(HEAD + WIDTH, c.size, WIDTH)]
        branches = tuple(Branch(s, t) for s, t in zip(springs[1:], times, strict=True))
        return Network(springs[0], branches)

    def model(self, values: np.ndarray) -> Actuator | Strip:
        """Return the base with the free parameters at natural ``values`` (d,)."""
        base = self.base
        if isinstance(base, Actuator):
            for j in self.column("permittivity"):
                film = replace(base.film, permittivity=float(values[j]))
                base = replace(base, film=film)
        return replace(base, network=self.build(values), effects=self._effects(values))

    def _effects(self, values: np.ndarray) -> EffectValues:
        given = {
            # a logarithm and back may round to just outside
            (q.effect, q.parameter.name): float(min(max(v, q.bounds[0]), q.bounds[1]))
            for q, v in zip(self.quantities, values, strict=True)
            if q.kind == "effect"
        }
        return tuple(
            (name, tuple((p.name, given[name, p.name]) for p in EFFECTS[name].parameters))
            for name, _ in self.base.effects
        )

    def by_relaxation_time(self, values: np.ndarray) -> np.ndarray:
        """Return ``values`` (d,) with the branches in order of relaxation time.

        Branches with the same kind of spring are interchangeable; a fixed order makes two fits of
        the same data comparable. A branch of which something is stated keeps its number.
        """
        return values[self.order_by_relaxation_time(values)]

    def order_by_relaxation_time(self, values: np.ndarray) -> np.ndarray:
        """Return the indices (d,) that ``by_relaxation_time`` takes of ``values`` (d,)."""
        places = np.arange(self.size)
        kinds = {s.kind for s in self.network.springs[1:]}
        if len(kinds) > 1:
            return places
        stated = {q.index for q in self.quantities if q.kind != "effect" and q.constraint}
        times = [j for j in self.column("T") if self.quantities[j].index not in stated]
        order = np.argsort(values[times], kind="stable")
        alike: dict[tuple[str, int], list[int]] = {}
        for j, q in enumerate(self.quantities):
            if q.kind != "effect" and q.index > 0 and q.index not in stated:
                alike.setdefault((q.kind, q.place), []).append(j)
        for columns in alike.values():
            if len(columns) == len(order):
                places[columns] = np.array(columns)[order]
        return places


def _shapes(springs: Sequence[Spring]) -> Iterator[FreeParameter]:
    """Yield the parameters of the strain energies of ``springs``, the locking limits first."""
    for limits in (True, False):
        for i, spring in enumerate(springs):
            for place, parameter in enumerate(SPRING_LAWS[spring.kind].parameters):
                if (parameter.name == LIMIT_NAME) == limits:
                    yield FreeParameter("J" if limits else "shape", i, law=spring.kind, place=place)


def _spring(c: np.ndarray, k: int) -> Spring:
    """Return the spring whose numbers begin at ``k`` of the coefficients ``c``."""
    kind = SPRINGS[int(c[k + KIND])]
    law = SPRING_LAWS[kind]
    shape = c[k + SHAPE : k + SHAPE + len(law.parameters) - law.has_limit]
    return Spring(float(c[k + MODULUS]), float(c[k + LIMIT]), kind, tuple(map(float, shape)))


def require_free(layout: FitLayout, samples: int) -> None:
    """Raise ``ModelError`` for a fit with more unknowns than readings."""
    if samples <= layout.size:
        raise ModelError(
            f"{samples} samples cannot determine {layout.size} parameters; record longer or fit "
            f"fewer branches"
        )
    if not math.isfinite(float(layout.lower.sum())):
        raise ModelError("the parameter bounds are not finite")
