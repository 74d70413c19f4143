"""What a run leaves in its file, and when."""

from __future__ import annotations

import hashlib
from pathlib import Path

import h5py
import numpy as np
import pytest

from dearig.drivers.channels import Channel, Scaling
from dearig.drivers.rig import Block, Event, RigIdentity
from dearig.errors import DearigError, InputError, InstrumentFault
from dearig.model.film.material import THESIS_FILM, THESIS_LOAD, Film, Load
from dearig.recording import open_recording, recover
from dearig.recording.verify import verify
from dearig.recording.writing import writer as writer_module
from tests.tools.recordings import CHANNELS, IDENTITY, RATE, SEQUENCE, Clock, run_counts
from tests.tools.recordings import write_run as write
from tests.tools.recordings import writer as make


def said(item: h5py.HLObject, attribute: str) -> str:
    return item.attrs[attribute].decode()


def text(dataset: h5py.Dataset) -> str:
    return dataset.asstr()[()]


def test_the_layout_is_the_contract(tmp_path: Path) -> None:
    path = tmp_path / "run.h5"
    counts = write(path)
    with h5py.File(path, "r") as file:
        assert said(file, "format") == said(file["entry"], "format") == "dearig-recording/1"
        entry = file["entry"]
        assert said(entry, "NX_class") == "NXentry"
        assert said(entry, "default") == "data"
        assert said(entry, "kind") == "actuator"
        assert entry.attrs["complete"]
        assert entry.attrs["samples"] == 3000
        assert text(entry["title"]) == "two lobes"
        assert (
            text(entry["start_time"]) == text(entry["end_time"]) == "2027-01-15T08:00:00.000+00:00"
        )
        assert text(entry["sequence"]) == SEQUENCE

        data = entry["data"]
        assert said(data, "NX_class") == "NXdata"
        assert said(data, "signal") == "displacement"
        assert data.attrs["axes"].tolist() == [b"time"]
        units = {
            "time": "s",
            "displacement": "m",
            "voltage_command": "V",
            "voltage_monitor": "V",
            "current_monitor": "A",
        }
        assert {n: said(data[n], "units") for n in units} == units
        assert said(data["voltage_command"], "hold") == "zero-order"
        for row, channel in zip(counts, CHANNELS, strict=True):
            raw = data[f"{channel.name}_counts"]
            assert raw.dtype == np.int16
            np.testing.assert_array_equal(raw[()], row)
            assert entry[f"instrument/channels/{channel.name}"] == raw
            assert raw.attrs["skew_s"] == channel.skew
            assert raw.attrs["delay_s"] == channel.delay
            assert raw.attrs["delay_error_s"] == channel.delay_error
        monitor = data["voltage_monitor_counts"]
        assert tuple(monitor.attrs["coefficients"]) == CHANNELS[1].scaling.coefficients
        assert monitor.attrs["gain"] == 1000.0

        amplifier = entry["instrument/amplifier"]
        assert said(amplifier, "serial") == "1234"
        assert amplifier.attrs["settings"].tolist() == [b"gain", b"1000 V/V"]
        assert entry["sample/film/length"][()] == 0.075
        assert said(entry["sample/film/length"], "units") == "m"
        assert text(entry["sample/film/kinematics"]) == "constrained-width"
        assert entry["sample/load/mass"][()] == 0.2
        assert "rest_length" not in entry["sample/load"]
        assert text(entry["sample/name"]) == "film 3"

        event = entry["events"][0]
        assert (event["sample"], event["time"]) == (510, 0.51)
        assert (event["level"], event["message"]) == (b"warning", b"near the limit")

        made = entry["provenance"]
        configuration = text(made["configuration"])
        assert (
            said(made, "configuration_sha256") == hashlib.sha256(configuration.encode()).hexdigest()
        )
        assert made.attrs["seed"] == 7
        assert said(made, "operator") == "Ada"
        for name in ("host", "dearig_version", "git_revision", "python_version", "hdf5_version"):
            assert name in made.attrs


def test_physical_values_follow_from_the_counts(tmp_path: Path) -> None:
    counts = write(tmp_path / "run.h5")
    run = open_recording(tmp_path / "run.h5")
    for row, channel in zip(counts, CHANNELS, strict=True):
        expected = channel.scaling.physical(row)
        if channel.name == "displacement":
            rest = expected[:1000].mean()
            assert run.rest_reading == pytest.approx(rest, rel=1e-12)
            expected = expected - rest
        np.testing.assert_allclose(getattr(run, channel.name), expected, atol=1e-15)
    np.testing.assert_array_equal(run.time, np.arange(3000) / RATE)


