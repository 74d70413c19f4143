#!/usr/bin/env bash
# PyMoDAQ: the unit in an HDF5 file is a JSON record that holds the Python repr of the unit.
#
# Expected: the attribute "units" of a dataset is "kV", as in NeXus and netCDF.
# Seen: it is {"module": "builtins", "type": "str", "data": "'kV'"}: JSON, and in it the repr with its own quotes.
#     Numbers carry their type too: the step of an axis is the text "np.float64(0.5)", as NumPy prints it since
#     its release 2. Both backends of the package do so. Other attributes of the same dataset (TITLE, CLASS) are
#     plain.
# Version: pymodaq_data 5.3.0, with the backends h5py and tables.
# Who is hurt: readers in MATLAB, Igor, Origin or xarray: unit and step must be taken apart by hand, and the text
#     of numbers depends on the release of NumPy that wrote it.
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check \
  "pymodaq_data==5.3.0" \
  "h5py==3.16.0" \
  "tables==3.11.1" \
  "numpy==2.4.6"
cat >finding.py <<'EOF'
from importlib.metadata import version
from pathlib import Path

import h5py
import numpy as np
from pymodaq_data.data import Axis, DataRaw
from pymodaq_data.h5modules.data_saving import DataSaverLoader
from pymodaq_data.h5modules.saving import H5SaverLowLevel

print("pymodaq_data", version("pymodaq_data"), "numpy", np.__version__)
for backend in ("h5py", "tables"):
    path = Path(f"{backend}.h5")
    saver = H5SaverLowLevel(backend=backend)
    saver.init_file(file_name=path, new_file=True)
    axis = Axis("time", units="s", data=np.arange(4) * 0.5, index=0)
    data = DataRaw("voltage", units="kV", data=[np.arange(4.0)], labels=["U"], axes=[axis])
    DataSaverLoader(saver).add_data(saver.get_set_group("/RawData", "run"), data)
    saver.close_file()
    with h5py.File(path, "r") as file:
        attributes = {
            "units": file["RawData/run/Data00"].attrs["units"],
            "scaling": file["RawData/run/Axis00"].attrs["scaling"],
            "TITLE": file["RawData/run/Axis00"].attrs["TITLE"],
        }
    texts = {
        name: value.decode() if isinstance(value, bytes) else value
        for name, value in attributes.items()
    }
    print(backend, texts)
    assert texts["units"] == '{"module": "builtins", "type": "str", "data": "\'kV\'"}', "changed"
    assert '"np.float64(0.5)"' in texts["scaling"] and texts["TITLE"] == "time", "changed"
EOF
HOME="$folder" venv/bin/python finding.py
