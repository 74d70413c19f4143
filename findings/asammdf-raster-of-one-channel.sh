#!/usr/bin/env bash
# asammdf: get(name, raster=0.1) gives steps of 0.1111 s; the same raster for the whole file gives 0.1 s.
#
# Expected: a raster is the distance of two samples, the same for one channel and for a table of all.
# Seen: where the raster goes into the duration without a remainder, get() spreads one point too few over it: 1 s at
#     0.1 s has 10 points 0.1111 s apart instead of 11. resample() and to_dataframe() are right, and so is get() for
#     a raster that leaves a remainder. The first and the last time are right in each case.
# Version: asammdf 8.8.28, a file of MDF 4.10.
# Who is hurt: people who fetch two channels one by one and compare them with a table by rows, or who take the raster as
#     the sample interval of a filter or a spectrum: frequencies are off by 11 %.
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check \
  "asammdf==8.8.28" \
  "numpy==2.4.6"
cat >finding.py <<'EOF'
from importlib.metadata import version

import numpy as np
from asammdf import MDF, Signal

print("asammdf", version("asammdf"))
time = np.arange(1001) / 1000
with MDF(version="4.10") as file:
    file.append([Signal(np.sin(2 * np.pi * time), time, name="force", unit="N")])
    file.save("run.mf4")
seen = {}
with MDF("run.mf4") as file:
    for raster in (0.1, 0.25, 0.3):
        ways = {
            "get": file.get("force", raster=raster).timestamps,
            "resample": file.resample(raster).get("force").timestamps,
            "to_dataframe": file.to_dataframe(raster=raster).index.to_numpy(),
        }
        for way, times in ways.items():
            seen[raster, way] = float(np.mean(np.diff(times)))
            print(f"raster {raster} s, {way}: {len(times)} points, step {seen[raster, way]:.4f} s")
for (raster, way), step in seen.items():
    points = {0.1: 10, 0.25: 4}.get(raster) if way == "get" else None
    expected = raster if points is None else 1 / (points - 1)
    assert abs(step - expected) < 1e-9, "changed"
EOF
venv/bin/python finding.py
