"""Driver of the Keyence controller, for the registry of instruments."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Literal

from dearig.drivers.instruments.laser import LaserInspection
from dearig.drivers.keyence.controller import Port, open_port
from dearig.drivers.keyence.inspection import inspect
from dearig.drivers.settings import LaserSettings

__all__ = ["DRIVER", "KeyenceDriver"]


class KeyenceDriver:
    """Driver of a laser with an LK-G5000 controller; see ``LaserDriver``.

    ``opener`` opens the serial port; ``clock`` returns the time in s for time-outs.
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
        """Return whether it answers, agrees with ``settings`` and sees the film."""
        return inspect(settings, self._opener, self._clock)


#: Entry of the registry.
DRIVER = KeyenceDriver()
