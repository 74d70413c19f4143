"""Where a read begins, what becomes of unread samples, and which read starts a task."""

import threading

import numpy as np
import pytest
from nidaqmx.constants import (
    READ_ALL_AVAILABLE,
    AcquisitionType,
    OverwriteMode,
    ReadRelativeTo,
    TaskMode,
)
from nidaqmx.errors import DaqError

from tests.tools.daqmx import HandClock, add_inputs, served, task

RATE = 10_000.0
BUFFER = 2000  # samples
ONE_SINE = 100  # samples, of a sine input


def code_of(call, *args, **named):
    """The code with which ``call`` is refused."""
    with pytest.raises(DaqError) as caught:
        call(*args, **named)
    return caught.value.error_code


@pytest.fixture
def clock():
    return HandClock()


@pytest.fixture
def session(clock):
    """A card whose inputs read a sine of 100 samples: a sample's value tells its number."""
    with served(clock=clock, sine=True, client_timeout=None) as card:
        yield card.session


def continuous(made, buffer=BUFFER):
    add_inputs(made, "ai5")
    made.timing.cfg_samp_clk_timing(RATE, sample_mode=AcquisitionType.CONTINUOUS)
    made.in_stream.input_buf_size = buffer


def sine(first, samples):
    """What an input with limits of 10 V reads from sample ``first`` on, in V."""
    return 0.6 * 10.0 * np.sin(2.0 * np.pi * (first + np.arange(samples)) / ONE_SINE)


@pytest.mark.parametrize("passed", [0.0345, 0.1234, 2.0717])  # s; the buffer holds 0.2 s
def test_the_newest_samples_are_read_and_the_others_overwritten(session, clock, passed):
    with task(session) as ai:
        continuous(ai)
        ai.in_stream.overwrite = OverwriteMode.OVERWRITE_UNREAD_SAMPLES
        ai.in_stream.relative_to = ReadRelativeTo.MOST_RECENT_SAMPLE
        ai.in_stream.offset = -10
        ai.start()
        for times in (1, 2, 3):
            clock.advance(passed)
            acquired = int(times * passed * RATE + 1e-6)
            assert ai.read(10, 2.0) == pytest.approx(sine(acquired - 10, 10), abs=1e-3)
            assert ai.in_stream.curr_read_pos == acquired
            assert ai.read(READ_ALL_AVAILABLE) == pytest.approx(sine(acquired - 10, 10), abs=1e-3)


@pytest.mark.parametrize("passed", [0.05, 0.45])
def test_places_of_a_read(session, clock, passed):
    with task(session) as ai:
        continuous(ai, buffer=8000)
        ai.start()
        clock.advance(passed)
        acquired = round(passed * RATE)
        for relative, offset, first in (
            (ReadRelativeTo.FIRST_SAMPLE, 0, 0),
            (ReadRelativeTo.FIRST_SAMPLE, 37, 37),
            (ReadRelativeTo.CURRENT_READ_POSITION, 0, 47),  # after the ten samples above
            (ReadRelativeTo.CURRENT_READ_POSITION, -20, 37),
            (ReadRelativeTo.CURRENT_READ_POSITION, 13, 60),
            (ReadRelativeTo.MOST_RECENT_SAMPLE, -100, acquired - 100),
            (ReadRelativeTo.FIRST_SAMPLE, 5, 5),
        ):
            ai.in_stream.relative_to, ai.in_stream.offset = relative, offset
            assert ai.read(10) == pytest.approx(sine(first, 10), abs=1e-3)
            assert ai.in_stream.curr_read_pos == first + 10
            assert ai.in_stream.avail_samp_per_chan == acquired - first - 10


def test_a_read_from_the_newest_waits_for_those_to_come(session, clock):
    with task(session) as ai:
        continuous(ai)
        ai.in_stream.relative_to = ReadRelativeTo.MOST_RECENT_SAMPLE
        ai.start()
        clock.advance(0.05)
        values = []
        reader = threading.Thread(target=lambda: values.extend(ai.read(20, 10.0)))
        reader.start()
        clock.until_somebody_waits()
        clock.advance(0.1)
        reader.join(30.0)
        assert values == pytest.approx(sine(500, 20), abs=1e-3)


def test_a_place_before_the_first_sample_is_refused(session, clock):
    with task(session) as ai:
        continuous(ai)
        ai.in_stream.relative_to = ReadRelativeTo.MOST_RECENT_SAMPLE
        ai.in_stream.offset = -10
        ai.start()
        clock.advance(0.0005)
        assert code_of(ai.read, 5) == -200277
        clock.advance(0.001)
        assert len(ai.read(5)) == 5


def test_a_place_that_needs_a_reference_trigger_is_refused_without_one(session, clock):
    with task(session) as ai:
        continuous(ai)
        ai.start()
        clock.advance(0.01)
        for place in (ReadRelativeTo.REFERENCE_TRIGGER, ReadRelativeTo.FIRST_PRETRIGGER_SAMPLE):
            ai.in_stream.relative_to = place
            assert code_of(ai.read, 5) == -200077


