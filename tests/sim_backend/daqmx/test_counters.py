"""Counters of the simulated card: each measurement on a signal that is known, and the pulses."""

import math

import numpy as np
import pytest
from nidaqmx.constants import (
    AcquisitionType,
    AngleUnits,
    CountDirection,
    Edge,
    EncoderType,
    FrequencyUnits,
    Level,
    TimeUnits,
    TriggerType,
)
from nidaqmx.errors import DaqError
from nidaqmx.stream_readers import CounterReader
from nidaqmx.types import CtrFreq, CtrTime

from tests.tools.daqmx import HandClock, served, task

WAVE = "1 kHz, 25 %"  # at PFI8 unless told otherwise


@pytest.fixture
def clock():
    return HandClock()


@pytest.fixture
def hand(clock):
    """A card whose time only the test moves."""
    with served(clock=clock) as card:
        yield card


@pytest.fixture
def counter(session):
    with task(session) as made:
        yield made


def _at(made, terminal, name):
    setattr(made.ci_channels[0], name, terminal)


# counting edges


@pytest.mark.parametrize(
    ("direction", "first", "counted"),
    [(CountDirection.COUNT_UP, 10, 510), (CountDirection.COUNT_DOWN, 10, 2**32 - 490)],
)
def test_edges_are_counted_from_the_start(hand, clock, direction, first, counted):
    with task(hand.session) as made:
        made.ci_channels.add_ci_count_edges_chan(
            "Dev1/ctr0", initial_count=first, count_direction=direction
        )
        clock.advance(0.25)
        made.start()
        assert made.read() == first
        clock.advance(0.5)
        assert made.read() == counted
        assert made.ci_channels[0].ci_count == counted


def test_the_clock_latches_the_count(counter):
    # 500 Hz at PFI9 take the count of 1 kHz at PFI8
    counter.ci_channels.add_ci_count_edges_chan("Dev1/ctr0")
    counter.timing.cfg_samp_clk_timing(500.0, source="/Dev1/PFI9", samps_per_chan=50)
    counts = counter.read(50)
    assert np.diff(counts).tolist() == [2.0] * 49


def test_a_level_decides_the_direction(session):
    signals = {"pfi8": "1 kHz", "pfi10": "1 Hz, 75 %"}
    with served(signals=signals) as card, task(card.session) as made:
        made.ci_channels.add_ci_count_edges_chan(
            "Dev1/ctr0", count_direction=CountDirection.EXTERNAL_SOURCE
        )
        made.timing.cfg_samp_clk_timing(1.0, source="/Dev1/PFI10", samps_per_chan=3)
        # 750 up and 250 down in each second
        assert np.diff(made.read(3)).tolist() == [500.0, 500.0]


def test_a_pause_trigger_gates_the_counting():
    signals = {"pfi8": "1 kHz", "pfi9": "1 Hz", "pfi0": "10 Hz, 30 %"}
    with served(signals=signals) as card, task(card.session) as made:
        made.ci_channels.add_ci_count_edges_chan("Dev1/ctr0")
        made.timing.cfg_samp_clk_timing(1.0, source="/Dev1/PFI9", samps_per_chan=3)
        pause = made.triggers.pause_trigger
        pause.trig_type = TriggerType.DIGITAL_LEVEL
        pause.dig_lvl_src = "/Dev1/PFI0"
        pause.dig_lvl_when = Level.LOW
        assert np.diff(made.read(3)).tolist() == [300.0, 300.0]


def test_a_counter_is_armed_by_an_edge(hand, clock):
    with task(hand.session) as made:
        made.ci_channels.add_ci_count_edges_chan("Dev1/ctr0")
        made.triggers.arm_start_trigger.trig_type = TriggerType.DIGITAL_EDGE
        made.triggers.arm_start_trigger.dig_edge_src = "/Dev1/PFI0"  # 10 Hz
        clock.advance(0.05)
        made.start()
        clock.advance(0.15)  # armed at 0.1 s
        assert made.read() == 100


