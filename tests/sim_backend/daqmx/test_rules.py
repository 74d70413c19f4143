"""The rules of the simulated card: what it refuses, and with which of DAQmx's codes."""

import nidaqmx
import numpy as np
import pytest
from nidaqmx import GrpcSessionOptions, SessionInitializationBehavior
from nidaqmx.constants import (
    Coupling,
    ReadRelativeTo,
    TaskMode,
    TerminalConfiguration,
    TriggerType,
    VoltageUnits,
)
from nidaqmx.errors import DaqError, RpcError
from nidaqmx.stream_readers import AnalogUnscaledReader
from nidaqmx.system import Device, WatchdogTask

from dearig.drivers.contract.rig import RATE, lobes
from tests.tools.daqmx import (
    ENABLE,
    add_inputs,
    add_output,
    clock_inputs,
    clock_output,
    play_finite,
    read,
    task,
    write,
)

HIGH, LOW = True, False


# the rules, a row each: what is tried, and the code with which the card refuses


def _same_channel_twice(session):
    with task(session) as ai:
        add_inputs(ai, "ai0", "ai0")


def _two_kinds(session):
    with task(session) as made:
        add_inputs(made)
        add_output(made)


def _reserved(kind):
    def attempt(session):
        with task(session) as one, task(session) as other:
            for made in (one, other):
                if kind == "ai":
                    add_inputs(made)
                    clock_inputs(made, RATE, source="")
                elif kind == "ao":
                    add_output(made)
                    clock_output(made, RATE, 10)
                else:
                    made.do_channels.add_do_chan(f"Dev1/{ENABLE}")
                made.control(TaskMode.TASK_RESERVE)

    return attempt


def _ai(*terminals, **options):
    def attempt(session):
        with task(session) as ai:
            for terminal in terminals:
                ai.ai_channels.add_ai_voltage_chan(terminal, **options)

    return attempt


def _ao(terminal, **options):
    def attempt(session):
        with task(session) as ao:
            ao.ao_channels.add_ao_voltage_chan(terminal, **options)

    return attempt


def _ai_clock(rate, samples=100, inputs=("ai0", "ai1", "ai2"), **more):
    def attempt(session):
        with task(session) as ai:
            add_inputs(ai, *inputs)
            ai.timing.cfg_samp_clk_timing(rate, samps_per_chan=samples, **more)
            ai.control(TaskMode.TASK_VERIFY)

    return attempt


def _output_on_a_clock_from_outside(ao):
    ao.timing.cfg_samp_clk_timing(1000.0, source="/Dev1/PFI0")
    ao.control(TaskMode.TASK_VERIFY)


def _with_output(act):
    def attempt(session):
        with task(session) as ao:
            add_output(ao)
            act(ao)

    return attempt


def _with_nothing(act):
    def attempt(session):
        with task(session) as made:
            act(made)

    return attempt


def _read_output(ao):
    reader = AnalogUnscaledReader(ao.in_stream)
    reader.verify_array_shape = False
    reader.read_int16(np.empty((1, 5), dtype=np.int16), 5)


def _with_inputs(act):
    def attempt(session):
        with task(session) as ai:
            add_inputs(ai)
            act(ai)

    return attempt


def _scan_too_long(ai):
    clock_inputs(ai, 20e3, source="")
    ai.timing.delay_from_samp_clk_delay = 30e-6
    ai.start()


def _timing_while_running(ao):
    clock_output(ao, RATE, 100)
    ao.write(np.zeros(100))
    ao.start()
    ao.timing.cfg_samp_clk_timing(RATE)


def _buffer_while_running(ai):
    clock_inputs(ai, RATE, source="")
    ai.start()
    ai.in_stream.input_buf_size = 2000


def _beyond_the_end(ao):
    clock_output(ao, RATE, 100, buffer=200)
    write(ao, np.zeros(150))


def _buffer_full(ao):
    clock_output(ao, RATE, buffer=100)
    write(ao, np.zeros(150))


def _second_write_without_a_size(ao):
    clock_output(ao, RATE, buffer=None)
    ao.out_stream.regen_mode = nidaqmx.constants.RegenerationMode.DONT_ALLOW_REGENERATION
    write(ao, np.zeros(100))
    write(ao, np.zeros(100))