def test_a_reader_gets_back_what_was_given(tmp_path: Path) -> None:
    write(tmp_path / "run.h5")
    run = open_recording(tmp_path / "run.h5")
    assert (run.kind, run.name, run.title) == ("actuator", "run", "two lobes")
    assert run.complete
    assert run.outcome == "finished"
    assert run.hold
    assert (run.film, run.load) == (THESIS_FILM, THESIS_LOAD)
    assert run.kinematics == "constrained-width"
    assert run.channels == CHANNELS
    assert run.instruments == IDENTITY.instruments
    assert (run.displacement_skew, run.displacement_delay) == (6e-6, 1e-3)
    assert run.displacement_delay_error == 1e-5
    assert run.sequence_toml == SEQUENCE
    assert run.provenance["rig"] == "sim:7"
    assert run.provenance["simulated"] is True
    assert run.temperature is None
    assert run.quiet.sum() == 1000
    # five counts of 4 mm/10 V each, with the rounding to whole ones
    assert run.noise_floor == pytest.approx(5 * 10 / 32768 * 4e-3, rel=0.1)
    assert run.events[0].message == "near the limit"
    assert len(run.sha256) == 64
    with pytest.raises(ValueError, match="read-only"):
        run.time[0] = 1.0


def test_a_nexus_viewer_shows_displacement_over_time(tmp_path: Path) -> None:
    silx_io = pytest.importorskip("silx.io")
    from silx.io import nxdata

    write(tmp_path / "run.h5")
    with silx_io.open(str(tmp_path / "run.h5")) as file:
        plot = nxdata.get_default(file)
        assert plot is not None
        assert plot.signal_ndim == 1
        assert plot.signal_name == "displacement from the loaded rest state (m)"
        assert plot.axes_names == ["time (s)"]
        assert plot.axes_dataset_names == ["time"]
        assert plot.axes[0].attrs["units"] == b"s"
        assert plot.signal.attrs["units"] == b"m"


