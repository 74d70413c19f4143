"""How close the general law of each family comes to other laws of it.

Run as ``python -m tests.benchmarks.bench_general_laws [SEEDS]``. Each law acts along one motion
(``tests/tools/general_laws.py``). The first table has the simple laws at their typical size, at
every combination of the starts of their shape parameters. The second has the forms of the simulated
rigs' generator B, drawn by as many seeds. Both have the smallest and largest RMS of what is left,
of the law's own.
"""

import sys
from collections.abc import Callable
from itertools import product

import numpy as np

from dearig.model.effects import EFFECTS
from dearig.model.film.material import TABLE_3, THESIS_FILM, THESIS_LOAD
from dearig.sim_backend.truth import generator_b_laws
from dearig.sim_backend.truth.cases import SECOND_FORMS
from dearig.sim_backend.truth.effect import TruthEffect
from dearig.sim_backend.truth.film import FilmNumbers
from dearig.sim_backend.truth.supply import Supply
from tests.tools.effect_cases import numbers
from tests.tools.general_laws import approximate, motion, response

_FINER = 10  # parts of a sample in which generator B's states are integrated


def shapes_of(name: str) -> list[dict[str, float]]:
    """Every combination of the starts of a law's shape parameters."""
    typical = numbers(name)
    starts = [
        p.starts if p.relative_to in ("", "spectrum") else (typical[p.name],)
        for p in EFFECTS[name].shape_parameters
    ]
    names = [p.name for p in EFFECTS[name].shape_parameters]
    return [dict(zip(names, values, strict=True)) for values in product(*starts)]


def general_laws() -> dict[str, list[str]]:
    """General laws by family."""
    general: dict[str, list[str]] = {}
    for name, effect in EFFECTS.items():
        if effect.is_general:
            general.setdefault(effect.family, []).append(name)
    return general


def left_by(laws: list[str], target: np.ndarray) -> float:
    """What the best of ``laws``, on the best of its grids, leaves of ``target`` (N,), in %."""
    return 100.0 * min(
        approximate(law, target, **grid).error for law in laws for grid in shapes_of(law)
    )


def of_generator_b(effect: TruthEffect) -> np.ndarray | None:
    """What an effect of generator B adds along the motion (N,); None if no hook is like it."""
    path = motion()
    if effect.on_voltage is not None:
        supply = Supply(path.voltage, path.voltage, path.voltage)
        out = effect.on_voltage(path.time, supply, None)[0].pull
        is_slow = effect.family == "dielectric_relaxation"
        changed: np.ndarray = out**2 - path.voltage**2 if is_slow else out - path.voltage
        return changed
    if effect.on_motion is not None:
        rows = np.stack((path.stretch - path.stretch[0], path.rate)) * path.length
        seen: np.ndarray = effect.on_motion(path.time, rows.copy(), None)[0][0] - rows[0]
        return seen
    if effect.on_film is None:
        return None
    return along(effect.on_film)


def along(on_film: Callable[[FilmNumbers], FilmNumbers]) -> np.ndarray:
    """What an effect within the equation of motion adds along the motion (N,)."""
    path, plain = motion(), FilmNumbers.of(THESIS_FILM, THESIS_LOAD, TABLE_3)
    film = on_film(plain)
    s, rest = film.hidden.further, path.stretch[0]
    if s.booth or s.johnson or s.peak_slope:
        square = path.voltage**2
        pairs = zip(square, path.stretch, strict=True)
        return np.array(
            [generator_b_laws.permittivity_factor(s, v2, e, rest) - 1.0 for v2, e in pairs]
        )
    y, dy = np.zeros(generator_b_laws.STATES), np.zeros(generator_b_laws.STATES)
    slipped, out, largest = np.zeros(len(film.stops)), [0.0], rest
    times, moduli = np.array(film.times[len(plain.times) :]), film.moduli[len(plain.moduli) :]
    late = np.zeros(times.size)
    for n in range(1, path.time.size):
        h = (path.time[n] - path.time[n - 1]) / _FINER
        travel = (path.stretch[n] - path.stretch[n - 1]) / _FINER
        stress = 0.0
        for part in range(_FINER):
            lam = path.stretch[n - 1] + (part + 1) * travel
            rate = path.rate[n - 1] + (part + 1) / _FINER * (path.rate[n] - path.rate[n - 1])
            stress = generator_b_laws.added_stress(s, y, 0, lam, rate, rest, dy)
            y += h * dy
            strain = np.log(lam / rest)
            late += (strain - late) * -np.expm1(-h / times)
        if film.stops:
            ends, stiffness = np.array(film.stops).T
            slipped = np.clip(slipped + travel * _FINER, -ends, ends)
            stress += float(stiffness @ slipped)
        if s.simo or s.roxburgh:
            largest = generator_b_laws.healed(s, largest, path.stretch[n], h * _FINER)
            out.append(generator_b_laws.wholeness(s, largest, path.stretch[n], rest) - 1.0)
        else:
            out.append(stress + float(np.dot(moduli, strain - late)) / path.stretch[n])
    return np.array(out)


def main() -> None:
    seeds = int(sys.argv[1]) if len(sys.argv) > 1 else 5
    general = general_laws()
    print("| family | simple law | left, % |\n|---|---|---|")
    for family, laws in sorted(general.items()):
        for name, effect in EFFECTS.items():
            if effect.family != family or effect.is_general or "voltage" not in effect.drives:
                continue
            targets = (response(name, numbers(name, **shape)) for shape in shapes_of(name))
            left = [left_by(laws, target) for target in targets]
            print(f"| {family} | {name} | {min(left):.2g} to {max(left):.2g} |")
    print("\n| family | form of generator B | left, % |\n|---|---|---|")
    for family, laws in sorted(general.items()):
        for form in SECOND_FORMS[family]:
            drawn = (form(np.random.default_rng(seed), THESIS_LOAD) for seed in range(seeds))
            found = [of_generator_b(effect) for effect in drawn]
            left = [left_by(laws, target) for target in found if target is not None]
            print(f"| {family} | {form.__name__} | {min(left):.2g} to {max(left):.2g} |")


if __name__ == "__main__":
    main()
