"""Start of an imported recording: that of the measurement, or said to be that of the import."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from nptdms import ChannelObject, TdmsWriter

from dearig.analysis.summary import RecordingSummary, summary_of
from dearig.batch.fits import about
from dearig.recording import Recording, import_file, open_recording
from dearig.recording.exporters import EXPORTS
from dearig.recording.reading.index import Entry, index_folder
from dearig.recording.reading.origin import origin_of
from dearig.recording.reading.summary import describe_rows
from dearig.recording.verify import verify
from tests.tools.imports import MOVED, TABLE, TIME, VOLTAGE, taken

BEGAN = datetime(2024, 3, 17, 14, 2, 11, 500_000)
LABVIEW = datetime(1904, 1, 1, tzinfo=UTC)


@pytest.fixture(autouse=True)
def _zone(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """A laboratory whose clock is not that of UTC."""
    if not hasattr(time, "tzset"):
        pytest.skip("this system cannot change the zone of a process")
    monkeypatch.setenv("TZ", "Europe/Berlin")
    time.tzset()
    yield
    monkeypatch.undo()
    time.tzset()


def start_of(run: Recording) -> datetime:
    return datetime.fromisoformat(str(run.provenance["start_time"]))


def written(path: Path, cells: list[str], name: str) -> Path:
    rows = [f"{c},{v:.9g},{x:.12g}" for c, v, x in zip(cells, VOLTAGE, MOVED * 1e3, strict=True)]
    path.write_text("\n".join([f"{name},voltage_V,displacement_mm", *rows]))
    return path


def listed(folder: Path) -> tuple[Entry, RecordingSummary]:
    entry = next(e for e in index_folder(folder) if e.path == "out.h5")
    return entry, summary_of(folder, entry)


@pytest.mark.parametrize(
    ("cells", "expected"),
    [
        (
            [f"{BEGAN + timedelta(seconds=t):%Y-%m-%d %H:%M:%S.%f}" for t in TIME],
            BEGAN,
        ),
        (
            [f"{BEGAN + timedelta(seconds=t):%Y-%m-%dT%H:%M:%S.%f}+00:00" for t in TIME],
            BEGAN.replace(tzinfo=UTC),
        ),
        (
            [f"{BEGAN + timedelta(seconds=t):%d/%m/%Y %H:%M:%S.%f}" for t in TIME],
            BEGAN,
        ),
        (
            [f"{BEGAN.replace(tzinfo=UTC).timestamp() + t:.3f}" for t in TIME],
            BEGAN.replace(tzinfo=UTC),
        ),
        (
            [f"{(BEGAN.replace(tzinfo=UTC) - LABVIEW).total_seconds() + t:.3f}" for t in TIME],
            BEGAN.replace(tzinfo=UTC),
        ),
        (None, BEGAN),
    ],
    ids=["date", "date with zone", "day first", "seconds since 1970", "seconds since 1904", "days"],
)
def test_a_column_of_dates_tells_the_start(
    tmp_path: Path, cells: list[str] | None, expected: datetime
) -> None:
    options = {}
    if cells is None:  # as a spreadsheet counts days
        first = (BEGAN - datetime(1899, 12, 30)).total_seconds() / 86_400.0
        cells = [f"{first + t / 86_400.0:.12f}" for t in TIME]
        options = {"columns": {"time_d": "when"}}
    name = "when" if options else "time_s" if cells[0].replace(".", "").isdigit() else "time"
    run = taken(written(tmp_path / "in.csv", cells, name), **options)
    # a date without a zone is of this computer's
    assert abs(start_of(run) - expected.astimezone()) < timedelta(milliseconds=2)
    assert str(run.provenance["start_time_from"]).startswith("the column ")
    assert verify(tmp_path / "out.h5").faults == []
    entry, summary = listed(tmp_path)
    assert not entry.start_is_import
    assert not summary.start_is_import
    assert datetime.fromisoformat(entry.start_time) == start_of(run)
    assert about(run)["started"] == run.provenance["start_time"]
    assert origin_of(run).started.startswith("2024-03-17 1")


@pytest.mark.parametrize(
    "cells",
    [
        [f"{t:.3f}" for t in TIME],
        # it may be the fourth of March or the third of April
        [f"{datetime(2024, 3, 4, 9) + timedelta(seconds=t):%d/%m/%Y %H:%M:%S.%f}" for t in TIME],
        # a time of day without a date
        [f"{BEGAN + timedelta(seconds=t):%H:%M:%S.%f}" for t in TIME],
    ],
    ids=["seconds", "twofold date", "time of day"],
)
def test_without_a_date_the_start_is_said_to_be_that_of_the_import(
    tmp_path: Path, cells: list[str]
) -> None:
    name = "time_s" if cells[0][2] != ":" and "/" not in cells[0] else "time"
    run = taken(written(tmp_path / "in.csv", cells, name))
    assert run.provenance["start_time_from"] == "the import"
    entry, summary = listed(tmp_path)
    assert entry.start_is_import
    assert summary.start_is_import
    assert about(run)["started"] == ""  # it says nothing of the film's age
    assert origin_of(run).started == ""
    rows = dict(describe_rows(run))
    assert "of the import: the file does not tell that of the measurement" in rows["start time"]


def test_recordings_of_earlier_versions_say_so_too(tmp_path: Path) -> None:
    run = taken(written(tmp_path / "in.csv", [f"{t:.3f}" for t in TIME], "time_s"))
    assert "start_time_from" in run.provenance
    import h5py

    with h5py.File(tmp_path / "out.h5", "r+") as file:
        del file["entry/provenance"].attrs["start_time_from"]
    assert origin_of(open_recording(tmp_path / "out.h5")).started == ""


def test_the_waveforms_of_a_tdms_file_tell_it_in_utc(tmp_path: Path) -> None:
    start = np.datetime64(BEGAN, "us")
    told = {"wf_increment": 0.01, "wf_start_time": start}
    path = tmp_path / "in.tdms"
    with TdmsWriter(path) as file:
        file.write_segment([
            ChannelObject("Log", "voltage_V", VOLTAGE, told),
            ChannelObject("Log", "displacement_mm", MOVED * 1e3, told),
        ])  # fmt: skip
    assert start_of(taken(path)) == BEGAN.replace(tzinfo=UTC)
    with TdmsWriter(path) as file:
        stamps = start + np.round(TIME * 1e6).astype("m8[us]")
        file.write_segment([
            ChannelObject("Log", "time", stamps),
            ChannelObject("Log", "voltage_V", VOLTAGE),
            ChannelObject("Log", "displacement_mm", MOVED * 1e3),
        ])  # fmt: skip
    assert start_of(taken(path)) == BEGAN.replace(tzinfo=UTC)


@pytest.mark.parametrize("zone", [None, "UTC"])
def test_dates_of_tables_of_pandas_and_workbooks(tmp_path: Path, zone: str | None) -> None:
    when = pd.Timestamp(BEGAN).tz_localize(zone) + pd.to_timedelta(TIME, "s")
    table = pd.DataFrame({"time": when, "voltage_V": VOLTAGE, "displacement_mm": MOVED * 1e3})
    expected = BEGAN.replace(tzinfo=UTC) if zone else BEGAN.astimezone()
    table.to_parquet(tmp_path / "in.parquet")
    assert start_of(taken(tmp_path / "in.parquet")) == expected
    if zone is None:  # Excel has none
        table.to_excel(tmp_path / "in.xlsx", index=False)
        assert start_of(taken(tmp_path / "in.xlsx")) == expected
    rows = [
        {"time": w.isoformat(), "voltage_V": v, "displacement_mm": x}
        for w, v, x in zip(when, VOLTAGE, MOVED * 1e3, strict=True)
    ]
    (tmp_path / "in.json").write_text(json.dumps(rows))
    assert start_of(taken(tmp_path / "in.json")) == expected


@pytest.mark.parametrize("form", ["mat", "parquet"])
def test_an_exported_recording_keeps_the_start_of_its_run(tmp_path: Path, form: str) -> None:
    cells = [f"{BEGAN + timedelta(seconds=t):%Y-%m-%d %H:%M:%S.%f}" for t in TIME]
    run = taken(written(tmp_path / "in.csv", cells, "time"))
    again = tmp_path / f"exported.{form}"
    EXPORTS[form].write(run, again)
    import_file(again, tmp_path / "again.h5")
    assert start_of(open_recording(tmp_path / "again.h5")) == start_of(run)
    np.savetxt(
        tmp_path / "in.csv", TABLE, delimiter=",", comments="",
        header="time_s,voltage_V,displacement_mm",
    )  # fmt: skip
    unknown = taken(tmp_path / "in.csv")
    again.unlink()
    EXPORTS[form].write(unknown, again)
    import_file(again, tmp_path / "unknown.h5")
    assert open_recording(tmp_path / "unknown.h5").provenance["start_time_from"] == "the import"
