"""Checks that every effect must pass: ours, and those of other distributions in their own tests.

``check_effect(name)`` raises ``ContractError``, a sentence for every fault. The checks find what
compiles and is wrong without a word: a stiffness that is not the derivative of the stress, state
outside the declared memory, a neutral value at which something is left, values that are not finite
within the bounds, steps that do not join, an error that depends on the length of the steps.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cache
from itertools import pairwise, product
from typing import Any

import numpy as np

from dearig.model import kernel
from dearig.model.circuit import loop as circuit
from dearig.model.coefficients import AIR_HUMIDITY, AIR_TEMPERATURE, EFFECTS_AT
from dearig.model.effects.description import Effect, Parameter, faults_of
from dearig.model.effects.hooks import FASTEST, HOOKS
from dearig.model.effects.registry import EFFECTS, ORIGINS, OURS, PLACES, hook_faults
from dearig.model.errors import ModelError
from dearig.model.film.material import TABLE_3, THESIS_FILM, THESIS_LOAD, Branch, Network, Spring
from dearig.model.simulation.actuator import Actuator, Drive, at_rest, reading_of
from dearig.model.simulation.strip import Strip

__all__ = ["ContractError", "check_effect", "faults_of_effect"]

_GUARD = 16  # numbers around an effect's own, which it must neither read nor write
_MAXWELL = 3e3  # Pa: of a field of 8 MV/m; no effect's stress moves the film against more
_SLOPE_TOLERANCE = 0.02  # of a derivative
_SLOPE_NOTHING = 1.0  # Pa: a ten-thousandth of a film's
_DRAG_NOTHING = 0.1  # Pa s: 0.05 Pa at the fastest edge
_JUMP_TOLERANCE = 0.02  # of the changes within steps
_DROP_NOTHING = 1e-3  # V
_NEARLY_NEUTRAL = 1e-7  # of the typical amplitude
_NEARLY_NOTHING = {"voltage": 0.05e-6, "stretch": 0.05}  # m, Pa: another choice of steps
_STEP_ERROR = 0.2e-6  # m: a fifth of the sensor's repeatability
_STEP_ERROR_PART = 0.02  # of what the effect does
_CIRCUIT_NOTHING = 1e-4  # of the largest voltage or current
_BASIS_TOLERANCE = 1e-9  # of the largest value

_AIR = (2.0, 0.1)  # K and relative humidity above the reference

_PURE = (
    "at_rest",
    "inertia",
    "permittivity",
    "charge",
    "conduct",
    "drop",
    "soften",
    "stress",
    "stiffness",
    "measured_stress",
)
_SUPPLY = ("supply", "polarise")
_RATES = (0.0, 1e-3, 0.01, 0.03, 0.1, 0.3, FASTEST)


class ContractError(ModelError):
    """An effect breaks the rules of its hooks; the message has a sentence for each fault."""


def check_effect(name: str) -> None:
    """Raise ``ContractError`` with everything that is wrong with the effect ``name``."""
    faults = faults_of_effect(name)
    if faults:
        raise ContractError(f"effect {name!r}: " + "; ".join(faults))


def faults_of_effect(name: str) -> list[str]:
    """Return what is wrong with the effect ``name``, in sentences; none if all is well."""
    if name not in EFFECTS:
        raise ModelError(f"effect {name!r} is not one of {', '.join(EFFECTS)}")
    ours = ORIGINS[name] == OURS
    faults = [*faults_of(EFFECTS[name], with_law=ours), *hook_faults(PLACES[name].module)]
    if not faults:
        probe = _Probe(name)
        for check in (_values, _pure, _stiffness, _joins, _rest, _supplies, _drops, _basis):
            faults += dict.fromkeys(check(probe))
    if not faults:
        faults += [*_in_circuits(name), *_in_simulations(name)]
    return faults


class _Probe:
    """Hooks of one effect on numbers of its own, with a guard of NaN around them."""

    def __init__(self, name: str) -> None:
        self.effect, self.module = EFFECTS[name], PLACES[name].module
        film = Actuator(THESIS_FILM, THESIS_LOAD, TABLE_3).coefficients()
        at_rest(film)
        film[AIR_TEMPERATURE], film[AIR_HUMIDITY] = _AIR
        self._film = film[:EFFECTS_AT]
        self.rest = float(at_rest(film)[1])
        self.k, self.j = EFFECTS_AT + _GUARD, _GUARD

    def has(self, hook: str) -> bool:
        return getattr(self.module, hook, None) is not None

    def coefficients(self, values: Sequence[float]) -> np.ndarray:
        guard = np.full(_GUARD, math.nan)
        return np.concatenate([self._film, guard, np.array(values, dtype=float), guard])

    def state(self) -> np.ndarray:
        guard = np.full(_GUARD, math.nan)
        return np.concatenate([guard, np.zeros(self.effect.memory), guard])

    def own(self, m: np.ndarray) -> np.ndarray:
        """The state variables of the effect."""
        return m[_GUARD : _GUARD + self.effect.memory]

    def call(self, hook: str, c: np.ndarray, m: np.ndarray, *arguments: float) -> np.ndarray:
        function: Any = getattr(self.module, hook)
        return np.atleast_1d(np.array(function(c, self.k, m, self.j, *arguments), dtype=float))

    def settings(self) -> Iterator[tuple[float, ...]]:
        """Values of the parameters: typical ones, and every combination of ends of the bounds."""
        yield tuple(values_of(self.effect).values())
        amplitudes, shapes = self.effect.amplitudes, self.effect.shape_parameters
        ends = [p.bounds for p in shapes]
        for shape in product(*ends):
            for p, end in product(amplitudes, (0, 1)):
                if p.bounds[end] != p.neutral:
                    yield (*(p.bounds[end] if q is p else _typical(q) for q in amplitudes), *shape)

    def course(self) -> Iterator[tuple[float, float, float, float]]:
        """``(lam0, lam, rate, h)`` of steps up, further up, down and at rest, fast and slow."""
        corners = (1.0, 1.0, 1.02, 1.1, 1.1, 0.99, 1.15, 1.15, 1.0)
        for h in (1e-3, 0.1):
            for before, after in pairwise(corners):
                yield before * self.rest, after * self.rest, (after - before) * self.rest / h, h


def values_of(effect: Effect, amplitude: float = 1.0) -> dict[str, float]:
    """Return values of all parameters: ``amplitude`` times the typical ones, shapes at a start."""
    return {p.name: _typical(p, amplitude) for p in effect.parameters}


def _typical(p: Parameter, amplitude: float = 1.0) -> float:
    if p.neutral is not None:
        value = p.neutral + amplitude * p.typical
    elif p.starts and p.relative_to in ("", "spectrum"):
        value = p.starts[0]
    else:
        value = p.typical
    return min(max(value, p.bounds[0]), p.bounds[1])


def _arguments(hook: str, probe: _Probe, step: tuple[float, float, float, float]) -> list[float]:
    lam0, lam, rate, h = step
    known = {
        "t": 1.0, "start": 5e3, "end": 6e3, "h": h, "lam": lam, "rate": rate, "lam0": lam0,
        "since": h, "warmth": 0.5, "moisture": 0.05, "field2": 36e6, "sigma": -50.0, "dt": h,
        "voltage": 5.5e3, "x": (lam / probe.rest - 1.0) * 0.08, "u": rate / probe.rest * 0.08,
    }  # fmt: skip
    return [known[name.strip()] for name in HOOKS[hook].arguments.split(",") if name]


def _values(probe: _Probe) -> Iterator[str]:
    """Finite values over the bounds, and no number of another effect read or written."""
    hooks = [hook for hook in HOOKS if probe.has(hook)]
    for values in probe.settings():
        c, m = probe.coefficients(values), probe.state()
        untouched = c.copy()
        said = ", ".join(
            f"{p.name} = {v:g}" for p, v in zip(probe.effect.parameters, values, strict=True)
        )
        for step in probe.course():
            for hook in hooks:
                found = probe.call(hook, c, m, *_arguments(hook, probe, step))
                if HOOKS[hook].values and not np.all(np.isfinite(found)):
                    yield (
                        f"its hook {hook} returns {found} at {said}: beyond the finite, or with a "
                        f"number of another effect"
                    )
                    return
        if not np.all(np.isfinite(probe.own(m))):
            yield f"its state is not finite at {said}"
        if np.isfinite(m).sum() > probe.effect.memory:
            yield f"it changes state outside its memory of {probe.effect.memory}"
        if not np.array_equal(c, untouched, equal_nan=True):
            yield "it changes coefficients"


def _pure(probe: _Probe) -> Iterator[str]:
    """Hooks without state of their own give the same value at every call within a step."""
    for hook in filter(probe.has, _PURE):
        c, m = probe.coefficients(tuple(values_of(probe.effect).values())), probe.state()
        steps = list(probe.course())
        first = [probe.call(hook, c, m, *_arguments(hook, probe, s)) for s in steps]
        again = [probe.call(hook, c, m, *_arguments(hook, probe, s)) for s in reversed(steps)]
        if not np.array_equal(first, again[::-1]):
            yield (
                f"its hook {hook} changes the state: it is called several times a step, and only "
                f"commit may do that"
            )


def _stiffness(probe: _Probe) -> Iterator[str]:
    """The hook ``stiffness`` against numeric derivatives of ``stress``, with the state at rest."""
    if not probe.has("stress") or (probe.has("stress") and not hasattr(probe.module, "stiffness")):
        return
    c, m = probe.coefficients(tuple(values_of(probe.effect).values())), probe.state()
    given = probe.has("stiffness")
    for part, rate, t in product((1.0, 1.02, 1.05, 1.1), _RATES, (0.5, 5.0)):
        lam = part * probe.rest
        slope, drag = _derivatives(probe, c, m, lam, rate, t)
        if abs(probe.call("stress", c, m, lam, rate, lam, 0.0, t)[0]) > _MAXWELL:
            continue
        said = probe.call("stiffness", c, m, lam, rate) if given else np.zeros(2)
        if said[0] < slope - _SLOPE_TOLERANCE * abs(slope) - _SLOPE_NOTHING:
            yield (
                f"its stiffness returns d stress/d lam = {said[0]:.4g} Pa at lam = {lam:.3g} and "
                f"rate = {rate:g} 1/s, less than the {slope:.4g} Pa of its stress: steps get too "
                f"long"
            )
            return
        if abs(said[1] - drag) > _SLOPE_TOLERANCE * abs(drag) + _DRAG_NOTHING:
            yield (
                f"its stiffness returns d stress/d rate = {said[1]:.4g} Pa s at lam = {lam:.3g} "
                f"and rate = {rate:g} 1/s, and that of its stress is {drag:.4g} Pa s"
            )
            return


def _derivatives(
    probe: _Probe, c: np.ndarray, m: np.ndarray, lam: float, rate: float, t: float
) -> tuple[float, float]:
    """D stress/d lam in Pa and d stress/d rate in Pa s, as central differences."""

    def stress(at: float, speed: float) -> float:
        return float(probe.call("stress", c, m, at, speed, lam, 0.0, t)[0])

    d, e = 1e-6 * lam, 1e-4 * max(rate, 1e-2)
    return (
        (stress(lam + d, rate) - stress(lam - d, rate)) / (2.0 * d),
        (stress(lam, rate + e) - stress(lam, rate - e)) / (2.0 * e),
    )


def _joins(probe: _Probe) -> Iterator[str]:
    """What ``commit`` hands to the next step continues what the step before ended with."""
    for hook in filter(probe.has, ("stress", "soften")):
        c, m = probe.coefficients(tuple(values_of(probe.effect).values())), probe.state()
        h, ends, begins, lam = 1e-4, [], [], probe.rest
        for n in range(2000):
            t = n * h
            rate = 0.3 * math.sin(60.0 * t) + 0.1 * math.cos(17.0 * t)
            after = lam + rate * h
            if hook == "stress":
                ends.append(probe.call(hook, c, m, after, rate, lam, h, t)[0])
            else:
                ends.append(probe.call(hook, c, m, after, h, t, 0.0)[0])
            if probe.has("commit"):
                probe.call("commit", c, m, after, rate, lam, h, t)
            if hook == "stress":
                begins.append(probe.call(hook, c, m, after, rate, after, 0.0, t + h)[0])
            else:
                begins.append(probe.call(hook, c, m, after, 0.0, t + h, 0.0)[0])
            lam = after
        jumps = np.abs(np.subtract(begins, ends))
        if hook == "stress":
            jump, scale = float(jumps.sum()), float(np.abs(np.diff(ends)).sum())
        else:  # softening by the path of the step may wait for the next step
            jump, scale = float(jumps.max()), float(np.ptp(ends)) or 1.0
        if jump > _JUMP_TOLERANCE * scale:
            yield (
                f"its {hook} jumps between steps of 0.1 ms by {jump / scale:.2g} of its changes: "
                f"what commit hands on is not what the step ended with"
            )


def _rest(probe: _Probe) -> Iterator[str]:
    """The factor at rest is that with which a record begins: else the film would move at once."""
    if not probe.has("at_rest"):
        return
    for values in probe.settings():
        c, m = probe.coefficients(values), probe.state()
        rest, begins = probe.call("at_rest", c, m)[0], 1.0
        if probe.has("soften"):
            begins = probe.call("soften", c, m, probe.rest, 0.0, 0.0, 0.0)[0]
        if not abs(rest - begins) < 1e-9:
            yield f"its at_rest is {rest:.6g} where its soften begins with {begins:.6g}"


def _supplies(probe: _Probe) -> Iterator[str]:
    """Steps of ``supply`` and ``polarise`` join, and asking for the present changes nothing."""
    for hook in filter(probe.has, _SUPPLY):
        c, m = probe.coefficients(tuple(values_of(probe.effect).values())), probe.state()
        h, last, end, jumps, seen = 1e-3, None, 0.0, [], []
        for n in range(1000):
            t = n * h
            start, end = end, 4e3 * (1.0 - math.cos(6.0 * (t + h)))
            lead, tail = ((t,), (probe.rest, 0.0)) if hook == "supply" else ((), ())
            kept = probe.own(m).copy()
            now = probe.call(hook, c, m, *lead, start, start, 0.0, *tail)
            again = probe.call(hook, c, m, *lead, start, start, 0.0, *tail)
            same = np.allclose(now, again, 1e-9) and np.allclose(kept, probe.own(m), 1e-9)
            if n and not same:
                yield f"its hook {hook} changes the state where h is 0: that asks for the present"
                return
            before, after = probe.call(hook, c, m, *lead, start, end, h, *tail)
            if last is not None:
                jumps += [before - last, now[0] - last]
            seen.append(after)
            last = after
        scale, jump = float(np.abs(seen).max()), float(np.abs(jumps).max())
        if jump > _JUMP_TOLERANCE * scale:
            yield f"its {hook} jumps by {jump:.3g} between two steps, of {scale:.3g}"


def _drops(probe: _Probe) -> Iterator[str]:
    """``drop`` is the difference between the voltage before ``supply`` and after it."""
    if not (probe.has("drop") and probe.has("supply")):
        return
    c, m = probe.coefficients(tuple(values_of(probe.effect).values())), probe.state()
    start, h = 0.0, 1e-2
    for n in range(1, 200):
        end = 8e3 * math.sin(0.05 * n)
        _, after = probe.call("supply", c, m, n * h, start, end, h, probe.rest, 0.0)
        dropped = float(probe.call("drop", c, m, after)[0])
        if not abs(after + dropped - end) < _JUMP_TOLERANCE * abs(end - after) + _DROP_NOTHING:
            yield (
                f"its drop is {dropped:.4g} V where its supply takes {end - after:.4g} V of "
                f"{end:.4g} V"
            )
            return
        start = end


def _basis(probe: _Probe) -> Iterator[str]:
    """``drift_basis`` is what ``sense`` adds for each amplitude."""
    if probe.effect.drift_basis is None:
        return
    time = np.linspace(0.0, 30.0, 61)
    basis = probe.effect.drift_basis(time)
    for i, _ in enumerate(probe.effect.parameters):
        c = probe.coefficients(np.eye(len(probe.effect.parameters))[i].tolist())
        m = probe.state()
        added = [probe.call("sense", c, m, t, 0.5, 0.0, 0.0)[0] for t in time]
        worst = np.abs(basis[:, i] - added).max()
        if worst > _BASIS_TOLERANCE * np.abs(added).max():
            yield f"its drift_basis differs from what sense adds by {worst:.3g} m a metre"


# --- in simulations


@cache
def _base(driven: str) -> Actuator | Strip:
    """The thesis's actuator, or a strip of film with one branch."""
    if driven == "stretch":
        return Strip(Network(Spring(40e3, 60.0), (Branch(Spring(30e3, 80.0), 2.0),)))
    return Actuator(THESIS_FILM, THESIS_LOAD, TABLE_3)


