"""The last look at a finished recording: it is there, can be read, and holds what was recorded."""

from __future__ import annotations

from array import array
from pathlib import Path

import numpy as np

from dearig.errors import DiskFault, InputError
from dearig.recording.content.checksums import BLOCK, checksum
from dearig.recording.content.layout import IDENTIFIER
from dearig.recording.content.physical import Counts
from dearig.recording.content.safe import Refused
from dearig.recording.content.text import text_of
from dearig.recording.reading.opening import UNREADABLE, opened

__all__ = ["check_written"]

#: Blocks of counts that are compared, at most: as many samples as a run with physical values has.
#: Those of a longer run are compared at even distances.
BLOCKS_MAX = 256


def check_written(path: Path, identifier: str, samples: int, checksums: array[int]) -> None:
    """Raise ``DiskFault`` unless the file at ``path`` is the recording that was written.

    ``checksums`` are those of each channel for each block of the ``samples``, as they came.
    """
    try:
        with opened(path) as file:
            entry = file["entry"]
            counts = Counts(entry)
            if text_of(entry[IDENTIFIER][()]) != identifier:
                raise DiskFault(f"{path} holds another recording: another program replaced it")
            if counts.samples != samples:
                raise DiskFault(
                    f"{path} holds {counts.samples} samples, and {samples} were written: another "
                    f"program changed the file"
                )
            expected = np.array(checksums).reshape(-1, len(counts.channels))
            blocks = len(expected)
            for i in np.unique(np.linspace(0, blocks - 1, min(blocks, BLOCKS_MAX)).astype(int)):
                start, stop = int(i) * BLOCK, min((int(i) + 1) * BLOCK, samples)
                if [checksum(row) for row in counts.raw(start, stop)] != expected[i].tolist():
                    raise DiskFault(
                        f"{path}: samples {start} to {stop - 1} are not those that were recorded: "
                        f"another program changed the file, or the disk fails"
                    )
    except (InputError, Refused, KeyError, *UNREADABLE) as error:
        raise DiskFault(
            f"{path} was written, and cannot be read ({error}): another program changed the file, "
            f"or the disk fails"
        ) from error
