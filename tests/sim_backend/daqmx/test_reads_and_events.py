"""Reads, limits, names and events of the simulated card, as a program of NI's library sees them."""

import threading

import nidaqmx
import numpy as np
import pytest
from nidaqmx.constants import READ_ALL_AVAILABLE, AcquisitionType, Edge, Signal
from nidaqmx.errors import DaqError, RpcError
from nidaqmx.task.channels import AIChannel

from dearig.sim_backend.clock import PacedClock
from tests.tools.daqmx import add_inputs, add_output, read, served, task


def code_of(call, *args, **named):
    """The code with which ``call`` is refused."""
    with pytest.raises(DaqError) as caught:
        call(*args, **named)
    return caught.value.error_code


# limits of an output channel


@pytest.mark.parametrize("volts", [5.5, 9.0, -3.0, float("nan")])
@pytest.mark.parametrize("terminal", ["ao0", "ao1"])
def test_a_value_beyond_the_channels_limits_is_refused(card, session, terminal, volts):
    with task(session) as ao:
        ao.ao_channels.add_ao_voltage_chan(f"Dev1/{terminal}", min_val=0.0, max_val=5.0)
        ao.write(5.0)
        assert code_of(ao.write, volts) == -200561
    assert card.device.history()[-1].output == pytest.approx(5.0 if terminal == "ao0" else 0.0)


def test_a_waveform_beyond_the_channels_limits_is_refused(session):
    with task(session) as ao:
        ao.ao_channels.add_ao_voltage_chan("Dev1/ao1", min_val=0.0, max_val=5.0)
        ao.timing.cfg_samp_clk_timing(1000, samps_per_chan=10)
        assert code_of(ao.write, np.linspace(0, 9, 10)) == -200561
        assert ao.write(np.linspace(0, 5, 10)) == 10


# reads


@pytest.mark.parametrize("inputs", [("ai0",), ("ai0", "ai1")])
def test_a_read_of_all_gives_what_a_finite_task_acquires(session, inputs):
    with task(session) as ai:
        add_inputs(ai, *inputs)
        ai.timing.cfg_samp_clk_timing(1000, samps_per_chan=50)
        assert np.shape(np.atleast_2d(ai.read(READ_ALL_AVAILABLE))) == (len(inputs), 50)


def test_a_read_of_all_gives_what_waits_in_a_continuous_task(session):
    with task(session) as ai:
        add_inputs(ai, "ai0")
        ai.timing.cfg_samp_clk_timing(1000, sample_mode=AcquisitionType.CONTINUOUS)
        ai.start()
        assert read(ai, 100).shape == (1, 100)
        waiting = ai.in_stream.avail_samp_per_chan
        assert len(ai.read(READ_ALL_AVAILABLE)) >= waiting


def test_a_read_of_all_without_a_clock_gives_one_sample(session):
    with task(session) as ai:
        add_inputs(ai, "ai0")
        assert len(ai.read(READ_ALL_AVAILABLE)) == 1


def test_a_read_of_all_available_does_not_wait_for_the_end(session):
    with task(session) as ai:
        add_inputs(ai, "ai0")
        ai.timing.cfg_samp_clk_timing(1000, samps_per_chan=100)
        ai.in_stream.read_all_avail_samp = True
        ai.start()
        assert len(read(ai, 40)[0]) == 40
        assert len(ai.read(READ_ALL_AVAILABLE)) <= 60


def test_a_finite_read_of_more_than_is_left_gives_the_rest(session):
    with task(session) as ai:
        add_inputs(ai, "ai0")
        ai.timing.cfg_samp_clk_timing(1000, samps_per_chan=5)
        ai.start()
        assert len(ai.read(10)) == 5
        assert code_of(ai.read, 10) == -200278


@pytest.mark.parametrize("terminal", ["ao0", "ao1"])
def test_each_output_reads_back_what_stands_there(session, terminal):
    with task(session) as ao, task(session) as ai:
        add_output(ao, terminal)
        ao.write(1.234)
        ai.ai_channels.add_ai_voltage_chan(f"Dev1/_{terminal}_vs_aognd")
        assert ai.read() == pytest.approx(1.234, abs=1e-3)


