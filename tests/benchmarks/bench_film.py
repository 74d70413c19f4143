"""What is found in a measured film, whichever of its recordings are fitted and whichever left out.

Run as ``python -m tests.benchmarks.bench_film [DATA]``, DATA being the folder of the measured data
(next to the checkout where it is not given). Every choice of one to three of the four recordings is
diagnosed by ``dearig diagnose``, and the others are foreseen. RMS in kPa, before and after; * marks
a recording that goes to a larger stretch than any that was fitted, or lasts much longer. Last come
how many of these are foreseen better and worse than before.
"""

import sys
import tempfile
from collections import Counter
from collections.abc import Iterator
from itertools import combinations
from pathlib import Path

import pytest

from dearig.analysis.readings.enough import extrapolated
from dearig.analysis.readings.record import Readings
from dearig.recording import open_recording
from dearig.recording.reading.recording import Recording
from tests.tools.command import done
from tests.tools.recordings import measured_data

NAMES = {
    "slow cycle": "vhb4910_cycle_rate0.01_stretch2.0",
    "fast cycle": "vhb4910_cycle_rate0.05_stretch2.0",
    "relaxation to 2": "vhb4910_relaxation_stretch2.0",
    "relaxation to 4": "vhb4910_relaxation_stretch4.0",
}


def imported(data: Path, folder: Path) -> dict[str, Recording]:
    recordings = {}
    for name, source in NAMES.items():
        path = folder / f"{name.replace(' ', '-')}.h5"
        done(
            "import", data / f"{source}.csv", "--out", path,
            "--gauge-length-mm", "80", "--area-mm2", "22",
        )  # fmt: skip
        recordings[name] = open_recording(path)
    return recordings


def diagnosed(recordings: dict[str, Recording], train: tuple[str, ...]) -> Iterator[str]:
    """Cells of one row."""
    validation = [
        w for n, r in recordings.items() if n not in train for w in ("--validate", r.path)
    ]
    given = [recordings[n] for n in train]
    found = done("diagnose", *(r.path for r in given), *validation, "--json", "-").json
    before, after = found["baseline"], found["final"]
    steps = ", ".join(step["effect"] for step in found["steps"]) or "nothing"
    yield ", ".join(train)
    yield f"{steps} ({found['verdict'].replace('_', ' ')})"
    yield f"{before['train']['rms_kPa']:.2f} -> {after['train']['rms_kPa']:.2f}"
    for name, recording in recordings.items():
        if name in train:
            yield ""
            continue
        first, last = (
            stage["validation_by_record"][recording.name]["rms_kPa"] for stage in (before, after)
        )
        beyond = extrapolated([*map(Readings, given)], [Readings(recording)])
        yield f"{first:.2f} -> {last:.2f}{' *' if beyond else ''}"
    yield f"{found['seconds']:.0f}"


def outcome(cell: str) -> str:
    """Of the cell of a recording that was left out: how it was foreseen, and whether marked."""
    first, last = (float(x) for x in cell.removesuffix(" *").split(" -> "))
    how = "worse" if last > first else "better" if last < first else "the same"
    return f"{how} *" if cell.endswith("*") else how


def main() -> None:
    try:
        data = Path(sys.argv[1]) if len(sys.argv) > 1 else measured_data()
    except pytest.skip.Exception as missing:
        sys.exit(str(missing))
    print("| fitted | found | fitted, kPa |", " | ".join(NAMES), "| s |")
    print("|---|---|---|", "---|" * (len(NAMES) + 1), sep="")
    outcomes: Counter[str] = Counter()
    with tempfile.TemporaryDirectory() as name:
        recordings = imported(data, Path(name))
        for count in (1, 2, 3):
            for train in combinations(NAMES, count):
                cells = list(diagnosed(recordings, train))
                print("|", " | ".join(cells), "|", flush=True)
                outcomes.update(outcome(cell) for cell in cells[3:-1] if cell)
    print(", ".join(f"{many} {how}" for how, many in outcomes.most_common()))


if __name__ == "__main__":
    main()
