"""Digital lines of the simulated card: read at once and with a clock, and written with a clock."""

import nidaqmx
import numpy as np
import pytest
from nidaqmx.constants import AcquisitionType, Level, LineGrouping
from nidaqmx.errors import DaqError
from nidaqmx.stream_readers import DigitalSingleChannelReader
from nidaqmx.stream_writers import DigitalSingleChannelWriter
from nidaqmx.system import WatchdogTask
from nidaqmx.types import DOExpirationState
from nitypes.waveform import DigitalWaveform

from tests.tools.daqmx import ENABLE, HandClock, add_output, enabled_rig, served, task

TOGETHER, EACH = LineGrouping.CHAN_FOR_ALL_LINES, LineGrouping.CHAN_PER_LINE


@pytest.fixture
def clock():
    return HandClock()


@pytest.fixture
def hand(clock):
    with served(clock=clock) as card:
        yield card


def test_inputs_read_what_outputs_write(session):
    # port0/line4 to line7 are wired to line0 to line3
    with task(session) as out, task(session) as made:
        out.do_channels.add_do_chan("Dev1/port0/line0:3", line_grouping=EACH)
        made.di_channels.add_di_chan("Dev1/port0/line4:7", line_grouping=EACH)
        for levels in ([True, False, True, True], [False, True, False, False]):
            out.write(levels)
            assert made.read() == levels


def test_a_port_is_read_as_a_number(session):
    with task(session) as out, task(session) as made:
        out.do_channels.add_do_chan("Dev1/port0/line0:3", line_grouping=TOGETHER)
        made.di_channels.add_di_chan("Dev1/port0", line_grouping=TOGETHER)
        out.write(0b0110)
        assert made.read() == 0b01100110
        assert made.di_channels[0].di_num_lines == 8


def test_the_line_of_a_terminal_has_its_signal():
    with served(signals={"pfi9": "1 Hz"}) as card, task(card.session) as made:
        made.di_channels.add_di_chan("Dev1/port2/line1")  # PFI9
        assert made.read() is True


def test_a_clock_samples_the_lines_at_its_edges(session):
    with (
        served(signals={"port0/line0": "100 Hz", "port0/line1": "50 Hz"}) as card,
        task(card.session) as made,
    ):
        made.di_channels.add_di_chan("Dev1/port0/line0:1", line_grouping=TOGETHER)
        made.timing.cfg_samp_clk_timing(1000.0, samps_per_chan=40)
        values = np.array(made.read(40))
    assert values[:20].tolist() == [3] * 5 + [2] * 5 + [1] * 5 + [0] * 5
    assert values[20:].tolist() == values[:20].tolist()


def test_inputs_share_the_clock_of_the_analog_inputs(session):
    with task(session) as ai, task(session) as di:
        ai.ai_channels.add_ai_voltage_chan("Dev1/ai0")
        ai.timing.cfg_samp_clk_timing(1000.0, sample_mode=AcquisitionType.CONTINUOUS)
        di.di_channels.add_di_chan("Dev1/port0", line_grouping=TOGETHER)
        di.timing.cfg_samp_clk_timing(
            1000.0, "/Dev1/ai/SampleClock", sample_mode=AcquisitionType.CONTINUOUS
        )
        di.start()
        ai.start()
        assert len(ai.read(500)) == len(di.read(500)) == 500


def test_the_first_sample_of_a_shared_clock_is_at_the_start():
    signals = {"port0/line0": "50 Hz, 10 %"}
    with (
        served(signals=signals) as card,
        task(card.session) as ai,
        task(card.session) as di,
    ):
        ai.ai_channels.add_ai_voltage_chan("Dev1/ai0")
        ai.timing.cfg_samp_clk_timing(1000.0, samps_per_chan=40)
        di.di_channels.add_di_chan("Dev1/port0/line0")
        di.timing.cfg_samp_clk_timing(1000.0, "/Dev1/ai/SampleClock", samps_per_chan=40)
        di.start()
        ai.start()
        levels = di.read(40)
    assert levels == ([True] * 2 + [False] * 18) * 2


def test_a_finite_generation_shows_each_sample(hand, clock):
    with task(hand.session) as out:
        out.do_channels.add_do_chan("Dev1/port0/line0:2", line_grouping=TOGETHER)
        out.timing.cfg_samp_clk_timing(10.0, samps_per_chan=4)
        out.write([1, 2, 4, 3], auto_start=True)
        seen = []
        for _ in range(4):
            clock.advance(0.05)
            seen.append([int(hand.device.line(f"port0/line{i}")) for i in range(3)])
            clock.advance(0.05)
        assert seen == [[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 0]]
        out.wait_until_done(0.0)
    assert hand.device.line("port0/line1") is True


def test_a_pattern_repeats_until_it_is_stopped(session):
    with task(session) as out, task(session) as made:
        out.do_channels.add_do_chan("Dev1/port0/line0")
        out.timing.cfg_samp_clk_timing(1000.0, sample_mode=AcquisitionType.CONTINUOUS)
        out.write([True, False, False, False])
        made.ci_channels.add_ci_freq_chan("Dev1/ctr0", min_val=2.0, max_val=1e5)
        made.ci_channels[0].ci_freq_term = "port0/line0"
        out.start()
        assert made.read() == pytest.approx(250.0)


