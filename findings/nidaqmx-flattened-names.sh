#!/usr/bin/env bash
# nidaqmx: flattening a list of channel names renames channels.
#
# Expected: unflatten_channel_string(flatten_channel_string(names)) gives the names again.
# Seen: "ch08" and "ch9" become "ch08:9", which is ch08 and ch09: a channel that does not exist, or another one.
#     Names of digits alone get the word None in front: "1", "2" become "None1:2". Both functions are public, and
#     their documentation names lists of virtual channels.
# Version: nidaqmx 1.7.0. No driver is needed.
# Who is hurt: scripts that pass a list of global channels, kept in MAX and numbered by hand over the years, to a
#     task: the string names ch09 where ch9 was asked for.
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check \
  "nidaqmx==1.7.0"
cat >finding.py <<'EOF'
from importlib.metadata import version

from nidaqmx.utils import flatten_channel_string, unflatten_channel_string

print("nidaqmx", version("nidaqmx"))
for names, flat, back in (
    (["ch8", "ch9"], "ch8:9", ["ch8", "ch9"]),
    (["ch08", "ch9"], "ch08:9", ["ch08", "ch09"]),
    (["1", "2"], "None1:2", ["None1", "None2"]),
):
    seen = flatten_channel_string(names)
    again = unflatten_channel_string(seen)
    print(f"{names} -> {seen!r} -> {again}", "" if again == names else "(other names)")
    assert (seen, again) == (flat, back), "changed"
EOF
venv/bin/python finding.py
