#!/usr/bin/env bash
# npTDMS: some time stamps come back a microsecond earlier, and each copy of the file takes another.
#
# Expected: a time in whole microseconds, written and read, is the same time. TDMS has room for 5e-20 s.
# Seen: of the million microseconds of one second, 11702 come back 1 us early. The number in the file is right to
#     less than 1 ns, and reading cuts off the rest below a microsecond. Start times of waveforms are read in the
#     same way, so a start that is copied from file to file drifts: 7 us are 0 us after seven copies.
# Version: npTDMS 1.13.0.
# Who is hurt: channels of trigger times at 1 MHz get equal and missing stamps; pipelines that rewrite files shift
#     the start against the other logs, each time only a little.
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check \
  "npTDMS==1.13.0" \
  "numpy==2.4.6"
cat >finding.py <<'EOF'
from importlib.metadata import version

import numpy as np
from nptdms import ChannelObject, TdmsFile, TdmsWriter


def copied(times: np.ndarray) -> tuple[np.ndarray, np.datetime64]:
    """The times, and the first of them as the start of the waveform, written and read."""
    with TdmsWriter("run.tdms") as writer:
        channel = ChannelObject("run", "trigger", times, {"wf_start_time": times[0]})
        writer.write_segment([channel])
    back = TdmsFile.read("run.tdms")["run"]["trigger"]
    return back[:], back.properties["wf_start_time"]


print("npTDMS", version("npTDMS"))
second = np.datetime64("2026-01-01T10:00:00", "us")
times = second + np.arange(1_000_000)
error_us, counts = np.unique((copied(times)[0] - times).astype(int), return_counts=True)
print("errors of a million stamps, in us:", dict(zip(error_us.tolist(), counts.tolist(), strict=True)))
stored = TdmsFile.read("run.tdms", raw_timestamps=True)["run"]["trigger"][1]
print("the stamp of 1 us: in the file", stored.as_datetime64("ns"), "read", stored.as_datetime64("us"))
start = second + 7
drift = []
for _ in range(8):
    _, start = copied(np.array([start]))
    drift.append(int((start - second).astype(int)))
print("a start of 7 us, copied eight times:", drift)
assert error_us.tolist() == [-1, 0] and counts[0] == 11702, "changed"
assert drift == [6, 5, 4, 3, 2, 1, 0, 0], "changed"
EOF
venv/bin/python finding.py
