"""What each stage and each rule of the diagnosis earns: switched off in turn, on the same rigs.

Run as ``python -m tests.benchmarks.bench_ablation [--first SEED] [--rigs N] [--generator second]
[--seeds 3,17] [--noise KIND] [--only NAME,...]``. Every rig is recorded once, as in the blind test,
and diagnosed by the whole method and by each method with one thing less. A row says for how many
rigs the first effect was of a hidden family (or nothing was named where nothing is hidden), for how
many the error on untouched recordings came within 15 % of what the truth itself would leave, for
how many it got worse than the baseline's, and the work of all searches in integration steps, over
the whole method's. A fit that two variants make in the same way is made once.

A rule earns its place if its row is worse than the first by more than chance: the last column is
the probability of so large a difference in the number within the noise, either way, if the rule did
nothing (the sign test on the rigs that differ). Rigs that were looked at are not evidence.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import math
import tempfile
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np
from scipy.stats import binomtest

from dearig.config.rigfile import RigFile
from dearig.model.diagnosis.conclusion import Conclusion
from dearig.model.diagnosis.engine import Search
from dearig.model.diagnosis.evidence import Judge, family_of
from dearig.model.diagnosis.fits import Fit, Fitter
from dearig.model.diagnosis.regression import Regression
from dearig.model.diagnosis.settings import DiagnosisSettings
from dearig.model.diagnosis.shapes import Extent
from dearig.model.effects import Effect
from dearig.model.film.material import TABLE_3
from dearig.model.fitting.slow_noise import WhitenedProblem
from dearig.model.readings.records import ActuatorRecord
from dearig.model.simulation.actuator import Actuator
from dearig.sim_backend.laser_noise import NOISES, WHITE
from dearig.sim_backend.truth.cases import GENERATORS
from tests.blind.play import Bench, Case, records_of
from tests.blind.score import WITHIN

Switch = Callable[[], AbstractContextManager[Any]]


@dataclass(frozen=True)
class Variant:
    """The method with one thing less: other settings, or a step that does nothing."""

    name: str
    settings: Mapping[str, Any]
    switch: Switch = nullcontext


def _without(owner: Any, name: str, instead: Callable[..., Any]) -> Switch:
    return lambda: mock.patch.object(owner, name, instead)


VARIANTS = (
    Variant("whole", {}),
    # stages
    Variant(
        "no general laws",
        {},
        _without(Search, "_with_general", lambda *given: given[-1]),
    ),
    Variant("no drift in the noise", {}, _without(Search, "_drifting", lambda *_: None)),
    Variant("no exchange", {}, _without(Search, "_exchanged", lambda *given: given[-1])),
    Variant("no pruning", {}, _without(Search, "_pruned", lambda *given: given[-1])),
    Variant(
        "shapes not sharpened", {}, _without(Regression, "_sharpened", lambda *given: given[1])
    ),
    Variant("one effect at most", {"effects_max": 1}),
    # rules
    Variant("one start of each effect", {"starts": 1}),
    Variant("no model of the form's error", {"form_error": 0.0, "form_share": 0.0}),
    Variant("a further effect need not explain half", {"share": 0.0}),
    Variant("noise is noise, white or not", {}, _without(Judge, "_is_like_rest", lambda *_: True)),
)


@dataclass(frozen=True)
class Outcome:
    """One rig under one variant; errors on untouched recordings over what the truth leaves.

    ``effort`` is the work of its search in integration steps, shared fits included.
    """

    right: bool
    before: float
    after: float
    effort: float


class Shared:
    """The variants of one rig: a fit that an earlier one made in the same way is not made again.

    Which derivatives coarse drives give is asked once of each set of effects, so that a variant may
    differ from a search of its own by what that was asked of.
    """

    def __init__(self, train: list[ActuatorRecord], base: Actuator) -> None:
        self._fitter = Fitter(train, base, DiagnosisSettings(), workers=1)
        self._baseline = self._fitter.baseline(lambda *_: None)
        self._spent = self._fitter.work.effort
        self._kept: dict[Any, tuple[Any, int, float]] = {}
        for name in ("descend", "refined", "careful", "identified", "costs"):
            setattr(self._fitter, name, self._once(name, getattr(self._fitter, name)))
        self._fitter.baseline = lambda _: self._baseline  # type: ignore[method-assign]

    def diagnosed(self, variant: Variant) -> tuple[Conclusion, float]:
        """Return the conclusion of one variant, and its work."""
        fitter = self._fitter
        fitter.settings = replace(DiagnosisSettings(), **variant.settings)
        fitter.work.simulations, fitter.work.effort = 0, self._spent
        with variant.switch():
            search = Search(fitter, lambda *_: None, lambda: False)
            search._regression = self._regressed(search._regression)  # type: ignore[method-assign]
            found = search.run()
            effort = fitter.work.effort
            return Conclusion(found, fitter, search.without), effort

    def _once(self, name: str, call: Callable[..., Any]) -> Callable[..., Any]:
        work = self._fitter.work

        def called(*given: Any, **options: Any) -> Any:
            key = (name, *map(_key, given), *((k, _key(v)) for k, v in sorted(options.items())))
            if key in self._kept:
                result, simulations, effort = self._kept[key]
                self._fitter._count(simulations, effort)
                return result
            simulations, effort = work.simulations, work.effort
            result = call(*given, **options)
            self._kept[key] = result, work.simulations - simulations, work.effort - effort
            return result

        return called

    def _regressed(self, call: Callable[..., Any]) -> Callable[..., Any]:
        """Return the regression of a parent, its starts found once for the same settings."""
        used = replace(self._fitter.settings, **dict.fromkeys(_NOT_OF_REGRESSION, 0))

        def called(parent: Any) -> Any:
            key = ("regression", used, Regression._sharpened, _key(parent))
            if key not in self._kept:
                regression, extent = call(parent)
                found: dict[Any, Any] = {}
                whole = regression.starts

                def starts(effects: Sequence[Effect], extent: Extent) -> Any:
                    names = tuple(e.name for e in effects)
                    if names not in found:
                        found[names] = whole(effects, extent)
                    return found[names]

                regression.starts = starts
                self._kept[key] = (regression, extent), 0, 0.0
            return self._kept[key][0]

        return called


#: Settings that the regression does not use.
_NOT_OF_REGRESSION = (
    "effort", "effects_max", "odds", "form_error", "form_share",
    "noise_margin", "white_correlation", "tempering",
)  # fmt: skip


def _key(given: Any) -> Any:
    """Return what tells one argument of a fit from another."""
    if isinstance(given, np.ndarray):
        return hashlib.sha256(np.ascontiguousarray(given).tobytes()).digest()
    if isinstance(given, WhitenedProblem):
        drift = given.noise_drift.amplitude if given.noise_drift else 0.0
        layout = given.layout
        bounds = (_key(layout.lower), _key(layout.upper))
        return repr(layout.base), bounds, drift, given.fidelity, given.samples
    if isinstance(given, Fit):
        return _key(given.problem), _key(given.x), _key(given.fixed)
    return given


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--first", type=int, default=90000, help="first seed [90000]")
    parser.add_argument("--rigs", type=int, default=100, help="how many rigs [100]")
    parser.add_argument("--seeds", help="these alone, such as 3,17")
    parser.add_argument("--generator", choices=tuple(GENERATORS), default="first", help="[first]")
    parser.add_argument("--noise", choices=NOISES, default=WHITE, help="[white]")
    parser.add_argument("--rate", type=float, default=200.0, help="Hz [200]")
    parser.add_argument("--only", help="names of variants besides the whole, with commas between")
    parser.add_argument("--effort", type=float, help="integration steps of a search [its own]")
    parser.add_argument("--keep", type=Path, help="append a line of JSON for each rig to this file")
    given = parser.parse_args()
    seeds = range(given.first, given.first + given.rigs)
    if given.seeds:
        seeds = [int(seed) for seed in given.seeds.split(",")]
    variants = list(VARIANTS)
    if given.effort:
        variants = [replace(v, settings={"effort": given.effort, **v.settings}) for v in variants]
    if given.only:
        names = ["whole", *(name.strip() for name in given.only.split(","))]
        if unknown := set(names) - {v.name for v in VARIANTS}:
            parser.error(f"no variant {', '.join(sorted(unknown))}")
        variants = [v for v in VARIANTS if v.name in names]
    found: dict[str, list[Outcome]] = {v.name: [] for v in variants}
    with tempfile.TemporaryDirectory() as folder:
        bench = Bench(Path(folder), given.rate)
        for seed in seeds:
            case = Case(seed, "thesis", given.generator, given.noise)
            outcomes, kept = _played(bench, case, Path(folder) / str(seed), variants)
            for name, outcome in outcomes.items():
                found[name].append(outcome)
            if given.keep:
                with given.keep.open("a", encoding="utf-8") as lines:
                    lines.write(json.dumps(kept) + "\n")
            print(f"{seed}: {_told(found)}", flush=True)
    print(_table(found))


def _played(
    bench: Bench, case: Case, folder: Path, variants: list[Variant]
) -> tuple[dict[str, Outcome], dict[str, Any]]:
    """Record the rig of ``case`` and diagnose it by every variant.

    With the outcomes is returned what the probabilities of the whole method are made of.
    """
    folder.mkdir()
    train, others = (records_of(paths) for paths in bench.record(case, folder))
    least = math.hypot(bench.floor_um(case.noise), bench.own_um(case)) * 1e-6
    rig = RigFile()
    shared = Shared(train, Actuator(rig.as_film(), rig.as_load(), TABLE_3))
    families = set(case.truth.families)
    outcomes: dict[str, Outcome] = {}
    kept: dict[str, Any] = {}
    for variant in variants:
        end, effort = shared.diagnosed(variant)
        order = end.order()
        right = family_of(order[0]) in families if order else not families
        models = (end.first.model, end.for_others())
        before, after = (
            _error(model, others) / least for model in models if isinstance(model, Actuator)
        )
        outcomes[variant.name] = Outcome(right, before, after, effort)
        kept = kept or _kept(case, end)
    kept["outcomes"] = {name: asdict(outcome) for name, outcome in outcomes.items()}
    return outcomes, kept


def _kept(case: Case, end: Conclusion) -> dict[str, Any]:
    """Return what the probabilities of the families are made of, for their calibration."""
    judge, found = end.judge, end.found
    return {
        "seed": case.seed,
        "hand": case.generator,
        "noise": case.noise,
        "hidden": list(case.truth.families),
        "status": found.status,
        "verdict": end.verdict(),
        "explained": end.explained,
        "small": end.is_small,
        "first_cost": end.first.cost,
        "last_cost": end.last.cost,
        "samples": judge.samples,
        "base_cost": judge.base_cost,
        "sought": sorted(found.sought),
        "best": sorted(found.best.members),
        "fits": [
            {
                "members": sorted(fit.members),
                "cost": fit.cost,
                "free": fit.free,
                "criterion": judge.criterion(fit),
            }
            for fit in found.fits.values()
        ],
    }


def _error(model: Actuator, records: list[ActuatorRecord]) -> float:
    """RMS in m of all ``records`` together; infinite where the model cannot follow one."""
    left = []
    for record in records:
        response = model.simulate(record.drive, record.lag)
        if not response.ok:
            return math.inf
        good = slice(None) if record.valid is None else record.valid
        left.append((record.displacement - record.seen(response.displacement))[good])
    return float(np.sqrt(np.mean(np.concatenate(left) ** 2)))


def _told(found: Mapping[str, list[Outcome]]) -> str:
    return ", ".join(f"{name} {rows[-1].after:.2f}" for name, rows in found.items())


def _table(found: Mapping[str, list[Outcome]]) -> str:
    heads = ("variant", "named right", "within 15 %", "worse", "work", "by chance")
    lines = ["| " + " | ".join(heads) + " |", "|" + "---|" * len(heads)]
    whole = [o.after <= WITHIN for o in found["whole"]]
    for name, rows in found.items():
        within = [o.after <= WITHIN for o in rows]
        gained = sum(a and not b for a, b in zip(within, whole, strict=True))
        lost = sum(b and not a for a, b in zip(within, whole, strict=True))
        chance = binomtest(lost, lost + gained).pvalue if lost + gained else 1.0
        cells = (
            name,
            f"{sum(o.right for o in rows)}/{len(rows)}",
            f"{sum(within)}/{len(rows)} (+{gained} -{lost})",
            str(sum(o.after > 1.001 * o.before for o in rows)),
            f"{sum(o.effort for o in rows) / sum(o.effort for o in found['whole']):.2f}",
            f"{chance:.2f}",
        )
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines)


if __name__ == "__main__":
    main()
