"""By how much averaging lowers the noise of each channel of the simulated rig, and what it costs.

Run as ``python -m tests.benchmarks.bench_averaging [--figure FILE.png] [--cost]``. The noise is the
standard deviation of the rows at 0 V over 20 s, at 1000 rows a second. With ``--cost`` runs of 100
conversions a row are recorded in processes of their own, which tell processor time and peak memory:
what grows with the length of a run is seen from the two lengths.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from dearig.acquisition.run import record
from dearig.config.rigfile import RigFile
from dearig.config.sequencefile import parse_sequence
from dearig.recording import open_recording
from dearig.report.figures import style
from tests.benchmarks.bench_recording import peak_memory

AVERAGES = (1, 3, 10, 30, 100)
TABLE = (1, 10, 100)
#: Channel: its name, its unit, and the factor from SI.
CHANNELS = {
    "voltage_monitor": ("voltage monitor", "V", 1.0),
    "current_monitor": ("current monitor", "uA", 1e6),
    "displacement": ("displacement", "um", 1e6),
}
REST = (
    'name = "rest"\nlead_in_s = 0.0\ntail_s = 0.0\n'
    '[[segment]]\nkind = "hold"\nvoltage_kV = 0.0\nduration_s = 20.0\n'
)
LENGTHS = (30, 120)  # s


def rig_file(average: int) -> RigFile:
    """A rig of 1000 rows a second whose card scans its inputs fast enough."""
    card = {"average": average, "first_convert_us": 2.0, "convert_interval_us": 2.0}
    limits = {"energy_max_J": 1e6, "time_at_voltage_max_s": 1e5}
    return RigFile.model_validate({"card": card, "limits": limits})


def noises(average: int) -> dict[str, float]:
    """Return the noise of each channel in SI units."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "rest.h5"
        record(parse_sequence(REST, "rest", Path()), "sim", rig_file(average), path)
        values = open_recording(path).values
    return {name: float(np.std(values[name], ddof=1)) for name in CHANNELS}


def cost(seconds: int) -> None:
    """Print processor time, peak memory above that of the imports and the size of one run."""
    periods = max(1, round(seconds / 11.4167))
    text = f'name = "long"\n[[segment]]\nkind = "thesis"\nperiods = {periods}\n'
    loaded = parse_sequence(text, "long", Path())
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "long.h5"
        record(parse_sequence(REST, "rest", Path()), "sim", rig_file(1), path)  # imports, kernels
        before, began = peak_memory(), time.process_time()
        result = record(loaded, "sim", rig_file(100), Path(folder) / "run.h5")
        told = {
            "seconds": result.samples / result.rate_Hz,
            "processor": time.process_time() - began,
            "memory": peak_memory() - before,
            "file": result.path.stat().st_size,
        }
    print(json.dumps(told))


def figure(found: dict[int, dict[str, float]], out: Path) -> None:
    """Draw the noise over that of single conversions, and the root law."""
    drawn = style.blank(style.WIDTH, 2.8)
    axes = drawn.add_subplot()
    averages = np.array(sorted(found), dtype=np.float64)
    axes.loglog(averages, averages**-0.5, color=style.ERROR, lw=0.8, ls="--", label="1/√N")
    # the monitors fall alike: one mark lies around the other
    drawing = ((style.THESIS, "o", 8), (style.MODEL, "s", 3), (style.MEASURED, "^", 5))
    for (name, (label, _, _)), (colour, mark, size) in zip(CHANNELS.items(), drawing, strict=True):
        ratio = [found[int(n)][name] / found[1][name] for n in averages]
        axes.loglog(
            averages, ratio, color=colour, marker=mark, ms=size, mfc="none", lw=1.0, label=label
        )
    axes.set_xlabel("conversions per row, N")
    axes.set_ylabel("noise over that of N = 1")
    axes.set_xticks(averages, [f"{n:g}" for n in averages])
    axes.set_yticks([1.0, 0.5, 0.2, 0.1], ["1", "0.5", "0.2", "0.1"])
    axes.minorticks_off()
    axes.legend(frameon=False)
    drawn.savefig(out, dpi=150)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--figure", type=Path)
    parser.add_argument("--cost", action="store_true")
    parser.add_argument("--child", type=int)
    asked = parser.parse_args()
    if asked.child:
        cost(asked.child)
        return
    if asked.cost:
        print("| length, s | processor time per s of the run, s | peak memory, MB | file, MB |")
        print("|---|---|---|---|")
        for seconds in LENGTHS:
            command = [sys.executable, "-m", "tests.benchmarks.bench_averaging"]
            child = subprocess.run(
                [*command, "--child", str(seconds)], check=True, capture_output=True, text=True
            )
            told = json.loads(child.stdout.splitlines()[-1])
            print(
                f"| {told['seconds']:.0f} | {told['processor'] / told['seconds']:.3f} "
                f"| {told['memory'] / 1e6:.0f} | {told['file'] / 1e6:.1f} |"
            )
        return
    found = {n: noises(n) for n in (AVERAGES if asked.figure else TABLE)}
    print("| noise of a row | " + " | ".join(f"N = {n}" for n in TABLE) + " |")
    print("|---" * (len(TABLE) + 1) + "|")
    for name, (label, unit, factor) in CHANNELS.items():
        told = [f"{found[n][name] * factor:.3g}" for n in TABLE]
        print(f"| {label}, {unit} | " + " | ".join(told) + " |")
    if asked.figure:
        figure(found, asked.figure)


if __name__ == "__main__":
    main()
