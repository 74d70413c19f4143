"""A run as files of other programs hold it, and its import."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from dearig.cli.output import with_hints
from dearig.errors import InputError
from dearig.recording import Recording, import_file, open_recording
from dearig.recording.importers import Imported, ImportOptions
from tests.tools.recordings import Clock

ROWS = 60
TIME = np.arange(ROWS) / 100.0
VOLTAGE = np.where(TIME < 0.3, 0.0, 4000.0 * (TIME - 0.3))  # V
MOVED = 1e-4 * (VOLTAGE / 1000.0) ** 2  # m
NAMES = ("time_s", "voltage_V", "displacement_mm")
TABLE = np.column_stack([TIME, VOLTAGE, MOVED * 1e3])


def imported(path: Path, **options: object) -> Imported:
    """Import a file as ``out.h5`` next to it."""
    out = path.parent / "out.h5"
    return import_file(path, out, ImportOptions(**options), overwrite=True, now=Clock())


def taken(path: Path, **options: object) -> Recording:
    """Import a file, and return the recording."""
    imported(path, **options)
    return open_recording(path.parent / "out.h5")


@contextmanager
def refused(match: str) -> Iterator[pytest.ExceptionInfo[InputError]]:
    """Expect an ``InputError`` whose text on the command line has ``match``, a pattern."""
    with pytest.raises(InputError) as caught:
        yield caught
    shown = with_hints(caught.value)
    assert re.search(match, shown), shown


def octave_text(columns: Mapping[str, np.ndarray]) -> str:
    """A text file as Octave's ``save`` writes it by default."""
    text = "# Created by Octave 7.3.0, Fri Nov 27 22:32:40 2026 UTC <user@host>\n"
    for name, values in columns.items():
        matrix = np.atleast_2d(values.T).T
        rows = "\n".join(" " + " ".join(f"{v:.17g}" for v in row) for row in matrix)
        text += f"# name: {name}\n# type: matrix\n# rows: {matrix.shape[0]}\n"
        text += f"# columns: {matrix.shape[1]}\n{rows}\n\n\n"
    return text


def same(run: Recording) -> None:
    np.testing.assert_allclose(run.time, TIME, rtol=0, atol=1e-8)
    np.testing.assert_allclose(run.voltage_command, VOLTAGE, rtol=1e-8)
    np.testing.assert_allclose(run.displacement, MOVED, rtol=1e-8, atol=1e-15)