def test_one_flush_of_the_file_in_a_quarter_of_a_second(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    clock = Clock()
    flushes: list[float] = []
    real = h5py.File.flush

    def flush(file: h5py.File) -> None:
        flushes.append(clock.moment)
        real(file)

    recorder = make(tmp_path / "run.h5", now=clock)
    started = clock.moment
    monkeypatch.setattr(h5py.File, "flush", flush)
    counts = run_counts(2000)
    flushed = []
    for i in range(100):
        recorder.append(Block(20 * i, counts[:, 20 * i : 20 * i + 20]))
        flushed.append(recorder.samples_flushed)
        clock.moment = started + (i + 1) * 0.0625
    assert np.diff(flushes).min() == 0.25
    assert np.diff(flushes).max() == 0.25
    assert flushed[3:6] == [0, 100, 100]
    recorder.close()
    assert recorder.samples_flushed == 2000


def test_a_clock_set_back_does_not_end_the_flushing(tmp_path: Path) -> None:
    clock = Clock()
    with make(tmp_path / "run.h5", now=clock) as recorder:
        clock.moment -= 3600.0
        recorder.append(Block(0, run_counts(100)))
        assert recorder.samples_flushed == 100


def test_nothing_to_write_is_not_flushed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    clock = Clock()
    with make(tmp_path / "run.h5", now=clock) as recorder:
        clock.moment += 1.0
        recorder.event(0, "info", "armed")
        with monkeypatch.context() as patch:
            patch.setattr(h5py.File, "flush", lambda _: pytest.fail("flushed twice"))
            recorder.event(1, "info", "started")


def test_what_is_refused_touches_nothing(tmp_path: Path) -> None:
    path = tmp_path / "run.h5"
    path.write_bytes(b"precious")
    with pytest.raises(InputError, match=r"run\.h5 exists already"):
        make(path)
    assert path.read_bytes() == b"precious"
    with pytest.raises(InputError, match="there is no folder"):
        make(tmp_path / "nowhere" / "run.h5")
    with pytest.raises(InputError, match="is a folder"):
        make(tmp_path, overwrite=True)
    with pytest.raises(InputError, match="the sequence is not TOML"):
        make(path, sequence_toml="[[", overwrite=True)
    assert path.read_bytes() == b"precious"
    assert [p.name for p in tmp_path.iterdir()] == ["run.h5"]
    with make(path, overwrite=True) as recorder:
        recorder.append(Block(0, run_counts(100)))
    assert open_recording(path).samples == 100


@pytest.mark.parametrize(
    ("channels", "match"),
    [
        (CHANNELS[:3], "a channel displacement"),
        (CHANNELS[1:], "a channel voltage_command"),
        ((*CHANNELS, CHANNELS[0]), "the same name"),
        ((*CHANNELS, Channel("stretch", "1", Scaling((0.0, 1.0), 1.0))), "'stretch'"),
        ((Channel("humidity", "%", Scaling((0.0, 1.0), 1.0)), *CHANNELS), "then others"),
        ((CHANNELS[1], CHANNELS[0], *CHANNELS[2:]), "channels come as voltage_command"),
        (
            (*CHANNELS[:3], Channel("displacement", "mm", Scaling((0.0, 1.0), 1.0))),
            "displacement is in 'mm', not in m",
        ),
    ],
)
def test_channels_it_cannot_record(
    tmp_path: Path, channels: tuple[Channel, ...], match: str
) -> None:
    identity = RigIdentity("sim", True, (), channels)
    with pytest.raises(ValueError, match=match):
        make(tmp_path / "run.h5", identity=identity)
    assert not list(tmp_path.iterdir())


def test_what_is_no_block_is_not_written(tmp_path: Path) -> None:
    recorder = make(tmp_path / "run.h5")
    recorder.append(Block(0, run_counts(100)))
    with pytest.raises(ValueError, match="starts at sample 150, not at 100"):
        recorder.append(Block(150, run_counts(100)))
    with pytest.raises(ValueError, match=r"counts \(4, n\), not float64"):
        recorder.append(Block(100, np.zeros((4, 10))))
    with pytest.raises(ValueError, match="from the first block to the last"):
        recorder.append(Block(100, run_counts(100)), np.zeros(100))
    recorder.close()
    assert open_recording(recorder.path).samples == 100


def test_a_run_that_fails_keeps_what_it_had(tmp_path: Path) -> None:
    path = tmp_path / "run.h5"

    def fail() -> None:
        with make(path) as recorder:
            recorder.append(Block(0, run_counts(1500)))
            recorder.event(1500, "fault", "amplifier tripped")
            raise InstrumentFault("amplifier tripped")

    with pytest.raises(InstrumentFault):
        fail()
    run = open_recording(path)
    assert run.outcome == "ended early: amplifier tripped"
    assert (run.samples, run.samples_expected) == (1500, 3000)
    assert (run.events[0].level, run.events[0].time) == ("fault", 1.5)


def test_a_run_that_fails_before_its_first_sample_leaves_no_file(tmp_path: Path) -> None:
    with pytest.raises(KeyboardInterrupt), make(tmp_path / "run.h5"):
        raise KeyboardInterrupt
    assert not list(tmp_path.iterdir())


def test_a_full_disk_at_the_end_leaves_the_counts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "run.h5"
    counts = run_counts()
    recorder = make(path)
    recorder.append(Block(0, counts))

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("dearig.recording.writing.finish._write_physical", full)
    with pytest.raises(DearigError, match=r"No space left.*in the file, as counts"):
        recorder.close()
    assert [p.name for p in tmp_path.iterdir()] == ["run.h5"]
    run = open_recording(path)
    assert not run.complete
    np.testing.assert_array_equal(run.voltage_command, CHANNELS[0].scaling.physical(counts[0]))


def test_messages_of_any_length_and_script(tmp_path: Path) -> None:
    path = tmp_path / "run.h5"
    with make(path) as recorder:
        recorder.append(Block(0, run_counts(100)))
        recorder.event(3, "info", "Über 8 kV \N{GREEK SMALL LETTER LAMDA} = 1.2")
        recorder.event(4, "info", "\N{GREEK SMALL LETTER LAMDA}" * 400)
        with pytest.raises(ValueError, match="'error' is not one of info, warning, fault"):
            recorder.event(5, "error", "")
    first, second = open_recording(path).events
    assert first.message == "Über 8 kV \N{GREEK SMALL LETTER LAMDA} = 1.2"
    assert second.message.endswith("\N{GREEK SMALL LETTER LAMDA}...")


@pytest.mark.parametrize("long", [False, True])
def test_the_overlay_and_its_parameters(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, long: bool
) -> None:
    if long:
        monkeypatch.setattr("dearig.recording.writing.finish.PHYSICAL_MAX", 50)
    path = tmp_path / "run.h5"
    overlay = np.linspace(0.0, 1e-3, 100)
    overlay[:10] = np.nan
    recorder = make(path, overlay=True, model_toml="mu = 1\n")
    recorder.append(Block(0, run_counts(100)[:, :60]), overlay[:60])
    with pytest.raises(ValueError, match="from the first block to the last"):
        recorder.append(Block(60, run_counts(100)[:, 60:]))
    recorder.append(Block(60, run_counts(100)[:, 60:]), overlay[60:])
    recorder.close("stopped by the operator")
    recorder.close()
    assert verify(path).sound
    run = open_recording(path)
    np.testing.assert_allclose(run.displacement_model, overlay, rtol=1e-6)
    assert run.displacement is not None
    assert run.unit("displacement_model") == "m"
    assert run.model_toml == "mu = 1\n"
    assert run.outcome == "stopped by the operator"


def test_the_overlay_of_a_run_that_was_killed(tmp_path: Path) -> None:
    path, copy = tmp_path / "run.h5", tmp_path / "copy.h5"
    recorder = make(path, overlay=True, model_toml="mu = 1\n")
    recorder.append(Block(0, run_counts(100)), np.full(100, 1e-3))
    recorder._flush_all(1.8e9)
    copy.write_bytes(path.read_bytes())
    recorder.close()
    assert open_recording(copy).samples == 100
    assert recover(copy, now=lambda: 4e9)
    assert verify(copy).sound
    np.testing.assert_allclose(open_recording(copy).displacement_model, 1e-3, rtol=1e-6)


def test_a_run_without_a_lead_in_counts_from_its_first_reading(tmp_path: Path) -> None:
    counts = run_counts(200, quiet=0)
    counts[0, 0] = 100
    write(tmp_path / "run.h5", counts)
    run = open_recording(tmp_path / "run.h5")
    assert run.displacement is not None
    assert run.displacement[0] == 0.0
    assert run.noise_floor is None


def test_temperature_in_kelvin_is_recorded_in_celsius(tmp_path: Path) -> None:
    thermometer = Channel("temperature", "K", Scaling((0.0, 0.01), 1.0, 273.15))
    identity = RigIdentity("sim", True, (), (*CHANNELS, thermometer))
    with make(tmp_path / "run.h5", identity=identity) as recorder:
        counts = np.vstack([run_counts(100), np.full(100, 2150, dtype=np.int16)])
        recorder.append(Block(0, counts))
    temperature = open_recording(tmp_path / "run.h5").temperature
    assert temperature is not None
    np.testing.assert_allclose(temperature, 21.5)


def test_other_films_and_loads_come_back(tmp_path: Path) -> None:
    film = Film(0.08, 0.022, 0.001, 3.2, 960.0, "uniaxial")
    load = Load(0.15, rest_length=0.09)
    with make(tmp_path / "run.h5", film=film, load=load) as recorder:
        recorder.append(Block(0, run_counts(100), (Event(0, "info", "go"),)))
    run = open_recording(tmp_path / "run.h5")
    assert (run.film, run.load, run.kinematics) == (film, load, "uniaxial")


def test_flushes_are_due_four_times_a_second() -> None:
    assert writer_module.FLUSH_INTERVAL == 0.25


def test_a_finished_run_takes_at_most_twice_the_bytes_of_its_counts(tmp_path: Path) -> None:
    counts = run_counts(60_000)
    write(tmp_path / "run.h5", counts, block=10_000)
    assert (tmp_path / "run.h5").stat().st_size <= 2 * counts.nbytes


def test_values_are_those_of_the_scaling_to_the_last_bit(tmp_path: Path) -> None:
    counts = write(tmp_path / "run.h5")
    with h5py.File(tmp_path / "run.h5", "r") as file:
        data = file["entry/data"]
        for channel, row in zip(CHANNELS, counts, strict=True):
            rest = data[channel.name].attrs.get("rest_reading", 0.0)
            expected = channel.scaling.physical(row) - rest
            assert data[channel.name][()].tobytes() == expected.tobytes()
            assert (data[f"{channel.name}_counts"][()] == row).all()
        assert data["time"][()].tobytes() == (np.arange(3000) / RATE).tobytes()
