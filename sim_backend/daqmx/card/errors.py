"""Errors of the simulated card: NI-DAQmx's codes with a shortened form of the driver's texts."""

from __future__ import annotations

from enum import IntEnum

from nidaqmx._grpc_interpreter import _ERROR_MESSAGES
from nidaqmx.error_codes import DAQmxErrors

__all__ = ["ERROR_TEXT", "WORDS", "Code", "DaqmxError", "message_of"]

#: Characters of an error's text in a reply, at most: its headers hold 8 KiB.
ERROR_TEXT = 1000


class Code(IntEnum):
    """Codes of NI-DAQmx that the simulated card uses."""

    RESOURCE_RESERVED = -50103
    RESOURCE_NOT_AVAILABLE = -50101
    MEMORY_FULL = -50352
    RUNTIME_ABORTED = -88709
    ROUTE_NOT_SUPPORTED = -89136
    INVALID_ROUTE_SOURCE = -89120
    MIN_NOT_LESS_THAN_MAX = -200082
    INVALID_SYNTAX = -200086
    INVALID_TASK = -200088
    DUPLICATE_TASK = -200089
    INVALID_VALUE = -200077
    UNKNOWN_CHANNEL = -200170
    UNKNOWN_DEVICE = -200220
    READ_BUFFER_TOO_SMALL = -200229
    WRITE_BUFFER_TOO_SMALL = -200234
    SAMPLES_NEVER_AVAILABLE = -200278
    SAMPLES_OVERWRITTEN = -200279
    NEGATIVE_SAMPLE = -200277
    SAMPLES_NOT_YET_AVAILABLE = -200284
    SAMPLES_NEVER_GENERATED = -200288
    OUTPUT_STARVED = -200290
    SAMPLES_NOT_YET_WRITTEN = -200292
    AI_CONVERT_RATE_TOO_HIGH = -200335
    CHANNEL_NOT_IN_TASK = -200486
    NOT_SUPPORTED_IN_TASK = -200452
    NOT_AN_INPUT = -200460
    NOT_AN_OUTPUT = -200459
    OUTPUT_BUFFER_EMPTY = -200462
    BUFFER_SIZE_FIXED = -200547
    NOT_WITHOUT_CHANNELS = -200478
    NOT_WHILE_RUNNING = -200479
    CHANNEL_ALREADY_IN_TASK = -200489
    MIXED_CHANNELS = -200559
    PROPERTY_WHILE_RUNNING = -200557
    SEVERAL_DEVICES = -200558
    NOT_DONE_IN_TIME = -200560
    INVALID_SAMPLE = -200561
    OUTPUT_BUFFER_TOO_SMALL = -200609
    WATCHDOG_ONLY = -200635
    WATCHDOG_EXPIRED_NO_RESET = -200644
    WATCHDOG_TIMEOUT = -200668
    WRITE_AFTER_WATCHDOG = -200678
    CHANNELS_DIFFER = -200524
    CONVERT_PERIOD = -200081
    WRITE_WITHOUT_START = -200846
    READ_WITHOUT_START = -200834
    READ_WITHOUT_COMMIT = -200473
    DONE_EVENT_REGISTERED = -200950
    SIGNAL_EVENT_REGISTERED = -200949
    SIGNAL_NOT_SUPPORTED = -200987
    ACQUIRED_EVENT_REGISTERED = -200966
    TRANSFERRED_EVENT_REGISTERED = -200967
    TRANSFERRED_NOT_FOR_INPUT = -200980
    ACQUIRED_NOT_FOR_OUTPUT = -200981
    EVENT_INTERVAL_ZERO = -200880
    EVENT_WITHOUT_BUFFER = -200848
    BUFFER_NOT_MULTIPLE = -200877
    EVENT_WHILE_RUNNING = -200960
    BEYOND_FINITE = -201132
    PROPERTY_NOT_SUPPORTED = -200197
    PROPERTY_CANNOT_BE_SET = -200231
    PROPERTY_CANNOT_BE_RESET = -200236
    NO_DEVICE_CONTEXT = -201118
    ONLY_WHEN_RESERVED = -200983
    TRIGGER_ON_DEMAND = -200262
    INVALID_ROUTE_DESTINATION = -89121
    UNKNOWN_SCALE = -200378
    UNITS_NOT_FROM_SCALE = -200447
    NOT_FOR_THIS_SCALE = -200601
    PRE_SCALED_EQUAL = -200602
    ZERO_SLOPE = -200409
    TABLE_SIZES_DIFFER = -200350
    TABLE_TOO_SHORT = -200434
    NO_COEFFICIENTS = -200404
    NO_BUFFER_ON_DEMAND = -200217
    NOT_MEASURED_BY_CHANNEL = -200431
    NOT_PUT_OUT_BY_CHANNEL = -200432
    SEVERAL_COUNTERS = -200147
    REFERENCE_WHEN_CONTINUOUS = -200358
    NOT_SUPPORTED_BY_DEVICE = -201380
    TERMINAL_NOT_VALID = -200354
    DIGITAL_LINES_MISMATCH = -200463
    OPERATION_TIMED_OUT = -200474
    SIGNAL_NOT_EXPORTED = -200375


