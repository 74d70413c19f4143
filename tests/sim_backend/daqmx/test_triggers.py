"""Triggers, clocks from outside, exported signals and routes of the simulated card."""

import numpy as np
import pytest
from nidaqmx.constants import AcquisitionType, Edge, Level, Signal, Slope, TriggerType
from nidaqmx.errors import DaqError
from nidaqmx.system import System

from tests.tools.daqmx import HandClock, add_inputs, add_output, served, task

READ_BACK = "_ao0_vs_aognd"


@pytest.fixture
def clock():
    return HandClock()


@pytest.fixture
def hand(clock):
    """A card whose time only the test moves, with 10 Hz at PFI0 and 1 kHz at PFI8."""
    with served(clock=clock) as card:
        yield card


def _clocked(made, samples=None, rate=1000.0, **more):
    mode = AcquisitionType.CONTINUOUS if samples is None else AcquisitionType.FINITE
    made.timing.cfg_samp_clk_timing(rate, sample_mode=mode, samps_per_chan=samples or 1000, **more)


# the start


@pytest.mark.parametrize(("edge", "at"), [(Edge.RISING, 0.1), (Edge.FALLING, 0.05)])
def test_an_acquisition_begins_with_the_edge(hand, clock, edge, at):
    with task(hand.session) as ai:
        add_inputs(ai, "ai0")
        _clocked(ai)
        ai.triggers.start_trigger.cfg_dig_edge_start_trig("/Dev1/PFI0", edge)
        clock.advance(0.01)
        ai.start()
        clock.advance(at - 0.01 - 1e-4)
        assert ai.in_stream.avail_samp_per_chan == 0
        clock.advance(0.0201)
        assert ai.in_stream.avail_samp_per_chan == 20


def test_a_generation_begins_with_the_edge(hand, clock):
    with task(hand.session) as ao:
        add_output(ao)
        _clocked(ao, 100)
        ao.triggers.start_trigger.cfg_dig_edge_start_trig("/Dev1/PFI0")
        ao.write(np.full(100, 3.0))
        clock.advance(0.01)
        ao.start()
        clock.advance(0.08)
        assert hand.device.output_voltage() == 0.0
        clock.advance(0.02)
        assert hand.device.output_voltage() == pytest.approx(3.0, abs=1e-3)
        assert hand.device.history()[-1].time == pytest.approx(0.1)
        clock.advance(0.1)
        ao.wait_until_done(0.0)


def test_outputs_start_with_inputs_that_wait(hand, clock):
    with task(hand.session) as ao, task(hand.session) as ai:
        add_output(ao)
        _clocked(ao, 100)
        ao.write(np.full(100, 3.0))
        ao.triggers.start_trigger.cfg_dig_edge_start_trig("/Dev1/ai/StartTrigger")
        add_inputs(ai, "ai0")
        _clocked(ai, 100)
        ai.triggers.start_trigger.cfg_dig_edge_start_trig("/Dev1/PFI0")
        ao.start()
        clock.advance(0.01)
        ai.start()
        clock.advance(0.05)
        assert hand.device.output_voltage() == 0.0
        clock.advance(0.06)
        assert hand.device.output_voltage() == pytest.approx(3.0, abs=1e-3)


def test_each_edge_gives_a_record_of_a_retriggerable_task(hand, clock):
    with task(hand.session) as ai:
        add_inputs(ai, "ai0")
        _clocked(ai, 30)
        ai.triggers.start_trigger.cfg_dig_edge_start_trig("/Dev1/PFI0")
        ai.triggers.start_trigger.retriggerable = True
        ai.in_stream.input_buf_size = 10_000
        clock.advance(0.01)
        ai.start()
        clock.advance(0.5)  # the edges from 0.1 to 0.5 s, the last 10 ms ago
        assert ai.in_stream.avail_samp_per_chan == 4 * 30 + 10
        assert len(ai.read(90)) == 90
        assert not ai.is_task_done()


