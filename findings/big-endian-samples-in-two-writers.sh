#!/usr/bin/env bash
# npTDMS and mat-io: samples in big-endian byte order are written as other numbers.
#
# Expected: an array is written by its values, whatever its byte order in memory is, or it is refused.
# Seen: npTDMS copies the bytes of the array and declares them little-endian: counts 1, 2, 3 are read back as 256,
#     512, 768, and floats as denormal numbers. mat-io does so for the counts in a file of version 7, while its floats
#     and its files of version 7.3 are right. There is no error or warning.
# Versions: npTDMS 1.13.0, mat-io 1.0.2, SciPy 1.17.1 as a second reader, on a little-endian machine.
# Who is hurt: people who convert Igor, SPE, netCDF 3, FITS or raw converter files: their readers give big-endian
#     arrays. Counts stay plausible, a factor of 256 away.
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check \
  "npTDMS==1.13.0" \
  "mat-io==1.0.2" \
  "scipy==1.17.1" \
  "numpy==2.4.6"
cat >finding.py <<'EOF'
import sys
from importlib.metadata import version

import numpy as np
import scipy.io
from matio import load_from_mat, save_to_mat
from nptdms import ChannelObject, TdmsFile, TdmsWriter


def by_nptdms(samples: np.ndarray) -> list[float]:
    with TdmsWriter("run.tdms") as writer:
        writer.write_segment([ChannelObject("run", "force", samples)])
    return TdmsFile.read("run.tdms")["run"]["force"][:].tolist()


def by_matio(samples: np.ndarray, form: str) -> list[float]:
    save_to_mat("run.mat", {"force": samples}, version=form)
    return load_from_mat("run.mat")["force"].ravel().tolist()


def by_matio_and_scipy(samples: np.ndarray) -> list[float]:
    save_to_mat("run.mat", {"force": samples}, version="v7")
    return scipy.io.loadmat("run.mat")["force"].ravel().tolist()


for name in ("npTDMS", "mat-io", "scipy", "numpy"):
    print(name, version(name))
print(sys.byteorder, "endian machine, written: [1, 2, 3]")
seen = {}
for kind in ("<i2", ">i2", "<f8", ">f8"):
    samples = np.array([1, 2, 3], dtype=kind)
    seen[kind] = {
        "npTDMS": by_nptdms(samples),
        "mat-io v7": by_matio(samples, "v7"),
        "mat-io v7, read by SciPy": by_matio_and_scipy(samples),
        "mat-io v7.3": by_matio(samples, "v7.3"),
    }
    for writer, back in seen[kind].items():
        print(f"  {kind} by {writer}: {back}")
wrong = {
    (kind, writer) for kind, read in seen.items() for writer, back in read.items() if back != [1, 2, 3]
}
swapped = [seen[">i2"][w] for w in ("npTDMS", "mat-io v7", "mat-io v7, read by SciPy")]
assert swapped == [[256, 512, 768]] * 3, "changed"
assert wrong - {(">f8", "npTDMS")} == {
    (">i2", "npTDMS"),
    (">i2", "mat-io v7"),
    (">i2", "mat-io v7, read by SciPy"),
}, "changed"
assert 0 < max(seen[">f8"]["npTDMS"]) < 1e-300, "changed"
EOF
venv/bin/python finding.py
