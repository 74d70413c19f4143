"""The current monitor: pulses in closed form, and an integral that is the charge."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from dearig.config.rigfile import RigFile
from dearig.drivers.contract.rig import lobes, play
from dearig.drivers.settings import AmplifierSettings
from dearig.model.film.material import TABLE_3, THESIS_FILM, THESIS_LOAD
from dearig.sim_backend.current import CurrentMonitor, CurrentState
from dearig.sim_backend.factory import open_simulated_rig
from dearig.sim_backend.plant import Electricity
from dearig.sim_backend.truth.film import FilmNumbers, rest_stretch
from dearig.sim_backend.truth.generator_b.electric import contacts
from dearig.sim_backend.truth.plant import TruthPlant
from tests.deep import one_of_each
from tests.sim_backend.truth.test_cases import FORMS

CAPACITANCE, CABLE = 2.7e-10, 1.5e-10
NUMBERS = FilmNumbers.of(THESIS_FILM, THESIS_LOAD, TABLE_3)
SLEW = 1.0e8  # V/s


def charged(voltage, capacitance=CAPACITANCE, lag=0.0):
    """The electricity of a capacitor under ``voltage`` (M,) V, held in each interval."""
    ends = np.stack((voltage, voltage))
    charge, nothing = capacitance * ends, np.zeros_like(ends)
    step = np.diff(charge[0], prepend=0.0)
    return Electricity(ends, ends, charge, step, nothing, nothing, lag)


def monitor(spacing, **settings):
    return CurrentMonitor(AmplifierSettings(**settings), spacing)


@pytest.mark.parametrize("bandwidth", [20.0, 25.0, 3.0])  # 25 kHz is the amplifier's own lag
@pytest.mark.parametrize("peak", [40.0, 8000.0])  # V: a small step, and one at the slew limit
def test_the_pulse_after_a_step_is_that_of_the_circuit(bandwidth, peak):
    spacing = 2e-4
    voltage = peak * np.array([0.0, 1.0, 0.3, -0.5, -0.5, 0.2])
    reading = monitor(spacing, current_monitor_bandwidth_kHz=bandwidth, cable_pF=CABLE * 1e12)
    tau, blur = (1.0 / (2e3 * math.pi * kHz) for kHz in (25.0, bandwidth))

    def slope(t, y, target):
        rate = np.clip((target - y[0]) / tau, -SLEW, SLEW)
        return [rate, ((CAPACITANCE + CABLE) * rate - y[1]) / blur]

    at = np.array([0.0, 2e-6, 1e-5, 6e-5, 1.9e-4])
    y, expected = np.zeros(2), np.empty((at.size, voltage.size))
    for k, target in enumerate(voltage):
        found = solve_ivp(
            slope, (0.0, spacing), y, "LSODA", args=(target,), dense_output=True,
            rtol=1e-10, atol=1e-12, max_step=1e-6,
        )  # fmt: skip
        expected[:, k], y = found.sol(at)[1], found.y[:, -1]
    for into, wanted in zip(at, expected, strict=True):
        shown, _ = reading.read(
            charged(voltage), SLEW, CAPACITANCE, slice(None), into, CurrentState()
        )
        np.testing.assert_allclose(shown, wanted, atol=2e-4 * np.abs(expected).max())


def test_a_record_that_is_cut_goes_on():
    voltage = 3000.0 * np.sin(np.arange(40.0))
    reading = monitor(1e-5, cable_pF=100.0)
    whole, _ = reading.read(charged(voltage), SLEW, CAPACITANCE, slice(None), 3e-6, CurrentState())
    head, state = reading.read(
        charged(voltage[:17]), SLEW, CAPACITANCE, slice(None), 3e-6, CurrentState()
    )
    part = charged(voltage[17:])
    part.step[0] -= CAPACITANCE * voltage[16]
    tail, _ = reading.read(part, SLEW, CAPACITANCE, slice(None), 3e-6, state)
    np.testing.assert_allclose(np.append(head, tail), whole, rtol=1e-12)


def test_charge_passes_the_resistance_of_the_law_in_its_time():
    lag = 5e-4
    shown = [
        monitor(1e-3).read(
            charged(np.full(4, 1000.0), lag=lag), SLEW, CAPACITANCE, slice(0, 1), t, CurrentState()
        )[0][0]
        for t in (2e-4, 7e-4)
    ]
    assert shown[1] / shown[0] == pytest.approx(math.exp(-1.0), rel=0.02)


ELECTRICAL = [
    p
    for p in FORMS
    if p.values[0]
    in ("amplifier", "electrode_resistance", "leakage", "dielectric_relaxation", "permittivity")
]


@pytest.mark.parametrize(("family", "form"), one_of_each(ELECTRICAL, lambda p: p.values[0]))
def test_the_integral_of_the_current_is_the_charge_and_what_leaked(family, form):
    """The integral of what the monitor shows, in pieces of a microsecond."""
    # the first steps of a lobe, and a fall to 0 V that leaves time for all to flow back
    time = np.arange(121) * 1e-3
    voltage = np.where(time < 0.06, 6000.0 * np.sin(np.pi * time / 0.12) ** 2, 0.0)
    effect = form(np.random.default_rng(3), THESIS_LOAD)
    motion, _ = TruthPlant.at_rest(NUMBERS, (effect,)).advance(time, voltage, True)
    electricity = motion.electricity
    reading, flowed, spacing = monitor(1e-3), 0.0, 1e-3
    into = (np.arange(1000) + 0.5) * 1e-6
    for t in into:
        shown, _ = reading.read(electricity, SLEW, CAPACITANCE, slice(None), t, CurrentState())
        flowed = flowed + shown * 1e-6
    leaked = electricity.conduction.mean(axis=0) * spacing
    expected = np.cumsum(electricity.step) + np.cumsum(np.diff(electricity.charge, axis=0)[0])
    np.testing.assert_allclose(expected, electricity.charge[1], atol=1e-15)
    # of what flows in a millisecond, less than 2 % is on its way through the monitor, or three
    # quarters through the resistance in front of a leak
    late = 0.02 + 3.0 * electricity.lag / spacing
    most = np.abs(electricity.step + np.diff(electricity.charge, axis=0)[0]).max()
    error = np.abs(np.cumsum(flowed - leaked) - electricity.charge[1])
    assert error.max() < late * most + 2e-3 * electricity.charge.max()
    assert np.abs(flowed).sum() > 1e-7


def ripple(into, tau, blur, interval):
    """A periodic train of unit charges through both lags, times the interval: its mean is 1."""
    parts = [math.exp(-into / t) / -math.expm1(-interval / t) for t in (blur, tau)]
    return interval / (blur - tau) * (parts[0] - parts[1])


@pytest.mark.parametrize(("bandwidth", "accuracy"), [(20.0, 0.16), (5.0, 0.05), (1.0, 0.01)])
def test_a_mean_of_samples_is_the_change_of_charge_as_well_as_their_rate_allows(
    bandwidth, accuracy
):
    """100 conversions in a row of a millisecond, on a staircase that rises with each of them."""
    interval, into = 1e-5, 3e-6
    voltage = 25e3 * interval * np.arange(3000)
    shown, _ = monitor(interval, current_monitor_bandwidth_kHz=bandwidth).read(
        charged(voltage), SLEW, CAPACITANCE, slice(None), into, CurrentState()
    )
    mean = shown.reshape(-1, 100).mean(axis=1)[5:]
    change = CAPACITANCE * 25e3
    np.testing.assert_allclose(mean, change, rtol=accuracy)
    tau, blur = (1.0 / (2e3 * math.pi * kHz) for kHz in (25.0, bandwidth))
    np.testing.assert_allclose(mean, change * ripple(into, tau, blur, interval), rtol=2e-3)


def test_rows_of_many_conversions_show_what_the_film_takes_up():
    """A rig at 100 kHz: means over a millisecond against the charge by voltage and stretch."""
    rate, rows = 1e5, 100
    settings = RigFile.model_validate(
        {
            "amplifier": {"monitor_noise_mV": 0.0, "current_monitor_bandwidth_kHz": 2.0},
            "card": {
                "sample_rate_Hz": rate,
                "first_convert_us": 1.0,
                "convert_interval_us": 2.5,
                "range_current_monitor_V": 0.1,
            },
            "laser": {"noise_um": 0.0, "averaging": 1},
        }
    )
    rig = open_simulated_rig("sim", settings, THESIS_FILM, THESIS_LOAD)
    record = play(rig, lobes(peaks=(8000.0,), seconds=0.2, rate=rate))
    current = record.physical(rig, "current_monitor").reshape(-1, rows).mean(axis=1)
    volts = record.physical(rig, "voltage_command")
    reading = record.physical(rig, "displacement")
    travel = reading - reading[:500].mean()
    lam = rest_stretch(NUMBERS) + travel / THESIS_FILM.length
    charge = NUMBERS.capacitance * lam**2 * volts
    change = np.diff(np.append(charge, 0.0)[::rows]) * rate / rows
    slope = np.sum(current * change) / np.sum(change**2)
    assert slope == pytest.approx(1.0, abs=0.02)
    assert np.abs(change).max() > 2e-5


def test_contacts_that_conduct_better_under_more_voltage_let_a_step_pass():
    """In nanoseconds, which neither the film's steps nor the monitor's may pass over.

    Of V' = -(v / RC) sinh(V / v) the hyperbolic tangent of V / 2v falls exponentially.
    """
    time = np.arange(8) * 1e-3
    voltage = np.where(time < 0.004, 6000.0, 0.0)
    effect = contacts(np.random.default_rng(3), THESIS_LOAD)
    motion, _ = TruthPlant.at_rest(NUMBERS, (effect,)).advance(time, voltage, True)
    seen, charge = motion.electricity.voltage[1], motion.electricity.charge[1]
    law = effect.on_film(NUMBERS).hidden.further
    times = law.contact * charge[3] / seen[3]
    twice, left = 2.0 * law.contact_voltage, np.exp(-(time[4:7] - 0.003) / times)
    expected = twice * np.arctanh(np.tanh(seen[3] / twice) * left)
    np.testing.assert_allclose(seen[4:7], expected, rtol=0.01)  # the film's capacitance changes
    shown, _ = monitor(1e-3).read(
        motion.electricity, SLEW, CAPACITANCE, slice(None), 1e-5, CurrentState()
    )
    assert np.abs(shown).max() < 2.0 * charge[3] / 1e-5
