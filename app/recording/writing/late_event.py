"""Events that are added to a finished recording, such as the acknowledgement of its alarm."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np

from dearig.errors import InputError
from dearig.input_file import why_no_file
from dearig.recording.content.journal import changed_in_place
from dearig.recording.content.layout import (
    EVENT_LEVELS,
    EVENT_TYPE,
    LIBVER,
    MESSAGE_BYTES,
    name_dimensions,
)
from dearig.recording.content.text import clip_text
from dearig.recording.files import system_text
from dearig.recording.lock import lock_existing
from dearig.recording.reading.opening import UNREADABLE
from dearig.recording.reading.reader import is_finished, open_recording

__all__ = ["add_event"]


def add_event(path: str | Path, level: str, message: str) -> None:
    """Add an event at the last sample of the recording at ``path``; all is written or nothing.

    Raises ``InputError`` for a file that is not a finished recording, is in use or cannot be
    written.
    """
    if level not in EVENT_LEVELS:
        raise ValueError(f"event level {level!r} is not one of {', '.join(EVENT_LEVELS)}")
    path = Path(path)
    if reason := why_no_file(path):
        raise InputError(f"{path} {reason}")
    path = path.resolve()  # the journal is next to the file itself
    recording = open_recording(path)
    try:
        if not is_finished(path):
            raise InputError(f"{path} is not finished; recover it", command=("recover", str(path)))
        row = np.zeros(1, dtype=EVENT_TYPE)
        last, text = max(recording.samples - 1, 0), clip_text(message, MESSAGE_BYTES)
        row[0] = (last, recording.duration, level.encode(), text)
        with (
            lock_existing(path) as lock,
            changed_in_place(path, lock) as changes,
            h5py.File(changes, "r+", libver=LIBVER) as file,
        ):
            events = file["entry/events"]
            events.resize((events.shape[0] + 1,))
            events[-1:] = row
            name_dimensions(file["entry"])
    except UNREADABLE as error:
        raise InputError(f"{path} cannot be written: {system_text(error)}") from error
