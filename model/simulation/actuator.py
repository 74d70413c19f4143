"""The film as an actuator: voltage in, stretch and displacement out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from types import MappingProxyType

import numpy as np

from dearig.model import coefficients as at
from dearig.model import kernel
from dearig.model.circuit import loop as circuit
from dearig.model.effects import (
    EFFECTS,
    MEMORY,
    NEUTRAL,
    PARAMETER_COUNT,
    PLACES,
    SENSOR_MEMORY,
    EffectValues,
)
from dearig.model.errors import ModelError
from dearig.model.film.material import VACUUM_PERMITTIVITY, Film, Load, Network
from dearig.model.film.network import HEAD, nominal_pull, shape_at
from dearig.model.film.sensor import at_sensor
from dearig.model.kinematics import thinning

__all__ = [
    "NO_AIR",
    "STATUS_TEXTS",
    "Actuator",
    "Drive",
    "Response",
    "at_rest",
    "effect_values",
    "ends_of",
    "initial_state",
    "reading_of",
    "readings_of",
]

STATUS_TEXTS = MappingProxyType(
    {
        kernel.OK: "ok",
        kernel.PULL_IN: "pull-in: the field exceeded the film's stiffness and the stretch ran away",
        kernel.LOCKED: "a spring was stretched to its locking limit",
        kernel.NOT_CONVERGED: "the integration step had to become too small",
        kernel.NO_REST: "no rest state: the springs cannot carry the load",
        kernel.BAD_INPUT: "the drive is not finite, or its time does not increase",
    }
)


#: Air as the kernel takes it where nothing was recorded.
NO_AIR = np.zeros((2, 0))


@dataclass(frozen=True)
class Drive:
    """Voltage at the film over time: ``time`` (N,) s, ``voltage`` (N,) V.

    Time increases and need not be even. ``hold`` says what happens between samples: True, the
    voltage stands until the next (a converter's output); False, it is linear. ``warmth`` (N,) K is
    the temperature of the room above that of the start, ``moisture`` (N,) its relative humidity (0
    to 1) above that of the start, None where they were not recorded. ``temperature`` in K and
    ``humidity`` are those of the start, less the reference of
    ``dearig.model.readings.environment``; None where they are not known.
    """

    time: np.ndarray
    voltage: np.ndarray
    hold: bool = False
    warmth: np.ndarray | None = None
    moisture: np.ndarray | None = None
    temperature: float | None = None
    humidity: float | None = None

    def __post_init__(self) -> None:
        recorded = [n for n in ("warmth", "moisture") if getattr(self, n) is not None]
        for name in ("time", "voltage", *recorded):
            object.__setattr__(
                self, name, np.ascontiguousarray(getattr(self, name), dtype=np.float64)
            )
        if self.time.ndim != 1 or self.time.shape != self.voltage.shape or self.time.size < 2:
            raise ModelError(
                f"a drive takes two arrays of one length of at least 2, "
                f"not {self.time.shape} and {self.voltage.shape}"
            )
        for name, what in (("warmth", "temperatures"), ("moisture", "humidities")):
            values = getattr(self, name)
            if values is not None and values.shape != self.time.shape:
                raise ModelError(f"{values.size} {what} at {self.time.size} times")

    @cached_property
    def ends(self) -> np.ndarray:
        """Voltages (N,) at the end of what follows each sample, as the kernel takes them."""
        return ends_of(self.voltage, self.hold)

    @property
    def air(self) -> np.ndarray:
        """``warmth`` and ``moisture`` as the kernel takes them: (2, N), or (2, 0) without any."""
        if self.warmth is None and self.moisture is None:
            return NO_AIR
        rows = np.zeros((2, self.time.size))
        for row, values in zip(rows, (self.warmth, self.moisture), strict=True):
            if values is not None:
                row[:] = values
        return rows


@dataclass(frozen=True)
class Response:
    """Motion of the film: arrays (N,) on the drive's time, and the status of the computation.

    ``stretch`` lam, ``rate`` dlam/dt in 1/s, ``displacement`` in m what the sensor reads, which is
    (lam - lam_rest) L1 unless an effect acts on it, ``field`` the true field phi/z in V/m.
    ``output`` V is the amplifier's, ``film_voltage`` V that at the film, each as a mean over the
    interval that a sample begins, and ``current`` A the mean that the amplifier delivers meanwhile:
    the change of charge, the jump at the sample included, and what is conducted. A leakage that is
    given as a loss of voltage says nothing of its current, which is left out.
    ``status`` is one of ``dearig.model.kernel``'s; beyond sample ``reached`` the arrays repeat the
    last stretch that was computed.
    """

    time: np.ndarray
    stretch: np.ndarray
    rate: np.ndarray
    displacement: np.ndarray
    field: np.ndarray
    rest_stretch: float
    status: int
    reached: int
    output: np.ndarray
    film_voltage: np.ndarray
    current: np.ndarray

    @property
    def ok(self) -> bool:
        """True when the whole drive was followed."""
        return self.status == kernel.OK

    @property
    def status_text(self) -> str:
        """Text of the status, with the time at which it occurred."""
        words = STATUS_TEXTS[self.status]
        if self.ok:
            return words
        return f"{words} (at {self.time[min(self.reached, self.time.size - 1)]:.4g} s)"


@dataclass(frozen=True)
class Actuator:
    """A film with its network, its load and any effects, ready to be driven.

    ``effects`` maps the names of ``dearig.model.effects.EFFECTS`` to their parameter values.
    """

    film: Film
    load: Load
    network: Network
    effects: EffectValues = field(default=())

    def __post_init__(self) -> None:
        effect_values(self.effects, "voltage")

    def coefficients(self) -> np.ndarray:
        """The kernel's coefficient vector (see ``dearig.model.coefficients``)."""
        film, load = self.film, self.load
        c = self.network.coefficients(film.held)
        permittivity = VACUUM_PERMITTIVITY * film.permittivity
        c[at.INERTIA] = film.inertia
        c[at.FORCE] = load.weight / (film.width * film.thickness)
        c[at.ELECTRIC] = permittivity / film.thickness**2
        c[at.LENGTH], c[at.THICKNESS] = film.length, film.thickness
        c[at.SECTION] = film.width * film.thickness
        c[at.CAPACITANCE] = permittivity * film.length * film.width / film.thickness
        if load.rest_length is not None:
            c[HEAD + at.MODULUS] = _modulus_at_rest(c, load.rest_length / film.length)
        c[at.EFFECTS_AT : at.EFFECTS_AT + PARAMETER_COUNT] = effect_values(self.effects, "voltage")
        return c

    def rest(self) -> float:
        """Stretch under the load at 0 V, solved. Raises ``ModelError`` where there is none."""
        status, stretch = kernel.rest_stretch(self.coefficients(), 0.0)
        if status != kernel.OK:
            raise ModelError(
                f"{STATUS_TEXTS[status]} (mu_0 = {self.network.equilibrium.modulus:.4g} Pa under "
                f"{self.load.weight:.4g} N)"
            )
        return stretch

    def simulate(self, drive: Drive, lag: float = 0.0) -> Response:
        """Follow ``drive`` from the loaded rest state with relaxed branches.

        ``lag`` s is the known age of a reading: the time by which the displacement is late.
        """
        c = self.coefficients()
        status, rest = at_rest(c, drive)
        stretch, rate = np.full(drive.time.size, rest), np.zeros(drive.time.size)
        reached = 0
        y = initial_state(c, rest)
        if status == kernel.OK:
            status, reached, _ = kernel.drive_by_voltage(
                c, drive.time, drive.voltage, drive.ends, drive.air, y, stretch, rate
            )
        displacement, velocity = np.empty_like(stretch), np.empty_like(rate)
        moved = (stretch - rest) * self.film.length
        speed = rate * self.film.length
        at_sensor(drive.time, moved, speed, drive.time - lag, displacement, velocity)
        kernel.read_sensor(c, drive.time, displacement, velocity, np.zeros(SENSOR_MEMORY))
        electric = circuit.follow(c, drive.time, drive.voltage, drive.ends, drive.air, stretch)
        return Response(
            time=drive.time,
            stretch=stretch,
            rate=rate,
            displacement=displacement,
            field=drive.voltage / self.film.thickness * thinning(self.film.held, stretch),
            rest_stretch=rest,
            status=status,
            reached=reached,
            output=electric[circuit.OUTPUT],
            film_voltage=electric[circuit.FILM],
            current=electric[circuit.INTO],
        )


def ends_of(voltage: np.ndarray, hold: bool) -> np.ndarray:
    """Voltages (N,) at which each interval ends that begins at one of ``voltage`` (N,)."""
    return voltage if hold else np.append(voltage[1:], voltage[-1])


def effect_values(effects: EffectValues, drive: str) -> np.ndarray:
    """The coefficients (PARAMETER_COUNT,) of ``effects``, neutral where there are none.

    Raises ``ModelError`` for effects and numbers that do not exist, are out of bounds, or are not
    of a film driven by ``drive`` (voltage or stretch).
    """
    found = NEUTRAL.copy()
    for name, values in effects:
        if name not in EFFECTS:
            raise ModelError(f"effect {name!r} is not one of {', '.join(EFFECTS)}")
        effect = EFFECTS[name]
        if drive not in effect.drives:
            raise ModelError(f"effect {name!r} is not one of films driven by {drive}")
        given = dict(values)
        wanted = [p.name for p in effect.parameters]
        for what, differ in (
            ("lacks", [n for n in wanted if n not in given]),
            ("does not know", [n for n in given if n not in wanted]),
        ):
            if differ:
                raise ModelError(
                    f"effect {name!r} {what} {', '.join(differ)}: it takes the parameters "
                    f"{', '.join(wanted)}"
                )
        for parameter in effect.parameters:
            value, (low, high) = given[parameter.name], parameter.bounds
            if not low <= value <= high:
                unit = f" {parameter.unit}" if parameter.unit else ""
                raise ModelError(
                    f"effect {name!r}: {parameter.name} = {value!r}{unit} must lie between {low:g} "
                    f"and {high:g}"
                )
            found[PLACES[name].column(effect, parameter.name) - at.EFFECTS_AT] = value
    return found


def _modulus_at_rest(c: np.ndarray, stretch: float) -> float:
    """mu_0 with which the load rests at ``stretch``."""
    held, k = int(c[at.HELD]), HEAD
    pull = nominal_pull(held, int(c[k + at.KIND]), shape_at(c, k), c[k + at.LOCKING], stretch)
    if not 0.0 < pull < np.inf:
        raise ModelError(
            f"load: a measured rest stretch of {stretch:.4g} needs a pull between 0 and the "
            f"locking limit; it must be above 1 and below the spring's locking stretch"
        )
    return float(c[at.FORCE] / pull)


def at_rest(c: np.ndarray, drive: Drive | None = None) -> tuple[int, float]:
    """Return ``(status, stretch)`` under the load at 0 V; enter it in the coefficients ``c``.

    The air is that of the start of ``drive``, or the reference. It is entered too.
    """
    _enter_air(c, drive)
    status, rest = kernel.rest_stretch(c, 0.0)
    c[at.REST] = rest
    return status, rest


def _enter_air(c: np.ndarray, drive: Drive | None) -> None:
    """Enter the air at the start of ``drive`` in coefficients ``c`` (C, ...)."""
    c[at.AIR_TEMPERATURE] = (drive.temperature if drive else None) or 0.0
    c[at.AIR_HUMIDITY] = (drive.humidity if drive else None) or 0.0


def initial_state(c: np.ndarray, rest: float) -> np.ndarray:
    """Kernel state at rest: branches relaxed, xi_i = lam_rest (eq. 48), state of the effects 0."""
    branches = (c.size - HEAD) // at.WIDTH - 1
    y = np.zeros(2 + branches + MEMORY)
    y[: 2 + branches] = rest
    y[1] = 0.0
    return y


def reading_of(
    c: np.ndarray,
    length: float,
    drive: Drive,
    lag: float = 0.0,
    fidelity: int = kernel.CAREFUL,
    times: np.ndarray | None = None,
) -> tuple[np.ndarray, int]:
    """``(reading, status)`` of coefficient vector ``c`` (see ``dearig.model.coefficients``): (N,)
    m.

    At ``times`` (N,) s, those of the drive where none are given. ``lag`` s is the known age of a
    reading, ``fidelity`` as the kernel has it. What the model did not reach reads 0.
    """
    readings, statuses, _ = readings_of(c[None], length, drive, lag, fidelity, times)
    return readings[0], int(statuses[0])


def readings_of(
    cs: np.ndarray,
    length: float,
    drive: Drive,
    lag: float = 0.0,
    fidelity: int = kernel.CAREFUL,
    times: np.ndarray | None = None,
    films: Sequence[Sequence[int]] | None = None,
) -> tuple[np.ndarray, np.ndarray, int]:
    """``(readings, statuses, steps)`` of coefficient vectors ``cs`` (P, C): (P, N) m, and (P,).

    ``films`` are the places in ``cs`` of members of one film, which differ in
    ``dearig.model.effects.SENSOR_COLUMNS`` alone: in how the sensor reads it. None where each has
    its own. They moved in ``steps`` steps. The rest is as in ``reading_of``.
    """
    times = drive.time if times is None else times
    members = cs.copy()
    _enter_air(members.T, drive)
    if films is None:
        film_of = first = np.arange(len(cs))
    else:
        first = np.array([places[0] for places in films])
        film_of = np.empty(len(cs), dtype=np.int64)
        for film, places in enumerate(films):
            film_of[places] = film
    readings, status = np.zeros((len(cs), times.size)), np.zeros(first.size, dtype=np.int64)
    steps = kernel.read_population(
        members, first, film_of, length, drive.time, drive.voltage, drive.ends, drive.air, lag,
        times, fidelity, readings, status,
    )  # fmt: skip
    return readings, status[film_of], steps
