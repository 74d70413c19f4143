"""The Keyence LK-G5000 laser controller on its RS-232C port."""

from dearig.drivers.keyence.compare import ControllerSettings, compare
from dearig.drivers.keyence.controller import Keyence, LaserError, NoReading, Port, open_port
from dearig.drivers.keyence.driver import KeyenceDriver
from dearig.drivers.keyence.inspection import inspect

__all__ = [
    "ControllerSettings",
    "Keyence",
    "KeyenceDriver",
    "LaserError",
    "NoReading",
    "Port",
    "compare",
    "inspect",
    "open_port",
]
