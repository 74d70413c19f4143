"""The simulated card as an unmodified nidaqmx client meets it: its data, its rules, its codes."""

import threading

import numpy as np
import pytest
from nidaqmx.constants import (
    AcquisitionType,
    ChannelType,
    DigitalWidthUnits,
    TerminalConfiguration,
)
from nidaqmx.errors import DaqError, DaqReadError, DaqWriteError
from nidaqmx.stream_readers import AnalogMultiChannelReader, AnalogUnscaledReader
from nidaqmx.stream_writers import AnalogUnscaledWriter
from nidaqmx.system import Device, System

from dearig.config.rigfile import RigFile
from dearig.drivers.contract.rig import RATE, begin, drain, lobes, play
from dearig.drivers.gate import ramp_down
from dearig.sim_backend.factory import open_simulated_rig
from tests.tools.daqmx import (
    AO_CLOCK,
    ENABLE,
    HandClock,
    add_inputs,
    add_output,
    as_the_rig_file_says,
    clock_inputs,
    clock_output,
    connected,
    in_thread,
    play_finite,
    read,
    served,
    task,
    the_rig,
    volts,
    write,
)

HIGH, LOW = True, False
LONG = lobes(peaks=(8000.0,) * 66)  # some chunks long


# what it says of itself


def test_it_says_what_it_is(session):
    system = System(session)
    assert [device.name for device in system.devices] == ["Dev1"]
    assert system.driver_version.major_version > 20
    device = Device("Dev1", grpc_options=session)
    assert device.product_type == "PCIe-6361"
    assert device.serial_num > 0
    assert device.is_simulated
    assert device.ai_physical_chans.channel_names[:2] == ["Dev1/ai0", "Dev1/ai1"]
    assert len(device.ai_physical_chans) == 16
    assert device.ao_physical_chans.channel_names == ["Dev1/ao0", "Dev1/ao1"]
    assert f"Dev1/{ENABLE}" in device.do_lines.channel_names
    assert device.ai_max_multi_chan_rate == 1e6
    assert device.ai_max_single_chan_rate == 2e6
    assert device.ao_max_rate == 2.86e6
    assert device.ai_voltage_rngs[-2:] == [-10.0, 10.0]
    assert device.ao_voltage_rngs == [-10.0, 10.0]
    assert TerminalConfiguration.DIFF in device.ai_physical_chans["ai3"].ai_term_cfgs
    assert TerminalConfiguration.DIFF not in device.ai_physical_chans["ai8"].ai_term_cfgs
    device.self_test_device()


def test_an_input_says_range_wiring_and_scaling(inputs, session):
    channel = inputs.ai_channels.add_ai_voltage_chan("Dev1/ai4", "fine", min_val=-1.5, max_val=0.9)
    assert channel.physical_channel.name == "Dev1/ai4"
    assert channel.chan_type is ChannelType.ANALOG_INPUT
    assert (channel.ai_min, channel.ai_max) == (-2.0, 2.0)
    assert (channel.ai_rng_low, channel.ai_rng_high) == (-2.0, 2.0)
    assert channel.ai_term_cfg is TerminalConfiguration.DIFF
    assert channel.ai_raw_samp_size == 16
    assert inputs.channel_names == ["Dev1/ai0", "Dev1/ai1", "Dev1/ai2", "fine"]
    own = the_rig().identify().channels
    for place, name in enumerate(inputs.channel_names[:3]):
        coefficients = tuple(inputs.ai_channels[name].ai_dev_scaling_coeff)
        assert coefficients == own[place + 1].scaling.coefficients
    assert inputs.ai_channels["fine"].ai_dev_scaling_coeff == [0.0, 2.0 / 32768, 0.0, 0.0]


def test_an_output_says_range_and_scaling(output):
    channel = output.ao_channels[0]
    assert (channel.ao_dac_rng_low, channel.ao_dac_rng_high) == (-10.0, 10.0)
    assert channel.ao_dev_scaling_coeff == [0.0, 3276.8]
    assert output.devices[0].name == "Dev1"


