#!/usr/bin/env bash
# npTDMS: time_track() takes the increment of a waveform for seconds, whatever unit the file gives it.
#
# Expected: a waveform with wf_increment 5 and wf_xunit_string "ms" has samples every 5 ms, at least where their absolute
#     times are asked for.
# Seen: absolute_time=True adds 5 s for each sample: a run of 15 ms ends 15 s after its start. Without it the numbers
#     0, 5, 10 come back without their unit, and as_dataframe(time_index=True) has the same index.
# Version: npTDMS 1.13.0; the property stands beside the increment in the channel's properties.
# Who is hurt: those who read files of programs that count x in ms or us: every rate and time constant from them is wrong
#     by a thousand or a million, and no message says so.
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check \
  "npTDMS==1.13.0" \
  "numpy==2.4.6" \
  "pandas==3.1.1"
cat >finding.py <<'EOF'
from importlib.metadata import version

import numpy as np
from nptdms import ChannelObject, TdmsFile, TdmsWriter

print("npTDMS", version("npTDMS"))
properties = {
    "wf_start_time": np.datetime64("2026-01-01T10:00:00"),
    "wf_start_offset": 0.0,
    "wf_increment": 5.0,
    "wf_samples": 4,
    "wf_xname": "Time",
    "wf_xunit_string": "ms",
}
with TdmsWriter("run.tdms") as writer:
    writer.write_segment([ChannelObject("run", "force", np.arange(4.0), properties)])
channel = TdmsFile.read("run.tdms")["run"]["force"]
print("unit of x in the file:", channel.properties["wf_xunit_string"])
print("time_track():", channel.time_track().tolist())
clock = [str(time)[11:23] for time in channel.time_track(absolute_time=True)]
print("time_track(absolute_time=True):", clock)
index = channel.as_dataframe(time_index=True).index.tolist()
print("as_dataframe(time_index=True).index:", index)
assert clock[-1] == "10:00:15.000", "changed"
assert index == channel.time_track().tolist() == [0.0, 5.0, 10.0, 15.0], "changed"
EOF
venv/bin/python finding.py