def test_an_output_is_retriggered(hand, clock):
    with task(hand.session) as ao:
        add_output(ao)
        _clocked(ao, 20)
        ao.triggers.start_trigger.cfg_dig_edge_start_trig("/Dev1/PFI0")
        ao.triggers.start_trigger.retriggerable = True
        ao.write(np.r_[np.full(10, 2.0), np.zeros(10)])
        clock.advance(0.01)
        ao.start()
        clock.advance(0.35)
        hand.device.output_voltage()
        rises = [c.time for c in hand.device.history() if c.output > 1.0]
        assert rises == pytest.approx([0.1, 0.2, 0.3])


# the reference


def _ramp(ao, samples=2000):
    """Let the output begin with the inputs, with 1 mV more for each sample."""
    add_output(ao)
    _clocked(ao, samples)
    ao.write(np.arange(samples) * 1e-3)
    ao.triggers.start_trigger.cfg_dig_edge_start_trig("/Dev1/ai/StartTrigger")
    ao.start()


def test_samples_before_and_after_the_edge_are_read(session):
    with task(session) as ao, task(session) as ai:
        _ramp(ao)
        add_inputs(ai, READ_BACK)
        _clocked(ai, 100)
        ai.triggers.reference_trigger.cfg_dig_edge_ref_trig("/Dev1/PFI0", pretrigger_samples=40)
        assert ai.triggers.reference_trigger.trig_type is TriggerType.DIGITAL_EDGE
        assert ai.triggers.reference_trigger.dig_edge_src == "/Dev1/PFI0"
        ai.start()
        volts = np.array(ai.read(100))
    # PFI0 rises at 0.1 s, when 101 samples were taken from 0 s on
    assert volts == pytest.approx(np.arange(61, 161) * 1e-3, abs=1e-3)


def test_the_reference_waits_for_the_samples_before_it(session):
    with task(session) as ao, task(session) as ai:
        _ramp(ao)
        add_inputs(ai, READ_BACK)
        _clocked(ai, 300)
        # the edge at 0.1 s comes before there are 150 samples
        ai.triggers.reference_trigger.cfg_dig_edge_ref_trig("/Dev1/PFI0", pretrigger_samples=150)
        ai.start()
        volts = np.array(ai.read(300))
    assert volts[0] == pytest.approx((201 - 150) * 1e-3, abs=1e-3)


@pytest.mark.parametrize(("slope", "first"), [(Slope.RISING, 251), (Slope.FALLING, None)])
def test_a_level_starts_or_is_the_reference(session, slope, first):
    with task(session) as ao, task(session) as ai:
        _ramp(ao, 1000)
        add_inputs(ai, READ_BACK)
        _clocked(ai, 100)
        ai.triggers.reference_trigger.cfg_anlg_edge_ref_trig(
            f"Dev1/{READ_BACK}", pretrigger_samples=50, trigger_slope=slope, trigger_level=0.25
        )
        ai.start()
        if first is None:
            with pytest.raises(DaqError) as caught:
                ai.read(100, timeout=2.0)
            assert caught.value.error_code == -200284
        else:
            volts = np.array(ai.read(100))
            assert volts[50] == pytest.approx(first * 1e-3, abs=2e-3)
            assert volts[49] <= 0.25 + 1e-3


def test_an_analog_start_begins_at_the_level(session):
    with task(session) as ao, task(session) as ai:
        _ramp(ao)
        add_inputs(ai, READ_BACK)
        _clocked(ai, 20)
        ai.triggers.start_trigger.cfg_anlg_edge_start_trig(
            f"Dev1/{READ_BACK}", Slope.RISING, trigger_level=0.5
        )
        ai.start()
        volts = np.array(ai.read(20))
    assert volts == pytest.approx(np.arange(501, 521) * 1e-3, abs=2e-3)


