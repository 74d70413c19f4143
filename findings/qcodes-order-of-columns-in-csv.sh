#!/usr/bin/env bash
# QCoDeS: export("csv") writes no names and sorts the measured columns by the alphabet.
#
# Expected: columns in the order in which the parameters were registered, or names that tell which is which.
# Seen: the file has no header line, and the dependent parameters come in alphabetical order: registered as
#     voltage, displacement they are written as displacement, voltage.
#     A parameter added later, whose name sorts earlier, moves the columns of all later files.
# Version: qcodes 0.58.0.
# Who is hurt: people who plot the file by column number; kV and mm are exchanged without an error. The netCDF
#     export of the same run has names.
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check \
  "qcodes==0.58.0"
cat >finding.py <<'EOF'
from importlib.metadata import version
from pathlib import Path

from qcodes.dataset import (
    Measurement,
    initialise_or_create_database_at,
    load_or_create_experiment,
)

print("qcodes", version("qcodes"))
initialise_or_create_database_at("runs.db")
load_or_create_experiment("film", "sample")


def columns_of(*names: str) -> list[str]:
    """The lines that QCoDeS writes for a run in which each parameter has a value that tells its name."""
    measurement = Measurement()
    measurement.register_custom_parameter("time", unit="s")
    for name in names:
        measurement.register_custom_parameter(name, setpoints=("time",))
    with measurement.run(write_in_background=False) as saver:
        for time in (0.0, 0.5):
            for name in names:
                saver.add_result(("time", time), (name, float(len(name))))
    folder = Path("-".join(names))
    folder.mkdir()
    saver.dataset.export("csv", path=str(folder))
    (path,) = folder.glob("*.csv")
    return path.read_text().splitlines()


seen = {}
for names in (("voltage", "displacement"), ("voltage", "displacement", "current_uA")):
    seen[names] = columns_of(*names)
    print("registered: time,", ", ".join(names), "(each value is the length of its name)")
    for line in seen[names]:
        print("   ", line.split("\t"))
first, second = seen.values()
assert first[0].split("\t") == ["0.0", "12.0", "7.0"], "changed"
assert second[0].split("\t") == ["0.0", "10.0", "12.0", "7.0"], "changed"
assert len(first) == 2, "changed"
EOF
HOME="$folder" venv/bin/python finding.py
