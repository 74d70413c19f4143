"""Export to a MATLAB MAT file of version 5: one variable for each column."""

from __future__ import annotations

from pathlib import Path

from dearig.errors import InputError
from dearig.recording.exporters.table import Exporter, columns_of, description_of, units_of
from dearig.recording.reading.recording import Recording

__all__ = ["EXPORTER"]

#: Bytes of one variable that a MAT file of version 5 can hold.
MAT_LIMIT = 2**31 - 1


def _write(recording: Recording, path: Path) -> None:
    # SciPy takes a while to import: only this format needs it
    from scipy.io import savemat

    columns = columns_of(recording)
    if recording.time.nbytes > MAT_LIMIT:
        raise InputError(
            f"{recording.path} has {recording.samples} samples, more than a MAT file of version 5 "
            f"can hold; export it to parquet"
        )
    about = {name: text for name, text in description_of(recording).items() if text}
    with path.open("wb") as stream:
        # compressed variables carry a checksum
        savemat(
            stream,
            columns | {"units": units_of(recording), "about": about},
            oned_as="column",
            long_field_names=True,
            do_compression=True,
        )


EXPORTER = Exporter("MATLAB MAT", _write)
