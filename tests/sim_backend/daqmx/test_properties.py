"""Properties of the simulated card: set later, given back, reset, or refused."""

import re
from pathlib import Path

import numpy as np
import pytest
from nidaqmx.constants import (
    AcquisitionType,
    Edge,
    Level,
    SampleTimingType,
    TaskMode,
    TerminalConfiguration,
    TriggerType,
    UnitsPreScaled,
    VoltageUnits,
)
from nidaqmx.errors import DaqError
from nidaqmx.scale import Scale
from nidaqmx.system import Device, System, WatchdogTask

from dearig.sim_backend.daqmx.properties import attributes
from dearig.sim_backend.daqmx.properties.attributes import TABLES
from dearig.sim_backend.daqmx.properties.kinds import NAMES
from tests.tools.daqmx import ENABLE, add_inputs, add_output, clock_inputs, read, task

# of a channel


def test_the_limits_of_an_input_choose_its_range(session):
    with task(session) as ai:
        channel = ai.ai_channels.add_ai_voltage_chan("Dev1/ai0")
        channel.ai_max, channel.ai_min = 2.0, -1.5
        # read back are the limits of what the range can measure, as NI's driver gives them
        assert (channel.ai_min, channel.ai_max, channel.ai_rng_high) == (-2.0, 2.0, 2.0)
        channel.ai_rng_high = 4.0
        assert (channel.ai_rng_low, channel.ai_rng_high) == (-5.0, 5.0)
        with pytest.raises(DaqError) as caught:
            channel.ai_max = 11.0
        assert caught.value.error_code == -200077


def test_the_limits_of_an_output_bound_what_is_written(session):
    with task(session) as ao:
        channel = ao.ao_channels.add_ao_voltage_chan("Dev1/ao1")
        channel.ao_max = 2.0
        with pytest.raises(DaqError) as caught:
            ao.write(3.0)
        assert caught.value.error_code == -200561


def test_the_wiring_of_an_input_can_be_set(session):
    with task(session) as ai:
        channel = ai.ai_channels.add_ai_voltage_chan("Dev1/ai8")
        channel.ai_term_cfg = TerminalConfiguration.NRSE
        assert channel.ai_term_cfg is TerminalConfiguration.NRSE
        with pytest.raises(DaqError) as caught:
            channel.ai_term_cfg = TerminalConfiguration.DIFF
        assert caught.value.error_code == -200077
        del channel.ai_term_cfg
        assert channel.ai_term_cfg is TerminalConfiguration.RSE


def test_a_property_is_set_on_every_addressed_channel(session):
    with task(session) as ai:
        add_inputs(ai, "ai0", "ai1", "ai2")
        for limit in ("ai_min", "ai_max"):
            setattr(ai.ai_channels["Dev1/ai0:1"], limit, {"ai_min": -1.0, "ai_max": 1.0}[limit])
        assert [channel.ai_max for channel in ai.ai_channels] == [1.0, 1.0, 10.0]
        ai.ai_channels.all.ai_max = 5.0
        assert [channel.ai_max for channel in ai.ai_channels] == [5.0, 5.0, 10.0]


def test_properties_without_effect_are_kept_by_channel(session):
    with task(session) as ai:
        add_inputs(ai, "ai0", "ai1")
        first, second = ai.ai_channels
        first.description = "cable 7"
        assert (first.description, second.description) == ("cable 7", "")


def test_a_property_is_not_set_while_the_task_runs(session):
    with task(session) as ai:
        add_inputs(ai, "ai0")
        clock_inputs(ai, 1000.0, source="")
        ai.start()
        with pytest.raises(DaqError, match="AI_MAX") as caught:
            ai.ai_channels[0].ai_max = 1.0
        assert caught.value.error_code == -200557


# of the timing


def test_the_timing_can_be_set_property_by_property(session):
    with task(session) as ai:
        add_inputs(ai, "ai0")
        ai.timing.samp_quant_samp_mode = AcquisitionType.FINITE
        ai.timing.samp_quant_samp_per_chan = 20
        assert ai.timing.samp_timing_type is SampleTimingType.ON_DEMAND
        ai.timing.samp_timing_type = SampleTimingType.SAMPLE_CLOCK
        ai.timing.samp_clk_timebase_div = 50_000
        assert ai.timing.samp_clk_rate == 2000.0
        ai.start()
        assert read(ai, 20).shape == (1, 20)
        ai.stop()
        del ai.timing.samp_clk_rate, ai.timing.samp_quant_samp_mode
        assert ai.timing.samp_clk_rate == 1000.0
        assert ai.timing.samp_quant_samp_mode is AcquisitionType.CONTINUOUS


