"""Electrical channels in a fit, against data made by the circuit with noise, gain and offset."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dearig.model.circuit import loop
from dearig.model.film.material import TABLE_3, THESIS_FILM, THESIS_LOAD
from dearig.model.fitting.channels import Channels, JointProblem, is_electric, results_of
from dearig.model.fitting.parameters import FitLayout
from dearig.model.fitting.slow_noise import WhitenedProblem
from dearig.model.readings.channels import (
    CURRENT,
    VOLTAGE_MONITOR,
    ChannelRecord,
    ElectricRecord,
)
from dearig.model.readings.records import ActuatorRecord
from dearig.model.simulation.actuator import Actuator, Drive, at_rest

PLAIN = Actuator(THESIS_FILM, THESIS_LOAD, TABLE_3)
TIME = np.arange(4000) * 5e-3
LEAD_IN = 400
NOISE = {VOLTAGE_MONITOR: 1.0, CURRENT: 1e-6}
LEAK = (("leakage", (("loss", 0.01), ("growth", 3.0), ("exponent", 0.5))),)
LAG = (("amplifier lag", (("time_constant", 0.01),)),)
ELECTRODE = (("electrode resistance", (("resistance", 4e7),)),)
SATURATION = (("amplifier saturation", (("loss", 0.02), ("exponent", 3.0))),)


def drive():
    lobes = 8e3 * np.sin(np.pi * 0.4 * (TIME - 2.0)) ** 2
    return Drive(TIME, np.where(TIME < 2.0, 0.0, lobes))


def moved(volts):
    delayed = np.interp(TIME - 0.02, TIME, volts)
    return 1.2e-3 * (delayed / 8e3) ** 2


def record(effects=(), *, leak_ohm=0.0, gain=1.0, offset=0.0, jump_f=0.0, seed=1, **replaced):
    """Return what a rig with ``effects`` reads; ``replaced`` are readings of channels by name."""
    given, rng = drive(), np.random.default_rng(seed)
    c = replace(PLAIN, effects=effects).coefficients()
    _, rest = at_rest(c, given)
    stretch = rest + moved(given.voltage) / THESIS_FILM.length
    rows = loop.follow(c, TIME, given.voltage, given.ends, given.air, stretch, loop.ABOUT)
    current = rows[loop.INTO] + jump_f * rows[loop.SLOPE]
    if leak_ohm:
        current = current + rows[loop.DROP] / leak_ohm
    values = {VOLTAGE_MONITOR: rows[loop.OUTPUT], CURRENT: gain * current + offset}
    channels = tuple(
        ChannelRecord(
            name,
            "V" if name == VOLTAGE_MONITOR else "A",
            replaced.get(name, values[name] + NOISE[name] * rng.standard_normal(TIME.size)),
            NOISE[name],
            LEAD_IN,
        )
        for name in values
    )
    seen = moved(given.voltage) + 1e-6 * rng.standard_normal(TIME.size)
    return ElectricRecord("made", given, seen, LEAD_IN, channels, means=True)


def costs(found, effects=()):
    misfits = Channels([found], PLAIN).misfits(replace(PLAIN, effects=effects))
    return {name: misfit.cost for name, misfit in misfits.items()}


def test_the_plain_circuit_leaves_the_noise_of_a_plain_rig():
    channels = Channels([record()], PLAIN)
    assert channels.used == (VOLTAGE_MONITOR, CURRENT)
    misfits = channels.misfits(PLAIN)
    for name in channels.used:
        assert misfits[name].cost == pytest.approx(1.0, abs=0.1)
        assert misfits[name].rms == pytest.approx(NOISE[name], rel=0.1)


@pytest.mark.parametrize(
    ("effects", "channel"),
    [(LAG, VOLTAGE_MONITOR), (SATURATION, VOLTAGE_MONITOR), (ELECTRODE, CURRENT)],
)
def test_an_effect_that_is_there_leaves_the_noise_and_the_plain_circuit_more(effects, channel):
    made = record(effects)
    assert costs(made, effects)[channel] == pytest.approx(1.0, abs=0.1)
    # twice the logarithm of the odds: e^5 tells two explanations apart
    odds = TIME.size * np.log(costs(made)[channel] / costs(made, effects)[channel])
    assert odds > 20.0


def test_gain_offset_and_what_a_jump_leaves_are_no_misfit():
    made = record(gain=1.01, offset=3e-5, jump_f=1e-10)
    assert costs(made)[CURRENT] == pytest.approx(1.0, abs=0.1)


def test_a_leak_shows_in_the_current_whatever_resistance_is_in_series():
    for ohm in (1e6, 3e6):
        made = record(LEAK, leak_ohm=ohm)
        assert costs(made, LEAK)[CURRENT] == pytest.approx(1.0, abs=0.15)
        assert costs(made)[CURRENT] > 5.0
        assert costs(made, SATURATION)[CURRENT] > 5.0


def test_a_loss_of_voltage_without_a_current_is_no_leak():
    # the charging through the resistance in series would have been a lag: so it is not large
    made = record()
    assert costs(made, LEAK)[CURRENT] > costs(made)[CURRENT] * 1.1


def test_why_a_channel_is_not_used():
    rng = np.random.default_rng(3)
    noise = {name: sigma * rng.standard_normal(TIME.size) for name, sigma in NOISE.items()}
    volts = drive().voltage
    for name, values, reason in (
        (VOLTAGE_MONITOR, noise[VOLTAGE_MONITOR], "not wired"),
        (VOLTAGE_MONITOR, 0.1 * volts + noise[VOLTAGE_MONITOR], "reads 0.1 times"),
        (CURRENT, noise[CURRENT], "a wire that is off reads the same"),
    ):
        channels = Channels([record(**{name: values})], PLAIN)
        assert name not in channels.used
        assert reason in channels.reasons[name]


def test_a_current_too_noisy_to_show_the_film_is_not_used():
    loud = ElectricRecord(
        "loud",
        drive(),
        moved(drive().voltage),
        LEAD_IN,
        (
            ChannelRecord(
                CURRENT,
                "A",
                1e-4 * np.random.default_rng(5).standard_normal(TIME.size),
                1e-4,
                LEAD_IN,
            ),
        ),
        means=True,
    )
    channels = Channels([loud], PLAIN)
    assert not channels
    assert "too noisy" in channels.reasons[CURRENT]


def test_results_name_every_channel_that_was_recorded():
    made = record()
    absent = replace(
        made, channels=(made.channels[0], replace(made.channels[1], reason="not recorded"))
    )
    monitor, current = results_of(Channels([absent], PLAIN), PLAIN, PLAIN)
    assert (monitor.name, monitor.used, monitor.reason) == (VOLTAGE_MONITOR, True, "")
    assert monitor.before == monitor.after == pytest.approx(1.0, rel=0.1)
    assert (current.used, current.noise, current.before, current.reason) == (
        False, None, None, "not recorded",
    )  # fmt: skip


def test_held_steps_are_seen_at_the_instants_of_the_readings():
    # 1 ms steps that an amplifier of 10 ms follows: half a step late against a line
    time = np.arange(20000) * 1e-3
    volts = np.where(time < 2.0, 0.0, 8e3 * np.sin(np.pi * 0.4 * (time - 2.0)) ** 2)
    tau, after = 0.01, 2e-5
    state, read = 0.0, np.empty_like(time)
    for k, v in enumerate(volts):
        read[k] = v + (state - v) * np.exp(-after / tau)
        state = v + (state - v) * np.exp(-1e-3 / tau)
    rng = np.random.default_rng(7)
    monitor = ChannelRecord(
        VOLTAGE_MONITOR, "V", read + rng.standard_normal(time.size), 1.0, 2000, skew=after
    )
    still = ElectricRecord(
        "held", Drive(time, volts, hold=True), np.zeros_like(time), 2000, (monitor,)
    )
    channels = Channels([still], PLAIN)
    lagging = replace(PLAIN, effects=LAG)
    assert channels.misfits(lagging)[VOLTAGE_MONITOR].cost == pytest.approx(1.0, abs=0.1)
    assert channels.misfits(PLAIN)[VOLTAGE_MONITOR].rms > 50.0


# --- joint with the displacement


def problem_of(effects, electric):
    model = replace(PLAIN, effects=effects)
    given = drive()
    seen = electric.displacement - electric.displacement[:LEAD_IN].mean()
    fitted = ActuatorRecord("made", given, seen, 1e-6, lead_in=LEAD_IN, electric=electric)
    layout = FitLayout(model)
    joint = JointProblem([fitted], layout, None, Channels([electric], PLAIN))
    return joint, WhitenedProblem([fitted], layout)


def test_rows_of_channels_follow_those_of_the_displacement():
    joint, alone = problem_of(ELECTRODE, record(ELECTRODE))
    x = joint.layout.coordinates(joint.layout.initial())
    n = alone.measured.size
    residuals = joint.residuals(x)
    np.testing.assert_array_equal(residuals[:n], alone.residuals(x))
    assert residuals.size == n + 2 * (TIME.size + 1)
    cost, same = joint.evaluate(x[None])
    np.testing.assert_allclose(same[0], residuals, rtol=1e-12, atol=1e-12)
    assert cost[0] == pytest.approx(float(residuals @ residuals) / joint.samples)
    np.testing.assert_array_equal(joint.white().residuals(x), alone.residuals(x))


def test_derivatives_of_channels_agree_with_differences():
    joint, _ = problem_of(ELECTRODE, record(ELECTRODE))
    x = joint.layout.coordinates(joint.layout.initial())
    free = np.ones(x.size, dtype=bool)
    place = joint.layout.names.index("electrode resistance: resistance")
    step = np.zeros(x.size)
    step[place] = 10.0 * joint.layout.differences(x)[place]
    n = joint.measured.size
    above, below = joint.residuals(x + step)[n:], joint.residuals(x - step)[n:]
    expected = (above - below) / (2.0 * step[place])
    jacobian = joint.jacobian(x, free)[n:]
    np.testing.assert_allclose(
        jacobian[:, place], expected, rtol=1e-2, atol=1e-4 * np.abs(expected).max()
    )
    # springs move no current
    assert not np.delete(jacobian, place, axis=1).any()


def test_effects_of_the_springs_and_the_sensor_are_not_electric():
    assert is_electric("leakage")
    assert is_electric("field-dependent permittivity")
    assert not is_electric("linear drag")
    assert not is_electric("sensor lag")


@pytest.mark.parametrize("alike", [0.0, 0.999, 1.0 - 1e-7])
def test_gain_and_conductance_are_those_of_least_squares(alike):
    (channel,) = (x for x in Channels([record()], PLAIN)._channels if x.name == CURRENT)
    rng = np.random.default_rng(5)
    predicted, other, noise = rng.standard_normal((3, channel.y.size))
    dropped = alike * predicted + np.sqrt(1.0 - alike**2) * other
    left = noise + 0.3 * predicted + 0.2 * other
    gain_error = channel._gain_error
    matrix = np.vstack([np.transpose([predicted, dropped]), [1.0 / gain_error, 0.0]])
    target = np.append(left, 0.0)
    both = np.linalg.lstsq(matrix, target)[0]
    conductance, residual = channel._solved(predicted, left, dropped)
    assert conductance == pytest.approx(both[1], rel=1e-6)
    np.testing.assert_allclose(residual, target - matrix @ both, atol=1e-8)
    gain = np.linalg.lstsq(matrix[:, :1], target)[0]
    np.testing.assert_allclose(
        channel._solved(predicted, left)[1], target - matrix[:, :1] @ gain, atol=1e-12
    )