@pytest.mark.parametrize("clock", ["", "/Dev1/ao/SampleClock"])
def test_each_output_reads_back_its_own_waveform(session, clock):
    with task(session) as ao, task(session) as ai:
        for terminal in ("ao0", "ao1"):
            add_output(ao, terminal)
            ai.ai_channels.add_ai_voltage_chan(f"Dev1/_{terminal}_vs_aognd")
        ao.timing.cfg_samp_clk_timing(1000, samps_per_chan=20)
        ai.timing.cfg_samp_clk_timing(1000, source=clock, samps_per_chan=20)
        wanted = np.array([np.linspace(0, 2, 20), np.linspace(3, 4, 20)])
        ao.write(wanted)
        ai.triggers.start_trigger.cfg_dig_edge_start_trig("/Dev1/ao/StartTrigger")
        ai.start()
        ao.start()
        assert np.array(ai.read(20)) == pytest.approx(wanted, abs=1e-3)


# names


def test_names_are_not_case_sensitive(session):
    with task(session) as ai:
        first = ai.ai_channels.add_ai_voltage_chan("dev1/AI0")
        ai.ai_channels.add_ai_voltage_chan("Dev1/ai1", "Monitor")
        assert first.ai_max == 5.0
        assert AIChannel(ai._handle, "mONITOR", ai._interpreter).physical_channel.name == "Dev1/ai1"
        assert code_of(ai.ai_channels.add_ai_voltage_chan, "Dev1/ai2", "monitor") == -200489


@pytest.mark.parametrize("name", ["volt", "volt0:2", "volt0, volt1, volt2"])
def test_channels_of_a_range_are_numbered(session, name):
    with task(session) as ai:
        ai.ai_channels.add_ai_voltage_chan("Dev1/ai0:2", name)
        assert ai.channel_names == ["volt0", "volt1", "volt2"]
        assert ai.ai_channels["volt0:2"].ai_max == 5.0


def test_a_channel_that_is_not_in_the_task_is_called_so(session):
    with task(session) as ai:
        add_inputs(ai, "ai0")
        nobody = AIChannel(ai._handle, "nobody", ai._interpreter)
        with pytest.raises(DaqError, match="nobody") as caught:
            _ = nobody.ai_max
        assert caught.value.error_code == -200486


# numbers and edges


@pytest.mark.parametrize("mode", [AcquisitionType.FINITE, AcquisitionType.CONTINUOUS])
def test_more_samples_than_a_buffer_can_have_are_refused(session, mode):
    with task(session) as ai:
        add_inputs(ai, "ai0")
        clock = ai.timing.cfg_samp_clk_timing
        assert code_of(clock, 1000, sample_mode=mode, samps_per_chan=2**40) == -200077


def test_the_edge_of_a_trigger_is_given_back(session):
    with task(session) as ai:
        add_inputs(ai, "ai0")
        ai.timing.cfg_samp_clk_timing(1000)
        start = ai.triggers.start_trigger
        start.cfg_dig_edge_start_trig("/Dev1/PFI0", Edge.FALLING)
        assert start.dig_edge_edge is Edge.FALLING
        start.dig_edge_edge = Edge.RISING
        assert start.dig_edge_edge is Edge.RISING


def test_what_is_not_simulated_is_one_line_in_the_log(session, caplog):
    with task(session) as made, pytest.raises(RpcError, match="not supported"):
        made.timing.cfg_handshaking_timing()
    told = [r.getMessage() for r in caplog.records]
    assert told == ["CfgHandshakingTiming is not simulated; the client is told so"]


# events


class Counted:
    """An event's calls, which come in a thread of the client's library.

    Kept is the argument in ``place``: 1 for the status, 2 for the number of samples.
    """

    def __init__(self, place):
        self._place = place
        self._changed = threading.Condition()
        self.calls = []

    def __call__(self, *args):
        with self._changed:
            self.calls.append(args[self._place])
            self._changed.notify_all()
        return 0

    def wait_for(self, number):
        with self._changed:
            assert self._changed.wait_for(lambda: len(self.calls) >= number, timeout=20.0)