# times between edges


def test_a_frequency_is_that_of_the_signal(counter):
    counter.ci_channels.add_ci_freq_chan("Dev1/ctr0", min_val=2.0, max_val=1e5)
    _at(counter, "/Dev1/PFI8", "ci_freq_term")
    counter.timing.cfg_implicit_timing(sample_mode=AcquisitionType.CONTINUOUS)
    counter.start()
    assert counter.read(500) == pytest.approx([1000.0] * 500)
    assert counter.ci_channels[0].ci_freq_term == "/Dev1/PFI8"


def test_the_timebase_resolves_a_frequency():
    # 3 MHz are 33.3 ticks of 100 MHz
    with served(signals={"pfi9": "3 MHz"}) as card, task(card.session) as made:
        made.ci_channels.add_ci_freq_chan("Dev1/ctr0", min_val=1e3, max_val=1e7)
        assert made.read() in (pytest.approx(1e8 / 33), pytest.approx(1e8 / 34))
    with served(signals={"pfi9": "3 MHz"}) as card, task(card.session) as made:
        made.ci_channels.add_ci_freq_chan(
            "Dev1/ctr0", min_val=10, max_val=1000, units=FrequencyUnits.TICKS
        )
        assert made.read() in (33.0, 34.0)


@pytest.mark.parametrize(
    ("add", "term", "truth"),
    [
        ("add_ci_period_chan", "ci_period_term", [1e-3] * 6),
        ("add_ci_pulse_width_chan", "ci_pulse_width_term", [0.25e-3] * 6),
        ("add_ci_semi_period_chan", "ci_semi_period_term", [0.25e-3, 0.75e-3] * 3),
    ],
)
def test_times_are_those_of_the_signal(counter, add, term, truth):
    getattr(counter.ci_channels, add)("Dev1/ctr0", min_val=1e-6, max_val=0.1)
    _at(counter, "/Dev1/PFI8", term)
    counter.timing.cfg_implicit_timing(samps_per_chan=6)
    assert counter.read(6) == pytest.approx(truth)


def test_a_falling_edge_begins_the_other_part(counter):
    counter.ci_channels.add_ci_pulse_width_chan(
        "Dev1/ctr0", min_val=100, max_val=1e6, units=TimeUnits.TICKS, starting_edge=Edge.FALLING
    )
    _at(counter, "/Dev1/PFI8", "ci_pulse_width_term")
    assert counter.read() == 75_000.0


def test_pulses_are_told_in_three_ways(session):
    for add, term, truth in (
        ("add_ci_pulse_chan_freq", "ci_pulse_freq_term", (1000.0, 0.25)),
        ("add_ci_pulse_chan_time", "ci_pulse_time_term", (0.25e-3, 0.75e-3)),
        ("add_ci_pulse_chan_ticks", "ci_pulse_ticks_term", (25_000, 75_000)),
    ):
        with task(session) as made:
            getattr(made.ci_channels, add)("Dev1/ctr0", min_val=1e-6, max_val=1e6)
            _at(made, "/Dev1/PFI8", term)
            value = made.read()
            assert [getattr(value, field) for field in value._fields] == pytest.approx(truth)
            made.timing.cfg_implicit_timing(samps_per_chan=3)
            assert [tuple(v) for v in made.read(3)] == [pytest.approx(truth)] * 3


def test_the_time_between_two_signals_is_measured(counter):
    # PFI10 leads PFI9, 500 Hz each, by a quarter of a period
    chan = counter.ci_channels.add_ci_two_edge_sep_chan("Dev1/ctr0", min_val=1e-6, max_val=0.1)
    assert counter.read() == pytest.approx(1.5e-3)  # up to its falling edge
    chan.ci_two_edge_sep_second_edge = Edge.RISING
    assert counter.read() == pytest.approx(0.5e-3)


