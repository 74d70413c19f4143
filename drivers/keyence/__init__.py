"""The Keyence LK-G5000 laser controller on its RS-232C port."""

from dearig.drivers.keyence.compare import ControllerSettings, compare
from dearig.drivers.keyence.controller import Keyence, LaserError, NoReading, Port, open_port
from dearig.drivers.keyence.inspection import (
    LaserInspection,
    analog_findings,
    inspect,
    require_agreement,
)

__all__ = [
    "ControllerSettings",
    "Keyence",
    "LaserError",
    "LaserInspection",
    "NoReading",
    "Port",
    "analog_findings",
    "compare",
    "inspect",
    "open_port",
    "require_agreement",
]
