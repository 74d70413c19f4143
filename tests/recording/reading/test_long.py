"""Recordings of any length: overviews and windows that read no more than they show."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np
import pytest

from dearig.drivers.rig import Block, Event
from dearig.recording import open_recording
from dearig.recording.content.metadata import RunMetadata
from dearig.recording.content.pyramid import BINS
from dearig.recording.reading.arrays import Arrays
from dearig.recording.reading.follow import Follower
from dearig.recording.reading.summary import describe
from dearig.recording.verify import verify
from dearig.recording.writing.save import save_recording
from tests.deep import mostly_deep
from tests.tools.recordings import RATE, Clock, run_counts, writer

N = 150_001


@pytest.fixture(scope="module")
def counts() -> np.ndarray:
    return run_counts(N, quiet=5000)


def record(path: Path, counts: np.ndarray) -> Path:
    """In blocks of any size, one of them of several bins and one of a single sample."""
    rng = np.random.default_rng(3)
    clock = Clock()
    with writer(path, samples_expected=counts.shape[1], now=clock) as recorder:
        start = 0
        for size in (1, 63, 70_000, *rng.integers(1, 9000, 200)):
            block = counts[:, start : start + size]
            if block.shape[1]:
                recorder.append(Block(start, block))
            start += block.shape[1]
            clock.moment += 0.1
    assert start == counts.shape[1]
    return path


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory, counts: np.ndarray) -> Path:
    return record(tmp_path_factory.mktemp("run") / "run.h5", counts)


@pytest.fixture(scope="module")
def long(tmp_path_factory: pytest.TempPathFactory, counts: np.ndarray) -> Path:
    """The same run, taken for one that is too long to have its physical values in the file."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("dearig.recording.writing.finish.PHYSICAL_MAX", 10_000)
        return record(tmp_path_factory.mktemp("long") / "run.h5", counts)


def test_the_stored_bins_are_those_of_the_counts(run: Path, counts: np.ndarray) -> None:
    with h5py.File(run) as file:
        for size in BINS:
            bins = file[f"entry/pyramid/bins_of_{size}"][()]
            full = N // size
            assert bins.shape == (full, 4, 2)
            cut = counts[:, : full * size].reshape(4, full, size)
            np.testing.assert_array_equal(bins[:, :, 0].T, cut.min(axis=2))
            np.testing.assert_array_equal(bins[:, :, 1].T, cut.max(axis=2))


@pytest.mark.parametrize("points", mostly_deep([1, 7, 500, 5000, 400_000], [1, 500, 400_000]))
@pytest.mark.parametrize("span", [(0, N), (12_345, 125_001), (149_000, N), (77, 78), (500, 4000)])
def test_an_overview_hides_nothing(run: Path, points: int, span: tuple[int, int]) -> None:
    recording = open_recording(run)
    start, stop = span
    for name in ("displacement", "voltage_command"):
        found = recording.overview(name, points, start, stop)
        there = recording.values[name][start:stop]
        assert found.time.shape == found.low.shape == found.high.shape
        assert 1 <= found.time.size <= points
        assert found.low.min() == there.min()
        assert found.high.max() == there.max()
        # every bin holds its own samples' extremes
        edges = np.searchsorted(recording.time[start:stop], found.time - 0.5 / RATE)
        np.testing.assert_array_equal(found.low, np.minimum.reduceat(there, edges))
        np.testing.assert_array_equal(found.high, np.maximum.reduceat(there, edges))


def test_a_window_is_a_part(run: Path, long: Path) -> None:
    whole = open_recording(run)
    for path in (run, long):
        part = open_recording(path)
        for name in whole.values:
            np.testing.assert_array_equal(
                part.window(name, 4990, 5010), whole.values[name][4990:5010]
            )
        assert part.window("time", N - 3, N + 50).size == 3
        with pytest.raises(ValueError, match="no channel 'force'; it has time, displacement"):
            part.window("force", 0, 1)
        with pytest.raises(ValueError, match="points = 0"):
            part.overview("displacement", 0)