def test_a_sample_clock_takes_the_newest_measurement(counter):
    counter.ci_channels.add_ci_period_chan("Dev1/ctr0", min_val=1e-6, max_val=0.1)
    _at(counter, "/Dev1/PFI8", "ci_period_term")
    counter.timing.cfg_samp_clk_timing(10.0, source="/Dev1/PFI0", samps_per_chan=5)
    assert counter.read(5) == pytest.approx([1e-3] * 5)


def test_without_a_signal_a_read_times_out(session):
    with served(signals={}) as card, task(card.session) as made:
        made.ci_channels.add_ci_freq_chan("Dev1/ctr0", min_val=2.0, max_val=1e5)
        made.start()
        with pytest.raises(DaqError) as caught:
            made.read(timeout=0.5)
        assert caught.value.error_code == -200284


def test_what_nobody_reads_is_overwritten(hand, clock):
    with task(hand.session) as made:
        made.ci_channels.add_ci_freq_chan("Dev1/ctr0", min_val=2.0, max_val=1e5)
        _at(made, "/Dev1/PFI8", "ci_freq_term")
        made.timing.cfg_implicit_timing(sample_mode=AcquisitionType.CONTINUOUS)
        made.in_stream.input_buf_size = 1000
        made.start()
        clock.advance(10.0)
        with pytest.raises(DaqError) as caught:
            made.read(10)
        assert caught.value.error_code == -200279


# encoders


@pytest.mark.parametrize(
    ("decoding", "swapped", "turned"),
    [(EncoderType.X_1, False, 360.0), (EncoderType.X_2, False, 360.0),
     (EncoderType.X_4, False, 360.0), (EncoderType.X_4, True, -360.0),
     (EncoderType.X_1, True, -360.0)],
)  # fmt: skip
def test_an_encoder_turns_as_its_signals_say(hand, clock, decoding, swapped, turned):
    # 100 periods a second at PFI3 and, a quarter later, at PFI11
    with task(hand.session) as made:
        made.ci_channels.add_ci_ang_encoder_chan(
            "Dev1/ctr1", decoding_type=decoding, pulses_per_rev=100, initial_angle=5.0
        )
        if swapped:
            made.ci_channels[0].ci_encoder_a_input_term = "/Dev1/PFI11"
            made.ci_channels[0].ci_encoder_b_input_term = "/Dev1/PFI3"
        clock.advance(0.001)
        made.start()
        assert made.read() == 5.0
        clock.advance(1.0)
        assert made.read() == pytest.approx(5.0 + turned)


def test_an_encoder_measures_ticks_radians_and_lengths(hand, clock):
    for add, settings, truth in (
        ("add_ci_ang_encoder_chan", {"units": AngleUnits.TICKS}, 200.0),
        ("add_ci_ang_encoder_chan", {"units": AngleUnits.RADIANS, "pulses_per_rev": 100}, math.pi),
        ("add_ci_lin_encoder_chan", {"dist_per_pulse": 0.01}, 0.5),
    ):
        with task(hand.session) as made:
            getattr(made.ci_channels, add)("Dev1/ctr1", **settings)
            made.start()
            clock.advance(0.5)
            assert made.read() == pytest.approx(truth)


def test_the_index_sets_the_position(hand, clock):
    with task(hand.session) as made:
        made.ci_channels.add_ci_ang_encoder_chan(
            "Dev1/ctr1", zidx_enable=True, zidx_val=90.0, pulses_per_rev=1000
        )
        clock.advance(0.7)
        made.start()
        clock.advance(0.25)
        assert made.read() == pytest.approx(25 * 0.36)
        clock.advance(0.55)  # the index comes at 1 s, and the position is 90 deg there
        assert made.read() == pytest.approx(90.0 + 50 * 0.36, abs=0.1)


# pulses


