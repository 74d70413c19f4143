"""The film as an actuator: voltage in, stretch and displacement out."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np

from model import kernel, network
from model.effects import EFFECTS
from model.errors import ModelError
from model.kinematics import thinning
from model.material import VACUUM_PERMITTIVITY, Film, Load, Network

__all__ = ["Actuator", "Drive", "Response", "displacements"]

STATUS_WORDS = MappingProxyType(
    {
        kernel.OK: "ok",
        kernel.PULL_IN: "pull-in: the field outgrew the film's stiffness and the stretch ran away",
        kernel.LOCKED: "a spring was stretched to its locking limit",
        kernel.NOT_CONVERGED: "the integration step had to become too small",
        kernel.NO_REST: "no rest state: the springs cannot carry the load",
        kernel.BAD_INPUT: "the drive is not finite, or its time does not increase",
    }
)


@dataclass(frozen=True)
class Drive:
    """Voltage at the film over time: ``time`` (N,) s, ``voltage`` (N,) V.

    Time increases and need not be even. ``hold`` says what happens between samples: True, the
    voltage stands until the next (a converter's output); False, it is linear.
    """

    time: np.ndarray
    voltage: np.ndarray
    hold: bool = False

    def __post_init__(self) -> None:
        for name in ("time", "voltage"):
            object.__setattr__(
                self, name, np.ascontiguousarray(getattr(self, name), dtype=np.float64)
            )
        if self.time.ndim != 1 or self.time.shape != self.voltage.shape or self.time.size < 2:
            raise ModelError(
                f"a drive takes two arrays of one length of at least 2, "
                f"not {self.time.shape} and {self.voltage.shape}"
            )


@dataclass(frozen=True)
class Response:
    """What the film did: arrays (N,) on the drive's time, and how the computation ended.

    ``stretch`` lam, ``rate`` dlam/dt in 1/s, ``displacement`` (lam - lam_rest) L1 in m, ``field``
    the true field phi/z in V/m. ``status`` is one of ``model.kernel``'s; beyond sample ``reached``
    the arrays repeat the last stretch that was computed.
    """

    time: np.ndarray
    stretch: np.ndarray
    rate: np.ndarray
    displacement: np.ndarray
    field: np.ndarray
    rest_stretch: float
    status: int
    reached: int

    @property
    def ok(self) -> bool:
        """True when the whole drive was followed."""
        return self.status == kernel.OK

    @property
    def in_words(self) -> str:
        """The status in words, with the time at which it came."""
        words = STATUS_WORDS[self.status]
        if self.ok:
            return words
        return f"{words} (at {self.time[min(self.reached, self.time.size - 1)]:.4g} s)"


@dataclass(frozen=True)
class Actuator:
    """A film with its network, its load and any effects, ready to be driven.

    ``effects`` maps the names of ``model.effects.EFFECTS`` to their parameter values.
    """

    film: Film
    load: Load
    network: Network
    effects: tuple[tuple[str, tuple[tuple[str, float], ...]], ...] = field(default=())

    def __post_init__(self) -> None:
        for name, values in self.effects:
            if name not in EFFECTS:
                raise ModelError(f"effect {name!r} is not one of {', '.join(EFFECTS)}")
            wanted = {p.name for p in EFFECTS[name].parameters}
            if {n for n, _ in values} != wanted:
                raise ModelError(
                    f"effect {name!r} takes the parameters {', '.join(sorted(wanted))}"
                )

    def coefficients(self) -> np.ndarray:
        """The kernel's coefficient vector (see ``model.network``)."""
        film, load = self.film, self.load
        c = self.network.coefficients(film.held)
        c[network.INERTIA] = film.inertia
        c[network.FORCE] = load.weight / (film.width * film.thickness)
        c[network.ELECTRIC] = VACUUM_PERMITTIVITY * film.permittivity / film.thickness**2
        if load.rest_length is not None:
            c[network.HEAD + network.MODULUS] = _modulus_at_rest(c, load.rest_length / film.length)
        for name, values in self.effects:
            EFFECTS[name].contribute(c, dict(values), film, load)
        return c

    def rest(self) -> float:
        """Stretch under the load at 0 V, solved. Raises ``ModelError`` where there is none."""
        status, stretch = kernel.rest_stretch(self.coefficients(), 0.0)
        if status != kernel.OK:
            raise ModelError(
                f"{STATUS_WORDS[status]} (mu_0 = {self.network.equilibrium.modulus:.4g} Pa under "
                f"{self.load.weight:.4g} N)"
            )
        return stretch

    def simulate(self, drive: Drive) -> Response:
        """Follow ``drive`` from the loaded rest state with relaxed branches."""
        c = self.coefficients()
        status, rest = kernel.rest_stretch(c, 0.0)
        stretch, rate = np.full(drive.time.size, rest), np.zeros(drive.time.size)
        reached = 0
        if status == kernel.OK:
            y = initial_state(c, rest)
            status, reached = kernel.drive_by_voltage(
                c, drive.time, drive.voltage, drive.hold, y, stretch, rate
            )
        return Response(
            time=drive.time,
            stretch=stretch,
            rate=rate,
            displacement=(stretch - rest) * self.film.length,
            field=drive.voltage / self.film.thickness * thinning(self.film.held, stretch),
            rest_stretch=rest,
            status=status,
            reached=reached,
        )


def _modulus_at_rest(c: np.ndarray, stretch: float) -> float:
    """mu_0 with which the load rests at ``stretch``."""
    held, k = int(c[network.HELD]), network.HEAD
    pull = network.nominal_pull(
        held, int(c[k + network.KIND]), c[k + network.LIMIT], c[k + network.LOCKING], stretch
    )
    if not 0.0 < pull < np.inf:
        raise ModelError(
            f"load: a measured rest stretch of {stretch:.4g} needs a pull between 0 and the "
            f"locking limit; it must be above 1 and below the spring's locking stretch"
        )
    return float(c[network.FORCE] / pull)


def initial_state(c: np.ndarray, rest: float) -> np.ndarray:
    """Kernel state at rest: branches relaxed, xi_i = lam_rest (eq. 48's initial condition)."""
    y = np.full(2 + (c.size - network.HEAD) // network.WIDTH - 1, rest)
    y[1] = 0.0
    return y


def displacements(
    coefficients: np.ndarray, length: float, drive: Drive, workers: int = 2
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A population under one drive: ``coefficients`` (P, C) to displacement (P, N) in m.

    Also returns the rates of displacement (P, N) in m/s and the statuses (P,). Members run on
    ``workers`` threads (the kernels release the interpreter).
    """
    population = coefficients.shape[0]
    x = np.zeros((population, drive.time.size))
    u = np.zeros_like(x)
    status = np.zeros(population, dtype=np.int64)

    def run(members: Sequence[int]) -> None:
        for p in members:
            c = coefficients[p]
            status[p], rest = kernel.rest_stretch(c, 0.0)
            if status[p] == kernel.OK:
                status[p], _ = kernel.drive_by_voltage(
                    c, drive.time, drive.voltage, drive.hold, initial_state(c, rest), x[p], u[p]
                )
                x[p] = (x[p] - rest) * length
                u[p] *= length

    if workers <= 1 or population == 1:
        run(range(population))
    else:
        with ThreadPoolExecutor(workers) as pool:
            # interleaved, so that stiff members (neighbours in a population) spread over threads
            list(pool.map(run, [range(w, population, workers) for w in range(workers)]))
    return x, u, status
