"""Properties of the channels of counters."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from dearig.sim_backend.daqmx.card.channels import CounterChannel, Pulse, PulseChannel
from dearig.sim_backend.daqmx.card.errors import Code, DaqmxError
from dearig.sim_backend.daqmx.card.numbers import FALLING, HIGH, LOW, RISING, TIMEBASE
from dearig.sim_backend.daqmx.card.terminals import PFI
from dearig.sim_backend.daqmx.digital.measures import PULSES, Measure
from dearig.sim_backend.daqmx.digital.pulses import CounterOutput
from dearig.sim_backend.daqmx.properties.kinds import Asked, Property, fixed, given

__all__ = ["COUNTER_CHANNEL"]

_PULSE_TIME, _PULSE_FREQUENCY, _PULSE_TICKS = 10269, 10119, 10268  # DAQmx: counter outputs
_SECONDS, _HERTZ = 10364, 10373


# counter inputs


def _counter(asked: Asked) -> CounterChannel:
    channel = asked.first()
    if not isinstance(channel, CounterChannel):
        raise DaqmxError(Code.NOT_SUPPORTED_IN_TASK, asked.where)
    return channel


def _of(asked: Asked, measures: tuple[Measure, ...]) -> CounterChannel:
    channel = _counter(asked)
    if channel.measure not in measures:
        raise DaqmxError(Code.NOT_SUPPORTED_IN_TASK, asked.where)
    return channel


def _field(name: str, *measures: Measure) -> Property:
    """Return getter and setter of a field of the channel, for these measurements."""
    wanted = measures or tuple(Measure)

    def set_field(asked: Asked, value: Any) -> None:
        channel = _of(asked, wanted)
        asked.device.counters.change(asked.own, channel, name, value)

    return Property((lambda a: getattr(_of(a, wanted), name)), set_field)


def _edge(name: str, *measures: Measure) -> Property:
    getter = _field(name, *measures).get

    def set_edge(asked: Asked, value: int) -> None:
        if value not in (RISING, FALLING):
            raise DaqmxError(Code.INVALID_VALUE, f"Property: edge; Requested Value: {value}")
        asked.device.counters.change(asked.own, _of(asked, measures), name, value)

    return Property(getter, set_edge)


def _terminal(role: str, *measures: Measure) -> Property:
    """Return getter and setter of the terminal of a role."""

    def get(asked: Asked) -> str:
        return asked.device.terminals.full_source(_of(asked, measures).terminals[role])

    def set_(asked: Asked, value: str) -> None:
        channel = _of(asked, measures)
        terminals = channel.terminals | {role: asked.device.terminals.name(value)}
        asked.device.counters.change(asked.own, channel, "terminals", terminals)

    return Property(get, set_)


def _limit(place: int) -> Property:
    def set_(asked: Asked, value: float) -> None:
        channel = _counter(asked)
        limits = list(channel.limits)
        limits[place] = value
        asked.device.counters.change(asked.own, channel, "limits", (limits[0], limits[1]))

    return Property((lambda a: _counter(a).limits[place]), set_)


def _count(asked: Asked) -> int:
    channel = _counter(asked)
    return asked.device.counters.count(asked.own) if channel.measure == Measure.COUNT_EDGES else 0


_EDGES, _FREQUENCY, _PERIOD = Measure.COUNT_EDGES, Measure.FREQUENCY, Measure.PERIOD
_WIDTH, _SEMI, _TWO = Measure.PULSE_WIDTH, Measure.SEMI_PERIOD, Measure.TWO_EDGE_SEPARATION
_ANGLE, _LENGTH = Measure.ANGLE, Measure.LENGTH
_P_FREQUENCY, _P_TIME, _P_TICKS = PULSES

_INPUTS: dict[str, Property] = {
    "CI_MEAS_TYPE": given(lambda a: _counter(a).measure),
    "CI_MAX": _limit(1),
    "CI_MIN": _limit(0),
    "CI_COUNT": given(_count),
    "CI_TC_REACHED": given(False),
    "CI_CTR_TIMEBASE_SRC": fixed("100MHzTimebase"),
    "CI_CTR_TIMEBASE_RATE": fixed(TIMEBASE),
    "CI_DUP_COUNT_PREVENT": fixed(True, False),
    "CI_PRESCALER": fixed(1),
    # the terminals
    "CI_COUNT_EDGES_TERM": _terminal("input", _EDGES),
    "CI_COUNT_EDGES_DIR_TERM": _terminal("direction", _EDGES),
    "CI_FREQ_TERM": _terminal("input", _FREQUENCY),
    "CI_PERIOD_TERM": _terminal("input", _PERIOD),
    "CI_PULSE_WIDTH_TERM": _terminal("input", _WIDTH),
    "CI_SEMI_PERIOD_TERM": _terminal("input", _SEMI),
    "CI_PULSE_FREQ_TERM": _terminal("input", _P_FREQUENCY),
    "CI_PULSE_TIME_TERM": _terminal("input", _P_TIME),
    "CI_PULSE_TICKS_TERM": _terminal("input", _P_TICKS),
    "CI_TWO_EDGE_SEP_FIRST_TERM": _terminal("input", _TWO),
    "CI_TWO_EDGE_SEP_SECOND_TERM": _terminal("second", _TWO),
    "CI_ENCODER_A_INPUT_TERM": _terminal("a", _ANGLE, _LENGTH),
    "CI_ENCODER_B_INPUT_TERM": _terminal("b", _ANGLE, _LENGTH),
    "CI_ENCODER_Z_INPUT_TERM": _terminal("z", _ANGLE, _LENGTH),
    # the edges
    "CI_COUNT_EDGES_ACTIVE_EDGE": _edge("edge", _EDGES),
    "CI_FREQ_STARTING_EDGE": _edge("edge", _FREQUENCY),
    "CI_PERIOD_STARTING_EDGE": _edge("edge", _PERIOD),
    "CI_PULSE_WIDTH_STARTING_EDGE": _edge("edge", _WIDTH),
    "CI_SEMI_PERIOD_STARTING_EDGE": _edge("edge", _SEMI),
    "CI_PULSE_FREQ_START_EDGE": _edge("edge", _P_FREQUENCY),
    "CI_PULSE_TIME_START_EDGE": _edge("edge", _P_TIME),
    "CI_PULSE_TICKS_START_EDGE": _edge("edge", _P_TICKS),
    "CI_TWO_EDGE_SEP_FIRST_EDGE": _edge("edge", _TWO),
    "CI_TWO_EDGE_SEP_SECOND_EDGE": _edge("second_edge", _TWO),
    # the units
    "CI_FREQ_UNITS": _field("units", _FREQUENCY),
    "CI_PERIOD_UNITS": _field("units", _PERIOD),
    "CI_PULSE_WIDTH_UNITS": _field("units", _WIDTH),
    "CI_SEMI_PERIOD_UNITS": _field("units", _SEMI),
    "CI_PULSE_FREQ_UNITS": _field("units", _P_FREQUENCY),
    "CI_PULSE_TIME_UNITS": _field("units", _P_TIME),
    "CI_TWO_EDGE_SEP_UNITS": _field("units", _TWO),
    "CI_ANG_ENCODER_UNITS": _field("units", _ANGLE),
    "CI_LIN_ENCODER_UNITS": _field("units", _LENGTH),
    # counting and encoders
    "CI_COUNT_EDGES_INITIAL_CNT": Property(
        lambda a: int(_of(a, (_EDGES,)).initial), _field("initial", _EDGES).set
    ),
    "CI_COUNT_EDGES_DIR": _field("direction", _EDGES),
    "CI_FREQ_MEAS_METH": fixed(lambda a: _of(a, (_FREQUENCY,)).method, 10105),
    "CI_PERIOD_MEAS_METH": fixed(lambda a: _of(a, (_PERIOD,)).method, 10105),
    "CI_ENCODER_DECODING_TYPE": _field("decoding", _ANGLE, _LENGTH),
    "CI_ENCODER_Z_INDEX_ENABLE": _field("index", _ANGLE, _LENGTH),
    "CI_ENCODER_Z_INDEX_PHASE": _field("index_phase", _ANGLE, _LENGTH),
    "CI_ENCODER_Z_INDEX_VAL": _field("index_value", _ANGLE, _LENGTH),
    "CI_ANG_ENCODER_INITIAL_ANGLE": _field("initial", _ANGLE),
    "CI_ANG_ENCODER_PULSES_PER_REV": given(lambda a: _of(a, (_ANGLE,)).pulses),
    "CI_LIN_ENCODER_DIST_PER_PULSE": _field("distance", _LENGTH),
    "CI_LIN_ENCODER_INITIAL_POS": _field("initial", _LENGTH),
}


# counter outputs


def _pulses(asked: Asked, kind: int | None = None) -> PulseChannel:
    channel = asked.first()
    if not isinstance(channel, PulseChannel) or kind not in (None, channel.kind):
        raise DaqmxError(Code.NOT_SUPPORTED_IN_TASK, asked.where)
    return channel


def _pulse(
    kind: int, get: Callable[[Pulse], Any], change: Callable[[Pulse, Any], Pulse]
) -> Property:
    """Return getter and setter of a property of the pulses of a channel of ``kind``."""

    def set_(asked: Asked, value: Any) -> None:
        channel = _pulses(asked, kind)
        asked.device.counters.change_pulse(asked.own, channel, change(channel.pulse, value))

    return Property((lambda a: get(_pulses(a, kind).pulse)), set_, running=True)


def _frequency(pulse: Pulse) -> float:
    return 1.0 / (pulse.high + pulse.low)


def _duty(pulse: Pulse) -> float:
    return pulse.high * _frequency(pulse)


def _delay(kind: int, per_second: float = 1.0) -> Property:
    def set_(asked: Asked, value: float) -> None:
        asked.device.counters.change(asked.own, _pulses(asked, kind), "delay", value / per_second)

    def get(asked: Asked) -> float:
        delay = _pulses(asked, kind).delay * per_second
        return delay if per_second == 1.0 else round(delay)

    return Property(get, set_)


def _set_output_terminal(asked: Asked, value: str) -> None:
    channel = _pulses(asked)
    output = asked.device.terminals.name(value)
    if output not in PFI:
        raise DaqmxError(Code.ROUTE_NOT_SUPPORTED, f"Destination Terminal: {value}")
    asked.device.counters.change(asked.own, channel, "output", output)


def _set_idle(asked: Asked, value: int) -> None:
    if value not in (HIGH, LOW):
        raise DaqmxError(Code.INVALID_VALUE, f"Property: CO.Pulse.IdleState; Value: {value}")
    asked.device.counters.change(asked.own, _pulses(asked), "idle_high", value == HIGH)


def _pulse_done(asked: Asked) -> bool:
    work = _pulses(asked) and asked.own.work
    return isinstance(work, CounterOutput) and asked.device.states.is_done(asked.own)


_OUTPUTS: dict[str, Property] = {
    "CO_OUTPUT_TYPE": given(lambda a: _pulses(a).kind),
    "CO_PULSE_FREQ": _pulse(
        _PULSE_FREQUENCY, _frequency, lambda p, v: Pulse.of_frequency(v, _duty(p))
    ),
    "CO_PULSE_DUTY_CYC": _pulse(
        _PULSE_FREQUENCY, _duty, lambda p, v: Pulse.of_frequency(_frequency(p), v)
    ),
    "CO_PULSE_FREQ_INITIAL_DELAY": _delay(_PULSE_FREQUENCY),
    "CO_PULSE_FREQ_UNITS": fixed(lambda a: _pulses(a, _PULSE_FREQUENCY) and _HERTZ, _HERTZ),
    "CO_PULSE_HIGH_TIME": _pulse(
        _PULSE_TIME, lambda p: p.high, lambda p, v: Pulse.of_times(v, p.low)
    ),
    "CO_PULSE_LOW_TIME": _pulse(
        _PULSE_TIME, lambda p: p.low, lambda p, v: Pulse.of_times(p.high, v)
    ),
    "CO_PULSE_TIME_INITIAL_DELAY": _delay(_PULSE_TIME),
    "CO_PULSE_TIME_UNITS": fixed(lambda a: _pulses(a, _PULSE_TIME) and _SECONDS, _SECONDS),
    "CO_PULSE_HIGH_TICKS": _pulse(
        _PULSE_TICKS,
        lambda p: round(p.high * TIMEBASE),
        lambda p, v: Pulse.of_times(v / TIMEBASE, p.low),
    ),
    "CO_PULSE_LOW_TICKS": _pulse(
        _PULSE_TICKS,
        lambda p: round(p.low * TIMEBASE),
        lambda p, v: Pulse.of_times(p.high, v / TIMEBASE),
    ),
    "CO_PULSE_TICKS_INITIAL_DELAY": _delay(_PULSE_TICKS, TIMEBASE),
    "CO_PULSE_IDLE_STATE": Property(lambda a: HIGH if _pulses(a).idle_high else LOW, _set_idle),
    "CO_PULSE_TERM": Property(
        lambda a: a.device.terminals.full_source(_pulses(a).output), _set_output_terminal
    ),
    "CO_PULSE_DONE": given(_pulse_done),
    "CO_RDY_FOR_NEW_VAL": given(lambda a: _pulses(a) and a.own.running),
    "CO_OUTPUT_STATE": given(lambda a: HIGH if a.device.counters.output_level(_pulses(a)) else LOW),
    "CO_CTR_TIMEBASE_SRC": fixed("100MHzTimebase"),
    "CO_CTR_TIMEBASE_RATE": fixed(TIMEBASE),
    "CO_ENABLE_INITIAL_DELAY_ON_RETRIGGER": fixed(False),
}


COUNTER_CHANNEL: dict[str, Property] = {**_INPUTS, **_OUTPUTS}
