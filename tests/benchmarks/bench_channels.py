"""Electrical families with and without the voltage monitor and the current.

Run as ``python -m tests.benchmarks.bench_channels``. Rigs of both generators that hide one effect
on the voltage or the dielectric, and rigs that hide nothing, play the thesis's sequence. Each
recording is diagnosed with its channels and without them, on the same machine one after the other,
so that the ratio of processor times is paired; ``--average`` makes each row the mean of so many
conversions. Printed are what is hidden, what was named, and the probability that the hidden family
has.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

from dearig.acquisition.run import RunOptions, record
from dearig.analysis.readings.compatibility import base_model
from dearig.analysis.readings.record import Readings
from dearig.config.rigfile import RigFile
from dearig.config.sequencefile import load_sequence
from dearig.model.diagnosis import diagnose
from dearig.model.diagnosis.results import Diagnosis
from dearig.model.readings.records import ActuatorRecord
from dearig.recording import open_recording
from dearig.sim_backend.truth import cases
from dearig.sim_backend.truth.cases import GENERATORS, TruthCase, address_of

FAMILIES = (
    "leakage",
    "amplifier",
    "electrode_resistance",
    "dielectric_relaxation",
    "permittivity",
    "clean",
)


def hidden(rig: RigFile, first: int, each: int, generator: str) -> Iterator[TruthCase]:
    """Yield the first ``each`` cases of every family, from seed ``first`` on."""
    left = dict.fromkeys(FAMILIES, each)
    seed = first
    while any(left.values()):
        case = cases.draw(seed, rig.as_film(), rig.as_load(), generator=generator)
        family = case.families[0] if len(case.families) == 1 else ""
        kind = "clean" if not case.families else family
        if left.get(kind, 0):
            left[kind] -= 1
            yield case
        seed += 1


def recorded(rig: RigFile, case: TruthCase, folder: Path) -> ActuatorRecord:
    """Return the thesis's run of the rig of ``case``."""
    address = address_of(case.seed, case.generator)
    out = folder / f"{address.replace(':', '-')}.h5"
    record(load_sequence("thesis"), address, rig, out, RunOptions(seed=case.seed))
    made = Readings(open_recording(out)).record
    assert isinstance(made, ActuatorRecord)
    return made


def diagnosed(
    rig: RigFile, made: ActuatorRecord, folder: Path, case: TruthCase
) -> tuple[Diagnosis, float]:
    """Return the diagnosis of a record, and its processor time in s."""
    address = address_of(case.seed, case.generator).replace(":", "-")
    base = base_model([open_recording(folder / f"{address}.h5")], 3, "gent", None, rig, "")
    started = time.process_time()
    found = diagnose([made], base)
    return found, time.process_time() - started


def told(found: Diagnosis, family: str) -> str:
    """Return what was named, and the probability of the hidden ``family``."""
    named = " + ".join(step.effect for step in found.steps) or found.verdict
    probability = dict(found.families).get("none" if family == "clean" else family, 0.0)
    return f"{named} ({probability:.2f})"


def main() -> None:
    """Play, diagnose twice, print the table and what it comes to."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--first", type=int, default=240000, help="seed [240000]")
    parser.add_argument("--each", type=int, default=2, help="rigs of each family [2]")
    parser.add_argument("--generator", choices=GENERATORS, help="one of the generators [both]")
    parser.add_argument("--average", type=int, default=1, help="conversions in a row [1]")
    given = parser.parse_args()
    rig = RigFile.model_validate({"card": {"average": given.average}})
    right: dict[str, list[bool]] = {"with": [], "without": []}
    seconds: dict[str, float] = dict.fromkeys(right, 0.0)
    print("| rig | hidden | with the channels | without | time, with over without |")
    print("|---|---|---|---|---|")
    for generator in [given.generator] if given.generator else GENERATORS:
        for case in hidden(rig, given.first, given.each, generator):
            family = case.families[0] if case.families else "clean"
            with tempfile.TemporaryDirectory() as name:
                made = recorded(rig, case, Path(name))
                results: dict[str, Any] = {}
                for how in right:
                    each = made if how == "with" else replace(made, electric=None)
                    results[how] = diagnosed(rig, each, Path(name), case)
            for how, (found, spent) in results.items():
                families = [step.family for step in found.steps] or ["clean"]
                right[how].append(family in families)
                seconds[how] += spent
            ratio = results["with"][1] / results["without"][1]
            print(
                f"| {address_of(case.seed, generator)} | {case.description or 'nothing'} "
                f"| {told(results['with'][0], family)} | {told(results['without'][0], family)} "
                f"| {ratio:.2f} |",
                flush=True,
            )
    for how, values in right.items():
        print(f"\n{how} the channels: {sum(values)} of {len(values)} families named right")
    print(f"\nprocessor time, with over without: {seconds['with'] / seconds['without']:.2f}")


if __name__ == "__main__":
    main()
