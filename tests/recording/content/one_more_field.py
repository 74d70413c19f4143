"""A text and a condition are each added to the source by one line.

Run with a folder; prints what each list shows of a recording that has both.
"""

from __future__ import annotations

import json
import sys
from importlib.machinery import PathFinder, SourceFileLoader
from pathlib import Path
from types import CodeType

import numpy as np

NAME = "dearig.recording.content.fields"
LINES = {
    '"notes": TextField(': '"lot": TextField("provenance/lot", "Lot", "Lot", column="lot"),\n',
    '"relative_humidity_percent":': '"bias_V": Condition("voltage_command", "bias", "V", 10.0),\n',
}


class OneLineMore(SourceFileLoader):
    """Loads the module of the fields with a line more in each table."""

    def get_code(self, fullname: str) -> CodeType:  # noqa: ARG002
        source = self.get_data(self.path).decode("utf-8")
        for before, line in LINES.items():
            assert source.count(before) == 1
            source = source.replace(before, f"{line}        {before}")
        return self.source_to_code(source.encode(), self.path)


class Finder(PathFinder):
    @classmethod
    def find_spec(cls, fullname: str, path: object = None, target: object = None) -> object:
        spec = super().find_spec(fullname, path, target) if fullname == NAME else None
        if spec is not None:
            spec.loader = OneLineMore(NAME, str(spec.origin))
        return spec


sys.meta_path.insert(0, Finder)

from dearig.analysis.summary import differences, summary_of  # noqa: E402
from dearig.batch.fits import about  # noqa: E402
from dearig.batch.table_file import read_table, write_csv  # noqa: E402
from dearig.batch.trend_columns import columns_in  # noqa: E402
from dearig.recording.content.metadata import RunMetadata  # noqa: E402
from dearig.recording.exporters import export_recording  # noqa: E402
from dearig.recording.importers import import_file  # noqa: E402
from dearig.recording.reading.index import glance, index_folder, lines  # noqa: E402
from dearig.recording.reading.reader import open_recording  # noqa: E402
from dearig.recording.reading.summary import describe, describe_rows  # noqa: E402
from dearig.recording.writing.save import save_recording  # noqa: E402
from dearig.report.text.study_table import _COLUMNS  # noqa: E402
from dearig.window.recordings.folder_model import COLUMNS  # noqa: E402


def main(folder: Path) -> None:
    paths = []
    for name, volts in (("one", 100.0), ("two", 300.0)):
        time = np.arange(50) * 0.01
        values = {
            "time": time,
            "voltage_command": np.full(50, volts),
            "displacement": 1e-6 * np.sin(time),
        }
        noted = RunMetadata(title=name, provenance={"lot": f"0{name}"})
        paths.append(save_recording(folder / f"{name}.h5", "actuator", values, noted))
    first = open_recording(paths[0])
    exported = export_recording(paths[0], "mat", folder / "one.mat")
    import_file(exported, folder / "again.h5")
    entry = glance(paths[0], "one.h5", 0)
    (column,) = [column for column in COLUMNS if column.head == "Lot"]
    rows = [about(open_recording(path)) for path in paths]
    table = folder / "table.csv"
    write_csv([{"lot": "007"}], table)
    described = describe(first)
    told = {
        "described": [described["provenance"]["lot"], described["bias_V"]],
        "shown": dict(describe_rows(first))["lot"],
        "index": [entry.as_json()["lot"], entry.room["bias_V"]],
        "lines": lines(index_folder(folder, cache=folder / "c.json"))[-1],
        "window": column.text(summary_of(folder, entry)),
        "study": [rows[0]["lot"], rows[0]["bias_V"]],
        "study_shown": "bias_V" in _COLUMNS,
        "trends": [c.label for c in columns_in(rows, ["", ""], ()) if c.unit == "V"],
        "names": read_table(table)[0]["lot"],
        "differ": {d.what: d.values for d in differences(paths) if d.what in ("lot", "bias (V)")},
        "imported": open_recording(folder / "again.h5").texts["lot"],
    }
    print(json.dumps(told))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
