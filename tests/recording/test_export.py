"""Recordings handed on come back as they were, and say what they are."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow
import pytest
from pyarrow import parquet
from scipy.io import loadmat

from dearig.errors import InputError
from dearig.model.film.material import THESIS_FILM, Load
from dearig.recording import (
    EXPORTS,
    Recording,
    RunMetadata,
    describe,
    describe_rows,
    export_recording,
    import_file,
    open_recording,
)
from dearig.recording.importers import ImportOptions
from tests.tools.recordings import Clock, measured_data, write_run, writer


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("run") / "run.h5"
    write_run(path)
    return path


def same(first: Recording, second: Recording) -> None:
    assert first.values.keys() == second.values.keys()
    for name, values in first.values.items():
        np.testing.assert_array_equal(second.values[name], values, err_msg=name)


@pytest.mark.parametrize("to", EXPORTS)
def test_a_run_comes_back_to_the_last_bit(tmp_path: Path, run: Path, to: str) -> None:
    out = export_recording(run, to, tmp_path / f"run.{to}")
    assert import_file(out, tmp_path / "again.h5", now=Clock()).warnings == ()
    first, second = open_recording(run), open_recording(tmp_path / "again.h5")
    same(first, second)
    for what in ("hold", "film", "load", "kinematics", "sequence_toml"):
        assert getattr(second, what) == getattr(first, what)
    for what in ("simulated", "rig", "seed", "operator"):
        assert second.provenance.get(what) == first.provenance.get(what)


def test_a_table_that_was_changed_is_not_described_by_the_file_beside_it(
    tmp_path: Path, run: Path
) -> None:
    out = export_recording(run, "csv", tmp_path / "run.csv")
    first, rest = out.read_text("utf-8").split("\n", 1)
    out.write_text(f"{first}\n{rest.split(chr(10), 1)[1]}", "utf-8")
    warnings = import_file(out, tmp_path / "again.h5", now=Clock()).warnings
    assert any("run.csv-metadata.json does not describe this table" in text for text in warnings)
    assert open_recording(tmp_path / "again.h5").film is None
    (tmp_path / "run.csv-metadata.json").write_text("[" * 100_000, "utf-8")
    import_file(out, tmp_path / "other.h5", now=Clock())


@pytest.mark.parametrize("to", EXPORTS)
def test_what_is_given_counts_more_than_what_was_exported(
    tmp_path: Path, run: Path, to: str
) -> None:
    out = export_recording(run, to, tmp_path / f"run.{to}")
    film, load = replace(THESIS_FILM, thickness=2e-3), Load(0.1)
    metadata = RunMetadata(film=film, load=load)
    import_file(out, tmp_path / "again.h5", metadata=metadata, now=Clock())
    again = open_recording(tmp_path / "again.h5")
    assert (again.film, again.load) == (film, load)


def test_parquet_files_that_cannot_be_taken(tmp_path: Path, run: Path) -> None:
    path, out = tmp_path / "in.parquet", tmp_path / "out.h5"
    good = {"time_s": [0.0, 1.0], "voltage_V": [0, 100], "displacement_m": [0.0, 1e-4]}
    for content, match in (
        ({"name": ["a"]}, r"in\.parquet holds no columns of numbers"),
        (good | {"voltage_V": [0, None]}, "row 2, column 'voltage_V': there is no value"),
        (good | {"time_s": [1.0, 0.0]}, "row 2, column 'time_s': time goes back"),
    ):
        parquet.write_table(pyarrow.table(content), path)
        with pytest.raises(InputError, match=match):
            import_file(path, out, now=Clock())
    parquet.write_table(pyarrow.table(good), path)
    import_file(path, out, now=Clock())
    assert open_recording(out).samples == 2
    whole = export_recording(run, "parquet", tmp_path / "run.parquet").read_bytes()
    for content in (whole[:5000], b"PAR1" + bytes(50) + b"PAR1", _turned(whole, 3000)):
        path.write_bytes(content)
        with pytest.raises(InputError, match=r"in\.parquet cannot be read as a Parquet file"):
            import_file(path, tmp_path / "other.h5", now=Clock())


def _turned(raw: bytes, at: int) -> bytes:
    return raw[:at] + bytes([raw[at] ^ 1]) + raw[at + 1 :]


def test_parquet_holds_units_and_origin(tmp_path: Path, run: Path) -> None:
    out = export_recording(run, "parquet", tmp_path / "run.parquet")
    table = parquet.read_table(out)
    recording = open_recording(run)
    assert table.column_names == [
        "time_s", "displacement_m", "voltage_V", "voltage_monitor_V", "current_A",
    ]  # fmt: skip
    for column, values in zip(table.columns, recording.values.values(), strict=True):
        np.testing.assert_array_equal(column.to_numpy(), values)
    assert table.schema.field("current_A").metadata == {b"units": b"A"}
    about = {name.decode(): text.decode() for name, text in table.schema.metadata.items()}
    assert (about["kind"], about["hold"]) == ("actuator", "zero-order")
    assert json.loads(about["film"])["length"] == 0.075
    assert json.loads(about["provenance"])["operator"] == "Ada"


def test_mat_holds_units(tmp_path: Path, run: Path) -> None:
    found = loadmat(export_recording(run, "mat", tmp_path / "run.mat"), simplify_cells=True)
    assert found["units"]["voltage_V"] == "V"
    assert found["units"]["displacement_m"] == "m"
    assert found["about"]["name"] == "run"
    assert found["time_s"].shape == (3000,)


def test_csv_is_a_plain_table(tmp_path: Path, run: Path) -> None:
    out = export_recording(run, "csv", tmp_path / "run.csv")
    lines = out.read_bytes().split(b"\n")
    assert lines[0] == b"time_s,displacement_m,voltage_V,voltage_monitor_V,current_A"
    assert len(lines) == 3002
    assert lines[1].startswith(b"0.0,")


def test_where_an_export_goes(tmp_path: Path, run: Path) -> None:
    copy = tmp_path / "copy.h5"
    copy.write_bytes(run.read_bytes())
    for to in EXPORTS:
        out = export_recording(copy, to)
        assert out == tmp_path / f"copy.{to}"
        before = out.read_bytes()
        with pytest.raises(InputError, match=f"copy.{to} exists already"):
            export_recording(copy, to)
        assert out.read_bytes() == before
        export_recording(copy, to, overwrite=True)
    with pytest.raises(InputError, match="exported to csv, mat, parquet, not to 'xlsx'"):
        export_recording(copy, "xlsx")
    with pytest.raises(InputError, match=r"none\.h5 is not there"):
        export_recording(tmp_path / "none.h5", "csv", tmp_path / "none.csv")
    assert not (tmp_path / "none.csv").exists()


@pytest.mark.parametrize("to", EXPORTS)
@pytest.mark.parametrize(
    "name",
    [
        "vhb4910_cycle_rate0.01_stretch2.0.csv",
        "vhb4910_cycle_rate0.05_stretch2.0.csv",
        "vhb4910_relaxation_stretch2.0.csv",
        "vhb4910_relaxation_stretch4.0.csv",
    ],
)
def test_measured_data_make_the_round(tmp_path: Path, name: str, to: str) -> None:
    source = measured_data() / name
    first, second = tmp_path / "first.h5", tmp_path / "second.h5"
    import_file(source, first, ImportOptions(gauge_length_mm=80, area_mm2=22), now=Clock())
    assert import_file(export_recording(first, to), second, now=Clock()).warnings == ()
    same(open_recording(first), open_recording(second))
    assert open_recording(second).kinematics == "uniaxial"


def test_a_description_for_programs(run: Path) -> None:
    d = json.loads(json.dumps(describe(open_recording(run)), allow_nan=False))
    assert (d["kind"], d["samples"], d["complete"]) == ("actuator", 3000, True)
    assert d["duration_s"] == pytest.approx(2.999)
    assert d["timing"]["even"]
    assert d["timing"]["rate_Hz"] == pytest.approx(1000.0)
    assert [c["name"] for c in d["channels"]] == [
        "displacement",
        "voltage_command",
        "voltage_monitor",
        "current_monitor",
    ]
    assert d["channels"][1]["max"] == pytest.approx(20000 * 10 / 32768 * 1e3, rel=1e-3)
    assert d["quiet_samples"] == 1000
    assert d["noise_floor_m"] == pytest.approx(6.1e-6, rel=0.1)
    assert d["film"]["length"] == 0.075
    assert d["film"]["id"] == "film 3"
    assert d["load"] == {"mass": 0.2, "rest_length": None}
    assert d["instruments"][1]["settings"] == {"averaging": "256", "sampling": "20 µs"}
    assert d["events"][0]["message"] == "near the limit"
    assert d["provenance"]["seed"] == 7
    assert 'name = "two lobes"' in d["sequence"]


def test_a_description_of_uneven_film_data(tmp_path: Path) -> None:
    source = tmp_path / "in.csv"
    source.write_text("time_s,stretch,nominal_stress_kPa\n0,1,0\n1,1.1,10\n3,1.2,20\n")
    import_file(source, tmp_path / "out.h5", now=Clock())
    recording = open_recording(tmp_path / "out.h5")
    d = describe(recording)
    assert d["timing"] == {"even": False, "rate_Hz": None, "step_min_s": 1.0, "step_max_s": 2.0}
    assert d["noise_floor_m"] is None
    rows = dict(describe_rows(recording))
    assert rows["rate"] == "uneven, steps of 1 to 2 s"
    assert rows["nominal stress"] == "0.00 to 20.00 kPa"
    assert rows["kinematics"] == "uniaxial"
    assert rows["source"] == "in.csv"


def test_a_description_for_people(tmp_path: Path, run: Path) -> None:
    rows = dict(describe_rows(open_recording(run)))
    assert rows["recording"] == "run (actuator, two lobes)"
    assert rows["outcome"] == "finished"
    assert rows["samples"] == "3000 over 2.999 s"
    assert rows["rate"] == "1000 Hz"
    assert rows["noise floor"].endswith("um, over 1000 samples at 0 V")
    assert rows["film"] == "film 3, 75 x 72 x 1 mm, permittivity 4.7, density 1000 kg/m3"
    assert rows["load"] == "200 g"
    assert rows["sensor"].startswith("LK-H152, serial unknown; averaging 256")
    assert rows["warning at 0.51 s"] == "near the limit"
    assert rows["operator"] == "Ada"

    from dearig.drivers.rig import Block
    from tests.tools.recordings import run_counts

    short = writer(tmp_path / "short.h5")
    short.append(Block(0, run_counts(10)))
    short.close("stopped by the operator")
    rows = dict(describe_rows(open_recording(tmp_path / "short.h5")))
    assert rows["samples"] == "10 over 0.009 s, 3000 were planned"
    assert rows["noise floor"].endswith(
        "from second differences: only 10 samples at 0 V at the start"
    )
