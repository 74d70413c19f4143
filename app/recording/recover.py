"""Recovery of a recording whose run was killed: repaired in place and finished."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

from dearig.errors import InputError
from dearig.recording.files import in_words
from dearig.recording.finish import finish
from dearig.recording.journal import carry_out, whole_journal
from dearig.recording.opening import UNREADABLE
from dearig.recording.reader import is_finished, open_recording
from dearig.recording.superblock import repair_superblock

__all__ = ["recover"]

#: s since the last change within which a run may still be writing the file.
STILL_RUNNING = 10.0


def recover(path: str | Path, now: Callable[[], float] = time.time) -> bool:
    """Make the recording at ``path`` readable by any program, with physical values.

    Returns True if the file was changed. It stays marked as incomplete. Bytes that are replaced are
    copied first, so that a kill during the recovery loses nothing. Raises ``InputError`` for a file
    that is not a recording, has no samples, or changed within the last ten seconds (``now`` is Unix
    time in s) and so may still be written to.
    """
    path = Path(path)
    samples = open_recording(path).samples
    age = now() - path.stat().st_mtime
    try:
        left = whole_journal(path) is not None
        if is_finished(path) and not left:
            return False
        if age < STILL_RUNNING:
            raise InputError(
                f"{path} changed {max(age, 0.0):.1f} s ago and may still be recorded to; "
                f"recover it when the run has ended"
            )
        # the run was killed while it closed
        if carry_out(path):
            return True
        finish(
            path,
            complete=False,
            outcome=f"killed; {samples} samples recovered",
            ended=None,
            repair=repair_superblock,
            fsync=True,
        )
    except UNREADABLE as error:
        raise InputError(f"{path} cannot be repaired: {in_words(error)}") from error
    return True