def test_rates_and_delays_are_what_the_timebase_makes_of_them(output, inputs):
    clock_output(output, 997.0, 100)
    assert output.timing.samp_clk_rate == 1e8 / 100301
    clock_inputs(inputs, 997.0, 100, source="")
    assert inputs.timing.samp_clk_rate == 1e8 / 100300  # NI truncates the divisor of an input
    inputs.timing.ai_conv_rate = 150e3
    assert inputs.timing.ai_conv_rate == 1e8 / 667
    inputs.timing.delay_from_samp_clk_delay = 12.3456e-6
    assert inputs.timing.delay_from_samp_clk_delay == pytest.approx(12.35e-6, rel=1e-12)
    inputs.timing.delay_from_samp_clk_delay_units = DigitalWidthUnits.TICKS
    assert inputs.timing.delay_from_samp_clk_delay == 1235.0


def test_an_unset_conversion_rate_leaves_time_to_settle_where_there_is_some(inputs):
    inputs.timing.cfg_samp_clk_timing(1000.0, samps_per_chan=100)
    assert inputs.timing.ai_conv_rate == pytest.approx(1e6 / 11.0)
    inputs.timing.cfg_samp_clk_timing(1e6 / 3.0, samps_per_chan=100)
    assert inputs.timing.ai_conv_rate == pytest.approx(1e6)


# data


@pytest.mark.parametrize("address", ["sim", "sim:7"])
def test_the_same_bytes_as_the_rig_in_process_run_after_run(address):
    rig = the_rig(address, seed=5)
    with served(address=address, seed=5) as card:
        for waveform in (lobes(), LONG):
            np.testing.assert_array_equal(
                play_finite(card.session, waveform), play(rig, waveform).counts[1:]
            )
        assert card.device.wire_voltage() == 0.0


@pytest.mark.parametrize(("written", "taken"), [(500, 100), (777, 333), (64, 1), (5000, 4999)])
def test_how_a_stream_is_cut_changes_nothing(session, output, inputs, written, taken):
    waveform = LONG
    wanted, total = play(the_rig(), waveform).counts[1:], waveform.samples
    if taken == 1:  # a call each: part of it says as much
        total = 120
    clock_output(output, RATE, waveform.samples, buffer=2 * written)
    clock_inputs(inputs, RATE)
    source = volts(waveform)
    gone = write(output, source[:written])
    inputs.start()
    output.start()
    parts, got = [], 0
    while got < total:
        if gone < source.size and output.out_stream.space_avail >= written:
            gone += write(output, source[gone : gone + written])
        parts.append(read(inputs, min(taken, total - got, gone - got)))
        got += parts[-1].shape[1]
    np.testing.assert_array_equal(np.concatenate(parts, axis=1), wanted[:, :total])


@pytest.mark.parametrize("blocks", [1, 3, 95])
def test_an_output_that_is_stopped_and_restarted_keeps_the_inputs_going(
    card, output, inputs, blocks
):
    """As the rig in process does when it ramps down."""
    waveform = LONG
    rig = open_simulated_rig(
        "sim", card.device.settings, RigFile().as_film(), RigFile().as_load(), block_samples=50
    )
    begin(rig, waveform)
    wanted = [rig.read().counts for _ in range(blocks)]
    rig.stop()
    wanted.append(drain(rig).counts)
    clock_output(output, RATE, waveform.samples, buffer=waveform.samples)
    clock_inputs(inputs, RATE)
    write(output, volts(waveform))
    inputs.start()
    output.start()
    found = [read(inputs, 50) for _ in range(blocks)]
    output.stop()
    played = inputs.in_stream.total_samp_per_chan_acquired
    assert played == 50 * blocks + 1
    assert card.device.wire_voltage() == pytest.approx(waveform.window()[played - 1], abs=0.2)
    ramp = ramp_down(waveform, played - 1, card.device.settings.limits.ramp_down_s) / 1000.0
    clock_output(output, RATE, ramp.size, buffer=ramp.size)
    write(output, ramp)
    output.start()
    found.append(read(inputs, 1 + ramp.size))
    np.testing.assert_array_equal(np.concatenate(found, axis=1), np.concatenate(wanted, axis=1)[1:])
    assert card.device.wire_voltage() == 0.0