@pytest.mark.parametrize("idle", [Level.LOW, Level.HIGH])
def test_a_pulse_has_its_times(hand, clock, idle):
    pfi = hand.device.terminals
    with task(hand.session) as made:
        made.co_channels.add_co_pulse_chan_time(
            "Dev1/ctr0", idle_state=idle, initial_delay=0.1, low_time=0.5, high_time=1.0
        )
        clock.advance(1.0)
        made.start()
        assert not made.is_task_done()
        clock.advance(3.0)
        made.wait_until_done(0.0)
        rises = pfi.signal("pfi12").edges(0.9, 3.0, True).tolist()
        falls = pfi.signal("pfi12").edges(0.9, 3.0, False).tolist()
    active = 1.0 if idle is Level.LOW else 0.5
    edges = (rises, falls) if idle is Level.LOW else (falls, rises)
    assert edges[0] == pytest.approx([1.1])
    assert edges[1] == pytest.approx([1.1 + active])


def test_one_counter_measures_the_other(session):
    with task(session) as train, task(session) as made:
        train.co_channels.add_co_pulse_chan_freq("Dev1/ctr0", freq=2500.0, duty_cycle=0.2)
        train.timing.cfg_implicit_timing(sample_mode=AcquisitionType.CONTINUOUS)
        made.ci_channels.add_ci_pulse_chan_freq("Dev1/ctr1", min_val=2.0, max_val=1e5)
        _at(made, "/Dev1/Ctr0InternalOutput", "ci_pulse_freq_term")
        train.start()
        value = made.read()
        assert (value.freq, value.duty_cycle) == pytest.approx((2500.0, 0.2))
        # a new pulse is taken from the end of the present one on
        train.write(CtrFreq(1000.0, 0.5))
        made.start()
        made.read()
        assert made.read().freq == pytest.approx(1000.0)
        assert train.co_channels[0].co_pulse_freq == pytest.approx(1000.0)
        assert train.co_channels[0].co_pulse_term == "/Dev1/PFI12"


def test_a_finite_train_has_its_pulses_and_is_done(hand, clock):
    done = []
    with task(hand.session) as train, task(hand.session) as made:
        train.co_channels.add_co_pulse_chan_freq("Dev1/ctr0", freq=100.0)
        train.timing.cfg_implicit_timing(samps_per_chan=25)
        train.register_done_event(lambda *args: done.append(args[1]) or 0)
        made.ci_channels.add_ci_count_edges_chan("Dev1/ctr1")
        _at(made, "/Dev1/PFI12", "ci_count_edges_term")
        made.start()
        train.start()
        clock.advance(1.0)
        assert made.read() == 25
        assert train.is_task_done()
        train.register_done_event(None)


def test_a_buffered_train_has_each_of_its_pulses(session):
    widths = [CtrTime(1e-3 * n, 2e-3) for n in range(1, 11)]
    with task(session) as train, task(session) as made:
        train.co_channels.add_co_pulse_chan_time("Dev1/ctr0")
        train.timing.cfg_implicit_timing(samps_per_chan=10)
        train.write(widths)
        made.ci_channels.add_ci_pulse_width_chan("Dev1/ctr1", min_val=1e-4, max_val=0.1)
        _at(made, "/Dev1/PFI12", "ci_pulse_width_term")
        made.timing.cfg_implicit_timing(samps_per_chan=10)
        made.start()
        train.start()
        assert made.read(10) == pytest.approx([1e-3 * n for n in range(1, 11)])


def test_a_sample_clock_changes_the_pulses(hand, clock):
    # 10 Hz at PFI0 take one written pulse after the other
    pulses = [CtrFreq(1000.0, 0.1 * n) for n in range(1, 6)]
    with task(hand.session) as train, task(hand.session) as made:
        train.co_channels.add_co_pulse_chan_freq("Dev1/ctr0", freq=1000.0, duty_cycle=0.9)
        train.timing.cfg_samp_clk_timing(
            10.0, source="/Dev1/PFI0", sample_mode=AcquisitionType.CONTINUOUS
        )
        train.write(pulses)
        made.ci_channels.add_ci_pulse_chan_freq("Dev1/ctr1", min_val=2.0, max_val=1e5)
        _at(made, "/Dev1/PFI12", "ci_pulse_freq_term")
        clock.advance(0.01)
        train.start()
        made.start()
        seen = []
        for _ in range(6):
            clock.advance(0.08)
            seen.append(made.read().duty_cycle)
            clock.advance(0.02)
        assert seen == pytest.approx([0.9, 0.1, 0.2, 0.3, 0.4, 0.5], abs=1e-4)


