#!/usr/bin/env bash
# mat-io: a MAT file of version 7.3 calls itself "MATLAB 5.0 MAT-file".
#
# Expected: the text of the first 116 bytes tells the version, as MATLAB writes "MATLAB 7.3 MAT-file" for HDF5.
# Seen: save_to_mat(..., version="v7.3") writes HDF5 behind a text that says 5.0. The two version bytes are right.
#     SciPy and mat-io go by those and recognise HDF5; whoever goes by the text takes the file for one of
#     version 5.
# Versions: mat-io 1.0.2, SciPy 1.17.1, h5py 3.16.0.
# Who is hurt: importers and archives that choose a reader by the text; they call a sound file damaged.
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check \
  "mat-io==1.0.2" \
  "scipy==1.17.1" \
  "h5py==3.16.0" \
  "numpy==2.4.6"
cat >finding.py <<'EOF'
from importlib.metadata import version

import h5py
import numpy as np
import scipy.io
from matio import load_from_mat, save_to_mat

for name in ("mat-io", "scipy", "h5py"):
    print(name, version(name))
texts = {}
for form in ("v7", "v7.3"):
    save_to_mat("run.mat", {"force": np.arange(4.0)}, version=form)
    with open("run.mat", "rb") as file:
        head = file.read(520)
    texts[form] = head[:19].decode()
    is_hdf5 = head[512:] == b"\x89HDF\r\n\x1a\n"
    print(f"{form}: text {texts[form]!r}, version bytes {head[124:126].hex()}, HDF5 at 512: {is_hdf5}")
    assert is_hdf5 == (form == "v7.3"), "changed"
found = scipy.io.matlab.matfile_version("run.mat")
print("SciPy finds version", found, "and mat-io reads", load_from_mat("run.mat")["force"].ravel())
with h5py.File("run.mat", "r") as file:
    print("h5py reads", file["force"][:].ravel().tolist())
assert texts["v7"] == texts["v7.3"] == "MATLAB 5.0 MAT-file" and found == (2, 0), "changed"
EOF
venv/bin/python finding.py
