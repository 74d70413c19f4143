"""The Keyence controller's driver, as the registry of instruments has it."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Literal

from dearig.drivers.keyence.controller import Port, open_port
from dearig.drivers.keyence.inspection import inspect
from dearig.drivers.laser import LaserInspection
from dearig.drivers.settings import LaserSettings

__all__ = ["DRIVER", "KeyenceDriver"]


class KeyenceDriver:
    """A laser with an LK-G5000 controller; see ``LaserDriver``.

    ``opener`` opens the serial port, ``clock`` gives the time in s by which replies are late.
    """

    role: Literal["laser"] = "laser"

    def __init__(
        self,
        opener: Callable[[LaserSettings], Port] = open_port,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._opener = opener
        self._clock = clock

    def inspect(self, settings: LaserSettings) -> LaserInspection:
        """Return whether it is there, set as ``settings`` say, and sees the film."""
        return inspect(settings, self._opener, self._clock)


#: As the registry has it.
DRIVER = KeyenceDriver()
