"""Which strain energy silicones ask for, from pulls to failure.

Run as ``python -m tests.benchmarks.bench_springs [FOLDER]``: FOLDER has CSV files of the Soft
Robotics Materials Database (that next to the checkout where it is not given). Each file is imported
and fitted by ``dearig identify --spring choose --branches 0``: one pull at one rate does not tell
relaxation from elasticity. A cell has the criterion above that of the best energy (minus twice the
logarithm of the evidence) and the error of each tenth of the pull, predicted by a fit to the
others, in % of the peak. The last row has the sums of the criteria and the means of the errors.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dearig.model.springs import SPRINGS
from dearig.recording import open_recording
from tests.tools.command import dearig, done
from tests.tools.recordings import measured_data

RATE = "10"  # Hz, of the files whose times are written as 40.10 for 41.0


def imported(source: Path, out: Path) -> Path:
    if dearig("import", source, "--out", out).code:
        done("import", source, "--out", out, "--rate-Hz", RATE)
    return out


def row(source: Path, folder: Path) -> tuple[str, dict[str, tuple[float, float]]]:
    """Return the line of a material, and for each energy its criterion and error."""
    path = imported(source, folder / f"{source.stem.replace(' ', '-')}.h5")
    recording = open_recording(path)
    assert recording.nominal_stress is not None
    assert recording.stretch is not None
    peak = float(np.max(recording.nominal_stress)) * 1e-3
    answer: dict[str, Any] = done(
        "identify", path, "--out", folder / "model.toml", "--spring", "choose",
        "--branches", "0", "--no-intervals", "--json", "-", "--force",
    ).json  # fmt: skip
    found = {
        s["spring"]: (s["criterion"], 100.0 * s["left_out_rms_kPa"] / peak)
        for s in answer["springs"]
    }
    best = answer["springs"][0]
    cells = [
        source.stem,
        f"{float(np.max(recording.stretch)):.1f}",
        f"{best['spring']} ({best['probability']:.2f})",
        *(f"{found[k][0]:.0f} ({found[k][1]:.2f})" if k in found else "" for k in SPRINGS),
    ]
    return f"| {' | '.join(cells)} |", found


def main() -> None:
    try:
        folder = Path(sys.argv[1]) if len(sys.argv) > 1 else measured_data() / "silicone"
    except pytest.skip.Exception as missing:
        sys.exit(str(missing))
    print("| material | stretch | most probable |", " | ".join(SPRINGS), "|")
    print("|---|---|---|", "---|" * len(SPRINGS), sep="")
    every = []
    with tempfile.TemporaryDirectory() as scratch:
        for source in sorted(folder.glob("*.csv")):
            line, found = row(source, Path(scratch))
            print(line, flush=True)
            every.append(found)
    cells = []
    for kind in SPRINGS:
        pairs = [found[kind] for found in every if kind in found]
        criteria, errors = zip(*pairs, strict=True)
        cells.append(f"{sum(criteria):.0f} ({np.mean(errors):.2f})")
    print("| all | | |", " | ".join(cells), "|")


if __name__ == "__main__":
    main()
