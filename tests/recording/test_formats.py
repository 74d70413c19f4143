"""Registries of importers and exporters: contracts, and formats of other distributions."""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
from nptdms import ChannelObject, TdmsWriter
from openpyxl import Workbook

from dearig.drivers.registry import EntryError
from dearig.errors import InputError
from dearig.recording import EXPORTS, export_recording, open_recording
from dearig.recording.exporters import Exporter
from dearig.recording.exporters import contract as exporters_contract
from dearig.recording.exporters.contract import check_exporter
from dearig.recording.importers import IMPORTERS, Importer, import_file
from dearig.recording.importers.contract import check_importer
from dearig.recording.importers.source import Source
from tests.tools.imports import octave_text
from tests.tools.plugins import run_with_distribution
from tests.tools.recordings import Clock, run_counts, write_run


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("run") / "run.h5"
    write_run(path, run_counts(300, quiet=100))
    return path


def sample_of(name: str, run: Path, folder: Path) -> Path:
    path = folder / f"sample.{'mat' if name == 'octave' else name}"
    if name in EXPORTS:
        return export_recording(run, name, path)
    recording = open_recording(run)
    columns = {
        "time_s": recording.time,
        "voltage_V": recording.voltage_command,
        "displacement_m": recording.displacement,
    }
    if name == "tdms":
        with TdmsWriter(path) as writer:
            writer.write_segment([ChannelObject("rig", n, v) for n, v in columns.items()])
    if name == "h5":
        with h5py.File(path, "w") as file:
            for n, v in columns.items():
                file[f"scan/{n}"] = v
    if name == "json":
        path.write_text(json.dumps({n: v.tolist() for n, v in columns.items()}), "utf-8")
    if name == "octave":
        path.write_text(octave_text(columns), "utf-8")
    if name == "xlsx":
        book = Workbook()
        for row in [list(columns), *np.column_stack(list(columns.values())).tolist()]:
            book.active.append(row)
        book.save(path)
    return path


@pytest.mark.parametrize("name", IMPORTERS)
def test_every_importer_keeps_the_contract(tmp_path: Path, run: Path, name: str) -> None:
    (tmp_path / "copies").mkdir()
    check_importer(name, IMPORTERS[name], sample_of(name, run, tmp_path), tmp_path / "copies")


@pytest.mark.parametrize("name", EXPORTS)
def test_every_exporter_keeps_the_contract(tmp_path: Path, run: Path, name: str) -> None:
    check_exporter(name, run, tmp_path, now=Clock())


def failing(path: Path) -> Source:
    if not path.read_bytes().endswith(b"\n"):
        raise RuntimeError("unexpected")
    return IMPORTERS["csv"].open(path)


@pytest.mark.parametrize(
    ("change", "match"),
    [
        ({"sniff": bool}, "takes zeros for its format"),
        ({"sniff": lambda head: not head}, "does not recognise the sample"),
        ({"suffixes": (".txt",)}, "has none of its suffixes"),
        ({"open": failing}, "raises RuntimeError: unexpected"),
    ],
)
def test_the_importers_contract_finds_a_fault(
    tmp_path: Path, run: Path, change: dict[str, object], match: str
) -> None:
    (tmp_path / "copies").mkdir()
    sample = sample_of("csv", run, tmp_path)
    with pytest.raises(EntryError, match=match):
        check_importer("csv", replace(IMPORTERS["csv"], **change), sample, tmp_path / "copies")


