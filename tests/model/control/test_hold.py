"""The hold's controller: it settles, it is stable with a wrong model, and nothing winds it up."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from dearig.model.control import HoldController, HoldSettings, sensitivity_of
from dearig.model.errors import ModelError
from dearig.model.film.material import TABLE_3, THESIS_FILM, THESIS_LOAD
from dearig.model.simulation.actuator import Actuator
from dearig.model.simulation.stability import static_stretch

HOLD = HoldSettings(
    setpoint=0.5e-3, sensitivity=1e-3, period=0.1, delay=0.6, response=2.0, authority=0.1,
    rate_limit=0.01, resolution=0.3e-6,
)  # fmt: skip
ALL = np.ones(10, dtype=bool)
RIPPLE = 1e-6 * np.resize([1.0, -1.0], 10)  # noise without a mean


def blocks(displacement: float) -> np.ndarray:
    return displacement + RIPPLE


def closed_loop(
    hold: HoldSettings, *, sensitivity: float = 1e-3, off: float = -40e-6, steps: int = 600
) -> tuple[np.ndarray, np.ndarray]:
    """Errors and corrections of a film that answers at once, after the delay of the output."""
    controller = HoldController(hold)
    queue = deque([0.0] * round(hold.delay / hold.period))
    errors, asked = [], []
    for _ in range(steps):
        film = hold.setpoint + off + sensitivity * queue.popleft()
        answer = controller.answer(blocks(film), ALL)
        queue.append(answer.correction)
        errors.append(answer.error)
        asked.append(answer.correction)
    return np.array(errors), np.array(asked)


def test_an_error_falls_with_the_chosen_response_time() -> None:
    errors, asked = closed_loop(replace(HOLD, rate_limit=1.0))
    assert errors[0] == pytest.approx(40e-6)
    # SIMC: exp(-t/tau) after the delay, without a swing beyond a tenth
    at = round((HOLD.delay + HOLD.response) / HOLD.period)
    assert errors[at] == pytest.approx(40e-6 * math.exp(-1.0), rel=0.15)
    assert errors.min() > -4e-6
    assert abs(errors[-1]) < 1e-9
    assert asked[-1] == pytest.approx(0.04, rel=1e-3)


def test_the_gain_margin_is_where_it_becomes_unstable() -> None:
    assert HOLD.gain_margin == pytest.approx(0.5 * math.pi * 2.6 / 0.6)
    assert HOLD.phase_margin == pytest.approx(90.0 - math.degrees(0.6 / 2.6))
    free = replace(HOLD, rate_limit=100.0, authority=1e6)
    for part, stable in ((0.85, True), (1.25, False)):
        errors, _ = closed_loop(free, sensitivity=part * HOLD.gain_margin * 1e-3)
        assert bool(np.abs(errors[-50:]).max() < 1e-6) is stable


def test_it_does_not_wind_up_at_its_limits() -> None:
    controller = HoldController(HOLD)
    for _ in range(1000):  # far too long, for long
        answer = controller.answer(blocks(0.9e-3), ALL)
    assert answer.state == "limited"
    assert answer.correction == -HOLD.authority
    back = controller.answer(blocks(0.4e-3), ALL)
    assert back.correction > -HOLD.authority
    assert back.state == "holding"


@pytest.mark.parametrize(
    ("readings", "usable"),
    [
        (blocks(0.4e-3), ~ALL),
        (blocks(0.4e-3), np.arange(10) < 4),
        (np.full(10, 0.4e-3), ALL),  # its output is held
        (np.full(10, np.nan), ALL),
        (np.full(10, np.inf), ALL),
    ],
)
def test_readings_of_no_use_freeze_the_correction_and_are_counted(readings, usable) -> None:
    controller = HoldController(HOLD)
    before = controller.answer(blocks(0.45e-3), ALL).correction
    for i in range(1, 4):
        answer = controller.answer(readings, usable)
        assert (answer.state, answer.correction) == ("frozen", before)
        assert math.isnan(answer.error)
        assert controller.blind == pytest.approx(i * HOLD.period)
    assert controller.answer(blocks(0.45e-3), ALL).correction > before
    assert controller.blind == 0.0


def test_a_spike_counts_no_more_than_any_reading() -> None:
    readings = blocks(HOLD.setpoint)
    readings[3] = 5e-3
    assert abs(HoldController(HOLD).answer(readings, ALL).error) < 0.2e-6


@given(
    st.lists(
        st.tuples(
            arrays(float, 6, elements=st.floats(allow_nan=True, allow_infinity=True)),
            arrays(bool, 6),
        ),
        max_size=20,
    )
)
@settings(max_examples=25)
def test_whatever_is_measured_a_correction_is_within_its_limits(measured) -> None:
    controller, before = HoldController(HOLD), 0.0
    with np.errstate(over="ignore", invalid="ignore"):
        for readings, usable in measured:
            correction = controller.answer(readings, usable).correction
            assert abs(correction) <= HOLD.authority
            most = HOLD.rate_limit * HOLD.period
            assert abs(correction - before) <= most * (1.0 + 1e-9)
            before = correction


def test_a_laser_with_the_wrong_sign_drives_it_to_its_authority_and_no_further() -> None:
    _, asked = closed_loop(HOLD, sensitivity=-1e-3)
    assert np.abs(asked).max() == HOLD.authority


@pytest.mark.parametrize("name", [name for name in vars(HOLD) if name != "setpoint"])
@pytest.mark.parametrize("value", [0.0, -1.0, math.nan, math.inf])
def test_settings_that_make_no_loop(name: str, value: float) -> None:
    with pytest.raises(ModelError, match=name):
        replace(HOLD, **{name: value})


def test_the_sensitivity_is_that_of_the_relaxed_film() -> None:
    model = Actuator(THESIS_FILM, THESIS_LOAD, TABLE_3)
    found = sensitivity_of(model, 4000.0)
    moved = static_stretch(model, 4004.0) - static_stretch(model, 3996.0)
    assert found == pytest.approx(moved / 0.002 * THESIS_FILM.length, rel=1e-3)
    with pytest.raises(ModelError):
        sensitivity_of(model, 0.0)