def test_a_long_run_opens_without_its_samples(
    long: Path, monkeypatch: pytest.MonkeyPatch, run: Path
) -> None:
    expected = describe(open_recording(run))
    monkeypatch.setattr(Arrays, "read", lambda *_: pytest.fail("read it all"))
    recording = open_recording(long)
    assert recording.overview("displacement", 100).low.size == 100
    for fact in ("samples", "duration_s", "timing", "quiet_samples", "noise_floor_m", "channels"):
        assert describe(recording)[fact] == expected[fact]


def test_a_long_run_has_the_same_values(run: Path, long: Path) -> None:
    with h5py.File(long) as file:
        assert "displacement" not in file["entry/data"]
    first, second = open_recording(run), open_recording(long)
    assert first.values.keys() == second.values.keys()
    for name, values in first.values.items():
        np.testing.assert_array_equal(second.values[name], values)
    assert second.complete
    assert second.rest_reading == first.rest_reading
    assert verify(long).faults == []


def test_a_viewer_shows_the_envelope_of_a_long_run(long: Path) -> None:
    silx_io = pytest.importorskip("silx.io")
    from silx.io import nxdata

    recording = open_recording(long)
    with silx_io.open(str(long)) as file:
        plot = nxdata.get_default(file)
        assert plot.signal_name == "displacement from the loaded rest state (m)"
        assert plot.axes_names == ["time (s)"]
        assert plot.signal.shape == plot.axes[0].shape
        assert plot.signal[()].max() == recording.displacement.max()
        assert plot.signal[()].min() == recording.displacement.min()


def test_imported_data_have_overviews_too(tmp_path: Path) -> None:
    time = np.sort(np.random.default_rng(0).uniform(0.0, 10.0, 5000))
    values = {"time": time, "stretch": 1.0 + time, "nominal_stress": time**2}
    path = save_recording(tmp_path / "x.h5", "film", values, RunMetadata(title="x"), now=Clock())
    found = open_recording(path).overview("nominal_stress", 100)
    assert found.low.size == 100
    assert found.high.max() == values["nominal_stress"].max()
    assert (np.diff(found.time) > 0.0).all()


def test_the_computers_clock_stands_beside_the_sample_clock(run: Path) -> None:
    with h5py.File(run) as file:
        rows = file["entry/wall_clock"][()]
    assert rows["sample"][0] == 0
    assert rows["sample"][-1] == N
    assert (np.diff(rows["unix_time"]) >= 0.0).all()
    assert rows["unix_time"][0] == Clock().moment


def test_a_run_is_followed_while_it_goes_on(tmp_path: Path) -> None:
    path, copy = tmp_path / "run.h5", tmp_path / "copy.h5"
    counts = run_counts(5000, quiet=2000)
    clock = Clock()
    recorder = writer(path, samples_expected=5000, now=clock)
    follower = Follower(copy)
    seen: list[np.ndarray] = []
    messages: list[str] = []
    ended = []
    for i in range(10):
        clock.moment += 0.3
        events = (Event(500 * i, "info", f"block {i}"),)
        recorder.append(Block(500 * i, counts[:, 500 * i : 500 * i + 500], events))
        # another process sees what this one has flushed
        copy.write_bytes(path.read_bytes())
        news = follower.look(most=400 if i == 2 else None)
        assert news.start == sum(s.size for s in seen)
        seen.append(news.values["voltage_command"])
        messages += [e.message for e in news.events]
        ended.append(news.ended)
    recorder.close()
    copy.write_bytes(path.read_bytes())
    last = follower.look()
    assert (last.values["time"].size, last.ended) == (0, True)
    assert not any(ended)
    assert [s.size for s in seen] == [500, 500, 400, 600, *[500] * 6]
    np.testing.assert_array_equal(np.concatenate(seen), open_recording(path).voltage_command)
    assert messages == [f"block {i}" for i in range(10)]
