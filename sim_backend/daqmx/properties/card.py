"""Properties of the system, of the card and of its physical channels."""

from __future__ import annotations

from collections.abc import Sequence

from dearig.sim_backend.daqmx.card.errors import Code, DaqmxError
from dearig.sim_backend.daqmx.card.hardware import INPUT_RANGES, INPUTS, LINES, OUTPUTS
from dearig.sim_backend.daqmx.card.numbers import LINES_RATE, TIMEBASE
from dearig.sim_backend.daqmx.card.sensors import Usage
from dearig.sim_backend.daqmx.card.terminals import COUNTERS
from dearig.sim_backend.daqmx.digital.measures import Measure
from dearig.sim_backend.daqmx.properties.kinds import Asked, changed, given

__all__ = ["CALIBRATION", "DEVICE", "PHYSICAL_CHANNEL", "SERIAL", "SYSTEM"]

SERIAL = 0x0D1E1EC7  #: serial number of the simulated card
DRIVER = (25, 0, 0)  #: driver version that the server reports

_PRODUCT, _PRODUCT_NUMBER = "PCIe-6361", 0x7434
_X_SERIES, _PCIE = 15858, 13612
_VOLTAGE = 10322
_MEASURED = (
    _VOLTAGE,
    Usage.CURRENT,
    Usage.WITH_EXCITATION,
    Usage.RESISTANCE,
    Usage.RTD,
    Usage.THERMISTOR,
)
_START, _REFERENCE, _PAUSE, _ARM_START = 1 << 2, 1 << 3, 1 << 1, 1 << 5
_NOTE, _NOTE_CHARACTERS = "calibration note", 4
_DC = 1 << 1  # bit of the coupling
_COUNTER_BITS = 32
_PULSES = [10269, 10119, 10268]  # DAQmx: kinds of a counter output: times, frequency, ticks
_SAMPLE_CLOCK, _ON_DEMAND, _CHANGE_DETECTION = 10388, 10390, 12504


def _names(asked: Asked, parts: Sequence[str]) -> str:
    return ", ".join(f"{asked.device.name}/{part}" for part in parts)


def _ranges(limits: Sequence[float]) -> list[float]:
    return [side * limit for limit in sorted(limits) for side in (-1.0, 1.0)]


def _ports() -> list[str]:
    return sorted({line.partition("/")[0] for line in LINES})


SYSTEM = {
    "NIDAQ_MAJOR_VERSION": given(DRIVER[0]),
    "NIDAQ_MINOR_VERSION": given(DRIVER[1]),
    "NIDAQ_UPDATE_VERSION": given(DRIVER[2]),
    "DEV_NAMES": given(lambda a: a.device.name),
    "TASKS": given(""),  # saved ones
    "GLOBAL_CHANS": given(""),
    "SCALES": given(lambda a: ", ".join(a.device.scales.saved())),
}

DEVICE = {
    "PRODUCT_TYPE": given(_PRODUCT),
    "PRODUCT_NUM": given(_PRODUCT_NUMBER),
    "PRODUCT_CATEGORY": given(_X_SERIES),
    "SERIAL_NUM": given(SERIAL),
    "IS_SIMULATED": given(True),
    "BUS_TYPE": given(_PCIE),
    "PCI_BUS_NUM": given(0),
    "PCI_DEV_NUM": given(0),
    "ACCESSORY_PRODUCT_TYPES": given(""),
    "ACCESSORY_PRODUCT_NUMS": given(()),
    "ACCESSORY_SERIAL_NUMS": given(()),
    "NUM_DMA_CHANS": given(8),
    "TERMINALS": given(lambda a: ", ".join(a.device.terminals.names())),
    "DIG_TRIG_SUPPORTED": given(True),
    "ANLG_TRIG_SUPPORTED": given(True),
    "AI_PHYSICAL_CHANS": given(lambda a: _names(a, [f"ai{i}" for i in range(INPUTS)])),
    "AI_SUPPORTED_MEAS_TYPES": given(_MEASURED),
    "AI_VOLTAGE_RNGS": given(lambda _: _ranges(INPUT_RANGES)),
    "AI_VOLTAGE_INT_EXCIT_DISCRETE_VALS": given(()),
    "AI_GAINS": given(()),
    "AI_COUPLINGS": given(_DC),
    "AI_MAX_SINGLE_CHAN_RATE": given(lambda a: a.device.timing.fastest_input),
    "AI_MAX_MULTI_CHAN_RATE": given(lambda a: 1e3 * a.device.settings.card.ai_rate_max_kHz),
    "AI_MIN_RATE": given(lambda a: a.device.timing.slowest),
    "AI_SIMULTANEOUS_SAMPLING_SUPPORTED": given(False),
    "AI_NUM_SAMP_TIMING_ENGINES": given(1),
    "AI_SAMP_MODES": given([10178, 10123]),
    "AI_TRIG_USAGE": given(_START | _REFERENCE | _PAUSE),
    "AO_PHYSICAL_CHANS": given(lambda a: _names(a, OUTPUTS)),
    "AO_SUPPORTED_OUTPUT_TYPES": given([_VOLTAGE]),
    "AO_VOLTAGE_RNGS": given(lambda a: _ranges([a.device.settings.card.ao_range_V])),
    "AO_SAMP_CLK_SUPPORTED": given(True),
    "AO_NUM_SAMP_TIMING_ENGINES": given(1),
    "AO_SAMP_MODES": given([10178, 10123]),
    "AO_MAX_RATE": given(lambda a: 1e3 * a.device.settings.card.ao_rate_max_kHz),
    "AO_MIN_RATE": given(lambda a: a.device.timing.slowest),
    "AO_TRIG_USAGE": given(_START),
    "DI_LINES": given(lambda a: _names(a, LINES)),
    "DI_PORTS": given(lambda a: _names(a, _ports())),
    "DI_MAX_RATE": given(LINES_RATE),
    "DI_NUM_SAMP_TIMING_ENGINES": given(1),
    "DI_TRIG_USAGE": given(_START | _PAUSE),
    "DO_LINES": given(lambda a: _names(a, LINES)),
    "DO_PORTS": given(lambda a: _names(a, _ports())),
    "DO_MAX_RATE": given(LINES_RATE),
    "DO_NUM_SAMP_TIMING_ENGINES": given(1),
    "DO_TRIG_USAGE": given(_START),
    "CI_PHYSICAL_CHANS": given(lambda a: _names(a, COUNTERS)),
    "CI_SUPPORTED_MEAS_TYPES": given([int(measure) for measure in Measure]),
    "CI_SAMP_CLK_SUPPORTED": given(True),
    "CI_SAMP_MODES": given([10178, 10123]),
    "CI_MAX_SIZE": given(_COUNTER_BITS),
    "CI_MAX_TIMEBASE": given(TIMEBASE),
    "CI_TRIG_USAGE": given(_PAUSE | _ARM_START),
    "CO_PHYSICAL_CHANS": given(lambda a: _names(a, COUNTERS)),
    "CO_SUPPORTED_OUTPUT_TYPES": given(_PULSES),
    "CO_SAMP_CLK_SUPPORTED": given(True),
    "CO_SAMP_MODES": given([10178, 10123]),
    "CO_MAX_SIZE": given(_COUNTER_BITS),
    "CO_MAX_TIMEBASE": given(TIMEBASE),
    "CO_TRIG_USAGE": given(_START),
}


