"""Channels that a rig file declares: from the card's input to the exported file, without code."""

from __future__ import annotations

import csv
import re
from pathlib import Path

import h5py
import numpy as np
import pytest
from pyarrow import parquet
from scipy.io import loadmat

from dearig.config.rigfile import RigFile
from dearig.drivers.channels import RESERVED_NAMES
from dearig.drivers.contract.rig import lobes, play
from dearig.drivers.interlocks import Interlocks, would_trip
from dearig.drivers.rig import Block
from dearig.model.film.material import THESIS_FILM, THESIS_LOAD
from dearig.recording import describe, describe_rows, export_recording, import_file, open_recording
from dearig.recording.content.layout import UNITS
from dearig.recording.reading.follow import Follower
from dearig.recording.verify import verify
from dearig.sim_backend.factory import open_simulated_rig
from tests.drivers.daqmx.test_rig import Bench
from tests.tools.command import dearig, done
from tests.tools.recordings import Clock

FORCE = {
    "name": "load_cell",
    "label": "Load cell",
    "terminal": "ai4",
    "unit": "N",
    "unit_per_V": 5.0,
    "value_at_0_V": 1.0,
    "delay_ms": 2.0,
    "simulated_value": 1.96,
    "simulated_noise": 0.01,
}
TRIGGER = {
    "name": "camera",
    "terminal": "ai13",
    "wiring": "RSE",
    "range_V": 5.0,
    "unit": "V",
    "unit_per_V": -1.0,
    "simulated_value": 3.3,
}
TOML = """
[film]
name = "film 3"
[[channel]]
name = "load_cell"
label = "Load cell"
terminal = "ai4"
unit = "N"
unit_per_V = 5.0
value_at_0_V = 1.0
simulated_value = 1.96
simulated_noise = 0.01
{limit}
[[channel]]
name = "camera"
terminal = "ai5"
unit = "V"
unit_per_V = 1.0
simulated_value = 3.3
"""
SEQUENCE = """
name = "step"
lead_in_s = 0.5
tail_s = 0.1
[[segment]]
kind = "half_sine"
amplitude_kV = 6.0
frequency_Hz = 2.0
"""