# pauses and clocks


def test_a_pause_leaves_out_samples(hand, clock):
    with task(hand.session) as ai:
        add_inputs(ai, "ai0")
        _clocked(ai)
        pause = ai.triggers.pause_trigger
        pause.trig_type = TriggerType.DIGITAL_LEVEL
        pause.dig_lvl_src, pause.dig_lvl_when = "/Dev1/PFI0", Level.HIGH
        assert pause.dig_lvl_when is Level.HIGH
        ai.start()
        clock.advance(1.0)  # PFI0 is high for half of the time
        assert ai.in_stream.avail_samp_per_chan == pytest.approx(500, abs=1)


def test_inputs_take_a_clock_at_a_terminal(hand, clock):
    with task(hand.session) as ai:
        add_inputs(ai, "ai0", "ai1")
        _clocked(ai, source="/Dev1/PFI9", rate=500.0)
        clock.advance(0.001)
        ai.start()
        clock.advance(1.0)
        assert ai.in_stream.avail_samp_per_chan == 500


# signals that the card puts out


def _count(made, terminal):
    made.ci_channels.add_ci_count_edges_chan("Dev1/ctr3")
    made.ci_channels[0].ci_count_edges_term = terminal
    made.start()


def test_an_exported_clock_can_be_counted(hand, clock):
    with task(hand.session) as ai, task(hand.session) as made:
        add_inputs(ai, "ai0")
        _clocked(ai)
        ai.export_signals.export_signal(Signal.SAMPLE_CLOCK, "/Dev1/PFI5")
        assert ai.export_signals.samp_clk_output_term == "/Dev1/PFI5"
        _count(made, "/Dev1/PFI5")
        clock.advance(0.5)
        ai.start()
        clock.advance(0.2495)
        assert made.read() in (249, 250)


def test_a_route_connects_two_terminals(hand, clock):
    system = System.remote(hand.session)
    with task(hand.session) as made:
        _count(made, "/Dev1/PFI5")
        clock.advance(0.1)
        assert made.read() == 0
        system.connect_terms("/Dev1/PFI8", "/Dev1/PFI5")
        clock.advance(0.1)
        assert made.read() == 100
        system.disconnect_terms("/Dev1/PFI8", "/Dev1/PFI5")
        clock.advance(0.1)
        assert made.read() == 100


# rules


def _reference_on_continuous(ai):
    _clocked(ai)
    ai.triggers.reference_trigger.cfg_dig_edge_ref_trig("/Dev1/PFI8", 50)
    ai.start()


def _too_many_before(ai):
    _clocked(ai, 100)
    ai.triggers.reference_trigger.cfg_dig_edge_ref_trig("/Dev1/PFI8", 99)
    ai.start()


def _level_of_another_channel(ai):
    _clocked(ai, 100)
    ai.triggers.start_trigger.cfg_anlg_edge_start_trig("Dev1/ai9")


RULES = {
    "a reference of a continuous task": (_reference_on_continuous, -200358),
    "no samples after the reference": (_too_many_before, -200077),
    "the level of a channel that is not read": (_level_of_another_channel, -200077),
    "an edge of a terminal that is not there": (
        lambda ai: ai.triggers.reference_trigger.cfg_dig_edge_ref_trig("/Dev1/PFI77", 50), -89120),
    "a file of the driver": (
        lambda ai: ai.in_stream.configure_logging("file.tdms"), -201380),
    "a power supply": (
        lambda ai: ai.ai_channels.add_ai_power_chan("Dev1/power", 0, 0, False), -200431),
}  # fmt: skip


@pytest.mark.parametrize(("attempt", "code"), RULES.values(), ids=RULES)
def test_a_trigger_refuses(session, attempt, code):
    with task(session) as ai:
        add_inputs(ai, "ai0")
        with pytest.raises(DaqError) as caught:
            attempt(ai)
    assert caught.value.error_code == code
