#!/usr/bin/env bash
# HDF5: Dataset.flush() does not make the data readable after a kill; the same file opened for SWMR reads all.
#
# Expected: a logger calls flush() of every dataset after each block, so a kill loses the current block only.
# Seen: the file opens and shows the full shapes, but reading any sample raises "addr overflow": a flush of a
#     dataset does not write the end of the allocated space into the superblock. Every byte is in the file:
#     h5py.File(path, "r", swmr=True) reads it, although the writer never used SWMR. With File.flush() both
#     ways of opening read everything.
# Version: h5py 3.16.0 with its HDF5, format of the file as h5py chooses it.
# Who is hurt: anyone who records for hours and flushes the channels one by one; after a power cut the recording
#     looks damaged, and a recovery tool may discard it.
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check \
  "h5py==3.16.0" \
  "numpy==2.4.6"
cat >finding.py <<'EOF'
import signal
import subprocess
import sys

import h5py

WRITER = """
import os, signal, sys
import h5py, numpy as np
with h5py.File("run.h5", "w") as file:
    channels = [
        file.create_dataset(name, (0,), "f8", maxshape=(None,), chunks=(1024,))
        for name in ("time", "force")
    ]
    file.flush()
    for start in range(0, 5000, 100):
        for channel in channels:
            channel.resize((start + 100,))
            channel[start:] = np.arange(start, start + 100)
            if sys.argv[1] == "datasets":
                channel.flush()
        if sys.argv[1] == "file":
            file.flush()
    os.kill(os.getpid(), signal.SIGKILL)
"""

READER = """
import sys
import h5py
with h5py.File("run.h5", "r", swmr=sys.argv[1] == "swmr") as file:
    try:
        print([(name, file[name].shape[0], float(file[name][-1])) for name in file])
    except OSError as error:
        print([(name, file[name].shape[0]) for name in file], "but", error)
"""


def after_a_kill(flushed: str, opened: str) -> str:
    writer = subprocess.run([sys.executable, "-c", WRITER, flushed])
    assert writer.returncode == -signal.SIGKILL
    reader = [sys.executable, "-c", READER, opened]
    return subprocess.run(reader, capture_output=True, text=True, check=True).stdout.strip()


print("h5py", h5py.__version__, "HDF5", h5py.version.hdf5_version)
seen = {}
for flushed in ("datasets", "file"):
    for opened in ("plain", "swmr"):
        seen[flushed, opened] = after_a_kill(flushed, opened)
        print(f"flush of the {flushed}, opened {opened}: {seen[flushed, opened]}")
whole = "[('force', 5000, 4999.0), ('time', 5000, 4999.0)]"
assert "5000" in seen["datasets", "plain"] and "addr overflow" in seen["datasets", "plain"], "changed"
assert seen["datasets", "swmr"] == seen["file", "plain"] == seen["file", "swmr"] == whole, "changed"
EOF
venv/bin/python finding.py