def _with(effect: Effect, driven: str, amplitude: float) -> Actuator | Strip:
    values = tuple(values_of(effect, amplitude).items())
    return replace(_base(driven), effects=((effect.name, values),))


@cache
def _without(driven: str) -> np.ndarray:
    return _simulated(_base(driven))


def _in_circuits(name: str) -> Iterator[str]:
    """Nearly neutral, the film's voltage and current are those without it, and they are finite."""
    effect = EFFECTS[name]
    if "voltage" not in effect.drives or PLACES[name].is_sensor:
        return
    plain, near, full = (_circuit(effect, amplitude) for amplitude in (0.0, _NEARLY_NEUTRAL, 1.0))
    for row, unit in ((circuit.OUTPUT, "V"), (circuit.FILM, "V"), (circuit.INTO, "A")):
        left = np.abs(near[row] - plain[row]).max()
        if not left < _CIRCUIT_NOTHING * np.abs(plain[row]).max():
            yield f"{left:.3g} {unit} of it are left in the circuit near its neutral values"
    if not np.isfinite(full).all():
        yield "voltage, charge or current are not finite"


def _circuit(effect: Effect, amplitude: float) -> np.ndarray:
    """Rows of the circuit under two lobes along a stretch that follows them."""
    base = _base("voltage")
    model = base if amplitude == 0.0 else _with(effect, "voltage", amplitude)
    if not isinstance(model, Actuator):
        raise ModelError("a strip has no circuit")
    time = np.linspace(0.0, 2.0, 401)
    volts = np.where(time < 1.0, 6e3, 8e3) * np.sin(math.pi * (time % 1.0))
    drive = Drive(time, volts, warmth=0.1 * time, moisture=0.02 * time)
    c = model.coefficients()
    _, rest = at_rest(c, drive)
    stretch = rest + 0.02 * (volts / 8e3) ** 2
    return circuit.follow(c, drive.time, drive.voltage, drive.ends, drive.air, stretch)