def test_each_edge_starts_a_retriggerable_pulse_again(hand, clock):
    with task(hand.session) as train, task(hand.session) as made:
        train.co_channels.add_co_pulse_chan_time("Dev1/ctr0", low_time=0.001, high_time=0.01)
        train.triggers.start_trigger.cfg_dig_edge_start_trig("/Dev1/PFI0")
        train.triggers.start_trigger.retriggerable = True
        made.ci_channels.add_ci_count_edges_chan("Dev1/ctr1")
        _at(made, "/Dev1/PFI12", "ci_count_edges_term")
        made.start()
        train.start()
        clock.advance(1.05)  # the edges from 0.1 to 1.0 s
        assert made.read() == 10
        assert not train.is_task_done()


# rules


def _with(add):
    def attempt(session):
        with task(session) as made:
            add(made)

    return attempt


def _two_tasks_on_one_counter(session):
    with task(session) as one, task(session) as two:
        for made in (one, two):
            made.ci_channels.add_ci_count_edges_chan("Dev1/ctr0")
            made.start()


def _count_with_implicit_timing(made):
    made.ci_channels.add_ci_count_edges_chan("Dev1/ctr0")
    made.timing.cfg_implicit_timing()


def _count_on_its_own_clock(made):
    made.ci_channels.add_ci_count_edges_chan("Dev1/ctr0")
    made.timing.cfg_samp_clk_timing(1000.0)
    made.start()


RULES = {
    "a fifth counter": (
        _with(lambda made: made.ci_channels.add_ci_count_edges_chan("Dev1/ctr4")),
        -200170,
    ),
    "two inputs in a task": (
        _with(lambda made: made.ci_channels.add_ci_count_edges_chan("Dev1/ctr0")
              and made.ci_channels.add_ci_count_edges_chan("Dev1/ctr2")),
        -200147,
    ),
    "a counter in use": (_two_tasks_on_one_counter, -50103),
    "limits the wrong way round": (
        _with(lambda made: made.ci_channels.add_ci_freq_chan("Dev1/ctr0", min_val=9, max_val=2)),
        -200082,
    ),
    "counts with implicit timing": (_with(_count_with_implicit_timing), -200077),
    "a clock that counters do not have": (_with(_count_on_its_own_clock), -200077),
    "a duty cycle above one": (
        _with(lambda made: made.co_channels.add_co_pulse_chan_freq("Dev1/ctr0", duty_cycle=1.5)),
        -200077,
    ),
    "pulses shorter than two ticks": (
        _with(lambda made: made.co_channels.add_co_pulse_chan_ticks(
            "Dev1/ctr0", "", low_ticks=1, high_ticks=5)),
        -200077,
    ),
    "an unknown terminal": (
        _with(lambda made: setattr(
            made.ci_channels.add_ci_count_edges_chan("Dev1/ctr0"),
            "ci_count_edges_term", "/Dev1/PFI99")),
        -89120,
    ),
}  # fmt: skip


@pytest.mark.parametrize(("attempt", "code"), RULES.values(), ids=RULES)
def test_a_counter_refuses(session, attempt, code):
    with pytest.raises(DaqError) as caught:
        attempt(session)
    assert caught.value.error_code == code


def test_a_reader_takes_counts_and_frequencies(counter):
    counter.ci_channels.add_ci_count_edges_chan("Dev1/ctr0")
    counter.timing.cfg_samp_clk_timing(500.0, source="/Dev1/PFI9", samps_per_chan=20)
    counts = np.zeros(20, dtype=np.uint32)
    assert CounterReader(counter.in_stream).read_many_sample_uint32(counts, 20) == 20
    assert np.diff(counts).tolist() == [2] * 19
