"""Waveforms, raw numbers, calibration and power-up states of the simulated card."""

import nidaqmx
import numpy as np
import pytest
from hightime import timedelta
from nidaqmx.constants import LineGrouping, PowerUpStates, WaveformAttributeMode
from nidaqmx.error_codes import DAQmxErrors
from nidaqmx.errors import DaqError
from nidaqmx.stream_readers import AnalogUnscaledReader
from nidaqmx.stream_writers import AnalogUnscaledWriter
from nidaqmx.system import Device, System
from nidaqmx.types import DOPowerUpState
from nitypes.waveform import AnalogWaveform

from tests.tools.daqmx import add_inputs, add_output, clock_output, served, task


def test_a_waveform_is_written_and_read_back(session):
    with task(session) as ao, task(session) as ai:
        add_output(ao)
        ao.write_waveform(AnalogWaveform.from_array_1d(np.linspace(0.0, 1.5, 20)), auto_start=True)
        ai.ai_channels.add_ai_voltage_chan("Dev1/_ao0_vs_aognd", "held")
        ai.timing.cfg_samp_clk_timing(1000, samps_per_chan=50)
        waveform = ai.read_waveform()
        assert waveform.scaled_data == pytest.approx(1.5, abs=1e-3)
        assert (waveform.sample_count, waveform.channel_name, waveform.units) == (
            50, "held", "Volts",
        )  # fmt: skip
        assert waveform.timing.sample_interval == timedelta(seconds=1e-3)
        ao.write(0.0)


def test_the_time_stamp_of_a_waveform_moves_on_with_its_samples(session):
    with task(session) as ai:
        add_inputs(ai, "ai0")
        ai.timing.cfg_samp_clk_timing(1000, samps_per_chan=500)
        first, second = ai.read_waveform(200), ai.read_waveform(200)
        moved = second.timing.timestamp - first.timing.timestamp
        assert moved.total_seconds() == pytest.approx(0.2, abs=1e-6)
        assert (second.sample_count, ai.read_waveform(200).sample_count) == (200, 100)


def test_what_a_waveform_carries_is_chosen(session):
    with task(session) as ai:
        add_inputs(ai, "ai0")
        ai.timing.cfg_samp_clk_timing(1000, samps_per_chan=10)
        ai.in_stream.waveform_attribute_mode = WaveformAttributeMode.NONE
        waveform = ai.read_waveform()
        assert (waveform.channel_name, waveform.units) == ("", "")
        assert not waveform.timing.has_timestamp


def test_waveforms_of_another_number_of_channels_are_refused(session):
    with task(session) as ao:
        add_output(ao)
        with pytest.raises(DaqError, match="number of channels") as caught:
            ao.write_waveform([AnalogWaveform.from_array_1d(np.zeros(5)) for _ in range(2)])
        assert caught.value.error_code == -200524


@pytest.mark.parametrize("kind", ["int16", "uint16", "int32", "uint32"])
def test_raw_numbers_of_every_size_are_written_and_read(card, session, kind):
    with task(session) as ao, task(session) as ai:
        add_output(ao)
        clock_output(ao, 1000.0, 10)
        writer = AnalogUnscaledWriter(ao.out_stream, auto_start=True)
        getattr(writer, f"write_{kind}")(np.linspace(0, 3277, 10).astype(kind)[np.newaxis])
        ao.wait_until_done(1.0)
        assert card.device.output_voltage() == pytest.approx(1.0, abs=1e-3)
        ai.ai_channels.add_ai_voltage_chan("Dev1/_ao0_vs_aognd", min_val=-10.0, max_val=10.0)
        counts = np.zeros((1, 5), dtype=kind)
        getattr(AnalogUnscaledReader(ai.in_stream), f"read_{kind}")(counts, 5)
        assert counts.tolist() == [[3277] * 5]


def test_an_unsigned_number_stands_for_the_signed_one_of_its_bits(card, session):
    with task(session) as ao:
        add_output(ao)
        writer = AnalogUnscaledWriter(ao.out_stream, auto_start=True)
        writer.write_uint16(np.array([[65536 - 3277]], dtype="uint16"))
        assert card.device.output_voltage() == pytest.approx(-1.0, abs=1e-3)


def test_a_card_with_a_sine_has_no_rig_at_its_inputs():
    with served(sine=True) as card, task(card.session) as ai:
        ai.ai_channels.add_ai_voltage_chan("Dev1/ai0", min_val=1.0, max_val=2.0)
        ai.ai_channels.add_ai_voltage_chan("Dev1/ai7", min_val=-4.0, max_val=4.0)
        ai.timing.cfg_samp_clk_timing(1000, samps_per_chan=200)
        ai.start()
        volts = np.array([*ai.read(70)]), np.array([*ai.read(130)])
        whole = np.concatenate(volts, axis=1)
    phase = 2.0 * np.pi * np.arange(200) / 100
    assert whole[0] == pytest.approx(1.5 + 0.3 * np.sin(phase), abs=1e-3)
    assert whole[1] == pytest.approx(2.4 * np.sin(phase), abs=1e-3)


def test_the_lines_of_a_card_with_a_sine_count_its_samples():
    with served(sine=True) as card, task(card.session) as di, task(card.session) as do:
        di.di_channels.add_di_chan("Dev1/port0/line0:3", line_grouping=LineGrouping.CHAN_PER_LINE)
        assert [di.read() for _ in range(3)] == [[False] * 4, [True, False, False, False],
                                                 [False, True, False, False]]  # fmt: skip
        do.do_channels.add_do_chan("Dev1/port0/line2")
        do.write(True)
        assert di.read() == [True, True, True, False]


def test_lines_that_are_put_out_can_be_read_back(session):
    with task(session) as do:
        do.do_channels.add_do_chan("Dev1/port0/line0:2", line_grouping=LineGrouping.CHAN_PER_LINE)
        do.write([True, False, True])
        assert do.read() == [True, False, True]


def test_the_card_is_calibrated_and_keeps_a_note(session):
    card = Device("Dev1", grpc_options=session)
    assert card.device_supports_cal
    assert card.self_cal_supported
    card.self_cal()
    card.restore_last_ext_cal_const()
    assert card.ext_cal_last_date_and_time == card.self_cal_last_date_and_time
    card.cal_user_defined_info = "rig seven"
    assert card.cal_user_defined_info == "rig "
    with pytest.raises(DaqError) as caught:
        _ = card.cal_acc_connection_count
    assert caught.value.error_code == -200197


def test_power_up_states_are_kept(session):
    system = System.remote(session)
    system.set_digital_power_up_states(
        "Dev1", [DOPowerUpState(physical_channel="Dev1/port0", power_up_state=PowerUpStates.LOW)]
    )
    states = {
        s.physical_channel: s.power_up_state for s in system.get_digital_power_up_states("Dev1")
    }
    assert states["Dev1/port0/line3"] is PowerUpStates.LOW
    assert states["Dev1/port1/line3"] is PowerUpStates.TRISTATE


@pytest.mark.parametrize(
    ("code", "text"),
    [
        (-200077, "Requested value is not a supported value"),
        (-200284, "Some or all of the samples requested"),
        (-200378, "Custom scale"),
        (-201500, DAQmxErrors(-201500).name if -201500 in {e.value for e in DAQmxErrors} else ""),
        (-12345, "Error code could not be found."),
    ],
)
def test_every_code_has_its_text(session, code, text):
    with nidaqmx.Task(grpc_options=session) as made:
        assert text in made._interpreter.get_error_string(code)
