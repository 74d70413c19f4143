"""Each simulated instrument against a closed form or a plain loop."""

import math

import numpy as np
import pytest

from dearig.drivers.errors import RigError
from dearig.drivers.settings import AmplifierSettings, LaserSettings, RigSettings
from dearig.sim_backend.amplifier import Amplifier, AmplifierState
from dearig.sim_backend.card import Converters
from dearig.sim_backend.laser import Laser, _averages
from dearig.sim_backend.streams import Streams

CAPACITANCE = 3.0e-10
TAU = 1.0 / (2.0 * math.pi * 25e3)


def amplified(volts, interval=1e-3, start=0.0, **settings):
    amplifier = Amplifier(AmplifierSettings(**settings))
    volts = np.atleast_1d(np.asarray(volts, dtype=float))
    rows, after = amplifier.advance(volts, interval, CAPACITANCE, AmplifierState(start))
    return amplifier, rows, after


@pytest.mark.parametrize("elapsed", [0.0, 1e-6, 6e-6, 5e-5, 9e-4])
@pytest.mark.parametrize("step", [0.1, -0.1])
def test_small_steps_are_a_first_order_lag(elapsed, step):
    amplifier, rows, _ = amplified([step])
    output = amplifier.outputs(rows, slice(None), elapsed)
    left = math.exp(-elapsed / TAU)
    assert output[0] == pytest.approx(1000.0 * step * (1.0 - left), abs=1e-9)


@pytest.mark.parametrize(
    ("settings", "slew"),
    [
        ({}, 0.04 / CAPACITANCE),
        ({"current_limit_mA": 1000.0}, 900e6),
        ({"slew_V_per_us": 10.0}, 10e6),
    ],
)
def test_large_steps_go_straight_at_the_lowest_limit_first(settings, slew):
    amplifier, rows, _ = amplified([8.0], **settings)
    line = 8000.0 / slew - TAU
    assert line > 0.0
    early = amplifier.outputs(rows, slice(None), 0.5 * line)
    assert early[0] == pytest.approx(0.5 * line * slew, rel=1e-9)
    later = amplifier.outputs(rows, slice(None), line + TAU)
    assert later[0] == pytest.approx(8000.0 - slew * TAU / math.e, rel=1e-9)


@pytest.mark.parametrize(
    ("start", "target"), [(0.0, 8.0), (8000.0, 0.0), (3000.0, 3.2), (-5e3, 5.0)]
)
def test_effective_voltage_is_the_root_mean_square_over_the_interval(start, target):
    interval = 2e-4
    amplifier, rows, after = amplified([target], interval, start)
    elapsed = np.linspace(0.0, interval, 40001)
    course = np.array([amplifier.outputs(rows, slice(None), t)[0] for t in elapsed])
    square = np.trapezoid(course**2, elapsed) / interval
    assert abs(rows.effective[0]) == pytest.approx(math.sqrt(square), rel=1e-6)
    assert after.output == pytest.approx(course[-1], abs=1e-9)


def test_cutting_a_record_changes_nothing():
    volts = np.sin(np.arange(50))
    _, whole, end = amplified(volts, 2e-5)
    _, head, middle = amplified(volts[:20], 2e-5)
    _, tail, cut_end = amplified(volts[20:], 2e-5, middle.output)
    np.testing.assert_array_equal(whole.effective, np.append(head.effective, tail.effective))
    assert cut_end == end


def test_output_stays_in_range_and_offset_adds():
    _, rows, after = amplified([20.0, -20.0, 0.0], offset_V=3.0)
    np.testing.assert_array_equal(rows.target, [1e4, -1e4, 3.0])
    assert after.output == pytest.approx(3.0)
    assert rows.settled.all()


def test_an_output_that_does_not_arrive_is_not_settled():
    _, rows, _ = amplified([8.0, 8.0], 2e-5)
    np.testing.assert_array_equal(rows.settled, [False, False])


def plain_average(position, phase, period, averaging, times):
    """The moving average as its words say it."""
    last = np.floor((times - phase) / period).astype(int)
    return np.array(
        [
            np.mean([position(max(0.0, phase + (j - i) * period)) for i in range(averaging)])
            for j in last
        ]
    )


def course(t):
    # a cubic: between nodes the laser's own interpolation is then exact
    return 1e-3 * (0.3 * t + 0.5 * t**2 - 0.7 * t**3)


def course_velocity(t):
    return 1e-3 * (0.3 + 1.0 * t - 2.1 * t**2)


@pytest.mark.parametrize(
    ("averaging", "period", "phase"),
    [
        (1, 2e-5, 0.0),
        (1, 2.55e-6, 1e-6),
        (16, 2e-5, 1.3e-5),
        (64, 1e-4, 0.9e-4),
        (4, 1e-3, 0.4e-3),
        (16, 3.3e-3, 1e-3),
        (256, 2e-5, 0.0),
    ],
)
def test_laser_averages_are_what_a_plain_loop_gives(averaging, period, phase):
    spacing = 1e-3
    nodes = np.arange(201) * spacing
    times = nodes[:-1] + 7e-5
    out = np.empty(times.size)
    # the film stood still before; the course starts with a velocity all the same
    _averages(
        course(nodes), course_velocity(nodes), 0, spacing, phase, period, averaging, times, out
    )
    expected = plain_average(course, phase, period, averaging, times)
    np.testing.assert_allclose(out, expected, atol=1e-15)


