#!/usr/bin/env bash
# pyqtgraph: downsampling by peaks drops the newest samples, and one NaN hides its neighbours.
#
# Expected: setDownsampling(method="peak") draws the largest and the smallest of every bin, so no spike is lost.
# Seen: the samples behind the last full bin are not drawn at all: up to one bin less one, always the newest. The
#     range of the axis is computed from what is drawn, so a spike there does not even move the scale. A bin with one
#     NaN (a lost sample) is drawn as NaN: its peak is hidden as well.
# Versions: pyqtgraph 0.14.0, PySide6 6.11.3, without a screen.
# Who is hurt: live plots of protected outputs. A trip ends the run with the spike that explains it, in the last
#     samples; zoomed out, the plot shows a flat line.
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check \
  "pyqtgraph==0.14.0" \
  "PySide6-Essentials==6.11.3" \
  "numpy==2.4.6"
cat >finding.py <<'EOF'
import warnings
from importlib.metadata import version

import numpy as np
import pyqtgraph

BIN, ROWS = 10, 1009

print("pyqtgraph", version("pyqtgraph"), "PySide6", version("PySide6-Essentials"))
application = pyqtgraph.mkQApp()


def drawn(values: np.ndarray) -> tuple[float, float, float]:
    """The last x and the largest y that are drawn, and the upper end of the range of y."""
    item = pyqtgraph.PlotDataItem(np.arange(len(values)), values)
    item.setDownsampling(ds=BIN, auto=False, method="peak")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)
        x, y = item.getData()
        return float(x[-1]), float(np.nanmax(y)), float(item.dataBounds(1)[1])


seen = {}
for case, at in (("in the middle", 504), ("in the last samples", ROWS - 5)):
    current = np.zeros(ROWS)
    current[at] = 5.0
    seen[case] = drawn(current)
current = np.zeros(ROWS)
current[504], current[507] = 5.0, np.nan
seen["in the middle, 3 samples before a NaN"] = drawn(current)
for case, (last, largest, upper) in seen.items():
    print(f"spike of 5.0 {case}: {ROWS} samples, drawn up to {last:.0f}")
    print(f"    largest drawn {largest}, range of the axis up to {upper}")
assert [largest for _, largest, _ in seen.values()] == [5.0, 0.0, 0.0], "changed"
assert [upper for _, _, upper in seen.values()] == [5.0, 0.0, 0.0], "changed"
assert all(last < ROWS - 9 for last, _, _ in seen.values()), "changed"
EOF
QT_QPA_PLATFORM=offscreen venv/bin/python finding.py
