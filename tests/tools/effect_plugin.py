"""Makes distributions that bring effects: a folder with modules and the entry points of each."""

import os
import subprocess
import sys
from pathlib import Path

MODULE = '''"""A made effect."""

from dearig.model.effects import Effect, Parameter
from dearig.model.compiled.jit import jit

EFFECT = Effect(
    name={name!r}, family="drag", acts_on="load", summary="a force against the motion",
    parameters=(Parameter("drag", "Pa s", (0.0, 1e6), "of the made effect", 50.0, 0.0),),
    drives=("voltage", "stretch"),
)


@jit
def stress(c, k, m, j, lam, rate, lam0, since, t):
    return {factor!r} * c[k] * rate
'''

#: Before a program: of the effects of dearig only two, one of the film and one of the sensor.
#: Kernels compile in a quarter of the time.
FEW = """
import pkgutil
every = pkgutil.iter_modules
pkgutil.iter_modules = lambda path=None, prefix="": (
    m for m in every(path, prefix)
    if m.ispkg or m.name.rpartition(".")[2] in ("linear_drag", "linear_drift")
)
"""


def made_effect(name, factor=1.0, more=""):
    """Source of a module with a linear drag, and ``more``."""
    return MODULE.format(name=name, factor=factor) + more


def add_distribution(folder, name, modules, entry_points=None):
    """Install ``modules`` (name: source) into ``folder``, each an effect's, as a distribution."""
    for module, source in modules.items():
        (folder / f"{module}.py").write_text(source, encoding="utf-8")
    info = folder / f"{name.replace('-', '_')}-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(
        f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n", encoding="utf-8"
    )
    lines = [f"{point} = {point}" for point in entry_points or modules]
    text = "\n".join(["[dearig.effects]", *lines, ""])
    (info / "entry_points.txt").write_text(text, encoding="utf-8")


def run_with(folder, program, compiled=False, cache=None):
    """Run ``program`` where the distributions in ``folder`` are installed; its standard output.

    Compiled, or interpreted: the kernels take half a minute to compile.
    """
    environment = {
        **os.environ,
        "PYTHONPATH": str(folder),
        "NUMBA_CACHE_DIR": str(cache or folder / "cache"),
        "NUMBA_DISABLE_JIT": "0" if compiled else "1",
    }
    done = subprocess.run(
        [sys.executable, "-c", program],
        cwd=Path(folder), env=environment, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done.stdout