def test_the_source_of_a_clock_is_checked_with_the_task(session):
    with task(session) as ai:
        add_inputs(ai, "ai0")
        assert ai.timing.samp_clk_src == "/Dev1/ai/SampleClockTimebase"
        ai.timing.cfg_samp_clk_timing(1000, source="pfi3", active_edge=Edge.FALLING)
        assert ai.timing.samp_clk_src == "/Dev1/PFI3"
        assert ai.timing.samp_clk_active_edge is Edge.FALLING
        ai.timing.samp_clk_src = "/Dev1/PFI77"
        with pytest.raises(DaqError) as caught:
            ai.start()
        assert caught.value.error_code == -89120


def test_the_type_of_a_trigger_follows_its_source(session):
    with task(session) as ai:
        add_inputs(ai, "ai0")
        ai.timing.cfg_samp_clk_timing(1000)
        start = ai.triggers.start_trigger
        start.dig_edge_src = "/Dev1/PFI1"
        assert start.trig_type is TriggerType.DIGITAL_EDGE
        assert start.dig_edge_src == "/Dev1/PFI1"
        start.disable_start_trig()
        assert start.trig_type is TriggerType.NONE


# of the card


def test_the_card_lists_only_what_a_program_can_have(session):
    card = Device("Dev1", grpc_options=session)
    assert card.do_lines.channel_names
    assert card.terminals
    for names, channels, add in (
        (card.di_lines, "di_channels", "add_di_chan"),
        (card.di_ports, "di_channels", "add_di_chan"),
        (card.ci_physical_chans, "ci_channels", "add_ci_count_edges_chan"),
        (card.co_physical_chans, "co_channels", "add_co_pulse_chan_freq"),
    ):
        for name in names.channel_names:
            with task(session) as made:
                getattr(getattr(made, channels), add)(name)
                made.control(TaskMode.TASK_VERIFY)


# scales

SCALES = {
    "linear": lambda s: Scale.create_lin_scale("mine", 2.0, 1.0, grpc_options=s),
    "map": lambda s: Scale.create_map_scale("mine", -5.0, 5.0, -9.0, 11.0, grpc_options=s),
    "polynomial": lambda s: Scale.create_polynomial_scale(
        "mine", [1.0, 2.0], [-0.5, 0.5], grpc_options=s
    ),
    "table": lambda s: Scale.create_table_scale(
        "mine", [-5.0, 0.0, 5.0], [-9.0, 1.0, 11.0], grpc_options=s
    ),
}


@pytest.mark.parametrize("kind", list(SCALES))
def test_a_scale_applies_to_what_is_written_and_read(card, session, kind):
    SCALES[kind](session)
    scaled = {"units": VoltageUnits.FROM_CUSTOM_SCALE, "custom_scale_name": "MINE"}
    with task(session) as ao, task(session) as ai:
        ao.ao_channels.add_ao_voltage_chan("Dev1/ao0", min_val=0.0, max_val=9.0, **scaled)
        ai.ai_channels.add_ai_voltage_chan(
            "Dev1/_ao0_vs_aognd", min_val=-7.0, max_val=9.0, **scaled
        )
        ao.write(4.0)  # 2 x 1.5 V + 1
        assert card.device.output_voltage() == pytest.approx(1.5, abs=1e-3)
        assert ai.read() == pytest.approx(4.0, abs=1e-3)
        with pytest.raises(DaqError) as caught:
            ao.write(9.5)
        assert caught.value.error_code == -200561
        channel = ai.ai_channels[0]
        assert channel.ai_voltage_units is VoltageUnits.FROM_CUSTOM_SCALE
        assert channel.ai_custom_scale.name == "mine"
        del channel.ai_custom_scale
        assert ai.read() == pytest.approx(1.5, abs=1e-3)
        ao.write(1.0)


