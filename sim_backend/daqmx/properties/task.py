"""Properties of a task: its channels, its buffers, its reads and writes, and its watchdog."""

from __future__ import annotations

from typing import Any

from dearig.sim_backend.daqmx.card.errors import Code, DaqmxError
from dearig.sim_backend.daqmx.card.tasks import (
    CURRENT_READ,
    CURRENT_WRITE,
    FALLING,
    NO_CHANGE,
    READ_OFFSET,
    READ_RELATIVE_TO,
    RISING,
    WRITE_OFFSET,
    WRITE_RELATIVE_TO,
    Kind,
    State,
    Watchdog,
)
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
_DO_NOT_OVERWRITE = 10159
_POLL, _YIELD, _SLEEP = 12524, 12525, 12547
_LOGGING_OFF, _OPEN_OR_CREATE = 10231, 15846
_WATCHDOG_S = 10.0  # default of a watchdog's time-out


def _input_task(asked: Asked) -> object:
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
        return asked.device.buffer_size(asked.own)

    def set_(asked: Asked, value: int | None) -> None:
        needs(asked)
        asked.device.set_buffer(asked.own, value)

    def default(asked: Asked) -> None:
        needs(asked)

    return Property(get, set_, default)


TASK: dict[str, Property] = {
    "NAME": given(lambda a: a.own.name),
    "CHANNELS": given(lambda a: ", ".join(a.own.channel_names)),
    "NUM_CHANS": given(lambda a: len(a.own.channel_names)),
    "DEVICES": given(lambda a: a.device.name if a.own.kind is not Kind.EMPTY else ""),
    "NUM_DEVICES": given(lambda a: int(a.own.kind is not Kind.EMPTY)),
    "COMPLETE": given(lambda a: a.device.is_done(a.own)),
}

BUFFER: dict[str, Property] = {
    "INPUT_BUF_SIZE": _buffer(needs_input=True),
    "OUTPUT_BUF_SIZE": _buffer(needs_input=False),
    "INPUT_ONBRD_BUF_SIZE": given(lambda a: _input_task(a) and 4095),
    "OUTPUT_ONBRD_BUF_SIZE": given(
        lambda a: _output_task(a) and a.device.settings.card.ao_fifo_samples
    ),
}


def _set_read_available(asked: Asked, value: bool) -> None:
    asked.own.read_available = value


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
    "AVAIL_SAMP_PER_CHAN": _at_work(lambda a: a.device.available(a.own)),
    "CURR_READ_POS": _at_work(lambda a: a.own.delivered),
    "TOTAL_SAMP_PER_CHAN_ACQUIRED": _at_work(lambda a: a.device.acquired(a.own)),
    "DEFAULT_NUMBER_OF_SAMPLES_TO_READ": given(lambda a: a.device.default_samples(a.own)),
    "AUTO_START": fixed(True),
    "READ_ALL_AVAIL_SAMP": changed(
        lambda a: a.own.read_available, _set_read_available, False, running=True
    ),
    "OVERWRITE": fixed(_DO_NOT_OVERWRITE),
    # a read from another place than the present one is refused when it is made
    "RELATIVE_TO": accepted(CURRENT_READ, key=READ_RELATIVE_TO),
    "OFFSET": accepted(0, key=READ_OFFSET),
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
    asked.device.set_regeneration(asked.own, value == _REGENERATION)


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
    "CURR_WRITE_POS": _at_work(lambda a: a.device.written(a.own)),
    "SPACE_AVAIL": _at_work(lambda a: a.device.space(a.own)),
    "TOTAL_SAMP_PER_CHAN_GENERATED": _at_work(lambda a: a.device.generated(a.own)),
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
    return asked.device.expired(asked.own)


WATCHDOG: dict[str, Property] = {
    "HAS_EXPIRED": given(_expired),
    "TIMEOUT": changed(
        lambda a: _watchdog(a).timeout,
        lambda a, v: a.device.set_watchdog_timeout(a.own, v),
        _WATCHDOG_S,
    ),
    "DO_EXPIR_STATE": changed(
        lambda a: a.device.expiration(a.own, a.channel),
        lambda a, v: a.device.set_expiration(a.own, a.channel, v),
        NO_CHANGE,
    ),
    # no edge ever comes at the terminals, so that only the time-out takes effect
    "DIG_EDGE_WATCHDOG_EXPIR_TRIG_SRC": accepted("", needs=_watchdog),
    "DIG_EDGE_WATCHDOG_EXPIR_TRIG_EDGE": accepted(RISING, RISING, FALLING, needs=_watchdog),
}
