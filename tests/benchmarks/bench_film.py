"""What is found in a measured film, whichever of its recordings are fitted and whichever left out.

Run as ``python -m tests.benchmarks.bench_film [DATA]``, DATA being the folder of the measured data
(beside the checkout where it is not given). Every choice of one to three of the four recordings is
diagnosed by ``dearig diagnose``, and the others are foreseen. RMS in kPa, before and after; a
recording that goes to a larger stretch than any that was fitted, or lasts much longer, is marked.
"""

import json
import subprocess
import sys
import tempfile
from itertools import combinations
from pathlib import Path
from typing import Any

from app.quality import beyond
from app.recording import open_recording
from tests.recording_tools import measured_data

NAMES = {
    "slow cycle": "vhb4910_cycle_rate0.01_stretch2.0",
    "fast cycle": "vhb4910_cycle_rate0.05_stretch2.0",
    "relaxation to 2": "vhb4910_relaxation_stretch2.0",
    "relaxation to 4": "vhb4910_relaxation_stretch4.0",
}


def dearig(*words: object) -> None:
    command = [sys.executable, "-m", "app", *map(str, words)]
    subprocess.run(command, check=True, capture_output=True)


def diagnosed(paths: dict[str, Path], train: tuple[str, ...], folder: Path) -> dict[str, Any]:
    out = folder / "out.json"
    validation = [w for name in NAMES if name not in train for w in ("--validate", paths[name])]
    given = [paths[name] for name in train]
    dearig("diagnose", *given, *validation, "--json", out, "--force")
    found: dict[str, Any] = json.loads(out.read_text(encoding="utf-8"))
    return found


def main() -> None:
    data = Path(sys.argv[1]) if len(sys.argv) > 1 else measured_data()
    print("| fitted | found | fitted, kPa |", " | ".join(NAMES), "| s |")
    print("|---|---|---|", "---|" * (len(NAMES) + 1), sep="")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        paths = {}
        for short, source in NAMES.items():
            paths[short] = folder / f"{short.replace(' ', '-')}.h5"
            dearig(
                "import", data / f"{source}.csv", "--out", paths[short],
                "--gauge-length-mm", 80, "--area-mm2", 22,
            )  # fmt: skip
        recordings = {short: open_recording(path) for short, path in paths.items()}
        for count in (1, 2, 3):
            for train in combinations(NAMES, count):
                found = diagnosed(paths, train, folder)
                before, after = found["baseline"], found["final"]
                cells = []
                for short in NAMES:
                    if short in train:
                        cells.append("")
                        continue
                    first, last = (
                        stage["validation_by_record"][paths[short].stem]["rms_kPa"]
                        for stage in (before, after)
                    )
                    far = beyond([recordings[t] for t in train], [recordings[short]])
                    cells.append(f"{first:.2f} -> {last:.2f}{' *' if far else ''}")
                steps = ", ".join(step["effect"] for step in found["steps"]) or "nothing"
                fitted = f"{before['train']['rms_kPa']:.2f} -> {after['train']['rms_kPa']:.2f}"
                words = [", ".join(train), f"{steps} ({found['verdict'].replace('_', ' ')})"]
                print("|", " | ".join([*words, fitted, *cells, f"{found['seconds']:.0f}"]), "|")
                sys.stdout.flush()


if __name__ == "__main__":
    main()
