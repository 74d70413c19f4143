"""The simulated card's digital lines: the enable line, the watchdog on it, and the wire."""

import nidaqmx
import numpy as np
import pytest
from nidaqmx.constants import (
    LineGrouping,
)
from nidaqmx.errors import DaqError, DaqWriteError
from nidaqmx.system import WatchdogTask
from nidaqmx.types import DOExpirationState

from dearig.drivers.contract.rig import RATE, lobes, play
from tests.tools.daqmx import (
    ENABLE,
    HandClock,
    add_inputs,
    add_output,
    clock_inputs,
    clock_output,
    enabled_rig,
    read,
    served,
    task,
    the_rig,
    volts,
)

HIGH, LOW = True, False


def test_the_history_proves_when_zero_was_reached():
    clock = HandClock()
    with served(clock=clock) as card, task(card.session) as ao:
        add_output(ao)
        clock.advance(2.0)
        clock_output(ao, RATE, 300)
        ao.write(np.concatenate((np.zeros(50), np.full(100, 5.0), np.zeros(150))))
        ao.start()
        clock.advance(1.0)
        assert [c.time for c in card.device.history()] == pytest.approx([0.0, 2.05, 2.15])
        assert [c.wire for c in card.device.history()] == pytest.approx([0.0, 5000.0, 0.0], abs=0.2)


@pytest.mark.parametrize("seconds", [None, 0.4])
def test_without_the_enable_line_the_film_gets_nothing(seconds):
    """``seconds`` is after how long the watchdog takes the line low."""
    waveform = lobes()
    with served(enabled_rig()) as card, task(card.session) as ao, task(card.session) as ai:
        line = nidaqmx.Task(grpc_options=card.session)
        line.do_channels.add_do_chan(f"Dev1/{ENABLE}")
        line.write(HIGH)
        dog = None
        if seconds is not None:
            dog = WatchdogTask("Dev1", timeout=0.1, grpc_options=card.session)
            dog.cfg_watchdog_do_expir_states(
                [DOExpirationState(f"Dev1/{ENABLE}", nidaqmx.constants.Level.LOW)]
            )
            dog.start()
        add_output(ao)
        add_inputs(ai, "ai0", "_ao0_vs_aognd")
        clock_output(ao, RATE, waveform.samples)
        clock_inputs(ai, RATE)
        ao.write(volts(waveform))
        ai.start()
        ao.start()
        parts = []
        for at in range(90, 300, 90):
            if dog is not None and at <= 180:
                dog.reset_timer()
            parts.append(read(ai, 90))
        counts = np.concatenate(parts, axis=1)
        own = play(the_rig(), waveform).counts
        np.testing.assert_array_equal(counts[1], own[0, :270])
        if dog is None:
            line.write(LOW)
            assert card.device.wire_voltage() == 0.0
            assert read(ai, 50)[0, 10:].max() < 20
        else:
            assert dog.expired
            assert card.device.line(ENABLE) is LOW
            assert card.device.wire_voltage() == 0.0
            # 0.1 s after the last reset at sample 90
            np.testing.assert_array_equal(counts[0, :190], own[1, :190])
            assert own[1, 195] > 1000
            assert np.abs(counts[0, 195:]).max() < 20
            with pytest.raises(DaqWriteError) as locked:
                line.write(HIGH)
            assert locked.value.error_code == -200678
            with pytest.raises(DaqError) as late:
                dog.reset_timer()
            assert late.value.error_code == -200644
            dog.clear_expiration()
            line.write(HIGH)
            assert card.device.line(ENABLE) is HIGH
            dog.close()
        line.close()


def test_digital_lines_hold_what_was_written(card, session):
    with task(session) as lines:
        lines.do_channels.add_do_chan(
            "Dev1/port0/line1:3", line_grouping=LineGrouping.CHAN_FOR_ALL_LINES
        )
        lines.write(0b101 << 1)
    levels = [card.device.line(f"port0/line{i}") for i in range(5)]
    assert levels == [False, True, False, True, False]
    each = LineGrouping.CHAN_PER_LINE
    with task(session) as lines:
        lines.do_channels.add_do_chan("Dev1/port0/line1:2", line_grouping=each)
        lines.write([False, True])
    assert [card.device.line(f"port0/line{i}") for i in (1, 2, 3)] == [False, True, True]


# events