def _empty_buffer(ao):
    clock_output(ao, RATE, 100)
    ao.start()


def _one_sample(ao):
    clock_output(ao, RATE, buffer=1)
    write(ao, np.zeros(1))
    ao.start()


def _read_too_much(ai):
    clock_inputs(ai, RATE, 100, source="")
    ai.start()
    read(ai, 100)
    read(ai, 1)


def _upside_down(ai):
    ai.ai_channels[0].ai_min = 5.0
    ai.ai_channels[0].ai_max = -5.0
    ai.control(TaskMode.TASK_VERIFY)


def _triggered_on_demand(ai):
    ai.triggers.start_trigger.cfg_dig_edge_start_trig("/Dev1/PFI0")
    ai.start()


def _analog_trigger(ai):
    clock_inputs(ai, RATE, source="")
    ai.triggers.start_trigger.trig_type = TriggerType.ANALOG_EDGE
    ai.start()


def _exported_to_nowhere(ai):
    ai.export_signals.start_trig_output_term = "nowhere"
    ai.control(TaskMode.TASK_VERIFY)


def _read_from_the_first(ai):
    ai.in_stream.relative_to = ReadRelativeTo.FIRST_SAMPLE
    ai.read()


def _not_done(ai):
    clock_inputs(ai, RATE, source="")
    ai.start()
    ai.wait_until_done(0.5)


def _watchdog(**options):
    def attempt(session):
        WatchdogTask("Dev1", grpc_options=session, **options)

    return attempt


def _twice_the_same_name(session):
    new = GrpcSessionOptions(
        session.grpc_channel,
        "",
        initialization_behavior=SessionInitializationBehavior.INITIALIZE_SERVER_SESSION,
    )
    with nidaqmx.Task("mine", grpc_options=session), nidaqmx.Task("mine", grpc_options=new):
        pass


