"""What the analog inputs and outputs of the card work with."""

from __future__ import annotations

from dataclasses import dataclass

from dearig.sim_backend.daqmx.analog.run import RigRun
from dearig.sim_backend.daqmx.card.state import CardState
from dearig.sim_backend.daqmx.card.wire import Wire
from dearig.sim_backend.daqmx.card.wiring import Wiring
from dearig.sim_backend.daqmx.setup.conversions import Conversions
from dearig.sim_backend.daqmx.setup.routes import Routes
from dearig.sim_backend.daqmx.setup.timing import Timing
from dearig.sim_backend.daqmx.setup.triggering import Triggering

__all__ = ["AnalogParts"]


@dataclass(frozen=True)
class AnalogParts:
    """Parts of the card that analog tasks share, and the rig behind its terminals."""

    state: CardState
    timing: Timing
    conversions: Conversions
    triggering: Triggering
    routes: Routes
    wire: Wire
    wiring: Wiring
    run: RigRun
