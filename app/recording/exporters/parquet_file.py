"""Export to Parquet: one table, with units and description in its schema."""

from __future__ import annotations

from pathlib import Path

from dearig.extras import import_extra
from dearig.recording.exporters.table import Exporter, columns_of, description_of, units_of
from dearig.recording.reading.recording import Recording

__all__ = ["EXPORTER"]


def _write(recording: Recording, path: Path) -> None:
    pyarrow = import_extra("pyarrow", "parquet", "a Parquet file")
    parquet = import_extra("pyarrow.parquet", "parquet", "a Parquet file")
    columns, units = columns_of(recording), units_of(recording)
    fields = [
        pyarrow.field(name, pyarrow.float64(), False, {"units": units[name]}) for name in columns
    ]
    schema = pyarrow.schema(fields, description_of(recording))
    arrays = [pyarrow.array(values) for values in columns.values()]
    table = pyarrow.Table.from_arrays(arrays, schema=schema)
    parquet.write_table(table, path, write_page_checksum=True)


EXPORTER = Exporter("Parquet", _write)
