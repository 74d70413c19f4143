"""The room of a run: readings of a thermo-hygrometer, recorded, shown and judged."""

from __future__ import annotations

import math

from dearig.acquisition.rigs import is_simulated
from dearig.config.rigfile import RigFile
from dearig.drivers.errors import RigError
from dearig.drivers.instruments.registered import room_driver
from dearig.drivers.instruments.room_watch import RoomWatch
from dearig.drivers.instruments.thermohygrometer import RoomLimits, RoomReading, RoomSource
from dearig.drivers.interlocks import Trip
from dearig.drivers.rig import Event
from dearig.drivers.settings import ThermohygrometerSettings
from dearig.errors import InstrumentFault, SafetyStop
from dearig.sim_backend.faults import FaultPlan
from dearig.sim_backend.room import SimulatedSource, air_of_run

__all__ = ["RoomOfRun", "open_room"]

_SAME = 1e-6  # s: two readings that were taken closer together are one


def open_room(
    address: str, rig_file: RigFile, seed: int, faults: FaultPlan | None = None
) -> RoomOfRun:
    """Return the room of a run at ``address``.

    ``seed`` and ``faults`` are those of a simulated rig. A real sensor is read once before this
    returns. Raises ``InstrumentFault`` where the rig file names a driver that does not exist.
    """
    settings = rig_file.thermohygrometer
    if settings is None:
        return RoomOfRun(None, None)
    if is_simulated(address):
        air = air_of_run(rig_file.room, seed)
        try:
            return RoomOfRun(SimulatedSource(settings, air, (seed,), faults), settings)
        except RigError as error:
            raise InstrumentFault(str(error)) from error
    driver = room_driver(settings.driver)
    if driver is None:
        raise InstrumentFault(
            f"there is no driver {settings.driver!r} of a thermo-hygrometer; correct "
            f"thermohygrometer.driver, or install what brings it"
        )
    watch = RoomWatch(settings, driver)
    watch.start()
    return RoomOfRun(watch, settings)


class RoomOfRun:
    """Readings of the room in one run; without a thermo-hygrometer there are none.

    ``source`` gives them, ``settings`` have their limits.
    """

    def __init__(
        self, source: RoomSource | None, settings: ThermohygrometerSettings | None
    ) -> None:
        self._source = source
        self._settings = settings or ThermohygrometerSettings()
        self._rate = 1.0
        self._limits = RoomLimits(self._settings, self._rate)
        self._due = -math.inf  # s of the run
        self._taken = -math.inf  # s of the run at which the newest recorded reading was taken
        self._known = True

    @property
    def exists(self) -> bool:
        """True with a thermo-hygrometer."""
        return self._source is not None

    def check(self) -> None:
        """Refuse to start where the room is out of its limits or, if that matters, unknown.

        Raises ``SafetyStop`` or ``InstrumentFault``.
        """
        if self._source is None:
            return
        for interlock, sentence in self._limits.broken(self._source.reading(0.0)):
            kind = InstrumentFault if interlock == "thermohygrometer" else SafetyStop
            raise kind(f"{sentence}; nothing was started")

    def begin(self, rate: float) -> None:
        """Take ``rate`` in Hz, that of the sample clock."""
        self._rate = rate
        self._limits = RoomLimits(self._settings, rate)

    def take(self, sample: int) -> tuple[list[tuple[int, RoomReading]], list[Event], list[Trip]]:
        """Return what is new once ``sample`` samples have come.

        That is a reading with the sample before which it was taken, or none, events, and
        interlocks that trip.
        """
        elapsed = sample / self._rate
        if self._source is None or elapsed < self._due:
            return [], [], []
        reading = self._source.reading(elapsed)
        events = []
        if reading.known != self._known:
            self._known = reading.known
            why = f": {reading.trouble}" if reading.trouble else ""
            events.append(
                Event(sample, "info", "thermo-hygrometer: it gives values again")
                if reading.known
                else Event(sample, "warning", f"thermo-hygrometer: no value{why}")
            )
        taken = elapsed - reading.age if reading.known else elapsed
        if taken <= self._taken + _SAME:
            return [], events, []
        self._taken = taken
        self._due = taken + self._settings.interval_s
        at = min(max(math.ceil(taken * self._rate - _SAME), 0), sample)
        return [(at, reading)], events, self._limits.watch(sample, reading)

    def close(self) -> None:
        """Release the sensor."""
        if self._source is not None:
            self._source.close()
