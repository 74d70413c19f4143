#!/usr/bin/env bash
# openpyxl: time stamps are read to the millisecond, although the file holds them to some microseconds.
#
# Expected: a workbook that openpyxl wrote gives the same times when openpyxl, or pandas by it, reads it.
# Seen: the cell holds the full number (to some two microseconds), and reading rounds it to a millisecond. At 5 kHz
#     the times come in groups of three and five equal ones: time stands still, then jumps. The numbers in the XML
#     of the same cells keep all samples apart.
# Versions: openpyxl 3.1.5, pandas 3.1.1.
# Who is hurt: people who get a workbook with clock times from a logger at more than 1 kHz: speeds become infinite,
#     and a check for equal times throws rows away.
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check \
  "openpyxl==3.1.5" \
  "pandas==3.1.1" \
  "numpy==2.4.6"
cat >finding.py <<'EOF'
import datetime
import re
import zipfile
from collections import Counter
from importlib.metadata import version

import openpyxl
import pandas

STEP_US, ROWS = 200, 16
START = datetime.datetime(2026, 1, 1, 10)

print("openpyxl", version("openpyxl"), "pandas", version("pandas"))
book = openpyxl.Workbook()
book.active.append(["time"])
written = [START + datetime.timedelta(microseconds=STEP_US * row) for row in range(ROWS)]
for time in written:
    book.active.append([time])
book.save("run.xlsx")

cells = openpyxl.load_workbook("run.xlsx").active.iter_rows(min_row=2, values_only=True)
read = [time for (time,) in cells]
frame = pandas.read_excel("run.xlsx")["time"].dt.to_pydatetime().tolist()
sheet = zipfile.ZipFile("run.xlsx").read("xl/worksheets/sheet1.xml").decode()
stored = [float(number) for number in re.findall(r"<v>(46\d+\.?\d*)</v>", sheet)]
first = stored[0]
micros = [round((number - first) * 86400e6) for number in stored]
print("written, in us:      ", [STEP_US * row for row in range(ROWS)])
print("stored in the XML:   ", micros)
for reader, times in (("openpyxl", read), ("pandas", frame)):
    print(f"read by {reader:8}:    ", [(time - START).microseconds for time in times])
    equal = sorted(Counter(times).values())
    print("   rows with one time:", equal)
    assert equal == [3, 3, 5, 5] and all(time.microsecond % 1000 == 0 for time in times), "changed"
assert all(abs(stored_us - STEP_US * row) <= 3 for row, stored_us in enumerate(micros)), "changed"
EOF
venv/bin/python finding.py
