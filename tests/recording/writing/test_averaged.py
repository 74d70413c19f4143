"""Recordings whose rows are means of several conversions, and everything that reads them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest

from dearig.drivers.rig import Block
from dearig.drivers.row_means import RowMeans, row_channels
from dearig.errors import InputError
from dearig.recording import EXPORTS, export_recording, import_file, open_recording, recover
from dearig.recording.reading.summary import describe, describe_rows
from dearig.recording.verify import verify
from dearig.recording.writing.disk_space import estimate_bytes
from tests.tools.recordings import CHANNELS, IDENTITY, RATE, run_counts, write_run, writer

N = 8
ROWS = 2500


@pytest.fixture(scope="module")
def conversions() -> np.ndarray:
    return run_counts(N * ROWS, quiet=N * 500)


def write(path: Path, conversions: np.ndarray, *, closes: bool = True) -> Path:
    """Record ``conversions`` in rows of N; without ``closes`` the run is killed at the end."""
    rows = RowMeans(N)
    identity = replace(IDENTITY, channels=row_channels(CHANNELS, N))
    recorder = writer(path, identity=identity, average=N, samples_expected=ROWS)
    for at in range(0, conversions.shape[1], 1111):
        recorder.append(rows.take(Block(at, conversions[:, at : at + 1111])))
    if closes:
        recorder.close()
    else:
        recorder._flush_all(1.8e9)
        content = path.read_bytes()
        recorder.discard()
        path.write_bytes(content)
    return path


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory, conversions: np.ndarray) -> Path:
    return write(tmp_path_factory.mktemp("averaged") / "run.h5", conversions)


def test_counts_are_exact_sums_that_the_stored_scaling_divides(
    run: Path, conversions: np.ndarray
) -> None:
    with h5py.File(run) as file:
        data = file["entry/data"]
        assert (data.attrs["average"], data.attrs["rate_Hz"]) == (N, RATE)
        assert data.attrs["conversion_rate_Hz"] == N * RATE
        for row, channel in zip(conversions, CHANNELS, strict=True):
            counts = data[f"{channel.name}_counts"]
            assert counts.dtype == np.int32
            mean = row.astype(float).reshape(ROWS, N).mean(axis=1)
            np.testing.assert_array_equal(counts[()], N * mean)
            # what a reader does that knows nothing of averaging
            volts = np.polynomial.polynomial.polyval(counts[()], counts.attrs["coefficients"])
            values = counts.attrs["offset"] + counts.attrs["gain"] * volts
            assert values == pytest.approx(channel.scaling.physical(mean), rel=1e-12)
            stored = data[channel.name][()]
            rest = values[:500].mean() if channel.name == "displacement" else 0.0
            np.testing.assert_allclose(stored, values - rest, rtol=0.0, atol=1e-12)


def test_the_time_of_a_row_is_the_mean_of_its_ticks(run: Path) -> None:
    recording = open_recording(run)
    ticks = np.arange(N * ROWS) / (N * RATE)
    np.testing.assert_allclose(recording.time, ticks.reshape(ROWS, N).mean(axis=1), rtol=1e-13)
    overview = recording.overview("time", ROWS)
    np.testing.assert_allclose(overview.time, recording.time, rtol=1e-13)
    seen = recording.overview("displacement", 10).time
    np.testing.assert_allclose(seen[0], recording.time[0], rtol=1e-13)


def test_a_recording_says_how_many_conversions_a_row_is(run: Path) -> None:
    recording = open_recording(run)
    assert (recording.average, recording.rate, recording.hold) == (N, RATE, False)
    assert describe(recording)["average"] == N
    assert ("row", f"mean of {N} conversions") in describe_rows(recording)
    # a count of the converter, not of the sum
    assert recording.voltage_step == pytest.approx(1000.0 * 10.0 / 32768)


def test_it_passes_verification(run: Path) -> None:
    found = verify(run)
    assert (found.faults, found.notes) == ([], [])


def test_minima_and_maxima_are_those_of_the_rows(run: Path) -> None:
    recording = open_recording(run)
    seen, values = recording.overview("voltage_command", 20), recording.voltage_command
    assert values is not None
    assert (seen.low.min(), seen.high.max()) == pytest.approx((values.min(), values.max()))


@pytest.mark.parametrize("to", sorted(EXPORTS))
def test_an_export_that_is_imported_again_keeps_the_number(
    run: Path, tmp_path: Path, to: str
) -> None:
    out = export_recording(run, to, tmp_path / f"run.{to}")
    again = tmp_path / "again.h5"
    import_file(out, again)
    first, second = open_recording(run), open_recording(again)
    assert second.average == N
    assert not second.hold
    np.testing.assert_array_equal(first.time, second.time)
    with h5py.File(again) as file:
        assert file["entry/data"].attrs["average"] == N


def test_a_csv_export_without_averaging_has_no_further_column(tmp_path: Path) -> None:
    write_run(tmp_path / "run.h5")
    out = export_recording(tmp_path / "run.h5", "csv")
    assert "conversions_per_row" not in out.read_text().partition("\n")[0]


@pytest.mark.parametrize("bad", ["8,8,7", "0,0,0", "2.5,2.5,2.5"])
def test_an_imported_number_of_conversions_is_one_whole_number(tmp_path: Path, bad: str) -> None:
    rows = "".join(f"{i},{i},{i * i},{n}\n" for i, n in enumerate(bad.split(",")))
    table = tmp_path / "x.csv"
    table.write_text(f"time_s,voltage_V,displacement_um,conversions_per_row\n{rows}")
    with pytest.raises(InputError, match="conversions_per_row must hold one whole number"):
        import_file(table, tmp_path / "x.h5")


def test_a_run_that_was_killed_is_recovered_in_means(
    tmp_path: Path, run: Path, conversions: np.ndarray
) -> None:
    killed = write(tmp_path / "killed.h5", conversions, closes=False)
    assert open_recording(killed).average == N
    recover(killed)
    whole, rescued = open_recording(run), open_recording(killed)
    assert (rescued.average, rescued.hold) == (N, False)
    for name in ("time", "displacement", "current_monitor"):
        np.testing.assert_array_equal(whole.values[name], rescued.values[name])
    assert verify(killed).faults == []


def test_a_file_that_goes_on_in_another_one_keeps_the_number(
    tmp_path: Path, conversions: np.ndarray
) -> None:
    identity = replace(IDENTITY, channels=row_channels(CHANNELS, N))
    recorder = writer(tmp_path / "run.h5", identity=identity, average=N)
    block = RowMeans(N).take(Block(0, conversions))
    recorder.append(block)
    with recorder.continued(ROWS) as more:
        more.append(Block(ROWS, block.counts))
    recorder.close()
    assert open_recording(more.path).average == N


def test_the_layout_without_averaging_is_as_before(tmp_path: Path) -> None:
    write_run(tmp_path / "run.h5")
    with h5py.File(tmp_path / "run.h5") as file:
        data = file["entry/data"]
        assert not {"average", "conversion_rate_Hz"} & set(data.attrs)
        assert data["displacement_counts"].dtype == np.int16
        assert file["entry/pyramid/bins_of_64"].dtype == np.int16
        assert data["time"][0] == 0.0
    assert open_recording(tmp_path / "run.h5").average == 1


def test_a_writer_refuses_counts_of_the_other_kind(tmp_path: Path) -> None:
    recorder = writer(tmp_path / "run.h5", average=N)
    with pytest.raises(ValueError, match=r"holds int32 counts \(4, n\), not int16"):
        recorder.append(Block(0, run_counts(10)))
    recorder.discard()


@pytest.mark.parametrize("value", [0, -3, 2.5, "many"])
def test_a_number_that_is_none_is_refused(tmp_path: Path, value: object) -> None:
    path = tmp_path / "run.h5"
    write_run(path)
    with h5py.File(path, "r+") as file:
        file["entry/data"].attrs["average"] = value
    with pytest.raises(InputError, match=r"average of /entry/data is .* not a whole number"):
        open_recording(path)


def test_a_file_of_means_is_as_large_as_estimated(run: Path) -> None:
    size = run.stat().st_size
    assert size <= estimate_bytes(len(CHANNELS), RATE, ROWS, N) <= 1.2 * size + 600_000
