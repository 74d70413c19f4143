#!/usr/bin/env bash
# Sigima (DataLab): the CSV of one signal keeps the unit of x and loses that of y.
#
# Expected: both axes have a label and a unit, so the header line says "time (s),displacement (mm)".
# Seen: the header is "time (s),displacement": the unit of x is written, that of y is not. Reading the file back by
#     Sigima gives an empty unit of y. A reader who sees "(s)" has reason to think that displacement has no unit, or
#     is in metres.
# Version: sigima 1.3.0.
# Who is hurt: people who hand curves on as CSV: a factor of 1000 between mm and m, with a header that looks complete.
#     The HDF5 file of the same program keeps all.
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check \
  "sigima==1.3.0"
cat >finding.py <<'EOF'
from importlib.metadata import version
from pathlib import Path

import numpy as np
from sigima.io import read_signals, write_signal
from sigima.objects import create_signal

print("sigima", version("sigima"))
signal = create_signal(
    "creep", np.arange(3.0), np.arange(3) * 0.5, units=("s", "mm"), labels=("time", "displacement")
)
units = {}
for path in ("run.csv", "run.h5sig"):
    write_signal(path, signal)
    (back,) = read_signals(path)
    units[path] = (back.xunit, back.yunit)
    print(f"{path}: units read back {units[path]}")
header = Path("run.csv").read_text().splitlines()[0]
print("header of the CSV:", header)
assert header == "time (s),displacement", "changed"
assert units == {"run.csv": ("s", ""), "run.h5sig": ("s", "mm")}, "changed"
EOF
HOME="$folder" venv/bin/python finding.py