def test_raw_and_scaled_reads_say_the_same(session):
    waveform = lobes()
    size = waveform.samples
    found = []
    for how in ("rows", "scans", "volts"):
        with served() as card, task(card.session) as ao, task(card.session) as ai:
            add_output(ao)
            add_inputs(ai)
            clock_output(ao, RATE, size)
            clock_inputs(ai, RATE, size)
            counts = np.rint(volts(waveform) * 3276.8).astype(np.int16)
            AnalogUnscaledWriter(ao.out_stream).write_int16(counts[None])
            ai.start()
            ao.start()
            if how == "rows":
                found.append(read(ai, size))
            elif how == "scans":
                raw = np.empty(3 * size, dtype=np.int16)
                assert ai.in_stream.read_into(raw) == size
                found.append(raw.reshape(size, 3).T)
            else:
                scaled = np.empty((3, size))
                AnalogMultiChannelReader(ai.in_stream).read_many_sample(scaled, size)
                scaling = [ai.ai_channels[n].ai_dev_scaling_coeff for n in ai.channel_names]
    np.testing.assert_array_equal(found[0], found[1])
    for row, raw, coefficients in zip(scaled, found[0], scaling, strict=True):
        np.testing.assert_allclose(row, np.polynomial.polynomial.polyval(raw, coefficients))


def test_the_card_reads_its_own_output_back(session, output):
    waveform = lobes()
    with task(session) as ai:
        add_inputs(ai, "_ao0_vs_aognd", "ai0", "ai5")
        clock_output(output, RATE, waveform.samples)
        clock_inputs(ai, RATE, waveform.samples)
        output.write(volts(waveform))
        ai.start()
        output.start()
        counts = read(ai, waveform.samples)
    np.testing.assert_array_equal(counts[0], play(the_rig(), waveform).counts[0])
    assert np.abs(counts[1] - counts[0].astype(int)).max() < 60
    assert not counts[2].any()  # nothing is wired to it


def test_inputs_on_their_own_clock_follow_what_is_set_by_hand(card, session, output):
    with task(session) as ai:
        add_inputs(ai)
        clock_inputs(ai, RATE, 200, source="")
        ai.start()
        first = read(ai, 70)
        output.write(3.0)
        second = read(ai, 130)
        ai.stop()
        slope = ai.ai_channels[0].ai_dev_scaling_coeff[1]
    assert abs(first[0]).max() * slope < 0.01
    np.testing.assert_allclose(second[0] * slope, 3.0, atol=0.01)
    assert second[2, -1] > first[2, -1]  # the film has got longer


@pytest.mark.parametrize("first", ["inputs wait", "output waits"])
def test_a_start_trigger_starts_two_clocks_at_once(session, output, inputs, first):
    waveform = lobes()
    size = waveform.samples
    clock_output(output, RATE, size)
    clock_inputs(inputs, RATE, size, source="")
    output.write(volts(waveform))
    waits, starts = (inputs, output) if first == "inputs wait" else (output, inputs)
    source = "ao" if waits is inputs else "ai"
    waits.triggers.start_trigger.cfg_dig_edge_start_trig(f"/Dev1/{source}/StartTrigger")
    waits.start()
    assert not waits.is_task_done()
    starts.start()
    np.testing.assert_array_equal(read(inputs, size), play(the_rig(), waveform).counts[1:])


def test_readings_on_demand_show_what_stands_on_the_wire(card, output, session):
    def reading():
        with task(session) as ai:
            add_inputs(ai)
            return np.array(ai.read(number_of_samples_per_channel=50))

    rest = reading()
    assert np.abs(rest[:2]).max() < 0.02
    assert rest[2].mean() == pytest.approx(6.4 / 4.0, abs=0.01)
    output.write(4.5)
    assert card.device.wire_voltage() == pytest.approx(4500.0, abs=0.2)
    assert reading()[0].mean() == pytest.approx(4.5, abs=0.01)
    assert not np.array_equal(reading()[0], reading()[0])


