"""Properties of a task: its channels, its buffers, its reads and writes, and its watchdog."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from dearig.sim_backend.daqmx.card.errors import Code, DaqmxError
from dearig.sim_backend.daqmx.card.numbers import (
    CURRENT_READ,
    CURRENT_WRITE,
    FALLING,
    FIRST_PRETRIGGER,
    FIRST_SAMPLE,
    MOST_RECENT,
    NO_CHANGE,
    REFERENCE_TRIGGER,
    RISING,
    WRITE_OFFSET,
    WRITE_RELATIVE_TO,
)
from dearig.sim_backend.daqmx.card.tasks import Kind, State, Task, Watchdog
from dearig.sim_backend.daqmx.properties.kinds import (
    Asked,
    Getter,
    Property,
    accepted,
    changed,
    fixed,
    given,
)

__all__ = ["BUFFER", "READ", "TASK", "WATCHDOG", "WRITE"]

_REGENERATION, _NO_REGENERATION = 10097, 10158
_DO_NOT_OVERWRITE, _OVERWRITE = 10159, 10252
_READ_FROM = (FIRST_SAMPLE, CURRENT_READ, REFERENCE_TRIGGER, FIRST_PRETRIGGER, MOST_RECENT)
_POLL, _YIELD, _SLEEP = 12524, 12525, 12547
_LOGGING_OFF, _OPEN_OR_CREATE = 10231, 15846
_WATCHDOG_S = 10.0  # default of a watchdog's time-out


def _input_task(asked: Asked) -> Task:
    if not asked.own.kind.is_input:
        raise DaqmxError(Code.NOT_SUPPORTED_IN_TASK, asked.where)
    return asked.own


def _output_task(asked: Asked) -> object:
    if asked.own.kind.is_input or asked.own.kind in (Kind.EMPTY, Kind.WATCHDOG):
        raise DaqmxError(Code.NOT_SUPPORTED_IN_TASK, asked.where)
    return asked.own


def _buffer(needs_input: bool) -> Property:
    needs = _input_task if needs_input else _output_task

    def get(asked: Asked) -> int:
        needs(asked)
        return asked.device.timing.buffer_size(asked.own)

    def set_(asked: Asked, value: int | None) -> None:
        needs(asked)
        asked.device.timing.set_buffer(asked.own, value)

    def default(asked: Asked) -> None:
        needs(asked)

    return Property(get, set_, default)


TASK: dict[str, Property] = {
    "NAME": given(lambda a: a.own.name),
    "CHANNELS": given(lambda a: ", ".join(a.own.channel_names)),
    "NUM_CHANS": given(lambda a: len(a.own.channel_names)),
    "DEVICES": given(lambda a: a.device.name if a.own.kind is not Kind.EMPTY else ""),
    "NUM_DEVICES": given(lambda a: int(a.own.kind is not Kind.EMPTY)),
    "COMPLETE": given(lambda a: a.device.states.is_done(a.own)),
}

BUFFER: dict[str, Property] = {
    "INPUT_BUF_SIZE": _buffer(needs_input=True),
    "OUTPUT_BUF_SIZE": _buffer(needs_input=False),
    "INPUT_ONBRD_BUF_SIZE": given(lambda a: _input_task(a) and 4095),
    "OUTPUT_ONBRD_BUF_SIZE": given(
        lambda a: _output_task(a) and a.device.settings.card.ao_fifo_samples
    ),
}


def _read_setting(field: str, default: int, allowed: Sequence[int] = ()) -> Property:
    """Return a property that each read of an input task looks at, which may run."""

    def get(asked: Asked) -> Any:
        return getattr(_input_task(asked), field)

    def set_(asked: Asked, value: int) -> None:
        if allowed and value not in allowed:
            raise _not_offered(asked, value, allowed)
        setattr(_input_task(asked), field, value)

    return changed(get, set_, default, running=True)


def _set_overwrites(asked: Asked, value: int) -> None:
    if value not in (_OVERWRITE, _DO_NOT_OVERWRITE):
        raise _not_offered(asked, value, (_OVERWRITE, _DO_NOT_OVERWRITE))
    _input_task(asked).overwrites = value == _OVERWRITE


def _not_offered(asked: Asked, value: int, allowed: Sequence[int]) -> DaqmxError:
    return DaqmxError(
        Code.INVALID_VALUE,
        f"Requested Value: {value}; You Can Select: {', '.join(map(str, allowed))}; {asked.where}",
    )


def _at_work(position: Getter) -> Property:
    """Return a property of the samples that passed, which only a reserved task has."""

    def get(asked: Asked) -> Any:
        if asked.own.state is State.VERIFIED:
            raise DaqmxError(Code.ONLY_WHEN_RESERVED, asked.where)
        return position(asked)

    return given(get)


READ: dict[str, Property] = {
    "CHANNELS_TO_READ": fixed(lambda a: ", ".join(a.own.channel_names), ""),
    "NUM_CHANS": given(lambda a: len(a.own.channel_names)),
    "DIGITAL_LINES_BYTES_PER_CHAN": given(
        lambda a: max((len(channel.lines) for channel in a.own.lines), default=0)
    ),
    "RAW_DATA_WIDTH": given(lambda a: 2 * len(a.own.inputs)),
    "AVAIL_SAMP_PER_CHAN": _at_work(lambda a: a.device.reader.available(a.own)),
    "CURR_READ_POS": _at_work(lambda a: a.own.delivered),
    "TOTAL_SAMP_PER_CHAN_ACQUIRED": _at_work(lambda a: a.device.states.passed(a.own)),
    "DEFAULT_NUMBER_OF_SAMPLES_TO_READ": given(lambda a: a.device.reader.default_samples(a.own)),
    "AUTO_START": _read_setting("auto_start", True),
    "READ_ALL_AVAIL_SAMP": _read_setting("read_available", False),
    "OVERWRITE": changed(
        lambda a: _OVERWRITE if _input_task(a).overwrites else _DO_NOT_OVERWRITE,
        _set_overwrites,
        _DO_NOT_OVERWRITE,
        running=True,
    ),
    "RELATIVE_TO": _read_setting("read_from", CURRENT_READ, _READ_FROM),
    "OFFSET": _read_setting("read_offset", 0),
    "OVERLOADED_CHANS_EXIST": given(False),
    "OVERLOADED_CHANS": given(""),
    # how the driver waits is no matter here: the server wakes a reader when its samples are there
    "WAIT_MODE": accepted(_YIELD, _POLL, _YIELD, _SLEEP),
    "SLEEP_TIME": accepted(0.001),
    # a file is not written: its mode stays off, with which the others have no effect
    "LOGGING_MODE": fixed(_LOGGING_OFF),
    "LOGGING_PAUSE": accepted(False),
    "LOGGING_FILE_PATH": accepted(""),
    "LOGGING_FILE_WRITE_SIZE": accepted(0),
    "LOGGING_FILE_PREALLOCATION_SIZE": accepted(0),
    "LOGGING_SAMPS_PER_FILE": accepted(0),
    "LOGGING_TDMS_GROUP_NAME": accepted(""),
    "LOGGING_TDMS_OPERATION": accepted(_OPEN_OR_CREATE),
}


def _set_regeneration(asked: Asked, value: int) -> None:
    if value not in (_REGENERATION, _NO_REGENERATION):
        raise DaqmxError(Code.INVALID_VALUE, f"Property: REGEN_MODE; Requested Value: {value}")
    asked.device.timing.set_regeneration(asked.own, value == _REGENERATION)


WRITE: dict[str, Property] = {
    "NUM_CHANS": given(lambda a: len(a.own.channel_names)),
    "DIGITAL_LINES_BYTES_PER_CHAN": given(
        lambda a: max((len(channel.lines) for channel in a.own.lines), default=0)
    ),
    "RAW_DATA_WIDTH": given(lambda a: 2 * len(a.own.outputs)),
    "REGEN_MODE": changed(
        lambda a: _REGENERATION if a.own.regenerates else _NO_REGENERATION,
        _set_regeneration,
        _REGENERATION,
    ),
    "CURR_WRITE_POS": _at_work(lambda a: 0 if a.own.waveform is None else a.own.waveform.written),
    "SPACE_AVAIL": _at_work(lambda a: a.device.buffer.space(a.own)),
    "TOTAL_SAMP_PER_CHAN_GENERATED": _at_work(lambda a: a.device.states.passed(a.own)),
    "RELATIVE_TO": accepted(CURRENT_WRITE, key=WRITE_RELATIVE_TO),
    "OFFSET": accepted(0, key=WRITE_OFFSET),
    "WAIT_MODE": accepted(_SLEEP, _POLL, _YIELD, _SLEEP),
    "SLEEP_TIME": accepted(0.001),
}


def _watchdog(asked: Asked) -> Watchdog:
    watchdog = asked.own.watchdog
    if watchdog is None:
        raise DaqmxError(Code.WATCHDOG_ONLY, asked.where)
    return watchdog


def _expired(asked: Asked) -> bool:
    _watchdog(asked)
    if not asked.own.running:
        raise DaqmxError(Code.ONLY_WHEN_RESERVED, asked.where)
    return asked.device.watchdogs.expired(asked.own)


WATCHDOG: dict[str, Property] = {
    "HAS_EXPIRED": given(_expired),
    "TIMEOUT": changed(
        lambda a: _watchdog(a).timeout,
        lambda a, v: a.device.watchdogs.set_timeout(a.own, v),
        _WATCHDOG_S,
    ),
    "DO_EXPIR_STATE": changed(
        lambda a: a.device.watchdogs.expiration(a.own, a.channel),
        lambda a, v: a.device.watchdogs.set_expiration(a.own, a.channel, v),
        NO_CHANGE,
    ),
    # no edge ever comes at the terminals, so that only the time-out takes effect
    "DIG_EDGE_WATCHDOG_EXPIR_TRIG_SRC": accepted("", needs=_watchdog),
    "DIG_EDGE_WATCHDOG_EXPIR_TRIG_EDGE": accepted(RISING, RISING, FALLING, needs=_watchdog),
}