def test_without_regeneration_a_late_writer_is_told(hand, clock):
    with task(hand.session) as out:
        out.do_channels.add_do_chan("Dev1/port0/line0")
        out.timing.cfg_samp_clk_timing(1000.0, sample_mode=AcquisitionType.CONTINUOUS)
        out.out_stream.regen_mode = nidaqmx.constants.RegenerationMode.DONT_ALLOW_REGENERATION
        out.write([True, False] * 50)
        out.start()
        clock.advance(0.5)
        with pytest.raises(DaqError) as caught:
            out.write([True, False])
        assert caught.value.error_code == -200290


def test_a_waveform_has_the_highest_line_of_a_port_first(hand, clock):
    with task(hand.session) as out, task(hand.session) as made:
        out.do_channels.add_do_chan("Dev1/port0", line_grouping=TOGETHER)
        out.timing.cfg_samp_clk_timing(1000.0, samps_per_chan=8)
        pattern = DigitalWaveform.from_port([1 << i for i in range(8)], mask=0xFF)
        made.di_channels.add_di_chan("Dev1/port0", line_grouping=TOGETHER)
        made.timing.cfg_samp_clk_timing(1000.0, "/Dev1/do/SampleClock", samps_per_chan=8)
        out.write(pattern)
        made.start()
        clock.advance(0.01)
        out.start()
        clock.advance(0.1)
        waveform = made.read_waveform(8)
        names = [signal.name for signal in waveform.signals]
    assert names == [f"Dev1/port0/line{i}" for i in range(8)]
    assert waveform.data.shape == (8, 8)
    # the clock's first edge is where the first sample comes
    assert waveform.data.tolist() == pattern.data.tolist()


def test_readers_and_writers_take_bytes_and_words(session):
    with task(session) as out, task(session) as made:
        out.do_channels.add_do_chan("Dev1/port0/line0:3", line_grouping=TOGETHER)
        made.di_channels.add_di_chan("Dev1/port0", line_grouping=TOGETHER)
        DigitalSingleChannelWriter(out.out_stream, auto_start=True).write_one_sample_port_byte(5)
        reader = DigitalSingleChannelReader(made.in_stream)
        assert reader.read_one_sample_port_uint32() == 0b01010101
        assert reader.read_one_sample_port_byte() == 0b01010101
        assert reader.read_one_sample_port_uint16() == 0b01010101


# the enable line


def test_the_film_follows_a_clocked_enable_line(clock):
    with (
        served(enabled_rig(), clock=clock) as card,
        task(card.session) as ao,
        task(card.session) as line,
    ):
        add_output(ao)
        ao.write(5.0)
        line.do_channels.add_do_chan(f"Dev1/{ENABLE}")
        line.timing.cfg_samp_clk_timing(10.0, samps_per_chan=3)
        line.write([True, False, False], auto_start=True)
        clock.advance(0.05)
        assert card.device.wire_voltage() == pytest.approx(5000.0, abs=0.5)
        clock.advance(0.1)
        assert card.device.wire_voltage() == 0.0
        changes = [(c.time, round(c.wire)) for c in card.device.history()]
    assert changes[-2:] == [(pytest.approx(0.0), 5000), (pytest.approx(0.1), 0)]


def test_the_watchdog_ends_a_generation_on_the_enable_line(clock):
    with (
        served(enabled_rig(), clock=clock) as card,
        task(card.session) as ao,
        task(card.session) as line,
    ):
        dog = WatchdogTask("Dev1", timeout=0.25, grpc_options=card.session)
        dog.cfg_watchdog_do_expir_states([DOExpirationState(f"Dev1/{ENABLE}", Level.LOW)])
        dog.start()
        add_output(ao)
        ao.write(5.0)
        line.do_channels.add_do_chan(f"Dev1/{ENABLE}")
        line.timing.cfg_samp_clk_timing(10.0, sample_mode=AcquisitionType.CONTINUOUS)
        line.write([True, False], auto_start=True)
        clock.advance(0.05)
        assert card.device.wire_voltage() > 4000.0
        for _ in range(20):
            clock.advance(0.1)
            late = card.device.wire_voltage()
        assert (dog.expired, late) == (True, 0.0)
        with pytest.raises(DaqError) as caught:
            line.stop()
        assert caught.value.error_code == -200678
        dog.close()


# rules


def _clock_on_port_1(made):
    made.di_channels.add_di_chan("Dev1/port1/line0")
    made.timing.cfg_samp_clk_timing(1000.0)
    made.start()


RULES = {
    "a clock for port 1": (_clock_on_port_1, -200077),
    "a line that is not there": (
        lambda made: made.di_channels.add_di_chan("Dev1/port0/line9"), -200170),
    "a port that is not there": (lambda made: made.di_channels.add_di_chan("Dev1/port7"), -200170),
    "lines in and out": (
        lambda made: (made.di_channels.add_di_chan("Dev1/port0/line0"),
                      made.do_channels.add_do_chan("Dev1/port0/line1")), -200559),
}  # fmt: skip


@pytest.mark.parametrize(("attempt", "code"), RULES.values(), ids=RULES)
def test_the_lines_refuse(session, attempt, code):
    with task(session) as made, pytest.raises(DaqError) as caught:
        attempt(made)
    assert caught.value.error_code == code