def test_after_a_run_the_laser_stays_where_it_was(session):
    last = play_finite(session, lobes())[2, -1]
    with task(session) as ai:
        add_inputs(ai)
        reader = AnalogUnscaledReader(ai.in_stream)
        counts = np.empty((3, 5), dtype=np.int16)
        reader.read_int16(counts, 5)
    assert set(counts[2]) == {last}


# buffers and clocks


def test_regeneration_repeats_what_was_written(card, output):
    clock_output(output, RATE)
    output.write(np.array([1.0, 2.0, 3.0, 4.0]))
    output.start()
    seen = []
    for _ in range(6):
        seen.append(card.device.output_voltage())
        card.device.state.clock.advance(0.001)
    assert np.allclose(seen, [1.0, 2.0, 3.0, 4.0, 1.0, 2.0], atol=1e-3)
    assert output.out_stream.total_samp_per_chan_generated == 6
    output.write(np.array([7.0]), auto_start=False)
    card.device.state.clock.advance(0.002)  # tick 8 is the first place of the buffer
    assert card.device.output_voltage() == pytest.approx(7.0, abs=1e-3)


def test_space_is_made_by_the_fifo_and_by_the_converter():
    clock = HandClock()
    settings = RigFile.model_validate({"card": {"ao_fifo_samples": 100}})
    with served(settings, clock=clock) as card, task(card.session) as ao:
        add_output(ao)
        clock_output(ao, RATE, buffer=1000)
        write(ao, np.zeros(1000))
        assert ao.out_stream.space_avail == 0
        ao.start()
        assert ao.out_stream.space_avail == 100
        clock.advance(0.25)
        assert ao.out_stream.space_avail == 350
        assert ao.out_stream.total_samp_per_chan_generated == 250
        assert ao.out_stream.curr_write_pos == 1000
        with pytest.raises(DaqWriteError) as caught:
            write(ao, np.zeros(500), timeout=0.0)
        assert caught.value.error_code == -200292
        assert caught.value.samps_per_chan_written == 350
        blocked = in_thread(lambda: write(ao, np.zeros(200)))
        clock.until_somebody_waits()
        clock.advance(0.3)
        assert blocked() == 200


def test_time_decides_what_there_is_to_read():
    clock = HandClock()
    waveform = lobes()
    with served(clock=clock) as card, task(card.session) as ao, task(card.session) as ai:
        add_output(ao)
        add_inputs(ai)
        clock_output(ao, RATE, waveform.samples)
        clock_inputs(ai, RATE)
        ao.write(volts(waveform))
        ai.start()
        assert ai.in_stream.avail_samp_per_chan == 0
        ao.start()
        clock.advance(0.0955)
        assert ai.in_stream.avail_samp_per_chan == 95
        assert card.device.wire_voltage() == pytest.approx(waveform.window()[95], abs=0.2)
        assert read(ai, 95).shape == (3, 95)
        pending = in_thread(lambda: read(ai, 100))
        clock.until_somebody_waits()
        clock.advance(0.05)
        clock.until_somebody_waits()
        clock.advance(0.05)
        assert pending().shape == (3, 100)
        with pytest.raises(DaqReadError) as caught:
            read(ai, 10, timeout=0.0)
        assert caught.value.error_code == -200284
        assert caught.value.samps_per_chan_read == 0
        assert not ao.is_task_done()
        clock.advance(1.0)
        assert ao.is_task_done()
        assert not ai.is_task_done()


