"""How often the 95 % band of a prediction holds recordings that no fit has seen.

Run as ``python -m tests.benchmarks.bench_bands --folder DIR [--first SEED] [--rigs N]
[--generator second] [--clean]``. Each simulated rig is recorded under the thesis's sequence, the
three validation sequences of the blind test, and three others, one of them with sharper edges and a
chirp. It is diagnosed by the public command from the first four; the model that this writes then
predicts the other three. Two shares are counted: of the readings that lie inside the band of a
reading, and of the means over 1 s of the error that lie inside the band of such a mean, in which
noise averages out and the other parts do not. Both are given with and without the part of the law.

Recordings and models stay in DIR, and are used again. Rigs are told apart by what was found: those
that hide nothing, those whose hidden family was named, and the others.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from dearig.analysis.outcomes import Comparison
from dearig.analysis.validate import validate_model
from dearig.errors import DearigError
from tests.blind.play import VALIDATION, Bench, Case, diagnose
from tests.blind.seeds import clean_seeds

UNSEEN = ("rich", "validation-b-8.0", "validation-a-1.0")
_RATE = 500.0  # Hz


@dataclass(frozen=True)
class Share:
    """Shares inside the band of one unseen recording: of readings, and of means over 1 s."""

    group: str
    sequence: str
    beyond: bool
    readings: float
    means: tuple[bool, ...]
    without_law: tuple[bool, ...]
    parts_um: tuple[float, float, float]


def recorded(bench: Bench, case: Case, folder: Path) -> list[Path]:
    """Return the recordings of ``case`` in ``folder``, which are made where they are missing."""
    folder.mkdir(parents=True, exist_ok=True)
    paths = []
    for i, name in enumerate(("thesis", *VALIDATION, *UNSEEN)):
        path = folder / f"{Path(name).name.removesuffix('.toml')}.h5"
        if not path.exists():
            bench._record(name, case.address, path, seed=i)
        paths.append(path)
    return paths


def shares(bench: Bench, case: Case) -> Iterator[Share]:
    """Yield what the band of the model of ``case`` holds of each unseen recording."""
    folder = bench.folder.parent / case.address.replace(":", "-")
    train, *others = recorded(bench, case, folder)
    model, told = folder / "model.toml", folder / "d.json"
    if not model.exists():
        _, error, _ = diagnose([train], others[:3], told, model=model)
        if error:
            print(f"{case.address}: {error}", file=sys.stderr)
            return
    found = {step["family"] for step in json.loads(told.read_text("utf-8"))["steps"]}
    hidden = set(case.truth.families)
    named = "the hidden family is named" if hidden <= found else "another verdict"
    group = named if hidden else "nothing hidden"
    for c in validate_model(model, others[3:]).comparisons:
        yield _share(group, c)


def _share(group: str, c: Comparison) -> Share:
    if c.band is None:
        raise SystemExit(f"{c.name}: the model has no band")
    error, many = c.measured - c.model, round(_RATE)
    count = error.size // many
    means = np.nanmean(error[: count * many].reshape(count, many), axis=1)
    inside = tuple((np.abs(means) <= c.band.of_means(many)).tolist())
    bare = replace(c.band, law=0.0).of_means(many)
    parts = (c.band.parameters_rms * 1e6, c.band.noise * 1e6, c.band.law * 1e6)
    return Share(
        group, c.name, c.band.beyond is not None, c.band.inside(error), inside,
        tuple((np.abs(means) <= bare).tolist()), parts,
    )  # fmt: skip


def table(found: Sequence[Share]) -> str:
    """Return the shares of each group, of recordings within and beyond what training showed."""
    lines = [
        "| rigs | drive | recordings | readings, % | means over 1 s, % | means without law, % |",
        "|---|---|---|---|---|---|",
    ]
    for group in dict.fromkeys(s.group for s in found):
        for beyond in (False, True):
            some = [s for s in found if s.group == group and s.beyond is beyond]
            if some:
                means, bare = ([m for s in some for m in getattr(s, w)] for w in _MEANS)
                lines.append(
                    f"| {group} | {'beyond training' if beyond else 'as trained'} | {len(some)} | "
                    f"{100.0 * np.mean([s.readings for s in some]):.1f} | "
                    f"{100.0 * np.mean(means):.1f} of {len(means)} | {100.0 * np.mean(bare):.1f} |"
                )
    return "\n".join(lines)


_MEANS = ("means", "without_law")


def main() -> None:
    """Count, and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--folder", type=Path, required=True, help="recordings and models")
    parser.add_argument("--first", type=int, default=7100, help="first seed [7100]")
    parser.add_argument("--rigs", type=int, default=6, help="rigs of each generator [6]")
    parser.add_argument("--clean", type=int, default=3, help="rigs that hide nothing [3]")
    given = parser.parse_args()
    bench = Bench(given.folder, _RATE)
    cases = [Case(seed, "thesis") for seed in clean_seeds(given.clean)]
    for seed in range(given.first, given.first + given.rigs):
        cases += [Case(seed, "thesis"), Case(seed + 100, "thesis", "second")]
    found: list[Share] = []
    for case in cases:
        try:
            new = list(shares(bench, case))
        except DearigError as error:
            print(f"{case.address}: {error}", file=sys.stderr)
            continue
        found += new
        for s in new:
            parts = ", ".join(f"{part:.3g}" for part in s.parts_um)
            print(
                f"{case.address} {s.group}, {s.sequence}: {100.0 * s.readings:.1f} % of readings, "
                f"{100.0 * np.mean(s.means):.0f} % of means; parts {parts} um",
                flush=True,
            )
    print(f"\n{table(found)}")


if __name__ == "__main__":
    main()