def test_the_exporters_contract_finds_values_that_do_not_come_back(
    tmp_path: Path, run: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def rounded(path: Path, to: str, out: Path) -> Path:
        written = export_recording(path, to, out)
        lines = written.read_text().splitlines()
        cut = [",".join(cell[:6] for cell in line.split(",")) for line in lines[1:]]
        written.write_text("\n".join([lines[0], *cut]) + "\n")
        return written

    monkeypatch.setattr(exporters_contract, "export_recording", rounded)
    with pytest.raises(EntryError, match="comes back with other values"):
        check_exporter("csv", run, tmp_path, now=Clock())


@pytest.mark.parametrize("name", IMPORTERS)
def test_a_file_with_another_suffix_is_known_by_its_first_bytes(
    tmp_path: Path, run: Path, name: str
) -> None:
    sample = sample_of(name, run, tmp_path)
    renamed = sample.rename(tmp_path / "measured.dat")
    import_file(renamed, tmp_path / "out.h5", now=Clock())
    found, expected = open_recording(tmp_path / "out.h5"), open_recording(run)
    np.testing.assert_array_equal(found.voltage_command, expected.voltage_command)


@pytest.mark.parametrize("what", ["import", "export"])
def test_parquet_without_pyarrow_is_a_sentence(
    tmp_path: Path, run: Path, monkeypatch: pytest.MonkeyPatch, what: str
) -> None:
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    source = tmp_path / "in.parquet"
    source.write_bytes(b"PAR1")
    call = {
        "import": lambda: import_file(source, tmp_path / "out.h5"),
        "export": lambda: export_recording(run, "parquet", tmp_path / "out.parquet"),
    }[what]
    with pytest.raises(InputError, match=r'not installed: pip install "dearig\[parquet\]"'):
        call()
    assert {path.name for path in tmp_path.iterdir()} == {"in.parquet"}


def readme_example() -> str:
    """Return the format that the how-to writes, so that the how-to is tested."""
    text = (Path(__file__).parents[2] / "app/recording/importers/README.md").read_text("utf-8")
    return text.split("```python\n", 1)[1].split("```", 1)[0]


def test_a_format_of_another_distribution_is_imported_and_exported(
    tmp_path: Path, run: Path
) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "copies").mkdir()
    found = run_with_distribution(
        tmp_path,
        {"spaced.py": readme_example()},
        {
            "dearig.importers": {"spaced": "spaced:IMPORTER"},
            "dearig.exporters": {"spaced": "spaced:EXPORTER"},
        },
        f"""
        from pathlib import Path
        from dearig.recording import EXPORTS, export_recording
        from dearig.recording.exporters.contract import check_exporter
        from dearig.recording.importers import IMPORTERS
        from dearig.recording.importers.contract import check_importer
        run, folder = Path({str(run)!r}), Path({str(tmp_path)!r})
        sample = export_recording(run, "spaced", folder / "sample.spaced")
        check_importer("spaced", IMPORTERS["spaced"], sample, folder / "copies")
        check_exporter("spaced", run, folder / "out")
        print(*EXPORTS, *IMPORTERS.left_out, *EXPORTS.left_out)
        """,
    )
    assert found.split() == ["csv", "mat", "parquet", "spaced"]


def test_formats_that_cannot_be_used_are_left_out(tmp_path: Path) -> None:
    found = run_with_distribution(
        tmp_path,
        {"bad.py": "from dearig.recording.exporters import Exporter\nOK = Exporter('x', print)\n"},
        {
            "dearig.importers": {"odd": "bad:OK", "csv": "bad:OK"},
            "dearig.exporters": {"Two-Words": "bad:OK"},
        },
        """
        from dearig.recording import EXPORTS
        from dearig.recording.importers import IMPORTERS
        print(len(IMPORTERS), len(EXPORTS))
        print(*IMPORTERS.left_out, *EXPORTS.left_out, sep="\\n")
        """,
    )
    counts, *sentences = found.splitlines()
    assert counts == f"{len(IMPORTERS)} {len(EXPORTS)}"
    assert [s.split(" is left out: ")[1].split(";")[0] for s in sentences] == [
        "the name 'csv' is already taken",
        "it is not a dearig.recording.importers.Importer",
        "its name must be the suffix of its files: small letters and digits",
    ]


def test_the_kinds_of_entry_are_told_apart() -> None:
    assert all(isinstance(importer, Importer) for importer in IMPORTERS.values())
    assert all(isinstance(exporter, Exporter) for exporter in EXPORTS.values())
