"""Properties of a task's timing, of its triggers and of its exported signals."""

from __future__ import annotations

from dearig.sim_backend.daqmx.card.errors import Code, DaqmxError
from dearig.sim_backend.daqmx.card.numbers import FALLING, RISING
from dearig.sim_backend.daqmx.card.tasks import Kind
from dearig.sim_backend.daqmx.properties.kinds import (
    Asked,
    Property,
    accepted,
    changed,
    fixed,
    given,
)

__all__ = ["EXPORTED", "TIMING", "TRIGGER", "WITH_DEVICE"]

_FINITE, _CONTINUOUS = 10178, 10123
_SAMPLE_CLOCK, _ON_DEMAND, _IMPLICIT = 10388, 10390, 10451
_DIGITAL_EDGE, _NO_TRIGGER = 10150, 10230
_TICKS = 10304
_PULSE, _TOGGLE, _LEVEL, _INTERLOCKED = 10265, 10307, 10210, 12549
_ACTIVE_HIGH, _ACTIVE_LOW = 10095, 10096
_RATE, _SAMPLES = 1000.0, 1000  # defaults of a sample clock


def _side(asked: Asked) -> str:
    task = asked.own
    return f"Ctr{task.counters[0].terminal[3:]}" if task.counters else task.kind.name.lower()


def _clock_source(asked: Asked) -> str:
    asked.device.timing.clock_of(asked.own)
    if not asked.own.timing.source:
        return f"/{asked.device.name}/{_side(asked)}/SampleClockTimebase"
    return asked.device.terminals.full_source(asked.own.timing.source)


def _clock_terminal(asked: Asked) -> str:
    asked.device.timing.clock_of(asked.own)
    return f"/{asked.device.name}/{_side(asked)}/SampleClock"


def _type(asked: Asked) -> int:
    clock = asked.own.clock
    if clock is None:
        return _ON_DEMAND
    return _IMPLICIT if clock.implicit else _SAMPLE_CLOCK


def _set_type(asked: Asked, value: int) -> None:
    if value == _IMPLICIT:
        timing = asked.own.timing
        asked.device.timing.set_implicit(asked.own, timing.finite, timing.samples)
        return
    if value not in (_SAMPLE_CLOCK, _ON_DEMAND):
        raise DaqmxError(
            Code.INVALID_VALUE,
            f"Requested Value: {value}; You Can Select: {_SAMPLE_CLOCK}, {_ON_DEMAND}; "
            f"{asked.where}",
        )
    asked.own.timing.implicit = False
    asked.device.timing.set_clocked(asked.own, value == _SAMPLE_CLOCK)


def _set_mode(asked: Asked, value: int) -> None:
    if value not in (_FINITE, _CONTINUOUS):
        raise DaqmxError(
            Code.INVALID_VALUE,
            f"Requested Value: {value}; You Can Select: {_FINITE}, {_CONTINUOUS}; {asked.where}",
        )
    asked.device.timing.change_clock(asked.own, finite=value == _FINITE)


def _set_clock_edge(asked: Asked, value: int) -> None:
    if value not in (RISING, FALLING):
        raise DaqmxError(
            Code.INVALID_VALUE,
            f"Requested Value: {value}; You Can Select: {RISING}, {FALLING}; {asked.where}",
        )
    asked.device.timing.clock_of(asked.own).edge = value


def _timebase(asked: Asked) -> float:
    return asked.device.timing.timebase


def _divisor(asked: Asked) -> int:
    return round(_timebase(asked) / asked.device.timing.clock_of(asked.own).rate)


def _set_divisor(asked: Asked, value: int) -> None:
    if value < 1:
        raise DaqmxError(Code.INVALID_VALUE, f"Requested Value: {value}; {asked.where}")
    asked.device.timing.change_clock(asked.own, rate=_timebase(asked) / value)


def _output_only(asked: Asked) -> object:
    return asked.of_kind(Kind.AO)


def _default_rate(asked: Asked) -> float:
    asked.own.convert_ticks = None
    return _timebase(asked) / asked.device.conversions.ticks(asked.own)