RULES = {
    "a device that is not there": (_ai("Dev2/ai0"), -200220),
    "a device in a property": (
        lambda s: Device("Dev7", grpc_options=s).product_type,
        -200220,
    ),
    "an input that is not there": (_ai("Dev1/ai16"), -200170),
    "an input that is none": (_ai("Dev1/ao0"), -200170),
    "an output that is not there": (_ao("Dev1/ao2"), -200170),
    "a line that is not there": (
        _with_nothing(lambda made: made.do_channels.add_do_chan("Dev1/port0/line31")),
        -200170,
    ),
    "a name without a device": (_ai("ai0"), -200086),
    "an input range that it has not": (_ai("Dev1/ai0", min_val=-11.0, max_val=11.0), -200077),
    "an output range that it has not": (_ao("Dev1/ao0", min_val=0.0, max_val=12.0), -200077),
    "a range upside down": (_ai("Dev1/ai0", min_val=1.0, max_val=-1.0), -200082),
    "the second of a pair": (
        _ai("Dev1/ai8", terminal_config=TerminalConfiguration.DIFF),
        -200077,
    ),
    "a wiring that it has not": (
        _ai("Dev1/ai0", terminal_config=TerminalConfiguration.PSEUDO_DIFF),
        -200077,
    ),
    "the same channel twice": (_same_channel_twice, -200489),
    "two kinds of channels": (_two_kinds, -200559),
    "inputs in use": (_reserved("ai"), -50103),
    "an output in use": (_reserved("ao"), -50103),
    "a line in use": (_reserved("do"), -50103),
    "too fast for one input": (_ai_clock(2.1e6, inputs=("ai0",)), -200077),
    "too fast for three inputs": (_ai_clock(340e3), -200077),
    "too fast for the output": (_with_output(lambda ao: clock_output(ao, 3e6, 100)), -200077),
    "too slow": (_ai_clock(0.01), -200077),
    "no samples": (_ai_clock(1000.0, samples=1), -200077),
    "a clock from nowhere": (_ai_clock(1000.0, source="/Dev1/ao/Nothing"), -89120),
    "a clock of another card": (_ai_clock(1000.0, source="/Dev3/ao/SampleClock"), -89120),
    "a clock that it cannot take": (_with_output(_output_on_a_clock_from_outside), -89136),
    "a clock without channels": (
        _with_nothing(lambda made: made.timing.cfg_samp_clk_timing(1000.0)),
        -200478,
    ),
    "a scan longer than a sample": (_with_inputs(_scan_too_long), -200081),
    "conversions too fast": (
        _with_inputs(lambda ai: setattr(ai.timing, "ai_conv_rate", 1.5e6)),
        -200077,
    ),
    "a start without channels": (_with_nothing(lambda made: made.start()), -200478),
    "a clock while it runs": (_with_output(_timing_while_running), -200479),
    "a buffer while it runs": (_with_inputs(_buffer_while_running), -200557),
    "a start with nothing written": (_with_output(_empty_buffer), -200462),
    "a buffer of one sample": (_with_output(_one_sample), -200609),
    "more volts than it has": (_with_output(lambda ao: ao.write(10.5)), -200561),
    "volts that are not a number": (_with_output(lambda ao: ao.write(float("nan"))), -200561),
    "a write without a start": (
        _with_output(lambda ao: ao.write(1.0, auto_start=False)),
        -200846,
    ),
    "a write beyond the end": (_with_output(_beyond_the_end), -201132),
    "a write into a full buffer": (_with_output(_buffer_full), -200292),
    "a second write where the first made the buffer": (
        _with_output(_second_write_without_a_size),
        -200547,
    ),
    "a read beyond the end": (_with_inputs(_read_too_much), -200278),
    "a read of an output": (
        _with_output(_read_output),
        -200460,
    ),
    "a wait that is too short": (_with_inputs(_not_done), -200560),
    "a property that it has not": (
        lambda s: Device("Dev1", grpc_options=s).ai_bridge_rngs,
        -200197,
    ),
    "a property of another kind of channel": (
        _with_inputs(lambda ai: ai.ai_channels[0].ai_bridge_cfg),
        -200452,
    ),
    "a value that a property has not": (
        _with_inputs(lambda ai: setattr(ai.ai_channels[0], "ai_coupling", Coupling.AC)),
        -200077,
    ),
    "limits upside down, set one after the other": (_with_inputs(_upside_down), -200082),
    "a trigger without a clock": (_with_inputs(_triggered_on_demand), -200262),
    "a trigger that is not simulated": (_with_inputs(_analog_trigger), -200077),
    "an export to nowhere": (_with_inputs(_exported_to_nowhere), -89121),
    "a property of one device of the task": (
        lambda s: _with_inputs(lambda ai: ai.timing[Device("Dev1", grpc_options=s)].samp_clk_rate)(
            s
        ),
        -201118,
    ),
    "a scale that is not there": (
        _ai("Dev1/ai0", units=VoltageUnits.FROM_CUSTOM_SCALE, custom_scale_name="nothing"),
        -200378,
    ),
    "a scale of another unit": (_ai("Dev1/ai0", custom_scale_name="nothing"), -200447),
    "a read from another place": (_with_inputs(_read_from_the_first), -200077),
    "a channel that is not in the task": (
        _with_inputs(lambda ai: ai.ai_channels["other"].ai_max),
        -200486,
    ),
    "a watchdog that waits for ever and a day": (_watchdog(timeout=1e6), -200668),
    "a name that is taken": (_twice_the_same_name, -200089),
}  # fmt: skip


def test_the_card_refuses_and_nothing_is_reserved_afterwards(card, session):
    for rule, (attempt, code) in RULES.items():
        with pytest.raises(DaqError) as caught:
            attempt(session)
        assert caught.value.error_code == code, (rule, caught.value)
    Device("Dev1", grpc_options=session).reset_device()
    play_finite(session, lobes())


def test_what_is_not_simulated_is_said_to_be_so(session):
    with task(session) as made, pytest.raises(RpcError, match="not supported"):
        made.timing.cfg_change_detection_timing("Dev1/port0/line0")


def test_a_task_that_another_client_has_cleared_is_refused(card, session):
    made = nidaqmx.Task("shared", grpc_options=session)
    card.device.clear(card.device.task("shared"))
    for call in (made.start, made.close):
        with pytest.raises(DaqError) as caught:
            call()
        assert caught.value.error_code == -200088
