"""The room in a run: its readings in the file, its limits before and during the run."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from dearig.acquisition.check import check_rig
from dearig.acquisition.run import RunObserver, RunOptions, record
from dearig.config.rigfile import RigFile
from dearig.config.sequencefile import parse_sequence
from dearig.drivers.instruments.thermohygrometer import RoomReading
from dearig.drivers.settings import RoomSettings, ThermohygrometerSettings
from dearig.errors import InstrumentFault, SafetyStop
from dearig.recording.reading.reader import open_recording

SINE = """
name = "a slow sine"
[[segment]]
kind = "half_sine"
amplitude_kV = 2.0
frequency_Hz = 0.25
"""
SEQUENCE = parse_sequence(SINE, "sine.toml", Path())


def rig_file(room: dict | None = None, **sensor: object) -> RigFile:
    wanted = {"interval_s": 1.0, "stale_s": 2.0, **sensor}
    return RigFile(
        thermohygrometer=ThermohygrometerSettings(**wanted), room=RoomSettings(**(room or {}))
    )


class Shown(RunObserver):
    def __init__(self) -> None:
        self.readings: list[tuple[float, RoomReading]] = []

    def room(self, time: float, reading: RoomReading) -> None:
        self.readings.append((time, reading))


def test_every_run_has_its_readings(tmp_path: Path) -> None:
    shown = Shown()
    room = {"heating_K": 4.0, "heating_percent": 20.0, "heating_period_min": 0.2}
    record(SEQUENCE, "sim", rig_file(room), tmp_path / "run.h5", observer=shown)
    run = open_recording(tmp_path / "run.h5")
    assert run.environment is not None
    np.testing.assert_allclose(run.environment.time, np.arange(run.duration // 1.0 + 1), atol=2e-3)
    assert np.ptp(run.environment.relative_humidity_percent) > 2.0
    assert [r.humidity for _, r in shown.readings] == pytest.approx(
        run.environment.relative_humidity_percent
    )
    assert run.temperature_degC == pytest.approx(22.0, abs=2.5)
    assert any(i.role == "thermohygrometer" for i in run.instruments)


def test_another_run_finds_the_room_at_another_time(tmp_path: Path) -> None:
    file = rig_file({"daily_percent": 10.0, "start_h": 9.0, "hours_per_run": 6.0})
    means = []
    for seed in (0, 1):
        out = tmp_path / f"{seed}.h5"
        record(SEQUENCE, "sim", file, out, RunOptions(seed=seed))
        means.append(open_recording(out).relative_humidity_percent)
    assert means == pytest.approx([45.0, 35.0], abs=0.2)


def test_a_room_out_of_its_limits_starts_nothing(tmp_path: Path) -> None:
    file = rig_file(humidity_max_percent=40.0)
    with pytest.raises(SafetyStop, match=r"relative humidity was 4\S+ %, 40 % or less is allowed;"):
        record(SEQUENCE, "sim", file, tmp_path / "run.h5")
    assert not (tmp_path / "run.h5").exists()
    wrong = [f for f in check_rig("sim", file).wrong if f.instrument == "Vaisala HMP110"]
    assert [f.item for f in wrong] == ["reading"]


def test_a_room_that_leaves_its_limits_ends_the_run(tmp_path: Path) -> None:
    # the heating warms the room by 4 K in the last 4.8 s of each 12 s; the run begins at 9 h
    file = rig_file({"heating_K": 4.0, "heating_period_min": 0.2}, temperature_min_degC=23.0)
    with pytest.raises(SafetyStop, match=r"room's temperature was 22\S* °C, 23 °C or more"):
        record(SEQUENCE, "sim", file, tmp_path / "run.h5")
    run = open_recording(tmp_path / "run.h5")
    assert "interlock room temperature" in " ".join(e.message for e in run.events)
    assert run.voltage_command is not None
    assert run.voltage_command[-1] == 0.0


@pytest.mark.parametrize("on_loss", ["go on", "ramp"])
def test_a_sensor_that_is_lost_ends_the_run_only_by_choice(tmp_path: Path, on_loss: str) -> None:
    options = RunOptions(faults=["room-sensor-gone@0.5+3"])
    file = rig_file(on_loss=on_loss)
    if on_loss == "ramp":
        with pytest.raises(SafetyStop, match="gave no value for 2 s"):
            record(SEQUENCE, "sim", file, tmp_path / "run.h5", options)
    else:
        record(SEQUENCE, "sim", file, tmp_path / "run.h5", options)
    run = open_recording(tmp_path / "run.h5")
    assert run.environment is not None
    assert np.isnan(run.environment.temperature_degC).any()
    assert any("thermo-hygrometer: no value" in e.message for e in run.events)
    back = any("gives values again" in e.message for e in run.events)
    assert back == (on_loss == "go on")


def test_a_sensor_that_must_be_there_and_is_not_starts_nothing(tmp_path: Path) -> None:
    options = RunOptions(faults=["room-sensor-gone@0"])
    with pytest.raises(InstrumentFault, match="gave no value"):
        record(SEQUENCE, "sim", rig_file(on_loss="ramp"), tmp_path / "run.h5", options)
    assert not (tmp_path / "run.h5").exists()
