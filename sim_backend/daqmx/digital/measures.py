"""What the counters measure, with DAQmx's numbers, and the terminals at which they do."""

from __future__ import annotations

from enum import IntEnum

__all__ = [
    "BY_TERMINAL",
    "DEGREES",
    "DOWN",
    "ENCODERS",
    "HERTZ",
    "INCHES",
    "METRES",
    "PULSES",
    "RADIANS",
    "SECONDS",
    "TICKS",
    "TWO_PULSES",
    "UP",
    "X1",
    "X2",
    "X4",
    "Measure",
    "default_terminal",
]


class Measure(IntEnum):
    """What a counter measures; its values are DAQmx's."""

    COUNT_EDGES = 10125
    FREQUENCY = 10179
    PERIOD = 10256
    PULSE_WIDTH = 10359
    SEMI_PERIOD = 10289
    TWO_EDGE_SEPARATION = 10267
    ANGLE = 10360
    LENGTH = 10361
    PULSE_FREQUENCY = 15864
    PULSE_TIME = 15865
    PULSE_TICKS = 15866


#: Measurements of which a sample is two numbers.
PULSES = (Measure.PULSE_FREQUENCY, Measure.PULSE_TIME, Measure.PULSE_TICKS)
ENCODERS = (Measure.ANGLE, Measure.LENGTH)

UP, DOWN, BY_TERMINAL = 10128, 10124, 10326  #: DAQmx: count directions
TICKS, HERTZ, SECONDS = 10304, 10373, 10364  #: DAQmx: units
DEGREES, RADIANS, METRES, INCHES = 10146, 10273, 10219, 10379
X1, X2, X4, TWO_PULSES = 10090, 10091, 10092, 10313  #: DAQmx: decodings of an encoder

#: Terminals of the counters by their part: source, gate, auxiliary (or A, Z and B).
_PINS = {
    "ctr0": {"source": 8, "gate": 9, "aux": 10},
    "ctr1": {"source": 3, "gate": 4, "aux": 11},
    "ctr2": {"source": 0, "gate": 1, "aux": 2},
    "ctr3": {"source": 5, "gate": 6, "aux": 7},
}


def default_terminal(counter: str, part: str) -> str:
    """Return the PFI terminal of ``part`` (source, gate, aux) of a counter, as the card has it."""
    return f"pfi{_PINS[counter][part]}"