def _in_simulations(name: str) -> Iterator[str]:
    """Nearly neutral is nearly nothing, and the length of steps does not matter."""
    effect = EFFECTS[name]
    for driven, unit in (("voltage", "m"), ("stretch", "Pa")):
        if driven not in effect.drives:
            continue
        left = np.abs(_simulated(_with(effect, driven, _NEARLY_NEUTRAL)) - _without(driven)).max()
        if not left < _NEARLY_NOTHING[driven]:
            yield f"{left:.3g} {unit} of it are left near its neutral values"
    if "voltage" not in effect.drives or PLACES[name].is_sensor:
        return
    strong = _with(effect, "voltage", 3.0)
    coarse, fine = _simulated(strong), _simulated(strong, finer=40)
    quick = _simulated(strong, fidelity=kernel.QUICK)
    allowed = _STEP_ERROR + _STEP_ERROR_PART * np.abs(fine - _without("voltage")).max()
    for error, what in (
        (coarse - fine, "samples of 10 ms cut into 40 change the displacement by"),
        (quick - coarse, "without is_hysteretic, quick steps change the displacement by"),
    ):
        if not np.abs(error).max() < allowed:
            yield (
                f"{what} {np.abs(error).max() * 1e6:.3g} um (allowed: {allowed * 1e6:.3g} um): "
                f"steps are too long for it"
            )