def test_what_came_before_a_timeout_is_delivered(session, output, inputs):
    waveform = lobes()
    clock_output(output, RATE, waveform.samples)
    clock_inputs(inputs, RATE)
    output.write(volts(waveform))
    inputs.start()
    output.start()
    counts = np.zeros((3, 1000), dtype=np.int16)
    reader = AnalogUnscaledReader(inputs.in_stream)
    with pytest.raises(DaqReadError) as caught:
        reader.read_int16(counts, 1000, 1.0)
    assert caught.value.error_code == -200284
    assert caught.value.samps_per_chan_read == waveform.samples
    packed = counts.reshape(-1)[: 3 * waveform.samples].reshape(3, -1)
    np.testing.assert_array_equal(packed, play(the_rig(), waveform).counts[1:])


def test_what_a_late_reader_lost_is_an_error_until_the_task_is_stopped(card, inputs):
    clock_inputs(inputs, RATE, source="", buffer=1000)
    inputs.start()
    card.device.state.clock.advance(1.5)
    for _ in range(2):
        with pytest.raises(DaqReadError) as caught:
            read(inputs, 10)
        assert caught.value.error_code == -200279
    with pytest.raises(DaqError) as stopped:
        inputs.stop()
    assert stopped.value.error_code == -200279
    inputs.start()
    assert read(inputs, 10).shape == (3, 10)


def test_an_output_that_starves_holds_its_last_sample_and_the_inputs_stop(card, output, inputs):
    clock_output(output, RATE, buffer=1000)
    clock_inputs(inputs, RATE)
    write(output, np.linspace(0.0, 5.0, 300))
    inputs.start()
    output.start()
    assert read(inputs, 300).shape == (3, 300)
    with pytest.raises(DaqReadError) as late:
        read(inputs, 1, timeout=0.5)
    assert late.value.error_code == -200284
    assert card.device.wire_voltage() == pytest.approx(5000.0, abs=0.2)
    for call in (
        output.is_task_done,
        lambda: write(output, np.zeros(10)),
        lambda: output.wait_until_done(1.0),
        output.stop,
    ):
        with pytest.raises(DaqError) as starved:
            call()
        assert starved.value.error_code == -200290
    assert card.device.wire_voltage() == pytest.approx(5000.0, abs=0.2)


# safety


def test_the_output_keeps_its_value_when_its_task_ends(card, session):
    waveform = lobes()
    with task(session) as ao:
        add_output(ao)
        ao.write(6.0)
    assert card.device.wire_voltage() == pytest.approx(6000.0, abs=0.2)
    with task(session) as ao:
        add_output(ao)
        clock_output(ao, RATE, waveform.samples)
        ao.write(volts(waveform))
        assert card.device.wire_voltage() == pytest.approx(6000.0, abs=0.2)
        ao.start()
        card.device.state.clock.advance(0.0955)
    assert card.device.wire_voltage() == pytest.approx(waveform.window()[95], abs=0.2)


def test_a_reset_takes_everything_to_zero_and_aborts_every_task(card, session, inputs):
    with connected(card.server.port) as other, task(other) as ao, task(other) as line:
        add_output(ao)
        line.do_channels.add_do_chan(f"Dev1/{ENABLE}")
        line.write(HIGH)
        clock_output(ao, RATE, buffer=1000)
        clock_inputs(inputs, RATE)
        write(ao, np.full(1000, 6.0))
        inputs.start()
        ao.start()
        with task(session) as mine:
            add_output(mine)
            with pytest.raises(DaqError) as taken:
                mine.write(0.0)
            assert taken.value.error_code == -50103
            Device("Dev1", grpc_options=session).reset_device()
            assert card.device.wire_voltage() == 0.0
            assert card.device.line(ENABLE) is LOW
            mine.write(0.0)
        for call in (lambda: write(ao, np.zeros(5)), lambda: read(inputs, 5), inputs.stop):
            with pytest.raises(DaqError) as gone:
                call()
            assert gone.value.error_code == -88709
        inputs.start()  # having been told, it may start again