def rig_file(*channels: dict, **tables: dict) -> RigFile:
    return RigFile.model_validate({"channel": list(channels), **tables})


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of the simulated rig with two declared channels, as the command records it."""
    folder = tmp_path_factory.mktemp("declared")
    (folder / "rig.toml").write_text(TOML.format(limit=""), encoding="utf-8")
    (folder / "step.toml").write_text(SEQUENCE, encoding="utf-8")
    done("record", folder / "step.toml", "--rig", "sim", "--rig-file", folder / "rig.toml",
         "--out", folder / "run.h5")  # fmt: skip
    return folder


# ---------------------------------------------------------------- the rigs


def test_names_of_recordings_are_reserved():
    assert set(UNITS) <= set(RESERVED_NAMES)


def test_simulated_rig_delivers_them_after_the_others():
    settings = rig_file(FORCE, TRIGGER, thermometer={})
    rig = open_simulated_rig("sim", settings, THESIS_FILM, THESIS_LOAD)
    names = [channel.name for channel in rig.identify().channels]
    assert names[-3:] == ["temperature", "load_cell", "camera"]
    record = play(rig, lobes())
    force = record.physical(rig, "load_cell")
    assert force.mean() == pytest.approx(1.96, abs=0.02)
    assert 0.005 < force.std() < 0.02
    np.testing.assert_allclose(record.physical(rig, "camera"), 3.3, atol=5e-3)
    channel = rig.identify().channels[-2]
    assert (channel.unit, channel.label, channel.delay) == ("N", "Load cell", 2e-3)


def test_other_channels_read_the_same_beside_them():
    records = []
    for settings in (rig_file(), rig_file(FORCE)):
        rig = open_simulated_rig("sim", settings, THESIS_FILM, THESIS_LOAD, seed=3)
        records.append(play(rig, lobes()).counts[:4])
    np.testing.assert_array_equal(*records)


def test_card_delivers_what_is_at_the_declared_terminals():
    with Bench(rig_file(FORCE, TRIGGER)) as bench:
        record = play(bench.rig, lobes())
        assert record.physical(bench.rig, "load_cell").mean() == pytest.approx(1.96, abs=0.02)
        np.testing.assert_allclose(record.physical(bench.rig, "camera"), 3.3, atol=5e-3)
        skews = [channel.skew for channel in bench.rig.identify().channels[1:]]
        np.testing.assert_allclose(np.diff(skews), 10e-6, rtol=1e-6)


# ---------------------------------------------------------------- the interlock


@pytest.mark.parametrize(
    ("limits", "value", "words"),
    [
        ({"limit_max": 3.0}, 4.0, "Load cell read 4 N, 3 N or less is allowed"),
        ({"limit_min": 0.5}, 0.0, "N, 0.5 N or more is allowed"),
        ({"limit_min": 0.5, "limit_max": 3.0}, 60.0, "0.5 to 3 N is allowed"),
        ({"limit_max": 3.0}, 2.9, ""),
        ({}, 60.0, ""),
    ],
)
@pytest.mark.parametrize("cut", [100, 7])
def test_limits_trip_after_their_debounce(limits, value, words, cut):
    settings = rig_file({**FORCE, **limits, "limit_action": "at once"})
    step = 10.0 / 32768
    channels = settings.channels(dict.fromkeys(settings.channel_names, (0.0, step)))
    shown = {"displacement": np.full(100, 6.4e-3), "load_cell": np.full(100, 1.96)}
    shown["load_cell"][40:] = value
    counts = np.stack([c.scaling.counts(shown.get(c.name, np.zeros(100))) for c in channels])
    watch = Interlocks(settings, channels, 1000.0, None)
    trips = [
        trip
        for first in range(0, 100, cut)
        for trip in watch.watch(Block(first, counts[:, first : first + cut]))
    ]
    if not words:
        assert not trips
        return
    (trip,) = trips
    assert (trip.interlock, trip.action, trip.sample) == ("channel load_cell", "at once", 44)
    assert words in trip.message


def test_a_plan_does_not_trip_what_it_says_nothing_of():
    settings = rig_file({**FORCE, "limit_min": 1.5})
    assert would_trip(settings, 1000.0, np.zeros(50), np.full(50, 1e-5)) == ()


def test_run_ends_where_a_declared_channel_leaves_its_limits(folder, tmp_path):
    (tmp_path / "rig.toml").write_text(TOML.format(limit="limit_max = 1.9"), encoding="utf-8")
    answer = dearig("record", folder / "step.toml", "--rig", "sim", "--rig-file",
                    tmp_path / "rig.toml", "--out", tmp_path / "run.h5")  # fmt: skip
    assert answer.code == 3
    assert "Load cell read 1.9" in answer.err


# ---------------------------------------------------------------- the recording


def test_recording_holds_them_with_unit_and_label(folder):
    recording = open_recording(folder / "run.h5")
    assert recording.declared == {"load_cell": "Load cell", "camera": "camera"}
    assert (recording.unit("load_cell"), recording.unit("displacement")) == ("N", "m")
    assert recording.values["load_cell"].mean() == pytest.approx(1.96, abs=0.02)
    low = recording.overview("camera", 10).low
    np.testing.assert_allclose(low, 3.3, atol=5e-3)
    with h5py.File(folder / "run.h5") as file:
        stored = file["entry/data/load_cell"]
        assert stored.attrs["units"] == b"N"
        assert stored.attrs["long_name"] == b"Load cell (N)"
        assert file["entry/data/camera"].attrs["units"] == b"V"
    assert verify(folder / "run.h5").faults == []


def test_run_that_is_not_closed_can_be_followed_and_read(folder, tmp_path):
    raw = (folder / "run.h5").read_bytes()
    (tmp_path / "copy.h5").write_bytes(raw)
    with h5py.File(tmp_path / "copy.h5", "r+") as file:  # as before its end: counts alone
        entry = file["entry"]
        for name in [n for n in entry["data"] if not n.endswith("_counts")]:
            del entry["data"][name]
    recording = open_recording(tmp_path / "copy.h5")
    np.testing.assert_array_equal(
        recording.values["load_cell"], open_recording(folder / "run.h5").values["load_cell"]
    )
    news = Follower(tmp_path / "copy.h5").look()
    assert news.values["camera"].size == recording.samples


def test_info_shows_them(folder):
    recording = open_recording(folder / "run.h5")
    told = {c["name"]: c for c in describe(recording)["channels"]}
    assert told["load_cell"]["unit"] == "N"
    assert told["load_cell"]["label"] == "Load cell"
    rows = dict(describe_rows(recording))
    assert rows["Load cell"].endswith(" N")
    # both ends of a range have the digits of the larger one
    low, _, high = rows["voltage monitor"].removesuffix(" kV").partition(" to ")
    assert len(low.partition(".")[2]) == len(high.partition(".")[2]) == 3
    assert "Load cell" in done("info", folder / "run.h5").out


def test_notebooks_get_them_with_their_units(folder):
    pytest.importorskip("xarray")
    pytest.importorskip("pandas")
    recording = open_recording(folder / "run.h5")
    assert recording.to_xarray()["load_cell"].attrs == {"units": "N", "long_name": "Load cell"}
    assert recording.to_pandas().attrs["units"]["camera"] == "V"


@pytest.mark.parametrize("to", ["csv", "mat", "parquet"])
def test_exports_hold_them(folder, tmp_path, to):
    recording = open_recording(folder / "run.h5")
    out = export_recording(folder / "run.h5", to, tmp_path / f"run.{to}")
    if to == "csv":
        with out.open(encoding="utf-8", newline="") as stream:
            column = [float(row["load_cell_N"]) for row in csv.DictReader(stream)]
    elif to == "mat":
        column = loadmat(out)["load_cell_N"].ravel()
    else:
        table = parquet.read_table(out)
        assert table.schema.field("load_cell_N").metadata[b"units"] == b"N"
        column = table["load_cell_N"].to_numpy()
    np.testing.assert_array_equal(column, recording.values["load_cell"])
    import_file(out, tmp_path / "again.h5", now=Clock())
    again = open_recording(tmp_path / "again.h5")
    assert again.declared == recording.declared
    assert again.unit("camera") == "V"
    assert again.displacement_delay == recording.displacement_delay
    np.testing.assert_array_equal(again.values["load_cell"], recording.values["load_cell"])
    assert verify(tmp_path / "again.h5").faults == []


def test_check_reads_them_at_zero_volts(folder):
    said = done("check", "--rig", "sim", "--rig-file", folder / "rig.toml").out
    assert "Load cell" in said
    assert re.search(r"reading: 1\.9[56]\d* N", said)