def test_reads_relative_to_a_reference_trigger(session, clock):
    with task(session) as ai:
        add_inputs(ai, "ai5")
        ai.timing.cfg_samp_clk_timing(RATE, samps_per_chan=100)
        ai.triggers.reference_trigger.cfg_anlg_edge_ref_trig("Dev1/ai5", 40, trigger_level=1.0)
        ai.start()
        clock.advance(0.1)
        record = ai.read(100)
        ai.stop()
        ai.in_stream.relative_to = ReadRelativeTo.REFERENCE_TRIGGER
        ai.in_stream.offset = -5
        ai.start()
        clock.advance(0.1)
        assert ai.read(10) == pytest.approx(record[35:45], abs=1e-3)


def test_unread_samples_that_were_overwritten_are_lost(session, clock):
    with task(session) as ai:
        continuous(ai)
        ai.in_stream.overwrite = OverwriteMode.OVERWRITE_UNREAD_SAMPLES
        ai.start()
        clock.advance(0.35)
        assert ai.in_stream.avail_samp_per_chan == BUFFER
        assert code_of(ai.read, 10) == -200279
        ai.in_stream.relative_to = ReadRelativeTo.MOST_RECENT_SAMPLE
        ai.in_stream.offset = -BUFFER
        assert ai.read(BUFFER) == pytest.approx(sine(3500 - BUFFER, BUFFER), abs=1e-3)


def test_without_overwriting_the_task_ends_when_the_buffer_is_full(session, clock):
    with task(session) as ai:
        continuous(ai)
        assert ai.in_stream.overwrite == OverwriteMode.DO_NOT_OVERWRITE_UNREAD_SAMPLES
        ai.start()
        clock.advance(0.35)
        assert code_of(ai.read, 10) == -200279
        assert code_of(ai.stop) == -200279


@pytest.mark.parametrize("kind", ["lines", "counter"])
def test_lines_and_counters_are_read_from_the_newest_too(session, clock, kind):
    with task(session) as made:
        if kind == "lines":
            made.di_channels.add_di_chan("Dev1/port0/line0:1")
            made.timing.cfg_samp_clk_timing(RATE, sample_mode=AcquisitionType.CONTINUOUS)
        else:
            made.ci_channels.add_ci_count_edges_chan("Dev1/ctr0")  # at PFI8: 1 kHz
            made.timing.cfg_samp_clk_timing(
                1000.0, source="/Dev1/PFI10", sample_mode=AcquisitionType.CONTINUOUS
            )
        made.in_stream.input_buf_size = 100
        made.in_stream.overwrite = OverwriteMode.OVERWRITE_UNREAD_SAMPLES
        made.in_stream.relative_to = ReadRelativeTo.MOST_RECENT_SAMPLE
        made.in_stream.offset = -4
        made.start()
        clock.advance(1.0002)
        found = np.array(made.read(4)).tolist()
        if kind == "lines":
            numbers = np.arange(9998, 10002)  # they count the samples
            assert found == (numbers & 0b11).tolist()
        else:
            assert np.diff(found).tolist() == [2.0, 2.0, 2.0]
            assert 990 <= found[-1] <= 1001


def test_a_read_that_must_not_start_the_task_is_refused(session):
    with task(session) as ai:
        continuous(ai)
        ai.in_stream.auto_start = False
        assert code_of(ai.read, 10) == -200473
        ai.control(TaskMode.TASK_RESERVE)
        assert code_of(ai.read, 10) == -200473
        ai.in_stream.auto_start = True
        ai.control(TaskMode.TASK_UNRESERVE)
    with task(session) as ai:
        add_inputs(ai, "ai5")
        ai.in_stream.auto_start = False
        assert code_of(ai.read) == -200834
        ai.start()
        assert isinstance(ai.read(), float)


def test_a_read_of_a_committed_task_waits_for_its_start(session, clock):
    with task(session) as ai:
        continuous(ai)
        ai.in_stream.auto_start = False
        ai.control(TaskMode.TASK_COMMIT)
        assert code_of(ai.read, 10, 0.0) == -200284
        values = []
        reader = threading.Thread(target=lambda: values.extend(ai.read(10, 10.0)))
        reader.start()
        clock.until_somebody_waits()
        ai.start()
        clock.advance(0.01)
        reader.join(30.0)
        assert values == pytest.approx(sine(0, 10), abs=1e-3)


@pytest.mark.parametrize("name", ["relative_to", "overwrite", "offset", "auto_start"])
def test_an_output_has_no_such_property(session, name):
    with task(session) as ao:
        ao.ao_channels.add_ao_voltage_chan("Dev1/ao1")
        assert code_of(getattr, ao.in_stream, name) == -200452
