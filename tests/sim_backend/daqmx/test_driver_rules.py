"""Rules of NI's driver that a program meets: coerced rates, counted names, states of a task."""

import numpy as np
import pytest
from nidaqmx.constants import AcquisitionType, LineGrouping, TaskMode
from nidaqmx.errors import DaqError

from dearig.config.rigfile import RigFile
from dearig.drivers.settings import CardSettings
from tests.tools.daqmx import add_inputs, add_output, served, task

NOT_WHILE_RUNNING, ONLY_WHEN_RESERVED = -200479, -200983


def code_of(call, *args, **named):
    """The code with which ``call`` is refused."""
    with pytest.raises(DaqError) as caught:
        call(*args, **named)
    return caught.value.error_code


# rates: the input truncates the divisor of the 100 MHz timebase, the output rounds it


@pytest.mark.parametrize(
    ("asked", "inputs", "divisor"),
    [
        (300e3, 1, 333),
        (600e3, 1, 166),  # 166.67
        (1.1e6, 1, 90),  # 90.91
        (1.99e6, 1, 50),  # 50.25
        (2e6, 1, 50),
        (70e3, 1, 1428),  # 1428.57
        (70e3, 3, 1428),
        (300.7e3, 3, 332),  # 332.56
        (1000.0, 2, 100_000),
        (0.03, 1, 3_333_333_333),
        (1e8 / 166, 1, 166),  # a rate that was given back is given back again
        (1e8 / 90, 1, 90),
    ],
)
def test_an_analog_input_truncates_the_divisor(session, asked, inputs, divisor):
    with task(session) as ai:
        add_inputs(ai, *(f"ai{i}" for i in range(inputs)))
        ai.timing.cfg_samp_clk_timing(asked)
        assert ai.timing.samp_clk_rate == pytest.approx(1e8 / divisor, rel=1e-12)
        assert ai.timing.samp_clk_timebase_div == divisor
        ai.timing.samp_clk_rate = ai.timing.samp_clk_rate
        assert ai.timing.samp_clk_timebase_div == divisor


@pytest.mark.parametrize(
    ("asked", "outputs", "divisor"),
    [(600e3, 1, 167), (1.1e6, 1, 91), (70e3, 1, 1429), (70e3, 2, 1429), (300.2e3, 2, 333)],
)
def test_an_analog_output_rounds_the_divisor(session, asked, outputs, divisor):
    with task(session) as ao:
        for terminal in range(outputs):
            ao.ao_channels.add_ao_voltage_chan(f"Dev1/ao{terminal}")
        ao.timing.cfg_samp_clk_timing(asked)
        assert ao.timing.samp_clk_rate == pytest.approx(1e8 / divisor, rel=1e-12)


def test_no_rate_is_coerced_beyond_the_highest():
    rig = RigFile(card=CardSettings(ai_rate_max_kHz=600.0))
    with served(rig) as card, task(card.session) as ai:
        add_inputs(ai, "ai0")
        highest = ai.timing.samp_clk_max_rate
        ai.timing.cfg_samp_clk_timing(highest)
        assert ai.timing.samp_clk_rate == pytest.approx(1e8 / 84)  # 83 would be above 1.2 MHz
        ai.control(TaskMode.TASK_VERIFY)


# names


@pytest.mark.parametrize(
    ("given", "names"),
    [
        ("myChan09", ["myChan09", "myChan10", "myChan11", "myChan12"]),
        ("myChan", ["myChan0", "myChan1", "myChan2", "myChan3"]),
        ("in8", ["in8", "in9", "in10", "in11"]),
        ("in099", ["in099", "in100", "in101", "in102"]),
        ("in0", ["in0", "in1", "in2", "in3"]),
        ("4", ["4", "5", "6", "7"]),
        ("a1b", ["a1b0", "a1b1", "a1b2", "a1b3"]),
        ("in08:11", ["in08", "in09", "in10", "in11"]),
    ],
)
def test_a_name_is_counted_on_from_its_number(session, given, names):
    with task(session) as ai:
        ai.ai_channels.add_ai_voltage_chan("Dev1/ai0:3", name_to_assign_to_channel=given)
        assert ai.channel_names == names


