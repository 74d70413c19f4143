#!/usr/bin/env bash
# netCDF4: one two-dimensional dimension scale anywhere makes a whole HDF5 file unreadable.
#
# Expected: netCDF4 reads the HDF5 groups that it understands; a calibration table in another group does not matter.
# Seen: h5py lets a dataset of two dimensions be a dimension scale, without a word. From then on netCDF4 refuses
#     the file with "NetCDF: HDF error" and does not name the dataset, and so does xarray, whose default engine for
#     such files is netCDF4. h5py and xarray with h5netcdf read the measured group of the same file; open_datatree
#     of h5netcdf fails on it too.
# Versions: netCDF4 1.7.5.1.post1 (netCDF-C 4.10.1), xarray 2026.9.0, h5netcdf 1.8.2, h5py 3.16.0.
# Who is hurt: instrument programs that mark look-up tables as scales so that a viewer labels axes; colleagues
#     cannot open the file by its default reader, and the message points at a damaged file.
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check \
  "h5py==3.16.0" \
  "h5netcdf==1.8.2" \
  "netCDF4==1.7.5.1.post1" \
  "xarray==2026.9.0" \
  "numpy==2.4.6"
cat >finding.py <<'EOF'
import re
from importlib.metadata import version

import h5py
import netCDF4
import numpy as np
import xarray


def write(path: str, scale: bool) -> None:
    with h5py.File(path, "w") as file:
        time = file.create_dataset("run/time", data=np.arange(5.0))
        time.make_scale("time")
        file.create_dataset("run/force", data=np.arange(5.0)).dims[0].attach_scale(time)
        table = file.create_dataset("calibration/table", data=np.eye(2))
        if scale:
            table.make_scale("table")


def attempt(read) -> str:
    try:
        return str(read())
    except (OSError, ValueError) as error:
        return re.sub(r"'[^']*[.]h5'", "FILE", f"{type(error).__name__}: {error}")


def by_netcdf4() -> list[float]:
    with netCDF4.Dataset(path) as file:
        return file["run/force"][:].tolist()


def by_xarray(**how: str) -> list[float]:
    with xarray.open_dataset(path, group="run", **how) as run:
        return run["force"].values.tolist()


def by_datatree() -> list[float]:
    with xarray.open_datatree(path, engine="h5netcdf", phony_dims="sort") as tree:
        return tree["run/force"].values.tolist()


for name in ("h5py", "netCDF4", "xarray", "h5netcdf"):
    print(name, version(name))
seen = {}
for scale in (False, True):
    path = f"scale-{scale}.h5"
    write(path, scale)
    print("a table that is", "a scale" if scale else "no scale")
    for reader, read in (
        ("netCDF4", by_netcdf4),
        ("xarray, default", by_xarray),
        ("xarray, h5netcdf", lambda: by_xarray(engine="h5netcdf")),
        ("datatree, h5netcdf", by_datatree),
    ):
        seen[scale, reader] = attempt(read)
        print(f"  {reader}: {seen[scale, reader]}")
right = "[0.0, 1.0, 2.0, 3.0, 4.0]"
assert all(text == right for (scale, _), text in seen.items() if not scale), "changed"
assert "HDF error" in seen[True, "netCDF4"] and "HDF error" in seen[True, "xarray, default"], "changed"
assert seen[True, "xarray, h5netcdf"] == right, "changed"
assert "1-dimensional" in seen[True, "datatree, h5netcdf"], "changed"
EOF
venv/bin/python finding.py
