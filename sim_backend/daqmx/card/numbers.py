"""DAQmx's numbers of settings, and the rates that are fixed in the card."""

from __future__ import annotations

__all__ = [
    "ANALOG_EDGE",
    "CURRENT_READ",
    "CURRENT_WRITE",
    "DIGITAL_EDGE",
    "FALLING",
    "FIRST_PRETRIGGER",
    "FIRST_SAMPLE",
    "HIGH",
    "LINES_RATE",
    "LOW",
    "MOST_RECENT",
    "NO_CHANGE",
    "NO_TRIGGER",
    "REFERENCE_TRIGGER",
    "RISING",
    "TIMEBASE",
    "TRISTATE",
    "WRITE_OFFSET",
    "WRITE_RELATIVE_TO",
]

RISING, FALLING = 10280, 10171  #: DAQmx: edges
HIGH, LOW, TRISTATE, NO_CHANGE = 10192, 10214, 10310, 10160  #: DAQmx: levels of a line
NO_TRIGGER, DIGITAL_EDGE, ANALOG_EDGE = 10230, 10150, 10099  #: DAQmx: types of a trigger
CURRENT_READ, CURRENT_WRITE = 10425, 10430  #: DAQmx: reads and writes go on where they were
FIRST_SAMPLE, MOST_RECENT = 10424, 10428  #: DAQmx: where a read begins
REFERENCE_TRIGGER, FIRST_PRETRIGGER = 10426, 10427  #: DAQmx: where it begins with such a trigger
#: Keys of properties that are kept, and refused when they would take effect.
WRITE_RELATIVE_TO, WRITE_OFFSET = "write relative to", "write offset"
TIMEBASE = 1e8  #: Hz; the counters' timebase of 100 MHz
LINES_RATE = 10e6  #: Hz; the fastest sample clock of the lines of port 0
