"""Compilation of the numerical kernels before they are needed, and a note that it was done.

The kernels of a fresh installation are compiled at their first call, which takes two minutes of
one processor. A program with a window does that once, in a process of its own.
"""

from __future__ import annotations

import contextlib
import os
import sys
import tempfile
from pathlib import Path

from dearig.acquisition.compilation import compilation_reported
from dearig.acquisition.overlay import OverlayModel
from dearig.acquisition.run import record
from dearig.config.rigfile import RigFile
from dearig.config.sequencefile import parse_sequence
from dearig.model.compiled.jit import cache_folder, is_enabled
from dearig.model.film.material import TABLE_3
from dearig.model.simulation.actuator import Actuator
from dearig.progress import Progress, quiet
from dearig.sim_backend.truth.circuit import electricity
from dearig.sim_backend.truth.film import follow

__all__ = ["compile_kernels", "has_cache", "is_warm"]

#: Rigs whose kernels a window needs: a plan, an overlay model, and both simulated films.
_RIGS = ("sim", "sim:1")
_SEQUENCE = """\
name = "compile"
lead_in_s = 0.05
tail_s = 0.05
[[segment]]
kind = "half_sine"
amplitude_kV = 1.0
frequency_Hz = 10.0
"""


def is_warm() -> bool:
    """Return True if the kernels of exactly these sources need no compilation."""
    note = _note()
    return not is_enabled() or (note is not None and note.exists())


def has_cache() -> bool:
    """Return True if kernels that one process compiles can be used by another."""
    return cache_folder() is not None


def compile_kernels(progress: Progress = quiet) -> None:
    """Compile what a window needs, by a short run on each simulated rig with an overlay model.

    The stages of the progress are "kernel 12 of 300".
    """
    rig_file = RigFile()
    actuator = Actuator(rig_file.as_film(), rig_file.as_load(), TABLE_3)
    overlay = OverlayModel("Table 3", actuator)
    loaded = parse_sequence(_SEQUENCE, "the sequence", Path())

    def report(ready: int, needed: int) -> None:
        progress(f"kernel {ready} of {needed}", ready / needed)

    with (
        tempfile.TemporaryDirectory(prefix="dearig-compile-") as folder,
        compilation_reported(report, (electricity, follow)),
    ):
        for number, address in enumerate(_RIGS):
            record(loaded, address, rig_file, Path(folder, f"{number}.h5"), overlay=overlay)
    note = _note()
    if note is not None:
        # without it the next start only looks for the kernels once more
        with contextlib.suppress(OSError):
            os.close(os.open(note, os.O_CREAT | os.O_WRONLY, 0o600))


def _note() -> Path | None:
    """Return the file that says that all kernels are in the cache; None without a cache."""
    folder = cache_folder()
    return None if folder is None else folder / f"complete-{sys.implementation.cache_tag}"
