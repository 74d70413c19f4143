#!/usr/bin/env bash
# npTDMS: a session that is appended to a TDMS file moves the earlier one to the later time.
#
# Expected: samples keep the time at which they were taken; between two sessions there is a gap, or a warning.
# Seen: a channel has one start time, and the last one written counts for all. After a second session is appended a
#     minute later, time_track() goes on without a gap, and the samples of the first session are dated in the
#     second. The first start time is still in the file, and TdmsFile does not show it.
# Version: npTDMS 1.13.0; the properties belong to each segment of the format.
# Who is hurt: long tests that are stopped and continued into the same file: creep and ageing curves lose the pause,
#     and a comparison with another log by its absolute time is wrong for the first part.
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

STARTS = ("2026-01-01T10:00:00", "2026-01-01T10:01:00")

print("npTDMS", version("npTDMS"))
for mode, start in zip("wa", STARTS, strict=True):
    properties = {
        "wf_start_time": np.datetime64(start),
        "wf_start_offset": 0.0,
        "wf_increment": 0.5,
        "wf_samples": 3,
    }
    with TdmsWriter("run.tdms", mode=mode) as writer:
        writer.write_segment([ChannelObject("run", "force", np.arange(3.0), properties)])
    force = TdmsFile.read("run.tdms")["run"]["force"]
    seconds = force.time_track()
    clock = [str(time)[11:21] for time in force.time_track(absolute_time=True)]
    print(f"session of {start[11:]} written:", seconds.tolist(), clock)
assert seconds.tolist() == [0.0, 0.5, 1.0, 1.5, 2.0, 2.5], "changed"
assert clock[0] == "10:01:00.0" and clock[3] == "10:01:01.5", "changed"
with open("run.tdms", "rb") as file:
    stored = file.read().count(b"wf_start_time")
print("start times stored in the file:", stored)
assert stored == len(STARTS), "changed"
EOF
venv/bin/python finding.py