def laser(interval=1e-3, **settings):
    quiet = {"noise_um": 0.0, "resolution_um": 0.0, "rest_position_mm": 0.0}
    return Laser(LaserSettings(**{**quiet, **settings}), Streams((3,)), 0, interval, interval)


def read_all(instrument, position, velocity, chunk=500, skew=7e-5, interval=1e-3):
    """Read a whole record in chunks; volts and alarms."""
    state, volts, alarms = instrument.start(), [], []
    for number, start in enumerate(range(0, position.size - 1, chunk)):
        end = min(start + chunk, position.size - 1)
        times = np.arange(start, end) * interval + skew
        rows, state = instrument.read(
            position[start : end + 1], velocity[start : end + 1], times, number, chunk, state
        )
        volts.append(rows.volts)
        alarms.append(rows.alarm)
    return np.concatenate(volts), np.concatenate(alarms)


@pytest.mark.parametrize("averaging", [1, 16, 4096, 65536])
def test_laser_lags_by_half_its_window(averaging):
    time = np.arange(6001) * 1e-3
    speed = 1e-3
    ramp = speed * time
    instrument = laser(averaging=averaging)
    volts, _ = read_all(instrument, ramp, np.full(time.size, speed))
    delay = LaserSettings(averaging=averaging).delay
    expected = speed * (time[3000:-1] + 7e-5 - delay)
    error = volts[3000:] * 4e-3 - expected
    # half a sampling period, and 20 ppm of the delay
    assert abs(error.mean()) < speed * (11e-6 + 20e-6 * delay)
    assert np.ptp(error) < speed * 45e-6


@pytest.mark.parametrize(("averaging", "window"), [(1, 0.02), (16, 0.32), (64, 1.28), (256, 5.12)])
def test_noise_has_the_set_size_and_is_correlated_where_windows_overlap(averaging, window):
    still = np.zeros(60001)
    instrument = laser(averaging=averaging, noise_um=1.0, clock_error_ppm=0.0)
    volts, _ = read_all(instrument, still, still, chunk=4096)
    noise = volts * 4e3
    assert noise.std() == pytest.approx(1.0, rel=0.03)
    expected = max(0.0, 1.0 - 1.0 / window)
    assert np.mean(noise[1:] * noise[:-1]) == pytest.approx(expected, abs=0.04)


def test_the_first_reading_is_taken_where_the_film_is():
    # what hums at the first sample already, as mains do, has not jumped there from rest
    position = 2.7e-5 * np.cos(2.0 * np.pi * 60.0 * np.arange(201) * 5e-4)
    instrument = laser(averaging=1, interval=5e-4, clock_error_ppm=0.0)
    volts, _ = read_all(instrument, position, np.zeros(position.size), interval=5e-4)
    assert volts[0] * 4e-3 == pytest.approx(2.7e-5, rel=0.02)


def test_laser_direction_resolution_range_and_alarm():
    travel = np.linspace(0.0, 0.05, 2001)
    velocity = np.full(travel.size, 0.025)
    instrument = laser(averaging=1, direction=-1, resolution_um=100.0)
    volts, alarm = read_all(instrument, travel, velocity)
    assert volts.min() == -10.0
    np.testing.assert_array_equal(alarm, travel[:-1] + 0.025 * 7e-5 > 0.04005)
    steps = volts * 4e-3 / 1e-4
    np.testing.assert_allclose(steps, np.rint(steps), atol=1e-9)


def test_card_counts_follow_the_scaling_it_tells():
    card = Converters(RigSettings(), Streams((1,)))
    for channel in card.channels[1:]:
        volts = np.linspace(-9.9, 9.9, 1001)
        counts = card.convert(channel.name, volts)
        told = np.polynomial.polynomial.polyval(counts.astype(float), channel.scaling.coefficients)
        assert np.abs(told - volts).max() < 0.51 * 20.0 / 65536.0
        assert len(channel.scaling.coefficients) == 4


def test_two_cards_are_calibrated_differently_and_one_always_the_same():
    coefficients = [
        Converters(RigSettings(), Streams((seed,))).channels[1].scaling.coefficients
        for seed in (1, 2, 1)
    ]
    assert coefficients[0] != coefficients[1]
    assert coefficients[0] == coefficients[2]


def test_inputs_saturate():
    card = Converters(RigSettings(), Streams((1,)))
    np.testing.assert_array_equal(
        card.convert("displacement", np.array([-11.0, 11.0])), [-32768, 32767]
    )


def test_command_goes_out_with_the_amplifiers_offset_taken_off():
    settings = RigSettings(amplifier=AmplifierSettings(offset_V=50.0))
    card = Converters(settings, Streams((1,)))
    volts = card.put_out(card.channels[0].scaling.counts(np.array([0.0, 1050.0])))
    np.testing.assert_allclose(volts, [-0.05, 1.0], atol=2e-4)


@pytest.mark.parametrize(("rate", "actual"), [(1000.0, 1000.0), (3000.0, 1e8 / 33333)])
def test_rates_are_divided_from_the_timebase(rate, actual):
    assert Converters(RigSettings(), Streams((1,))).actual_rate(rate) == actual


def test_buffer():
    card = Converters(RigSettings(), Streams((1,)))
    card.check_buffer(100_000, 1000.0)
    with pytest.raises(RigError, match=r"100001 samples waited .* holds 100000") as caught:
        card.check_buffer(100_001, 1000.0)
    assert caught.value.code == -200279


def test_buffer_holds_more_than_the_delay_that_ends_a_run():
    settings = RigSettings()
    Converters(settings, Streams((1,))).check_buffer(round(4e5 * settings.interlocks.late_s), 1e5)