def _simulated(
    model: Actuator | Strip, finer: int = 1, fidelity: int = kernel.CAREFUL
) -> np.ndarray:
    """Displacement in m under lobes and a fast edge, or stress in Pa of a strip that is pulled."""
    if isinstance(model, Strip):
        time = np.linspace(0.0, 40.0, 401)
        corners = [0.0, 5.0, 10.0, 12.0, 20.0, 38.0, 40.0]
        film = model.simulate(time, np.interp(time, corners, [1.0, 1.5, 1.1, 1.1, 1.9, 1.9, 1.05]))
        return film.stress if film.ok else np.full(time.size, math.nan)
    time = np.linspace(0.0, 2.4, 241)
    volts = np.where(time < 1.0, 6e3, 8e3) * np.sin(math.pi * (time % 1.0))
    volts = np.where(time < 2.0, volts, 7e3 * np.clip((time - 2.1) / 0.02, 0.0, 1.0))
    fine = np.arange(240 * finer + 1) / (100.0 * finer)
    drive = Drive(
        fine, np.interp(fine, time, volts), warmth=0.1 * fine, moisture=0.02 * fine,
        temperature=_AIR[0], humidity=_AIR[1],
    )  # fmt: skip
    c = model.coefficients()
    displacement, status = reading_of(c, model.film.length, drive, fidelity=fidelity)
    return displacement[::finer] if status == kernel.OK else np.full(time.size, math.nan)
