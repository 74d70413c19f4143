"""What a screen sees of a run is what was recorded, whoever looks and however late."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dearig.acquisition.overlay import OverlayModel
from dearig.acquisition.plan import plan
from dearig.acquisition.run import record
from dearig.config.rigfile import RigFile
from dearig.config.sequencefile import parse_sequence
from dearig.drivers.channels import Channel, Scaling
from dearig.drivers.rig import Block, RigIdentity
from dearig.model.film.material import TABLE_3, THESIS_FILM, THESIS_LOAD
from dearig.model.simulation.actuator import Actuator, Drive
from dearig.recording import open_recording
from dearig.window.run import live as live_module
from dearig.window.run.live import Live
from tests.window.conftest import SHORT

THESIS = OverlayModel("thesis", Actuator(THESIS_FILM, THESIS_LOAD, TABLE_3))
LOADED = parse_sequence(SHORT, "short", Path())
RATE = 1000.0
SCALING = Scaling((0.0, 10.0 / 32768), 1000.0)
CHANNELS = (
    Channel("voltage_command", "V", SCALING),
    Channel("voltage_monitor", "V", SCALING),
    Channel("displacement", "m", Scaling((0.0, 10.0 / 32768), 4e-3)),
)


def started(*models: OverlayModel) -> tuple[Live, np.ndarray]:
    """A run that has begun, and its planned voltage."""
    planned = plan(LOADED, RigFile())
    live = Live(models)
    live.started(planned, RigIdentity("sim", True, (), CHANNELS), RATE)
    return live, planned.voltage.window(0, planned.samples)


def blocks(voltage: np.ndarray, size: int) -> list[Block]:
    rows = np.zeros((3, voltage.size), dtype=np.int16)
    rows[0] = rows[1] = SCALING.counts(voltage)
    rows[2] = 100
    return [Block(s, rows[:, s : s + size]) for s in range(0, voltage.size, size)]


def test_a_run_that_nobody_looked_at_is_all_there_afterwards(tmp_path: Path) -> None:
    live = Live([THESIS])
    result = record(LOADED, "sim", RigFile(), tmp_path / "run.h5", observer=live)
    live.close()
    recording = open_recording(result.path)
    now = live.now()
    assert now is not None
    assert (now.samples, now.total) == (result.samples, result.samples)
    for name, values, scale in (
        ("command", recording.voltage_command, 1.0),
        ("monitor", recording.voltage_monitor, 1.0),
        ("current", recording.current_monitor, 1.0),
    ):
        time, seen = live.view(name, 0.0, 10.0)
        np.testing.assert_allclose(time, recording.time, atol=1e-12)
        np.testing.assert_array_equal(seen, values * scale)
    _, moved = live.view("displacement", 0.0, 10.0)
    assert np.ptp(moved - recording.displacement) < 1e-6  # but for the rest, known a little later
    lag = recording.displacement_delay - recording.displacement_skew
    assert recording.voltage_command is not None
    model = THESIS.actuator.simulate(Drive(recording.time, recording.voltage_command, True), lag)
    _, followed = live.view("model 0", 0.0, 10.0)
    np.testing.assert_allclose(followed, model.displacement, atol=1e-8)
    rms = float(np.sqrt(np.mean((moved - followed) ** 2)))
    assert now.errors[0].rms == pytest.approx(rms, rel=1e-9)
    assert now.errors[0].nrmse_pct == pytest.approx(100.0 * rms / np.ptp(moved), rel=1e-9)


def test_a_model_that_comes_late_runs_through_what_it_has_missed() -> None:
    live, voltage = started()
    parts = blocks(voltage, 50)
    for part in parts[:7]:
        live.block(part)
    live.follow((THESIS,), "monitor")
    for part in parts[7:]:
        live.block(part)
    live.close()
    early, _ = started(THESIS)
    for part in parts:
        early.block(part)
    early.close()
    for name in ("model 0", "drawn 0", "residual 0", "rms 0"):
        np.testing.assert_array_equal(live.view(name, 0.0, 9.0), early.view(name, 0.0, 9.0))
    # A film that moves draws a current, of which conversions at one moment see a part.
    assert np.ptp(early.view("drawn 0", 0.0, 9.0)[1]) > 1e-8  # A


def test_a_run_too_long_to_be_kept_goes_on_with_the_models_that_it_has(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(live_module, "_KEPT_MAX", 300)
    live, voltage = started(THESIS)
    parts = blocks(voltage, 50)
    for part in parts[:7]:
        live.block(part)
    other = replace(THESIS, name="other")
    live.follow((other, THESIS), "command")
    for part in parts[7:]:
        live.block(part)
    live.close()
    early, _ = started(THESIS)
    for part in parts:
        early.block(part)
    early.close()
    for late, name in (
        ("model 1", "model 0"), ("rms 1", "rms 0"), ("command", "command"),
        ("displacement", "displacement"),
    ):  # fmt: skip
        np.testing.assert_array_equal(live.view(late, 0.0, 9.0), early.view(name, 0.0, 9.0))
    now = live.now()
    assert now is not None
    assert "too long to simulate another model" in now.words[0]
    assert now.words[1] == ""
    assert np.isnan(live.view("model 0", 0.0, 9.0)[1]).all()
    assert now.samples == voltage.size


def test_a_model_without_a_rest_state_is_said_and_the_others_go_on() -> None:
    limp = replace(TABLE_3, equilibrium=replace(TABLE_3.equilibrium, modulus=0.0))
    without_rest = replace(THESIS.actuator, network=limp)
    live, voltage = started(OverlayModel("limp", without_rest), THESIS)
    for part in blocks(voltage, 100):
        live.block(part)
    live.close()
    now = live.now()
    assert now is not None
    assert "no rest state" in now.words[0]
    assert now.words[1] == ""
    assert np.isnan(now.errors[0].rms)
    assert np.isfinite(now.errors[1].rms)


def test_before_a_run_there_is_nothing_to_see() -> None:
    live = Live()
    assert live.now() is None
    assert live.view("command", 0.0, 1.0)[0].size == 0
    live.close()