def _set_note(asked: Asked, value: str) -> None:
    asked.device.state.kept[_NOTE] = value[:_NOTE_CHARACTERS]


CALIBRATION = {
    "SELF_CAL_SUPPORTED": given(True),
    "SELF_CAL_LAST_TEMP": given(0.0),
    "EXT_CAL_LAST_TEMP": given(0.0),
    "EXT_CAL_RECOMMENDED_INTERVAL": given(24),  # months
    "CAL_DEV_TEMP": given(0.0),  # degrees Celsius, as NI's simulated devices say
    "CAL_USER_DEFINED_INFO": changed(lambda a: a.device.state.kept.get(_NOTE, ""), _set_note),
    "CAL_USER_DEFINED_INFO_MAX_SIZE": given(_NOTE_CHARACTERS),
}


def _input(asked: Asked) -> int:
    """Return the number of the asked input; raises an error unless the card has it."""
    name = asked.channel.rpartition("/")[2].lower()
    if not (name.startswith("ai") and name[2:].isdigit() and int(name[2:]) < INPUTS):
        raise DaqmxError(Code.UNKNOWN_CHANNEL, f"Physical Channel: {asked.channel}")
    return int(name[2:])


def _output(asked: Asked) -> str:
    """Return the asked output; raises an error unless the card has it."""
    name = asked.channel.rpartition("/")[2].lower()
    if name not in OUTPUTS:
        raise DaqmxError(Code.UNKNOWN_CHANNEL, f"Physical Channel: {asked.channel}")
    return name


def _wirings(asked: Asked) -> int:
    """Return the bits of an input's wirings: RSE, NRSE, and DIFF for the first of a pair."""
    return 0b111 if _input(asked) % 16 < 8 else 0b011


def _port_lines(asked: Asked) -> int:
    return len(asked.device.levels.lines_of(asked.channel))


def _has_sample_clock(asked: Asked) -> bool:
    return all(line.startswith("port0") for line in asked.device.levels.lines_of(asked.channel))


PHYSICAL_CHANNEL = {
    "PHYSICAL_CHAN_AI_TERM_CFGS": given(_wirings),
    "PHYSICAL_CHAN_AI_SUPPORTED_MEAS_TYPES": given(lambda a: _MEASURED if _input(a) + 1 else []),
    "PHYSICAL_CHAN_AO_TERM_CFGS": given(lambda a: 0b001 if _output(a) else 0),
    "PHYSICAL_CHAN_AO_SUPPORTED_OUTPUT_TYPES": given(lambda a: [_VOLTAGE] if _output(a) else []),
    "PHYSICAL_CHAN_DI_PORT_WIDTH": given(_port_lines),
    "PHYSICAL_CHAN_DI_SAMP_CLK_SUPPORTED": given(_has_sample_clock),
    "PHYSICAL_CHAN_DI_CHANGE_DETECT_SUPPORTED": given(lambda a: bool(_port_lines(a)) and False),
    "PHYSICAL_CHAN_CI_SUPPORTED_MEAS_TYPES": given([int(measure) for measure in Measure]),
    "PHYSICAL_CHAN_CO_SUPPORTED_OUTPUT_TYPES": given(_PULSES),
    "PHYSICAL_CHAN_DO_PORT_WIDTH": given(_port_lines),
    "PHYSICAL_CHAN_DO_SAMP_CLK_SUPPORTED": given(_has_sample_clock),
}
