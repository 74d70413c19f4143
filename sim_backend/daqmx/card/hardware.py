"""What a PCIe-6361 has: its inputs, outputs, ranges, clocked engines and pins."""

from __future__ import annotations

from dearig.sim_backend.daqmx.card.tasks import Kind
from dearig.sim_backend.daqmx.card.terminals import LINES

__all__ = [
    "CLOCKED_KINDS",
    "CLOCK_OF",
    "DIFFERENTIAL",
    "INPUTS",
    "INPUT_RANGES",
    "LINES",
    "OUTPUTS",
    "PINS",
    "SINGLE",
    "SINGLE_OWN_SENSE",
]

INPUT_RANGES = (10.0, 5.0, 2.0, 1.0, 0.5, 0.2, 0.1)  #: V, plus and minus, as the PCIe-6361 has them
INPUTS = 16
OUTPUTS = ("ao0", "ao1")
#: Terminals on the connector and the bus, in lower case.
PINS = {f"pfi{i}": f"PFI{i}" for i in range(16)} | {f"rtsi{i}": f"RTSI{i}" for i in range(8)}
#: Terminal of the sample clock of each kind of task.
CLOCK_OF = {
    Kind.AI: "ai/sampleclock",
    Kind.AO: "ao/sampleclock",
    Kind.DI: "di/sampleclock",
    Kind.DO: "do/sampleclock",
}
#: Kinds of tasks with a sample clock.
CLOCKED_KINDS = (*CLOCK_OF, Kind.CI, Kind.CO)
DIFFERENTIAL, SINGLE, SINGLE_OWN_SENSE = 10106, 10083, 10078  #: DAQmx: DIFF, RSE, NRSE
