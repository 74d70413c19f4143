"""Runs whose rows are means: gate, interlocks and replay work on every conversion."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest

from dearig.acquisition import run as run_module
from dearig.acquisition.check import check_rig
from dearig.acquisition.overlay import Overlay, OverlayModel
from dearig.acquisition.plan import plan
from dearig.acquisition.rigs import kind_of, options_of
from dearig.acquisition.run import RunObserver, RunOptions, record
from dearig.config.rigfile import RigFile
from dearig.config.sequencefile import parse_sequence
from dearig.drivers.errors import RigError
from dearig.drivers.rig import Block
from dearig.drivers.row_means import RowMeans, row_channels
from dearig.drivers.settings import CardSettings, InterlockSettings
from dearig.errors import InputError, SafetyStop
from dearig.model.film.material import TABLE_3
from dearig.model.simulation.actuator import Actuator
from dearig.recording import open_recording
from dearig.sim_backend.card import Converters
from dearig.sim_backend.streams import Streams
from tests.acquisition.test_replay import counts, same
from tests.deep import mostly_deep
from tests.tools.command import LOBE, done, write
from tests.tools.daqmx import Served, served

LOADED = parse_sequence(LOBE, "lobe", Path())
N = 20
ROW_RATE = 200.0
QUICK = {"first_convert_us": 2.0, "convert_interval_us": 2.0}
FAST = RigFile(card=CardSettings(sample_rate_Hz=N * ROW_RATE, **QUICK))
AVERAGED = RigFile(card=CardSettings(sample_rate_Hz=ROW_RATE, average=N, **QUICK))


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """The same run as single conversions, and as means."""
    folder = tmp_path_factory.mktemp("runs")
    paths = folder / "fast.h5", folder / "averaged.h5"
    for path, rig_file in zip(paths, (FAST, AVERAGED), strict=True):
        record(LOADED, "sim", rig_file, path)
    return paths


def test_rows_are_the_sums_of_the_conversions_of_the_same_run(runs: tuple[Path, Path]) -> None:
    single, sums = (counts(path) for path in runs)
    for name, row in single.items():
        rows = row.size // N
        assert sums[name].size == rows
        expected = row[: rows * N].astype(np.int64).reshape(rows, N).sum(axis=1)
        np.testing.assert_array_equal(sums[name], expected)


def test_the_drive_is_computed_at_the_rate_of_conversions() -> None:
    fast, averaged = plan(LOADED, FAST), plan(LOADED, AVERAGED)
    assert averaged.rate == N * ROW_RATE
    assert averaged.rows == averaged.samples // N
    assert averaged.admitted().digest == fast.admitted().digest


@pytest.mark.parametrize("block", mostly_deep([1, 7, 333], [7]))
def test_blocks_that_cut_rows_change_nothing(
    runs: tuple[Path, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, block: int
) -> None:
    def opened(*args: object) -> object:
        rig = kind_of("sim").open("sim", AVERAGED, options_of(AVERAGED))
        rig._block_samples = block
        return rig

    monkeypatch.setattr(run_module, "open_rig", opened)
    result = record(LOADED, "sim", AVERAGED, tmp_path / "again.h5")
    assert (result.rate_Hz, result.samples) == (ROW_RATE, open_recording(runs[1]).samples)
    assert same(runs[1], tmp_path / "again.h5")


def test_a_current_in_one_conversion_trips_though_the_mean_is_small(tmp_path: Path) -> None:
    # the amplifier's limit flows for one conversion: 40 mA, and 2 mA in the mean of its row
    locks = InterlockSettings(current_debounce_ms=0.0)
    rig_file = AVERAGED.model_copy(update={"interlocks": locks})
    path, at = tmp_path / "run.h5", 0.9
    options = RunOptions(faults=[f"arc@{at}+{1.0 / (N * ROW_RATE)}"])
    with pytest.raises(SafetyStop, match=r"current monitor read 40\.00 mA.* at once to 0 V"):
        record(LOADED, "sim", rig_file, path, options)
    recording = open_recording(path)
    trip = next(e for e in recording.events if e.message.startswith("interlock current"))
    assert trip.sample == pytest.approx(at * ROW_RATE, abs=1.0)
    assert recording.current_monitor is not None
    mean = np.abs(recording.current_monitor).max()
    assert mean < 0.2 * locks.current_max_mA * 1e-3


@pytest.mark.parametrize("fault", ["arc@0.9", "film-rupture@0.9", "monitor-wire-off@0.9"])
def test_interlocks_trip_as_early_as_without_averaging(tmp_path: Path, fault: str) -> None:
    trips = []
    for name, rig_file in (("fast", FAST), ("averaged", AVERAGED)):
        path = tmp_path / f"{name}.h5"
        with pytest.raises(SafetyStop):
            record(LOADED, "sim", rig_file, path, RunOptions(faults=[fault]))
        event = next(e for e in open_recording(path).events if e.message.startswith("interlock"))
        trips.append((event.message, event.time))
    (said, when), (said_averaged, when_averaged) = trips
    assert said_averaged == said
    assert when_averaged == pytest.approx(when, abs=1.0 / ROW_RATE)


def test_a_stopped_run_ends_with_whole_rows(tmp_path: Path) -> None:
    path = tmp_path / "run.h5"
    with pytest.raises(SafetyStop, match="ramped down"):
        record(LOADED, "sim", AVERAGED, path, RunOptions(faults=["sensor-stuck@0.5"]))
    recording = open_recording(path)
    assert recording.voltage_command is not None
    assert abs(recording.voltage_command[-1]) < 20.0
    assert recording.average == N


def test_a_sequence_shorter_than_a_row_is_refused(tmp_path: Path) -> None:
    toml = LOBE.replace("lead_in_s = 0.4", "lead_in_s = 0.0").replace("1.0", "100.0")
    toml = toml.replace("3.0", "0.1").replace("tail_s = 0.1", "tail_s = 0.0")
    card = CardSettings(sample_rate_Hz=1.0, average=10_000)
    with pytest.raises(InputError, match="shorter than one row"):
        record(parse_sequence(toml, "x", Path()), "sim", RigFile(card=card), tmp_path / "x.h5")


def test_a_replay_repeats_the_means(tmp_path: Path) -> None:
    first, again = tmp_path / "first.h5", tmp_path / "again.h5"
    rig = f"[card]\nsample_rate_Hz = 200.0\naverage = {N}\n"
    files = write(tmp_path / "lobe.toml", LOBE), write(tmp_path / "rig.toml", rig)
    done("record", files[0], "--rig", "sim", "--rig-file", files[1], "--out", first)
    done("record", "--like", first, "--rig", "sim", "--out", again)
    assert same(first, again)
    assert open_recording(again).average == N


class Seen(RunObserver):
    """Keeps what an observer is told."""

    def __init__(self) -> None:
        self.rows = 0
        self.rate = 0.0

    def started(self, planned: object, identity: object, rate: float) -> None:  # noqa: ARG002
        self.rate = rate

    def block(self, block: Block) -> None:
        assert block.start == self.rows
        assert block.counts.dtype == np.int32
        self.rows += block.counts.shape[1]


def test_observers_and_the_overlay_get_rows(tmp_path: Path) -> None:
    model = Actuator(AVERAGED.as_film(), AVERAGED.as_load(), TABLE_3)
    seen = Seen()
    path = tmp_path / "run.h5"
    record(LOADED, "sim", AVERAGED, path, overlay=OverlayModel("own", model), observer=seen)
    recording = open_recording(path)
    assert (seen.rows, seen.rate) == (recording.samples, ROW_RATE)
    assert recording.displacement is not None
    assert recording.displacement_model is not None
    left = recording.displacement - recording.displacement_model
    noise = recording.noise
    assert noise is not None
    assert np.sqrt(np.mean(left**2)) < 1.1 * noise.value


def test_an_overlay_of_means_does_not_depend_on_the_blocks(runs: tuple[Path, Path]) -> None:
    model = Actuator(AVERAGED.as_film(), AVERAGED.as_load(), TABLE_3)
    with h5py.File(runs[0]) as file:
        data = file["entry/data"]
        raw = np.array([data[f"{n}_counts"][()] for n in ("voltage_command", "displacement")])
    found = []
    channels = [c for c in open_recording(runs[0]).channels if c.name in data_names()]
    for length in (N, 37 * N, raw.shape[1]):
        rows = RowMeans(N)
        overlay = Overlay(model, row_channels(channels, N), ROW_RATE, average=N)
        starts = range(0, raw.shape[1], length)
        blocks = [rows.take(Block(at, raw[:, at : at + length])) for at in starts]
        found.append(np.concatenate([overlay.advance(block) for block in blocks]))
    for other in found[1:]:
        np.testing.assert_allclose(other, found[0], rtol=0.0, atol=5e-8)


def data_names() -> tuple[str, str]:
    return "voltage_command", "displacement"


def test_the_same_voltage_at_the_same_place_of_a_row(runs: tuple[Path, Path]) -> None:
    averaged, fast = open_recording(runs[1]), open_recording(runs[0])
    assert averaged.time[0] == pytest.approx(0.5 * (N - 1) / (N * ROW_RATE))
    assert replace(averaged.arrays.overview("time", 5, 0, 5)).time[0] == averaged.time[0]
    assert fast.voltage_command is not None
    assert averaged.voltage_command is not None
    between = np.interp(averaged.time, fast.time, fast.voltage_command)
    assert np.abs(averaged.voltage_command - between).max() < 0.5


def address_of(card: Served) -> str:
    return f"daqmx:Dev1@127.0.0.1:{card.server.port}"


@pytest.mark.deep
def test_a_card_plays_and_records_means(tmp_path: Path) -> None:
    card = CardSettings(sample_rate_Hz=ROW_RATE, average=N, i_have_no_watchdog=True, **QUICK)
    rig_file = AVERAGED.model_copy(
        update={"card": card, "film": AVERAGED.film.model_copy(update={"name": "A"})}
    )
    path = tmp_path / "run.h5"
    with served(rig_file) as server:
        result = record(LOADED, address_of(server), rig_file, path)
    recording = open_recording(path)
    assert (result.rate_Hz, recording.rate, recording.average) == (ROW_RATE, ROW_RATE, N)
    assert recording.samples == plan(LOADED, rig_file).rows
    assert recording.voltage_command is not None
    planned = plan(LOADED, rig_file).admitted().window()
    means = planned[: recording.samples * N].reshape(-1, N).mean(axis=1)
    assert np.abs(recording.voltage_command - means).max() < 0.3
    # the card has put out every conversion's step: rows that are held would be 5 V off
    assert recording.voltage_monitor is not None
    assert np.std(recording.voltage_monitor - means) < 1.0


def test_a_card_that_is_too_slow_for_the_conversions_is_found() -> None:
    card = CardSettings(
        sample_rate_Hz=10_000.0, average=40, first_convert_us=0.0, convert_interval_us=0.5,
        ai_rate_max_kHz=4000.0, ao_rate_max_kHz=4000.0, i_have_no_watchdog=True,
    )  # fmt: skip
    with served() as server:
        found = check_rig(address_of(server), RigFile(card=card)).findings
    (rate,) = [f for f in found if f.item == "card.sample_rate_Hz x card.average"]
    assert (rate.found, rate.verdict) == ("400000", "wrong")
    assert rate.advice == "lower one of them"


def test_the_simulated_card_refuses_a_rate_of_conversions_that_it_does_not_have() -> None:
    card = CardSettings(average=N, **QUICK)
    converters = Converters(RigFile(card=card), Streams((1,)))
    with pytest.raises(RigError, match=r"400000 Hz, card\.sample_rate_Hz times card\.average = 20"):
        converters.actual_rate(4e5)