def test_every_start_has_its_events_also_when_it_follows_at_once():
    with served(clock=PacedClock()) as card, task(card.session) as ai:
        add_inputs(ai, "ai0")
        ai.timing.cfg_samp_clk_timing(10_000, samps_per_chan=100)
        done, chunks = Counted(1), Counted(2)
        ai.register_done_event(done)
        ai.register_every_n_samples_acquired_into_buffer_event(10, chunks)
        for _ in range(5):
            ai.start()
            ai.wait_until_done(5)
            ai.stop()
        done.wait_for(5)
        chunks.wait_for(50)
        assert done.calls == [0] * 5
        assert chunks.calls == [10] * 50


def test_a_signal_comes_with_every_sample():
    with served(clock=PacedClock()) as card, task(card.session) as ai:
        add_inputs(ai, "ai0")
        ai.timing.cfg_samp_clk_timing(1000, samps_per_chan=20)
        samples = Counted(1)
        ai.register_signal_event(Signal.SAMPLE_COMPLETE, samples)
        ai.start()
        samples.wait_for(20)
        assert samples.calls == [Signal.SAMPLE_COMPLETE.value] * 20


def test_a_task_that_is_stopped_before_its_end_is_not_done():
    with served(clock=PacedClock()) as card, task(card.session) as ai:
        add_inputs(ai, "ai0")
        ai.timing.cfg_samp_clk_timing(1000, samps_per_chan=100_000)
        done = Counted(1)
        ai.register_done_event(done)
        ai.start()
        ai.stop()
        ai.timing.cfg_samp_clk_timing(10_000, samps_per_chan=10)
        ai.start()
        done.wait_for(1)
        assert done.calls == [0]


def _nothing(*_):
    return 0


def _acquired(made, every):
    made.register_every_n_samples_acquired_into_buffer_event(every, _nothing)


def _signalled(made, signal):
    made.register_signal_event(signal, _nothing)


def _transferred(made, every):
    made.register_every_n_samples_transferred_from_buffer_event(every, _nothing)


@pytest.mark.parametrize(
    ("kind", "register", "every", "code"),
    [
        ("ai", _acquired, (100, 100), -200966),
        ("ao", _transferred, (100, 100), -200967),
        ("ai", lambda made, _: made.register_done_event(_nothing), (0, 0), -200950),
        ("ai", _signalled, (Signal.SAMPLE_COMPLETE, Signal.SAMPLE_CLOCK), -200949),
        ("ai", _signalled, (Signal.CHANGE_DETECTION_EVENT,), -200987),
        ("ai", _transferred, (100,), -200980),
        ("ao", _acquired, (100,), -200981),
        ("ai", _acquired, (0,), -200880),
    ],
)
def test_an_event_that_a_task_cannot_have_is_refused(session, kind, register, every, code):
    with task(session) as made:
        add_inputs(made, "ai0") if kind == "ai" else add_output(made)
        made.timing.cfg_samp_clk_timing(1000)
        for number in every[:-1]:
            register(made, number)
        # the library itself refuses a second one; the card is asked by another user of the task
        with nidaqmx.Task(made.name, grpc_options=session_of(session, made.name)) as other:
            assert code_of(register, other, every[-1]) == code


def session_of(session, name):
    """A session that attaches to the task called ``name``."""
    return nidaqmx.GrpcSessionOptions(session.grpc_channel, name)


def test_an_interval_that_does_not_divide_the_buffer_is_refused(session):
    with task(session) as ai:
        add_inputs(ai, "ai0")
        ai.timing.cfg_samp_clk_timing(1000, sample_mode=AcquisitionType.CONTINUOUS)
        ai.in_stream.input_buf_size = 500
        _acquired(ai, 300)
        assert code_of(ai.start) == -200877