TIMING: dict[str, Property] = {
    "SAMP_TIMING_TYPE": changed(_type, _set_type, _ON_DEMAND),
    "SAMP_CLK_RATE": changed(
        lambda a: a.device.timing.clock_of(a.own).rate,
        lambda a, v: a.device.timing.change_clock(a.own, rate=v),
        _RATE,
    ),
    "SAMP_CLK_MAX_RATE": given(lambda a: a.device.timing.fastest(a.own)),
    "SAMP_CLK_SRC": changed(
        _clock_source, lambda a, v: a.device.timing.change_clock(a.own, source=v), ""
    ),
    "SAMP_CLK_TERM": given(_clock_terminal),
    "SAMP_CLK_ACTIVE_EDGE": changed(
        lambda a: a.device.timing.clock_of(a.own).edge, _set_clock_edge, RISING
    ),
    "SAMP_CLK_TIMEBASE_RATE": fixed(_timebase),
    "SAMP_CLK_TIMEBASE_DIV": changed(_divisor, _set_divisor, lambda a: round(_timebase(a) / _RATE)),
    "SAMP_CLK_TIMEBASE_SRC": fixed(lambda a: f"/{a.device.name}/100MHzTimebase"),
    "SAMP_CLK_TIMEBASE_ACTIVE_EDGE": fixed(RISING),
    "SAMP_QUANT_SAMP_MODE": changed(
        lambda a: _FINITE if a.device.timing.clock_of(a.own).finite else _CONTINUOUS,
        _set_mode,
        _CONTINUOUS,
    ),
    "SAMP_QUANT_SAMP_PER_CHAN": changed(
        lambda a: a.device.timing.samples(a.own),
        lambda a, v: a.device.timing.change_clock(a.own, samples=v),
        _SAMPLES,
    ),
    "AI_CONV_RATE": changed(
        lambda a: _timebase(a) / a.device.conversions.ticks(a.of_kind(Kind.AI)),
        lambda a, v: a.device.conversions.set_rate(a.own, v),
        _default_rate,
    ),
    "AI_CONV_MAX_RATE": given(lambda a: 1e3 * a.device.settings.card.ai_rate_max_kHz),
    "AI_CONV_TIMEBASE_DIV": changed(
        lambda a: a.device.conversions.ticks(a.of_kind(Kind.AI)),
        lambda a, v: a.device.conversions.set_rate(a.own, _timebase(a) / max(v, 1)),
    ),
    "AI_CONV_ACTIVE_EDGE": fixed(RISING),
    "DELAY_FROM_SAMP_CLK_DELAY": changed(
        lambda a: a.device.conversions.delay(a.own),
        lambda a, v: a.device.conversions.set_delay(a.own, v),
    ),
    "DELAY_FROM_SAMP_CLK_DELAY_UNITS": changed(
        lambda a: a.own.delay_units,
        lambda a, v: a.device.conversions.set_delay_units(a.own, v),
        _TICKS,
    ),
    "ON_DEMAND_SIMULTANEOUS_AO_ENABLE": accepted(False, needs=_output_only),
    "REF_CLK_SRC": fixed(""),
}

#: Properties of the timing that a program may ask of one device of a task.
WITH_DEVICE = {name for name in TIMING if name.startswith("AI_CONV_")}


def _trigger_source(asked: Asked) -> str:
    return asked.device.terminals.full_source(asked.own.trigger) if asked.own.trigger else ""


TRIGGER: dict[str, Property] = {
    "START_TRIG_TYPE": changed(
        lambda a: a.own.trigger_type,
        lambda a, v: a.device.triggering.set_start_type(a.own, v),
        _NO_TRIGGER,
    ),
    "DIG_EDGE_START_TRIG_SRC": changed(
        _trigger_source,
        lambda a, v: a.device.triggering.set_start(a.own, v, a.own.trigger_edge),
        "",
    ),
    "DIG_EDGE_START_TRIG_EDGE": changed(
        lambda a: a.own.trigger_edge,
        lambda a, v: a.device.triggering.set_start_edge(a.own, v),
        RISING,
    ),
    # a filter delays an edge by less than the simulation resolves
    "DIG_EDGE_START_TRIG_DIG_FLTR_ENABLE": accepted(False),
    "DIG_EDGE_START_TRIG_DIG_FLTR_MIN_PULSE_WIDTH": accepted(0.0),
    "DIG_EDGE_START_TRIG_DIG_FLTR_TIMEBASE_RATE": accepted(0.0),
    "DIG_EDGE_START_TRIG_DIG_FLTR_TIMEBASE_SRC": accepted(""),
    "DIG_EDGE_START_TRIG_DIG_SYNC_ENABLE": accepted(False),
}


def _exported(name: str) -> Property:
    """Return the property for the terminal to which a signal goes; it is checked at the start."""

    def set_(asked: Asked, value: str) -> None:
        asked.own.exports[name] = value

    return changed(lambda a: a.own.exports.get(name, ""), set_, "")


#: Exported signals: those that the simulation has are put out at the start of the task.
EXPORTED: dict[str, Property] = {
    "SAMP_CLK_OUTPUT_TERM": _exported("SAMP_CLK"),
    "SAMP_CLK_OUTPUT_BEHAVIOR": accepted(_PULSE, _PULSE, _TOGGLE, _LEVEL, _INTERLOCKED),
    "SAMP_CLK_PULSE_POLARITY": accepted(_ACTIVE_HIGH, _ACTIVE_HIGH, _ACTIVE_LOW),
    "SAMP_CLK_TIMEBASE_OUTPUT_TERM": _exported("SAMP_CLK_TIMEBASE"),
    "AI_CONV_CLK_OUTPUT_TERM": _exported("AI_CONV_CLK"),
    "AI_HOLD_CMPLT_EVENT_OUTPUT_TERM": _exported("AI_HOLD_CMPLT_EVENT"),
    "START_TRIG_OUTPUT_TERM": _exported("START_TRIG"),
    "REF_TRIG_OUTPUT_TERM": _exported("REF_TRIG"),
    "PAUSE_TRIG_OUTPUT_TERM": _exported("PAUSE_TRIG"),
    "10_MHZ_REF_CLK_OUTPUT_TERM": _exported("10_MHZ_REF_CLK"),
    "20_MHZ_TIMEBASE_OUTPUT_TERM": _exported("20_MHZ_TIMEBASE"),
    "CTR_OUT_EVENT_OUTPUT_TERM": _exported("CTR_OUT_EVENT"),
}
