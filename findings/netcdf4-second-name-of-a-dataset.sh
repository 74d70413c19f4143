#!/usr/bin/env bash
# netCDF4: a second name for a dataset, in a group without its time axis, makes the whole file unreadable.
#
# Expected: HDF5 links give one dataset two names, as NeXus does everywhere; a reader of /run is not concerned.
# Seen: netCDF4 fails to open any part of the file ("'NoneType' object has no attribute 'dimensions'"), with a soft
#     link as with a hard one, because the dimension scale is not in the group of the second name or above it. With
#     the link in a group below that of the scale the file opens. xarray fails by its default engine; h5netcdf reads
#     the group.
# Versions: netCDF4 1.7.5.1.post1 (netCDF-C 4.10.1), xarray 2026.9.0, h5netcdf 1.8.2, h5py 3.16.0.
# Who is hurt: writers of NeXus files, where plotted data are links into the instrument; the error is one of Python
#     and names neither the link nor the axis.
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
from importlib.metadata import version

import h5py
import netCDF4
import numpy as np
import xarray


def write(path: str, second: str | None, soft: bool) -> None:
    with h5py.File(path, "w") as file:
        time = file.create_dataset("run/time", data=np.arange(5.0))
        time.make_scale("time")
        force = file.create_dataset("run/force", data=np.arange(5.0))
        force.dims[0].attach_scale(time)
        if second is not None:
            file[second] = h5py.SoftLink(force.name) if soft else force


def attempt(read) -> str:
    try:
        return str(read())
    except AttributeError as error:
        return f"{type(error).__name__}: {error}"


def by_netcdf4() -> list[float]:
    with netCDF4.Dataset(path) as file:
        return file["run/force"][:].tolist()


def by_xarray(**how: str) -> list[float]:
    with xarray.open_dataset(path, group="run", **how) as run:
        return run["force"].values.tolist()


for name in ("h5py", "netCDF4", "xarray", "h5netcdf"):
    print(name, version(name))
right = "[0.0, 1.0, 2.0, 3.0, 4.0]"
error = "AttributeError: 'NoneType' object has no attribute 'dimensions'"
for second, soft, expected in (
    (None, False, right),
    ("run/plot/force", False, right),
    ("instrument/force", False, error),
    ("instrument/force", True, error),
):
    path = f"{second}-{soft}.h5".replace("/", "-")
    write(path, second, soft)
    print("second name:", second, "(soft link)" if soft else "(hard link)" if second else "")
    seen = {
        "netCDF4": attempt(by_netcdf4),
        "xarray, default": attempt(by_xarray),
        "xarray, h5netcdf": attempt(lambda: by_xarray(engine="h5netcdf")),
    }
    for reader, text in seen.items():
        print(f"  {reader}: {text}")
    assert seen["netCDF4"] == seen["xarray, default"] == expected, "changed"
    assert seen["xarray, h5netcdf"] == right, "changed"
EOF
venv/bin/python finding.py
