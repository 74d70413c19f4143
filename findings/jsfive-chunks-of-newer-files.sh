#!/usr/bin/env bash
# jsfive: a chunked dataset in a file of format 1.10 ends in a TypeError; a contiguous one in the same file is read.
#
# Expected: a reader says which feature of HDF5 it lacks, or refuses the whole file.
# Seen: the file opens, lists its datasets and reads the contiguous ones. Every chunked dataset raises "thing is not a
#     function", even with a single chunk and no filter. SWMR needs format 1.10 and a chunked dataset for every
#     channel that grows, so nothing of a live recording can be read. h5wasm reads all of them; both read the same
#     datasets in a file of format 1.8.
# Versions: jsfive 0.4.2, h5wasm 0.10.3; the files are written by h5py 3.16.0.
# Who is hurt: web viewers and dashboards built on jsfive. A file that h5py writes as it chooses works, and
#     the instrument's own recordings do not.
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check "h5py==3.16.0" "numpy==2.4.6"
printf '{"type": "module"}\n' >package.json
npm install --silent --no-audit --no-fund jsfive@0.4.2 h5wasm@0.10.3
cat >write.py <<'EOF'
import h5py
import numpy as np

for form in ("v108", "v110"):
    with h5py.File(f"{form}.h5", "w", libver=(form, form)) as file:
        file["contiguous"] = np.arange(4.0)
        file.create_dataset("chunked", data=np.arange(4.0), chunks=(4,))
        file.create_dataset("growing", data=np.arange(4.0), chunks=(3,), maxshape=(None,))
EOF
venv/bin/python write.py
cat >finding.mjs <<'EOF'
import assert from "node:assert";
import { readFileSync } from "node:fs";
import * as jsfive from "jsfive";
import h5wasm from "h5wasm/node";

const versionOf = (name) =>
  JSON.parse(readFileSync(`node_modules/${name}/package.json`, "utf8")).version;
console.log("jsfive", versionOf("jsfive"), "h5wasm", versionOf("h5wasm"), "node", process.version);
await h5wasm.ready;
const read = (dataset) => {
  try {
    return Array.from(dataset().value).join(" ");
  } catch (error) {
    return String(error);
  }
};
for (const form of ["v108", "v110"]) {
  const bytes = readFileSync(`${form}.h5`);
  const five = new jsfive.File(
    bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length),
    form,
  );
  const wasm = new h5wasm.File(`${form}.h5`, "r");
  for (const name of ["contiguous", "chunked", "growing"]) {
    const seen = [read(() => five.get(name)), read(() => wasm.get(name))];
    console.log(`${form} ${name}: jsfive "${seen[0]}", h5wasm "${seen[1]}"`);
    assert.equal(seen[1], "0 1 2 3", "changed");
    const fails = form === "v110" && name !== "contiguous";
    assert.equal(seen[0], fails ? "TypeError: thing is not a function" : "0 1 2 3", "changed");
  }
  wasm.close();
}
EOF
node finding.mjs
