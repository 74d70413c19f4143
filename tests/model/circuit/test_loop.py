"""The circuit along a given stretch, against its physics written out with SciPy."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from dearig.model.circuit.loop import ABOUT, AFTER, AT, DROP, FILM, INTO, OUTPUT, SLOPE, follow
from dearig.model.coefficients import CAPACITANCE
from dearig.model.effects import EFFECTS
from dearig.model.effects_contract import values_of
from dearig.model.film.material import TABLE_3, THESIS_FILM, THESIS_LOAD
from dearig.model.simulation.actuator import Actuator, Drive, at_rest

STEP = 1e-3
TIME = np.arange(3000) * STEP


def volts(t):
    return 8e3 * np.sin(np.pi * np.asarray(t)) ** 2


def stretched(t):
    return 1.15 + 0.02 * np.sin(np.pi * np.asarray(t) - 0.1) ** 2


def circuit(way, hold=False, **effects):
    given = tuple((name.replace("_", " "), tuple(v.items())) for name, v in effects.items())
    c = replace(Actuator(THESIS_FILM, THESIS_LOAD, TABLE_3), effects=given).coefficients()
    drive = Drive(TIME, volts(TIME), hold=hold)
    at_rest(c, drive)
    return c, follow(c, TIME, drive.voltage, drive.ends, drive.air, stretched(TIME), way)


def test_mean_current_is_the_change_of_charge():
    c, rows = circuit(AFTER)
    charge = c[CAPACITANCE] * stretched(TIME) ** 2 * volts(TIME)
    np.testing.assert_allclose(rows[INTO][:-1], np.diff(charge) / STEP, rtol=1e-9, atol=1e-15)


def test_an_instant_after_a_step_sees_the_film_move_and_not_its_charging():
    c, rows = circuit(AT, hold=True)
    growth = np.diff(stretched(TIME) ** 2) / STEP
    expected = c[CAPACITANCE] * growth * volts(TIME[:-1])
    np.testing.assert_allclose(rows[INTO][:-1], expected, rtol=1e-3, atol=1e-12)
    np.testing.assert_allclose(rows[OUTPUT], volts(TIME), rtol=1e-12)
    np.testing.assert_allclose(rows[SLOPE][1:], np.diff(volts(TIME)) / STEP, rtol=1e-9)


def test_a_mean_about_the_sample_has_both_halves():
    c, rows = circuit(ABOUT)
    edges = TIME[1:-1, None] + STEP * np.array([-0.5, 0.5])
    line = np.interp(edges, TIME, volts(TIME))
    area = np.interp(edges, TIME, stretched(TIME)) ** 2
    charge = c[CAPACITANCE] * area * line
    np.testing.assert_allclose(
        rows[INTO][1:-1], np.diff(charge)[:, 0] / STEP, rtol=1e-6, atol=1e-13
    )


def test_resistance_of_the_electrodes_smooths_voltage_and_current():
    resistance = 4e7
    c, rows = circuit(ABOUT, electrode_resistance={"resistance": resistance})
    capacitance = lambda t: c[CAPACITANCE] * stretched(t) ** 2  # noqa: E731

    def charging(t, q):
        return (volts(t) - q / capacitance(t)) / resistance

    true = solve_ivp(charging, (0.0, TIME[-1]), [0.0], t_eval=TIME, rtol=1e-9, atol=1e-16).y[0]
    film = true / capacitance(TIME)
    assert np.abs(rows[OUTPUT] - volts(TIME))[1:-1].max() < 0.05
    assert np.abs(rows[FILM] - film)[1:-1].max() < 0.3  # of 340 V that it lags
    current = (volts(TIME) - film) / resistance
    assert np.abs(rows[INTO] - current)[1:-1].max() < 2e-8  # of 8.5 uA


def test_polarisation_is_a_part_of_the_charge():
    d, tau = 0.2, 0.1
    c, rows = circuit(
        AFTER, dielectric_relaxation={"strength": d, "relaxation_time": tau, "settled": 1.0}
    )
    slow = solve_ivp(
        lambda t, u: (volts(t) - u) / tau, (0.0, TIME[-1]), [0.0], t_eval=TIME, rtol=1e-9
    ).y[0]
    charge = c[CAPACITANCE] * stretched(TIME) ** 2 * (volts(TIME) + d * slow) / (1.0 + d)
    # at 0 V the polarisation is asked for at 1 V
    wrong = np.abs(rows[INTO][:-1] - np.diff(charge) / STEP)
    assert np.median(wrong) < 1e-11
    assert wrong.max() < 1e-3 * np.abs(rows[INTO]).max() + 2.0 * c[CAPACITANCE] * d / STEP


def test_permittivity_is_a_factor_on_the_charge():
    slope = 3.0
    c, rows = circuit(AFTER, **{"strain-dependent permittivity": {"strain_coefficient": slope}})
    rest = at_rest(c)[1]
    factor = 1.0 + slope * (stretched(TIME) - rest)
    charge = c[CAPACITANCE] * stretched(TIME) ** 2 * factor * volts(TIME)
    np.testing.assert_allclose(rows[INTO][:-1], np.diff(charge) / STEP, rtol=1e-6, atol=1e-13)


def test_a_leak_drops_what_the_film_does_not_get():
    _, rows = circuit(AFTER, leakage={"loss": 0.02, "growth": 2.0, "exponent": 0.5})
    inside = slice(1, -1)
    lost = rows[OUTPUT] - rows[FILM]
    assert np.abs(rows[DROP] - lost)[inside].max() < 0.05 * lost.max()
    assert 100.0 < lost.max() < 250.0


def test_the_output_has_the_amplifier_and_not_the_electrodes():
    _, rows = circuit(
        ABOUT, amplifier_lag={"time_constant": 0.01}, electrode_resistance={"resistance": 4e7}
    )
    _, alone = circuit(ABOUT, amplifier_lag={"time_constant": 0.01})
    np.testing.assert_array_equal(rows[OUTPUT], alone[OUTPUT])
    assert np.abs(rows[FILM] - rows[OUTPUT]).max() > 100.0


def test_a_sheet_holds_the_mean_charge_of_its_modes():
    _, rows = circuit(ABOUT, sheet_electrode={"resistance": 4e7, "contact": 0.95})
    _, lumped = circuit(ABOUT, electrode_resistance={"resistance": 4e7})
    # where nearly all resistance is at the contact the sheet is one capacitor
    assert np.abs(rows[INTO] - lumped[INTO]).max() < 0.02 * np.abs(lumped[INTO]).max()


@pytest.mark.parametrize("name", [n for n, e in EFFECTS.items() if "voltage" in e.drives])
def test_at_its_neutral_values_an_effect_leaves_the_plain_circuit(name):
    neutral = dict(values_of(EFFECTS[name], amplitude=0.0))
    _, rows = circuit(AFTER, **{name.replace(" ", "_"): neutral})
    np.testing.assert_array_equal(rows, circuit(AFTER)[1])