def test_a_reset_frees_who_waits_for_samples():
    clock = HandClock()
    with served(clock=clock) as card, task(card.session) as ai:
        add_inputs(ai)
        clock_inputs(ai, RATE)
        ai.start()
        pending = in_thread(lambda: read(ai, 10))
        clock.until_somebody_waits()
        with connected(card.server.port) as other:
            Device("Dev1", grpc_options=other).reset_device()
        with pytest.raises(DaqReadError) as caught:
            pending()
        assert caught.value.error_code == -88709


def test_a_done_event_comes_when_it_is_done(card, output):
    done = threading.Event()
    told = []

    def callback(_, status, __):
        told.append(status)
        done.set()
        return 0

    output.register_done_event(callback)
    clock_output(output, RATE, 100)
    output.write(np.zeros(100))
    output.start()
    assert not done.is_set()
    card.device.state.clock.advance(0.2)
    assert done.wait(30.0)
    assert told == [0]
    output.stop()
    output.register_done_event(None)


def test_every_n_samples_an_event_comes(card, inputs):
    three = threading.Semaphore(0)
    inputs.register_every_n_samples_acquired_into_buffer_event(100, lambda *_: three.release() or 0)
    clock_inputs(inputs, RATE, source="")
    inputs.start()
    card.device.state.clock.advance(0.35)
    for _ in range(3):
        assert three.acquire(timeout=30.0)
    assert not three.acquire(blocking=False)
    inputs.stop()
    inputs.register_every_n_samples_acquired_into_buffer_event(100, None)


def test_tasks_on_a_rate_that_only_the_clock_knows(session, output, inputs):
    """Inputs on the output's clock run at its rate, whatever they were told to expect."""
    waveform = lobes(rate=500.0)
    clock_output(output, 500.0, waveform.samples)
    clock_inputs(inputs, 2000.0, waveform.samples, source=AO_CLOCK)
    as_the_rig_file_says(inputs)
    output.write(volts(waveform))
    inputs.start()
    output.start()
    np.testing.assert_array_equal(
        read(inputs, waveform.samples), play(the_rig(), waveform).counts[1:]
    )
    assert inputs.timing.samp_quant_samp_mode is AcquisitionType.FINITE


def test_a_long_stream_is_forgotten_behind_itself_and_nothing_of_it_is_wrong(session, card):
    rate, size, piece = 100e3, 450_000, 30_000
    command = np.round(2000.0 * (1.0 + np.sin(np.arange(size) * 3e-4)))
    with task(session) as ao, task(session) as ai:
        add_output(ao)
        add_inputs(ai, "_ao0_vs_aognd", "ai0")
        clock_output(ao, rate, buffer=2 * piece)
        ai.timing.cfg_samp_clk_timing(
            rate, source=AO_CLOCK, sample_mode=AcquisitionType.CONTINUOUS, samps_per_chan=size
        )
        gone = write(ao, command[: 2 * piece] / 3276.8)
        ai.start()
        ao.start()
        parts = []
        while gone < size:
            parts.append(read(ai, piece)[0])
            gone += write(ao, command[gone : gone + piece] / 3276.8)
        parts.append(read(ai, 2 * piece)[0])
        held = card.device.task(ao.name).waveform._used
    np.testing.assert_array_equal(np.concatenate(parts), command.astype(np.int16))
    assert held < size // 2


def test_a_narrower_range_reads_the_same_volts_in_finer_steps():
    waveform, found = lobes(), []
    for limit in (10.0, 2.0):
        with served() as card, task(card.session) as ao, task(card.session) as ai:
            add_output(ao)
            ai.ai_channels.add_ai_voltage_chan("Dev1/ai2", min_val=-limit, max_val=limit)
            clock_output(ao, RATE, waveform.samples)
            clock_inputs(ai, RATE, waveform.samples)
            ao.write(volts(waveform))
            ai.start()
            ao.start()
            found.append(np.array(ai.read(waveform.samples)))
    wide, narrow = found
    # half a step of the wide range, and its calibration
    np.testing.assert_allclose(narrow, wide, atol=10.0 * 350e-6 + 10.0 / 65536)
    assert not np.array_equal(narrow, wide)