WORDS: dict[int, str] = {
    Code.RESOURCE_RESERVED: "The specified resource is reserved. The operation could not be "
    "completed as specified.",
    Code.RESOURCE_NOT_AVAILABLE: "The specified resource is not available.",
    Code.MEMORY_FULL: "There is not enough memory for the operation.",
    Code.RUNTIME_ABORTED: "The operation was aborted: the device was reset or the task aborted.",
    Code.ROUTE_NOT_SUPPORTED: "Specified route cannot be satisfied, because the hardware does not "
    "support it.",
    Code.INVALID_ROUTE_SOURCE: "Source terminal to be routed could not be found on the device.",
    Code.MIN_NOT_LESS_THAN_MAX: "Minimum value is not less than the maximum value.",
    Code.INVALID_SYNTAX: "Syntax for a range of objects in the input string is invalid.",
    Code.INVALID_TASK: "Task specified is invalid or does not exist.",
    Code.DUPLICATE_TASK: "Task name specified conflicts with an existing task name.",
    Code.INVALID_VALUE: "Requested value is not a supported value for this property.",
    Code.UNKNOWN_CHANNEL: "Physical channel specified does not exist on this device.",
    Code.UNKNOWN_DEVICE: "Device identifier is invalid.",
    Code.READ_BUFFER_TOO_SMALL: "Read buffer is too small to fit the requested data.",
    Code.WRITE_BUFFER_TOO_SMALL: "Buffer is too small to fit the written data.",
    Code.SAMPLES_NEVER_AVAILABLE: "Cannot read the requested samples, because they will never be "
    "available.",
    Code.SAMPLES_OVERWRITTEN: "The application is not able to keep up with the hardware "
    "acquisition: samples were overwritten in the buffer before they were read.",
    Code.NEGATIVE_SAMPLE: "Attempted to read a sample before the first one that was acquired.",
    Code.SAMPLES_NOT_YET_AVAILABLE: "Some or all of the samples requested have not yet been "
    "acquired.",
    Code.SAMPLES_NEVER_GENERATED: "Some or all of the samples to write will never be generated.",
    Code.OUTPUT_STARVED: "The generation has stopped to prevent the regeneration of old samples. "
    "Your application was unable to write samples to the background buffer fast enough.",
    Code.SAMPLES_NOT_YET_WRITTEN: "Some or all of the samples to write could not be written to the "
    "buffer yet. More space will free up as samples currently in the buffer are generated.",
    Code.AI_CONVERT_RATE_TOO_HIGH: "Specified AI conversion rate exceeds the maximum.",
    Code.CHANNEL_NOT_IN_TASK: "Specified channel is not in the task.",
    Code.NOT_SUPPORTED_IN_TASK: "Specified property is not supported by the device or is not "
    "applicable to the task.",
    Code.NOT_AN_INPUT: "Read cannot be performed, because this task does not contain any "
    "input channels.",
    Code.NOT_AN_OUTPUT: "Write cannot be performed, because this task does not contain any "
    "output channels.",
    Code.OUTPUT_BUFFER_EMPTY: "Generation cannot be started, because the output buffer is empty.",
    Code.BUFFER_SIZE_FIXED: "Write failed, because the buffer was configured from the first write "
    "and is full; set its size to write more before the start.",
    Code.NOT_WITHOUT_CHANNELS: "Specified operation cannot be performed when there are no channels "
    "in the task.",
    Code.NOT_WHILE_RUNNING: "Specified operation cannot be performed while the task is running.",
    Code.CHANNEL_ALREADY_IN_TASK: "Specified channel cannot be added to the task, because a "
    "channel with the same name is already in the task.",
    Code.MIXED_CHANNELS: "Task contains channels of several types; one type is allowed.",
    Code.PROPERTY_WHILE_RUNNING: "Specified property cannot be set while the task is running.",
    Code.SEVERAL_DEVICES: "Task contains physical channels on one or more devices that do not "
    "support multidevice tasks.",
    Code.NOT_DONE_IN_TIME: "Wait Until Done did not indicate that the task was done within the "
    "specified timeout.",
    Code.INVALID_SAMPLE: "Attempted writing analog data that is too large or too small.",
    Code.OUTPUT_BUFFER_TOO_SMALL: "Generation cannot be started because the selected buffer size "
    "is too small.",
    Code.WATCHDOG_ONLY: "Specified action is supported only by watchdog timer tasks.",
    Code.WATCHDOG_EXPIRED_NO_RESET: "Watchdog timer cannot be reset after it has expired.",
    Code.WATCHDOG_TIMEOUT: "Watchdog timeout is out of range and not the special value -1.",
    Code.WRITE_AFTER_WATCHDOG: "Write failed, because the watchdog timer expired.",
    Code.CHANNELS_DIFFER: "Write cannot be performed, because the number of channels in the data "
    "does not match the number of channels in the task.",
    Code.CONVERT_PERIOD: "Sample rate, number of channels and conversion period do not agree: "
    "the conversions of one sample take longer than the sample period.",
    Code.WRITE_WITHOUT_START: "Write cannot be performed when the auto start input is false and "
    "the task is not running.",
    Code.READ_WITHOUT_START: "Read cannot be performed when the auto start property is false and "
    "the task is not running.",
    Code.READ_WITHOUT_COMMIT: "Read cannot be performed when the auto start property is false and "
    "the task is not running or committed.",
    Code.DONE_EVENT_REGISTERED: "Done event is already registered within this task.",
    Code.SIGNAL_EVENT_REGISTERED: "Signal event is already registered within this task.",
    Code.SIGNAL_NOT_SUPPORTED: "Signal event of this type is not supported by the channels or "
    "devices in the task.",
    Code.ACQUIRED_EVENT_REGISTERED: "Every N Samples Acquired Into Buffer event is already "
    "registered within this task.",
    Code.TRANSFERRED_EVENT_REGISTERED: "Every N Samples Transferred From Buffer event is already "
    "registered within this task.",
    Code.TRANSFERRED_NOT_FOR_INPUT: "Every N Samples Transferred From Buffer event is not "
    "supported by the device for input tasks.",
    Code.ACQUIRED_NOT_FOR_OUTPUT: "Every N Samples Acquired Into Buffer event is not supported "
    "by the device for output tasks.",
    Code.EVENT_INTERVAL_ZERO: "Every N Samples event interval must be greater than zero.",
    Code.EVENT_WITHOUT_BUFFER: "Every N Samples event is not supported for non-buffered tasks.",
    Code.BUFFER_NOT_MULTIPLE: "Buffer size must be a multiple of the Every N Samples event "
    "interval.",
    Code.EVENT_WHILE_RUNNING: "Software event cannot be registered while the task is running.",
    Code.BEYOND_FINITE: "Samples cannot be written beyond the last sample of the finite "
    "generation.",
    Code.PROPERTY_NOT_SUPPORTED: "Specified property is not supported by the device.",
    Code.PROPERTY_CANNOT_BE_SET: "Specified property cannot be set.",
    Code.PROPERTY_CANNOT_BE_RESET: "Specified property cannot be reset to its default.",
    Code.NO_DEVICE_CONTEXT: "Specified property does not support a device context.",
    Code.ONLY_WHEN_RESERVED: "Specified property can be read only while the task is reserved, "
    "committed or running.",
    Code.TRIGGER_ON_DEMAND: "Start and reference triggers need a sample clock; the sample timing "
    "is On Demand.",
    Code.INVALID_ROUTE_DESTINATION: "Destination terminal to be routed could not be found on the "
    "device.",
    Code.UNKNOWN_SCALE: "Custom scale specified does not exist.",
    Code.UNITS_NOT_FROM_SCALE: "A custom scale is given, but the units are not From Custom Scale.",
    Code.NOT_FOR_THIS_SCALE: "Specified property is not supported for this type of scale.",
    Code.PRE_SCALED_EQUAL: "Minimum and maximum of the values before scaling are equal.",
    Code.ZERO_SLOPE: "Slope of a linear scale is zero.",
    Code.TABLE_SIZES_DIFFER: "Scaled and pre-scaled values of a table differ in number.",
    Code.TABLE_TOO_SHORT: "A table needs two or more values.",
    Code.NO_COEFFICIENTS: "A polynomial scale needs forward and reverse coefficients.",
    Code.NOT_MEASURED_BY_CHANNEL: "Selected physical channel does not support the measurement type "
    "required by the virtual channel you are creating.",
    Code.NOT_PUT_OUT_BY_CHANNEL: "Selected physical channel does not support the output type "
    "required by the virtual channel you are creating.",
    Code.SEVERAL_COUNTERS: "Task contains several counter input channels; one is allowed.",
    Code.REFERENCE_WHEN_CONTINUOUS: "Reference trigger cannot be used in a continuous acquisition.",
    Code.NOT_SUPPORTED_BY_DEVICE: "Device does not support this operation.",
    Code.TERMINAL_NOT_VALID: "Specified property value is not the name of a valid terminal.",
    Code.DIGITAL_LINES_MISMATCH: "Number of lines in the data does not match the number of lines "
    "in the channel.",
    Code.SIGNAL_NOT_EXPORTED: "Specified signal cannot be exported by this task.",
    Code.OPERATION_TIMED_OUT: "Specified operation did not complete, because the specified timeout "
    "expired.",
    Code.NO_BUFFER_ON_DEMAND: "Buffered operations cannot use On Demand for the sample timing.",
}


def message_of(code: int) -> str:
    """Return the text for ``code``: the library's own where it has one, or this module's."""
    if code in _ERROR_MESSAGES:
        return str(_ERROR_MESSAGES[code])
    if code in WORDS:
        return WORDS[code]
    if code in {known.value for known in DAQmxErrors}:
        return f"Error {code} ({DAQmxErrors(code).name}) occurred."
    return "Error code could not be found. The simulated card and the library do not know it."


class DaqmxError(Exception):
    """Error with its ``code``; ``detail`` names values, ``read`` and ``written`` are samples.

    ``read`` or ``written`` is set for an error of a read or a write.
    """

    def __init__(
        self,
        code: Code,
        detail: str = "",
        *,
        read: int | None = None,
        written: int | None = None,
    ) -> None:
        text = WORDS[code]
        super().__init__(f"{text} {detail}" if detail else text)
        self.code = int(code)
        self.read = read
        self.written = written
