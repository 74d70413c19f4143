"""Why the diagnosis misses: one cause for each simulated rig that it does not explain.

Run as ``python -m tests.benchmarks.bench_misses --rows FILE [--first SEED] [--rigs N]
[--seeds 3,17] [--generator second] [--train rich] [--noise KIND]``. Each rig is recorded and
diagnosed as in the blind test. A miss is a rig whose error on untouched recordings is above 15 %
over what the truth itself leaves, or whose hidden family is not named. Two further searches then
use the library's laws of the hidden families alone, without a limit of work:

* *alone*: fitted to the training recordings, from the starts of the regression and from the optima
  of the second search; the fit with the best criterion counts, as in a diagnosis;
* *together*: fitted to training and validation recordings; the fit with the smallest validation
  error counts. It shows what the library can express, and predicts nothing.

The cause is ``search`` if *alone* comes within 15 %: the laws and the recordings would have done.
It is ``excitation`` if only *together* does: the training recordings do not determine the law or
its numbers. It is ``form`` if neither does: no law of the family comes near; ``form, not shown`` if
*alone* meets the training recordings all the same, so that no search could see it in them. Within
15 % but misnamed has no error to explain. A change that happens once cannot be predicted
(``once``).

Each rig is a line of JSON in FILE, and is skipped the next time; ``--table`` prints the table of
what is there.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
import tempfile
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import platformdirs

from dearig.config.rigfile import RigFile
from dearig.model.diagnosis.engine import Search
from dearig.model.diagnosis.evidence import Judge
from dearig.model.diagnosis.fits import Fit, Fitter
from dearig.model.diagnosis.settings import DiagnosisSettings
from dearig.model.film.material import TABLE_3
from dearig.model.readings.records import ActuatorRecord
from dearig.model.simulation.actuator import Actuator
from dearig.sim_backend.laser_noise import NOISES, WHITE
from dearig.sim_backend.truth.cases import GENERATORS, TruthCase
from dearig.sim_backend.truth.effects import sudden
from tests.benchmarks.bench_ablation import _error
from tests.blind.play import MODES, Bench, Case, records_of
from tests.blind.score import FAILED, WITHIN, Score, score

SEARCH, EXCITATION, FORM, NOT_SHOWN = "search", "excitation", "form", "form, not shown"
REACHED, ONCE = "within 15 %", "once"
COLUMNS = (SEARCH, EXCITATION, NOT_SHOWN, FORM, REACHED, ONCE)
_CROSSED = 3  # fits of one search that are starts of the other
_BESIDE = 2  # fits of a first family to which laws of a second one are added
_ITERATIONS = 20  # of a fit that begins next to an optimum


class Oracle:
    """The laws of ``families`` alone, fitted to ``records`` without a limit of work."""

    def __init__(
        self, records: Sequence[ActuatorRecord], base: Actuator, families: Sequence[str]
    ) -> None:
        self.fitter = Fitter(records, base, DiagnosisSettings(effort=math.inf), workers=1)
        self._search = search = Search(self.fitter, lambda *_: None, lambda: False)
        laws = [*search.effects, *search.general]
        search.general = []
        fits = [search.keep(self.fitter.baseline(lambda *_: None))]
        self.judge = search.judge = Judge(self.fitter.settings, fits[0])
        for family in families:
            among = [e for e in laws if e.family == family]
            grown = [f for fit in fits[:_BESIDE] for f in search._raced(fit, among)]
            if family == "drift":
                grown += [f for fit in fits[:_BESIDE] if (f := search._drifting(fit))]
            fits = self.judge.ranked(grown) or fits
        self.fits = fits

    def continued(self, others: Iterable[Fit]) -> None:
        """Add fits that begin at the optima of ``others``, which are of other records."""
        for other in list(others)[:_CROSSED]:
            problem = self.fitter.problem(other.model, other.drift)
            layout = problem.layout
            start = layout.coordinates(layout.initial()).clip(layout.lower, layout.upper)
            fit = self.fitter.descend(problem, start, _ITERATIONS, sure=True)
            self.fits.append(self.fitter.refined(fit))
        self.judge.see(self.fits)
        self.fits = self.judge.ranked(self.fits)


def oracles(
    train: list[ActuatorRecord],
    others: list[ActuatorRecord],
    families: Sequence[str],
    least: float,
) -> dict[str, Any]:
    """Return what the laws of ``families`` reach alone and together, over ``least`` in m."""
    rig = RigFile()
    base = Actuator(rig.as_film(), rig.as_load(), TABLE_3)
    alone = Oracle(train, base, families)
    together = Oracle([*train, *others], base, families)
    of_alone = list(alone.fits)
    alone.continued(together.fits)
    together.continued(of_alone)
    first = alone.fits[0]
    reached = [(_over(fit, others, least), fit) for fit in together.fits]
    error, best = min(reached, key=lambda pair: pair[0])
    return {
        "alone": _told(first, _over(first, others, least), _over(first, train, least)),
        "together": _told(best, error, _over(best, train, least)),
        "chosen": [_told(f, _over(f, others, least), math.nan) for f in alone.fits[:_CROSSED]],
    }


def _over(fit: Fit, records: list[ActuatorRecord], least: float) -> float:
    model = fit.model
    return _error(model, records) / least if isinstance(model, Actuator) else math.inf


def _told(fit: Fit, validation: float, train: float) -> dict[str, Any]:
    return {"laws": sorted(fit.members), "validation": validation, "train": train}


def happened_once(truth: TruthCase) -> bool:
    """Whether what is hidden happens once: no law predicts it."""
    hooks = [h for e in truth.effects for h in (e.on_course, e.on_motion, e.on_voltage)]
    return any(getattr(h, "__module__", "") == sudden.__name__ for h in hooks)


def said_of(found: Score) -> str:
    """Return the row of the table: how ``found`` names what is hidden."""
    if found.kind == "pair" and not found.both:
        return "one of two missed"
    if found.outcome in ("right", "group"):
        return "named right"
    return "named wrongly" if found.named else "nothing named"


def cause_of(row: Mapping[str, Any]) -> str:
    """Return the column of the table: where the error of a ``row`` comes from."""
    if row["once"]:
        return ONCE
    if row["after"] <= WITHIN:
        return REACHED
    if row["alone"]["validation"] <= WITHIN:
        return SEARCH
    if row["together"]["validation"] <= WITHIN:
        return EXCITATION
    return NOT_SHOWN if row["alone"]["train"] <= WITHIN else FORM


def row_of(bench: Bench, case: Case) -> dict[str, Any] | None:
    """Record and diagnose ``case``, and find where its error comes from.

    None where there is no diagnosis: an interlock may have ended the recording.
    """
    result = bench.kept(case, any_sources=False) or bench.play(case)
    found = score(result)
    if found.outcome == FAILED:
        return None
    row: dict[str, Any] = {
        "seed": case.seed, "mode": case.mode, "generator": case.generator, "noise": case.noise,
        "sources": result["sources"], "families": list(found.families),
        "description": found.description, "named": list(found.named), "said": said_of(found),
        "verdict": found.verdict, "before": found.before / found.least, "after": found.over_least,
        "once": happened_once(case.truth),
    }  # fmt: skip
    row["missed"] = not (found.found and found.is_noise and found.both is not False)
    if row["missed"] and not row["once"] and not found.is_noise:
        with tempfile.TemporaryDirectory(prefix="dearig-misses-") as folder:
            train, others = (records_of(paths) for paths in bench.record(case, Path(folder)))
        row |= oracles(train, others, found.families, found.least * 1e-6)
    return row


def table(rows: Sequence[Mapping[str, Any]]) -> str:
    """Return the table of causes of the ``rows`` that are missed."""
    lines = []
    for generator in dict.fromkeys(r["generator"] for r in rows):
        of = [r for r in rows if r["generator"] == generator]
        missed = [r for r in of if r["missed"]]
        counts = Counter((r["said"], cause_of(r)) for r in missed)
        lines += ["", f"Generator {generator}: {len(missed)} of {len(of)} rigs are missed", ""]
        lines += [f"| | {' | '.join(COLUMNS)} |", "|---|" + "---|" * len(COLUMNS)]
        for said in dict.fromkeys(r["said"] for r in missed):
            cells = (str(counts[said, column]) for column in COLUMNS)
            lines.append(f"| {said} | {' | '.join(cells)} |")
        lines += ["", "| seed | hidden | named | error | alone | together | cause |"]
        lines.append("|---|" + "---|" * 6)
        lines += [_line(r) for r in missed]
    return "\n".join(lines)


def _line(row: Mapping[str, Any]) -> str:
    def reached(which: str) -> str:
        if which not in row:
            return ""
        laws = " + ".join(row[which]["laws"]) or "no law"
        return f"{row[which]['validation']:.2f} ({laws})"

    cells = (
        str(row["seed"]), row["description"] or "nothing", " + ".join(row["named"]) or "nothing",
        f"{row['after']:.2f}", reached("alone"), reached("together"), cause_of(row),
    )  # fmt: skip
    return f"| {' | '.join(cells)} |"


def main() -> None:
    given = _arguments()
    rows = _read(given.rows)
    if not given.table:
        done = {(r["seed"], r["mode"], r["generator"], r["noise"]) for r in rows}
        bench = Bench(given.out, given.rate, bare=True)
        for seed in given.seeds or range(given.first, given.first + given.rigs):
            case = Case(seed, given.train, given.generator, given.noise)
            if (seed, given.train, given.generator, given.noise) in done:
                continue
            row = row_of(bench, case)
            if row is None:
                print(f"{seed}: not diagnosed", flush=True)
                continue
            rows.append(row)
            with given.rows.open("a", encoding="utf-8") as lines:
                lines.write(json.dumps(row) + "\n")
            cause = cause_of(row) if row["missed"] else "not missed"
            print(f"{seed}: {row['said']}, {row['after']:.2f}, {cause}", flush=True)
    sys.stdout.write(table(rows) + "\n")


def _read(path: Path) -> list[dict[str, Any]]:
    if not path.exists():
        return []
    return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    add = parser.add_argument
    add("--rows", type=Path, required=True, help="file of JSON lines, one for each rig")
    add("--first", type=int, default=0, help="first seed [0]")
    add("--rigs", type=int, default=100, help="how many rigs [100]")
    add("--seeds", type=lambda text: [int(s) for s in text.split(",")], help="these, such as 3,17")
    add("--generator", choices=tuple(GENERATORS), default="first", help="[first]")
    add("--noise", choices=NOISES, default=WHITE, help="noise of the laser [white]")
    add("--train", choices=tuple(MODES), default="thesis", help="training recordings [thesis]")
    add("--rate", type=float, default=200.0, help="Hz [200]")
    add(
        "--out", type=Path, default=Path(platformdirs.user_cache_dir("dearig-blind")),
        help="where results of the blind test are kept [the user's cache]",
    )  # fmt: skip
    add("--table", action="store_true", help="print the table of what is there, play nothing")
    return parser.parse_args()


if __name__ == "__main__":
    main()
