"""The rescue of a recording whose run was killed: mended, and finished like any other."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

from app.errors import InputError
from app.recording.finish import finish
from app.recording.reader import open_recording, opened
from app.recording.superblock import mend_superblock

__all__ = ["recover"]

#: s since the last change within which a file may still be in the hands of a run.
STILL_RUNNING = 10.0


def recover(path: str | Path, now: Callable[[], float] = time.time) -> bool:
    """Make the recording at ``path`` readable by any program, with physical values.

    True if there was anything to do. It stays marked as incomplete. The file is replaced as a
    whole, once the new one has been written. Raises ``InputError``: not a recording, no samples in
    it, or it changed within the last ten seconds (``now`` is Unix time in s) and so may still be
    written to.
    """
    path = Path(path)
    samples = open_recording(path).samples
    with opened(path) as file:
        if "time" in file["entry/data"]:
            return False
    age = now() - path.stat().st_mtime
    if age < STILL_RUNNING:
        raise InputError(
            f"{path} changed {max(age, 0.0):.1f} s ago and may still be recorded to; "
            f"recover it when the run has ended"
        )
    try:
        finish(
            path,
            complete=False,
            outcome=f"killed; {samples} samples recovered",
            ended=None,
            mend=mend_superblock,
        )
    except ValueError as error:
        raise InputError(f"{path} cannot be mended: {error}") from error
    return True
