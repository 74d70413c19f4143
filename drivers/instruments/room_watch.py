"""A thermo-hygrometer that is read in a separate thread during a run.

A serial line may stall for seconds, and the loop of a run must not. The loop takes the newest
reading and its age; a value that is too old is never handed on as a present one.
"""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable

from dearig.drivers.instruments.thermohygrometer import (
    NO_READING,
    RoomReading,
    Thermohygrometer,
    ThermohygrometerDriver,
    ThermohygrometerError,
    aged,
)
from dearig.drivers.settings import ThermohygrometerSettings

__all__ = ["RoomWatch"]


class RoomWatch:
    """Newest reading of the sensor of ``settings``; see ``RoomSource``.

    It is read once before the first call returns, then every ``interval_s`` once ``start`` was
    called. A port that fails is opened again at the next reading.
    """

    def __init__(
        self,
        settings: ThermohygrometerSettings,
        driver: ThermohygrometerDriver,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._settings = settings
        self._driver = driver
        self._clock = clock
        self._sensor: Thermohygrometer | None = None
        # the newest reading, when it was taken, and why there is no newer one
        self._newest: tuple[RoomReading, float, str] = (NO_READING, -math.inf, "")
        self._end = threading.Event()
        self._thread: threading.Thread | None = None
        self.poll()

    def start(self) -> None:
        """Begin to read on a thread."""
        self._thread = threading.Thread(target=self._work, name="thermo-hygrometer", daemon=True)
        self._thread.start()

    def poll(self) -> None:
        """Read the sensor once; a fault is kept as the reason why there is no newer value."""
        reading, at, _ = self._newest
        try:
            if self._sensor is None:
                self._sensor = self._driver.open(self._settings)
            self._newest = (self._sensor.read(), self._clock(), "")
        except ThermohygrometerError as error:
            self._newest = (reading, at, error.what)
            self._release()

    def reading(self, elapsed: float = 0.0) -> RoomReading:  # noqa: ARG002
        """Return the newest reading with its age; without values where that is above stale_s."""
        newest, at, trouble = self._newest
        return aged(newest, max(self._clock() - at, 0.0), self._settings, trouble)

    def close(self) -> None:
        """End the thread and release the port."""
        self._end.set()
        if self._thread is not None:
            self._thread.join()
        self._release()

    def _work(self) -> None:
        while not self._end.wait(self._settings.interval_s):
            self.poll()

    def _release(self) -> None:
        if self._sensor is not None:
            self._sensor.close()
            self._sensor = None
