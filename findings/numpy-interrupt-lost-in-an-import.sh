#!/usr/bin/env bash
# NumPy: a ctrl-C that arrives while numpy.random is imported can be lost, and the program goes on.
#
# Expected: the KeyboardInterrupt leaves the import statement, as it does from any Python code.
# Seen: one that Python raises while numpy.random._generator, a compiled module, imports numpy.random._pickle and registers a type is
#     dropped: the import succeeds, nothing is printed, and sys.unraisablehook hears nothing of it. The same signal in the import of
#     a module written in Python alone is raised.
# Version: numpy 2.4.6, Python 3.11.
# Who is hurt: commands that load NumPy and then move something: an operator's first ctrl-C is ignored, and the run starts. A
#     handler of the signal that keeps a note of it, looked at before the start, hears each one.
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check "numpy==2.4.6"
cat >finding.py <<'EOF'
import abc
import importlib
import os
import signal
import sys
from importlib.metadata import version

print("numpy", version("numpy"), "python", sys.version.split()[0])
signal.signal(signal.SIGINT, signal.default_int_handler)
unraisable = []
sys.unraisablehook = unraisable.append
register = abc.ABCMeta.register
wanted, sent = "", []


def importing(name):
    frame = sys._getframe(2)
    while frame and "importlib" in frame.f_code.co_filename:
        frame = frame.f_back
    return frame is not None and frame.f_code.co_filename.endswith(name)


def pressed(cls, subclass):
    found = register(cls, subclass)
    if wanted not in sent and importing(wanted):
        sent.append(wanted)
        os.kill(os.getpid(), signal.SIGINT)
        for _ in range(10):
            pass
    return found


abc.ABCMeta.register = pressed
seen = {}
for module, wanted in (("plain", "plain.py"), ("numpy.random", "_pickle.py")):
    try:
        importlib.import_module(module)
        seen[module] = "lost"
    except KeyboardInterrupt:
        seen[module] = "raised"
    print(f"ctrl-C in the import of {module}: {seen[module]}, {len(unraisable)} unraisable")
assert sent == ["plain.py", "_pickle.py"], "changed: no such moment"
assert seen == {"plain": "raised", "numpy.random": "lost"} and not unraisable, "changed"
EOF
echo "import collections.abc; collections.abc.Sized.register(type('Own', (), {}))" >plain.py
venv/bin/python finding.py
