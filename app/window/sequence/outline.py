"""Outline of a plan without compiled kernels, in a process that compiles nothing.

It imports nothing of the model before the compiler is switched off.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Any

__all__ = ["outline"]


def outline(toml: str, folder: str, rig_text: str, progress: Any = None) -> Any:
    """Return the curves of the sequence ``toml`` as a ``Preview`` that cannot be played.

    ``rig_text`` is that of the rig file in force. The kernels are run as Python, by which the same
    equations take longer for each step, and no minute of compilation. Returns None where the
    sequence cannot be planned, or where this process has the compiler already.
    """
    del progress
    if "numba" in sys.modules:  # its kernels are compiled already, or were made to be
        return None
    os.environ["NUMBA_DISABLE_JIT"] = "1"  # of this process alone, and before numba is imported
    from dearig.config.rigform import parse_rig_file
    from dearig.window.sequence.planner import make_preview
    from dearig.window.session.state import Preview

    place = Path(folder)
    made = make_preview(toml, place, parse_rig_file(rig_text, place))
    if made.plan is None or made.loaded is None:
        return None
    return Preview(
        toml,
        sentence=made.loaded.sequence.name,
        curves=made.curves,
        breaches=made.breaches,
        segments=made.segments,
        is_outline=True,
    )
