"""How close the general law of each family comes to each simple law of it.

Run as ``python -m tests.benchmarks.bench_general_laws``. Each law acts along the same motion
(``tests/tools/general_laws.py``) at its typical size, at every combination of the starts of its
shape parameters. The table has the smallest and largest RMS of what is left, of the law's own.
"""

from itertools import product

from dearig.model.effects import EFFECTS
from tests.tools.effect_cases import numbers
from tests.tools.general_laws import approximate, response


def shapes_of(name: str) -> list[dict[str, float]]:
    """Every combination of the starts of a law's shape parameters."""
    typical = numbers(name)
    starts = [
        p.starts if p.relative_to in ("", "spectrum") else (typical[p.name],)
        for p in EFFECTS[name].shape_parameters
    ]
    names = [p.name for p in EFFECTS[name].shape_parameters]
    return [dict(zip(names, values, strict=True)) for values in product(*starts)]


def main() -> None:
    general: dict[str, list[str]] = {}
    for name, effect in EFFECTS.items():
        if effect.is_general:
            general.setdefault(effect.family, []).append(name)
    print("| family | simple law | nearest general law | left, % |\n|---|---|---|---|")
    for family, laws in sorted(general.items()):
        for name, effect in EFFECTS.items():
            if effect.family != family or effect.is_general or "voltage" not in effect.drives:
                continue
            found = []
            for shape in shapes_of(name):
                target = response(name, numbers(name, **shape))
                tried = [
                    (approximate(law, target, **grid).error, law)
                    for law in laws
                    for grid in shapes_of(law)
                ]
                found.append(min(tried))
            left = [100.0 * error for error, _ in found]
            print(f"| {family} | {name} | {max(found)[1]} | {min(left):.2g} to {max(left):.2g} |")


if __name__ == "__main__":
    main()
