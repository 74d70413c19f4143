"""Displacement from voltage and current, on currents whose stretch, noise and leakage are known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dearig.model.circuit import loop
from dearig.model.coefficients import LENGTH
from dearig.model.errors import ModelError
from dearig.model.film.material import TABLE_3, THESIS_FILM, THESIS_LOAD
from dearig.model.readings.channels import CURRENT, CURRENT_UNIT, ChannelRecord
from dearig.model.readings.sensing import sense_displacement
from dearig.model.simulation.actuator import Actuator, Drive, at_rest

STEP = 2e-3
TIME = np.arange(3500) * STEP
REST = 500  # rows before the voltage
NOISE = 4e-8  # A, of a row


def volts(peak: float) -> np.ndarray:
    return peak * np.sin(np.pi * np.clip(TIME - REST * STEP, 0.0, 6.0)) ** 2


def readings(
    model: Actuator, drive: Drive, seed: int, offset: float = 2e-7, leak: float = 0.0
) -> tuple[np.ndarray, ChannelRecord]:
    """True displacement in m, and the current that an amplifier reads with an offset and noise."""
    c = model.coefficients()
    _, rest = at_rest(c, drive)
    moved = 0.02 * (drive.voltage / 8e3) ** 2
    given = (drive.time, drive.voltage, drive.ends, drive.air)
    rows = loop.follow(c, *given, rest + moved, loop.ABOUT)
    noise = NOISE * np.random.default_rng(seed).standard_normal(TIME.size)
    values = rows[loop.INTO] + leak * drive.voltage + offset + noise
    return c[LENGTH] * moved, ChannelRecord(CURRENT, CURRENT_UNIT, values, NOISE, REST)


def thesis(thickness: float = THESIS_FILM.thickness, **effects: dict[str, float]) -> Actuator:
    film = replace(THESIS_FILM, thickness=thickness)
    given = tuple((name.replace("_", " "), tuple(v.items())) for name, v in effects.items())
    return Actuator(film, THESIS_LOAD, TABLE_3, given)


def test_the_standard_error_is_that_of_the_differences() -> None:
    model, drive = thesis(), Drive(TIME, volts(8e3))
    squares, shares = [], []
    for seed in range(30):
        true, current = readings(model, drive, seed, leak=2e-10)
        sensed = sense_displacement(model, drive, current, 1.0, 0.0)
        known = np.isfinite(sensed.displacement)
        z = (sensed.displacement - true)[known] / sensed.standard_error[known]
        squares.append(np.mean(z**2))
        shares.append(np.mean(np.abs(z) < 2.0))
    assert np.sqrt(np.mean(squares)) == pytest.approx(1.0, abs=0.15)
    assert np.mean(shares) == pytest.approx(0.954, abs=0.04)


def test_offset_and_conduction_are_taken_from_the_charge() -> None:
    model, drive = thesis(), Drive(TIME, volts(8e3))
    _, current = readings(model, drive, 3, offset=5e-7, leak=1e-9)
    sensed = sense_displacement(model, drive, current, 1.0, 0.01)
    assert sensed.offset == pytest.approx(5e-7, abs=5e-9)
    assert sensed.conductance == pytest.approx(1e-9, rel=0.02)
    assert sensed.anchors == 6
    # a common gain is a part of the stretch: 1 % of C is 0.5 % of it in a film of constant width
    at = int(np.nanargmin(sensed.noise_error))
    stretch = 1.18942 + sensed.displacement[at] / 0.075
    assert sensed.gain_error[at] == pytest.approx(0.005 * 0.075 * stretch, rel=1e-4)


def test_a_thinner_film_is_sensed_better_under_the_same_voltage() -> None:
    errors = []
    for thickness in (1e-3, 0.5e-3):
        model, drive = thesis(thickness), Drive(TIME, volts(3e3))
        heavier = replace(
            model, load=replace(THESIS_LOAD, mass=THESIS_LOAD.mass * thickness / 1e-3)
        )
        _, current = readings(heavier, drive, 5)
        errors.append(np.nanmin(sense_displacement(heavier, drive, current, 1.0, 0.0).noise_error))
    assert errors[1] == pytest.approx(0.5 * errors[0], rel=0.05)


def test_effects_of_the_model_on_the_charge_are_taken_into_account() -> None:
    model = thesis(electrode_resistance={"resistance": 4e7})
    drive = Drive(TIME, volts(8e3))
    true, current = readings(model, drive, 7)
    sensed = sense_displacement(model, drive, current, 1.0, 0.0)
    plain = sense_displacement(thesis(), drive, current, 1.0, 0.0)

    def z(found) -> float:
        known = np.isfinite(found.displacement)
        return np.sqrt(np.mean(((found.displacement - true) / found.noise_error)[known] ** 2))

    assert z(sensed) < 2.0 < 5.0 < z(plain)


def test_a_charge_of_another_film_gives_no_estimate() -> None:
    drive = Drive(TIME, volts(8e3))
    _, current = readings(thesis(), drive, 1)
    sensed = sense_displacement(
        replace(thesis(), film=replace(THESIS_FILM, permittivity=20.0)), drive, current, 1.0, 0.01
    )
    assert sensed.share == pytest.approx(4.7 / 20.0, rel=0.1)
    assert not np.isfinite(sensed.displacement).any()


def test_a_voltage_that_does_not_come_back_is_refused() -> None:
    model = thesis()
    _, current = readings(model, Drive(TIME, volts(8e3)), 1)
    with pytest.raises(ModelError, match="does not come back to 0 V"):
        sense_displacement(model, Drive(TIME, np.full(TIME.size, 5e3)), current, 1.0, 0.01)
    with pytest.raises(ModelError, match="there is no voltage"):
        sense_displacement(model, Drive(TIME, np.zeros(TIME.size)), current, 1.0, 0.01)
