"""A model stepped in time with a run is the model over the whole run."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dearig.acquisition import run
from dearig.acquisition.overlay import Overlay, OverlayModel
from dearig.config.rigfile import RigFile
from dearig.config.sequencefile import parse_sequence
from dearig.drivers.channels import Channel, Scaling
from dearig.drivers.rig import Block
from dearig.errors import InputError
from dearig.model.circuit import loop
from dearig.model.film.material import TABLE_3, THESIS_FILM, THESIS_LOAD
from dearig.model.simulation.actuator import Actuator, Drive, at_rest
from dearig.model.simulation.excitation import Lobes, Ramp, Sequence, Steps

RATE = 1000.0
SCALING = Scaling((0.0, 10.0 / 32768), 1000.0)
COMMAND = Channel("voltage_command", "V", SCALING)
MONITOR = Channel("voltage_monitor", "V", SCALING)
READING = Channel("displacement", "m", SCALING, skew=7e-5, delay=2e-3)
CHANNELS = (COMMAND, MONITOR, READING)
CURRENT = Channel("current_monitor", "A", SCALING, skew=2e-5)
THESIS = Actuator(THESIS_FILM, THESIS_LOAD, TABLE_3)
DRAG = replace(THESIS, effects=(("linear drag", (("drag", 300.0),)),))
LEAKY = replace(
    THESIS, effects=(("leakage", (("loss", 0.02), ("growth", 2.0), ("exponent", 0.75))),)
)
SLOW = replace(THESIS, effects=(("electrode resistance", (("resistance", 4e7),)),))
LATE = replace(THESIS, effects=(("sensor lag", (("time_constant", 0.01),)),))


def counts(voltage: np.ndarray) -> np.ndarray:
    rows = np.zeros((3, voltage.size), dtype=np.int16)
    rows[0] = SCALING.counts(voltage)
    rows[1] = SCALING.counts(0.9 * voltage)
    return rows


def driven() -> np.ndarray:
    sequence = Sequence(
        "s", (Lobes(periods=1), Steps((5e3, 8e3), 0.5), Ramp(0.0, 0.2)), lead_in=0.5, tail=0.5
    )
    return sequence.sample(RATE)[1]


def stepped(actuator: Actuator, rows: np.ndarray, cuts: list[int], **more: object) -> np.ndarray:
    overlay = Overlay(actuator, CHANNELS, RATE, **more)  # type: ignore[arg-type]
    parts, start = [], 0
    for part in np.split(rows, cuts, axis=1):
        parts.append(overlay.advance(Block(start, part)))
        start += part.shape[1]
    assert overlay.failure == ""
    return np.concatenate(parts)


@pytest.mark.parametrize("cuts", [[], list(range(100, 13_000, 100)), [1, 2, 3, 777, 5000]])
@pytest.mark.parametrize("drive", ["command", "monitor"])
@pytest.mark.parametrize("actuator", [THESIS, DRAG, LATE], ids=["plain", "drag", "late"])
def test_blocks_of_any_length_are_the_whole_record(
    cuts: list[int], drive: str, actuator: Actuator
) -> None:
    rows = counts(driven())
    volts = SCALING.physical(rows[0 if drive == "command" else 1])
    lag = READING.delay - READING.skew
    time = np.arange(volts.size) / RATE
    whole = actuator.simulate(Drive(time, volts, hold=True), lag).displacement
    found = stepped(actuator, rows, [c for c in cuts if c < volts.size], drive=drive)
    assert np.max(np.abs(found - whole)) < 3e-8  # m, on 1.6 mm
    assert np.ptp(whole) > 1e-3


@pytest.mark.parametrize("average", [1, 5])
@pytest.mark.parametrize("actuator", [THESIS, LEAKY, SLOW], ids=["plain", "leaky", "slow"])
def test_the_current_of_blocks_is_that_of_the_whole_record(
    actuator: Actuator, average: int
) -> None:
    rows = counts(driven())
    into = CURRENT.skew if average == 1 else 0.0
    n = rows.shape[1]
    voltage = SCALING.physical(rows[0])
    drive = Drive(np.arange(n) / RATE, voltage, hold=average == 1)
    stretch = actuator.simulate(drive).stretch
    way = loop.AT if average == 1 else loop.ABOUT
    coefficients = actuator.coefficients()
    at_rest(coefficients)
    whole = loop.follow(
        coefficients, drive.time, voltage, drive.ends, drive.air, stretch, way, into
    )[loop.INTO]
    parts, start = [], 0
    overlay = Overlay(actuator, (*CHANNELS, CURRENT), RATE, average=average)
    for part in np.split(rows, [1, 2, 3, *range(100, n, 100)], axis=1):
        overlay.advance(Block(start, np.vstack([part, part[:1]])))
        parts.append(overlay.current)
        start += part.shape[1]
    found = np.concatenate(parts)
    largest = float(np.abs(whole).max())
    away = np.abs(found - whole)
    ends = np.zeros(n, dtype=bool)
    ends[[0, 1, 2, *range(99, n, 100), n - 1]] = True
    # what follows the end of a block is taken to go on as before; a step of the voltage does not
    assert away[~ends].max() < 1e-3 * largest
    assert np.median(away[ends]) < 1e-2 * largest


def test_two_overlays_owe_each_other_nothing() -> None:
    rows = counts(driven())
    soft = replace(THESIS, load=replace(THESIS_LOAD, mass=0.25))
    one, two = Overlay(THESIS, CHANNELS, RATE), Overlay(soft, CHANNELS, RATE)
    for start in range(0, 3000, 100):
        block = Block(start, rows[:, start : start + 100])
        first, second = one.advance(block), two.advance(block)
    alone = stepped(THESIS, rows[:, :3000], list(range(100, 3000, 100)))
    np.testing.assert_array_equal(first, alone[-100:])
    assert np.max(np.abs(first - second)) > 1e-5


def test_a_film_that_runs_away_ends_in_nan_with_a_word() -> None:
    overlay = Overlay(
        THESIS, (Channel("voltage_command", "V", replace(SCALING, gain=1e5)), READING), RATE
    )
    rows = np.zeros((2, 4000), dtype=np.int16)
    rows[0, 1000:] = 32767
    found = overlay.advance(Block(0, rows))
    assert np.isfinite(found[:1000]).all()
    assert np.isnan(found[-1])
    assert "pull-in" in overlay.failure
    assert np.isnan(overlay.advance(Block(4000, rows))).all()


def test_a_block_that_is_missing_is_refused() -> None:
    overlay = Overlay(THESIS, CHANNELS, RATE)
    with pytest.raises(ValueError, match="starts at sample 100, not at 0"):
        overlay.advance(Block(100, counts(np.zeros(10))))


def test_a_drive_that_was_not_recorded_is_refused() -> None:
    with pytest.raises(ValueError, match="the channels are voltage_command, displacement"):
        Overlay(THESIS, (COMMAND, READING), RATE, "monitor")


def test_a_thermometer_counts_from_the_first_second() -> None:
    warm = replace(THESIS, effects=(("temperature", (("stiffening", 0.02),)),))
    kelvin = Channel("temperature", "K", Scaling((0.0, 10.0 / 32768), 10.0, 273.15))
    channels = (COMMAND, READING, kelvin)
    rows = np.zeros((3, 6000), dtype=np.int16)
    rows[0, 500:] = SCALING.counts(np.array([6e3]))
    rows[2] = kelvin.scaling.counts(np.where(np.arange(6000) < 2000, 295.0, 305.0))
    blocks = [Block(s, rows[:, s : s + 100]) for s in range(0, 6000, 100)]
    warmed, steady = Overlay(warm, channels, RATE), Overlay(THESIS, channels, RATE)
    difference = [warmed.advance(b) - steady.advance(b) for b in blocks]
    assert np.max(np.abs(np.concatenate(difference[:20]))) < 1e-7
    assert np.max(np.abs(difference[-1])) > 1e-5


def test_an_overlay_model_is_compiled_before_an_instrument_is_touched(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    done: list[str] = []
    advance = Overlay.advance

    def advanced(overlay: Overlay, block: Block) -> np.ndarray:
        done.append("advanced")
        return advance(overlay, block)

    def opened(*_: object) -> None:
        done.append("opened")
        raise InputError("no further")

    monkeypatch.setattr(Overlay, "advance", advanced)
    monkeypatch.setattr(run, "open_rig", opened)
    text = 'name = "x"\n[[segment]]\nkind = "hold"\nvoltage_kV = 0.0\nduration_s = 1.0\n'
    loaded = parse_sequence(text, "the sequence", Path())
    overlay = OverlayModel("x", THESIS)
    with pytest.raises(InputError, match="no further"):
        run.record(loaded, "sim", RigFile(), tmp_path / "run.h5", overlay=overlay)
    assert done == ["advanced", "advanced", "opened"]