def test_names_of_lines_and_outputs_are_counted_on_too(session):
    with task(session) as do, task(session) as ao:
        do.do_channels.add_do_chan("Dev1/port0/line0:1", "valve9", LineGrouping.CHAN_PER_LINE)
        assert do.channel_names == ["valve9", "valve10"]
        ao.ao_channels.add_ao_voltage_chan("Dev1/ao0:1", "out1")
        assert ao.channel_names == ["out1", "out2"]


# states


def _clocked_input(made):
    add_inputs(made, "ai0")
    made.timing.cfg_samp_clk_timing(1000.0, samps_per_chan=100)


def _input_on_demand(made):
    add_inputs(made, "ai0")


def _clocked_output(made):
    add_output(made)
    made.timing.cfg_samp_clk_timing(1000.0, samps_per_chan=100)
    made.write(np.zeros(100), auto_start=False)


def _lines(made):
    made.do_channels.add_do_chan("Dev1/port0/line0")


def _clocked_lines(made):
    made.di_channels.add_di_chan("Dev1/port0/line0")
    made.timing.cfg_samp_clk_timing(1000.0, samps_per_chan=100)


def _counter(made):
    made.ci_channels.add_ci_count_edges_chan("Dev1/ctr0")


def _pulses(made):
    made.co_channels.add_co_pulse_chan_freq("Dev1/ctr0")


@pytest.mark.parametrize(
    "set_up",
    [
        _clocked_input,
        _input_on_demand,
        _clocked_output,
        _lines,
        _clocked_lines,
        _counter,
        _pulses,
    ],
)
def test_a_running_task_is_not_started_again(session, set_up):
    with task(session) as made:
        set_up(made)
        made.start()
        assert code_of(made.start) == NOT_WHILE_RUNNING
        assert code_of(made.control, TaskMode.TASK_START) == NOT_WHILE_RUNNING
        made.stop()


def test_a_finite_task_is_stopped_before_it_is_started_again(session):
    with task(session) as ao:
        add_output(ao)
        ao.timing.cfg_samp_clk_timing(1000.0, samps_per_chan=3000)
        assert ao.write([0.0] * 3000, auto_start=True) == 3000
        ao.wait_until_done(5.0)
        assert code_of(ao.start) == NOT_WHILE_RUNNING
        ao.stop()


_INPUT = ("avail_samp_per_chan", "curr_read_pos", "total_samp_per_chan_acquired")
_OUTPUT = ("curr_write_pos", "space_avail", "total_samp_per_chan_generated")


@pytest.mark.parametrize("name", _INPUT)
@pytest.mark.parametrize("set_up", [_clocked_input, _clocked_lines, _counter])
def test_a_task_at_rest_has_no_samples_to_count(session, set_up, name):
    with task(session) as made:
        set_up(made)
        assert code_of(getattr, made.in_stream, name) == ONLY_WHEN_RESERVED
        made.start()
        assert getattr(made.in_stream, name) >= 0
        made.stop()
        assert code_of(getattr, made.in_stream, name) == ONLY_WHEN_RESERVED


@pytest.mark.parametrize("name", _OUTPUT)
def test_an_output_at_rest_has_no_samples_to_count(session, name):
    with task(session) as ao:
        add_output(ao)
        ao.timing.cfg_samp_clk_timing(1000.0, samps_per_chan=100)
        assert code_of(getattr, ao.out_stream, name) == ONLY_WHEN_RESERVED
        ao.write(np.zeros(100), auto_start=False)  # reserves and commits it
        assert getattr(ao.out_stream, name) >= 0
        ao.control(TaskMode.TASK_UNRESERVE)
        assert code_of(getattr, ao.out_stream, name) == ONLY_WHEN_RESERVED


def test_a_reserved_task_has_counts_of_zero(session):
    with task(session) as ai:
        add_inputs(ai, "ai0")
        ai.timing.cfg_samp_clk_timing(1000.0, sample_mode=AcquisitionType.CONTINUOUS)
        ai.control(TaskMode.TASK_RESERVE)
        assert [getattr(ai.in_stream, name) for name in _INPUT] == [0, 0, 0]
        ai.start()
        assert len(ai.read(50)) == 50
        assert ai.in_stream.curr_read_pos == 50
        assert ai.in_stream.total_samp_per_chan_acquired >= 50
        ai.stop()  # goes back to the state before the start
        assert ai.in_stream.avail_samp_per_chan == 0