def test_the_properties_of_a_scale_can_be_set(session):
    scale = SCALES["linear"](session)
    scale.lin_slope, scale.scaled_units, scale.description = 5.0, "mm", "of the laser"
    scale.pre_scaled_units = UnitsPreScaled.AMPS
    assert (scale.lin_slope, scale.lin_y_intercept, scale.scaled_units) == (5.0, 1.0, "mm")
    assert (scale.description, scale.pre_scaled_units) == ("of the laser", UnitsPreScaled.AMPS)
    for attempt, code in (
        (lambda: scale.poly_forward_coeff, -200601),
        (lambda: setattr(scale, "lin_slope", 0.0), -200409),
        (lambda: Scale("nobody", grpc_options=session).scaled_units, -200378),
    ):
        with pytest.raises(DaqError) as caught:
            attempt()
        assert caught.value.error_code == code


def test_a_saved_scale_is_listed(session):
    SCALES["map"](session).save("kept", author="the operator")
    system = System.remote(session)
    assert list(system.scales.scale_names) == ["kept"]
    assert system.scales["kept"].author == "the operator"
    assert system.scales["kept"].load().map_scaled_max == 11.0
    system.scales["kept"].delete()
    assert list(system.scales.scale_names) == []


def test_the_reverse_of_a_polynomial_is_fitted(session):
    reverse = Scale.calculate_reverse_poly_coeff([1.0, 2.0], -10, 10, 100, -1, grpc_options=session)
    assert reverse == pytest.approx([-0.5, 0.5])


# of a watchdog


@pytest.mark.parametrize(
    ("level", "after"),
    [(Level.HIGH, True), (Level.LOW, False), (Level.TRISTATE, False), (Level.NO_CHANGE, True)],
)
def test_a_line_takes_its_level_when_the_watchdog_expires(card, session, level, after):
    with task(session) as lines, WatchdogTask("Dev1", timeout=0.5, grpc_options=session) as dog:
        lines.do_channels.add_do_chan(f"Dev1/{ENABLE}")
        lines.write(True)
        dog.expiration_states[f"Dev1/{ENABLE}"].do_state = level
        assert dog.expiration_states[f"Dev1/{ENABLE}"].do_state is level
        dog.timeout = 0.25
        dog.start()
        assert dog.timeout == 0.25
        with task(session) as ai:  # time passes while samples are read
            add_inputs(ai, "ai0")
            clock_inputs(ai, 1000.0, source="")
            ai.start()
            read(ai, 500)
        assert dog.expired
        assert card.device.line(ENABLE) is after


def test_whether_a_watchdog_has_expired_is_known_while_it_runs(session):
    with WatchdogTask("Dev1", timeout=0.5, grpc_options=session) as dog:
        with pytest.raises(DaqError) as caught:
            _ = dog.expired
        assert caught.value.error_code == -200983


def test_an_output_has_no_input_buffer(session):
    with task(session) as ao:
        add_output(ao)
        with pytest.raises(DaqError) as caught:
            ao.in_stream.input_buf_size = 1000
        assert caught.value.error_code == -200452


def test_a_waveform_is_scaled_row_by_row(session):
    SCALES["linear"](session)
    with task(session) as ao, task(session) as ai:
        add_output(ao)
        ai.ai_channels.add_ai_voltage_chan("Dev1/_ao0_vs_aognd")
        ai.ai_channels.add_ai_voltage_chan(
            "Dev1/_ao1_vs_aognd",
            max_val=11.0,
            min_val=-9.0,
            units=VoltageUnits.FROM_CUSTOM_SCALE,
            custom_scale_name="mine",
        )
        ao.write(2.0)
        assert np.array(ai.read(3)) == pytest.approx(np.array([[2.0] * 3, [1.0] * 3]), abs=2e-3)
        ao.write(0.0)


# of the tables


def test_every_name_in_a_table_is_one_of_the_protocol():
    for group, table in TABLES.items():
        known = {name for (of, _), name in NAMES.items() if of == group}
        assert set(table) <= known, group


def test_every_property_without_effect_is_named_in_the_readme():
    words = (Path(attributes.__file__).parents[1] / "README.md").read_text(encoding="utf-8")
    named = set(re.findall(r"`([A-Z_]+)`", words))
    for table in TABLES.values():
        for name, entry in table.items():
            assert entry.effect or any(part in name for part in named), name
