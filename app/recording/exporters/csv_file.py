"""Export to CSV: a line of names, then a line for each sample."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from dearig.recording.content.layout import AVERAGE_COLUMN
from dearig.recording.exporters.table import Exporter, columns_of
from dearig.recording.reading.recording import Recording

__all__ = ["EXPORTER"]

#: Rows that are formatted at a time.
BATCH = 20_000


def _write(recording: Recording, path: Path) -> None:
    columns = columns_of(recording)
    if recording.average > 1:  # also for those who have the table alone
        columns[AVERAGE_COLUMN] = np.full(recording.samples, recording.average)
    with path.open("w", encoding="utf-8", newline="") as stream:
        stream.write(",".join(columns) + "\n")
        for first in range(0, recording.samples, BATCH):
            rows = zip(*(c[first : first + BATCH].tolist() for c in columns.values()), strict=True)
            # repr is the shortest text that reads back as the same number
            stream.writelines(",".join(map(repr, row)) + "\n" for row in rows)


EXPORTER = Exporter("CSV", _write, describes=False)
