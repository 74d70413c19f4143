"""Registry entry of the simulated rigs, with their inspection."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal

import numpy as np

from dearig.drivers.channels import Channel
from dearig.drivers.errors import RigError
from dearig.drivers.gate import FilmForecast, admit
from dearig.drivers.inputs import Inputs
from dearig.drivers.instruments.amplifier import Monitors
from dearig.drivers.instruments.findings import Finding
from dearig.drivers.instruments.laser import LaserDriver, LaserInspection
from dearig.drivers.instruments.registered import (
    INSTRUMENTS,
    instrument_findings,
    reading_findings,
    room_driver,
)
from dearig.drivers.instruments.thermohygrometer import ThermohygrometerDriver
from dearig.drivers.instruments.vaisala import VaisalaDriver
from dearig.drivers.keyence.driver import KeyenceDriver
from dearig.drivers.rig import Rig, RigIdentity
from dearig.drivers.rig_kind import RigOptions
from dearig.drivers.settings import LaserSettings, RigSettings
from dearig.model.film.material import Film
from dearig.sim_backend.factory import open_simulated_inputs, open_simulated_rig
from dearig.sim_backend.faults import FaultKind, FaultPlan
from dearig.sim_backend.keyence import SimulatedController
from dearig.sim_backend.room import SimulatedSource, air_of_run
from dearig.sim_backend.serial_line import SimulatedLine

__all__ = ["KIND", "SimulatedKind"]

_SECONDS = 0.2  # of samples at 0 V
_SAMPLES_MIN = 16


class SimulatedKind:
    """Rig that follows the model (``sim``) or hides an effect (``sim:SEED``); see ``RigKind``."""

    addresses: tuple[str, ...] = ("sim", "sim:SEED such as sim:7")
    simulated = True

    def open(self, address: str, settings: RigSettings, options: RigOptions) -> Rig:
        """Return the rig at ``address``; raises as ``open_simulated_rig``."""
        return open_simulated_rig(
            address, settings, options.film, options.load, seed=options.seed, paced=options.paced,
            actuator=options.actuator, faults=options.faults,
        )  # fmt: skip

    def open_inputs(self, address: str, settings: RigSettings, options: RigOptions) -> Inputs:
        """Return the inputs of the rig at ``address`` at rest; raises as ``open``."""
        return open_simulated_inputs(
            address, settings, options.film, options.load, actuator=options.actuator
        )

    def inspect(
        self, address: str, settings: RigSettings, options: RigOptions
    ) -> tuple[Finding, ...]:
        """Play 0 V on the rig and read it; query a simulated controller if ``laser.port`` is set.

        Raises as ``open``.
        """
        faults: FaultPlan = options.faults or FaultPlan()
        serial = faults.of(FaultKind.SERIAL_GARBAGE)
        others = FaultPlan(tuple(fault for fault in faults.faults if fault not in serial))
        rig = open_simulated_rig(address, settings, options.film, options.load, faults=others)
        try:
            identity = rig.identify()
            rate, readings = _at_zero(rig, settings, options.film, identity.channels)
        except RigError as error:
            broken = Finding(settings.card.model, "samples at 0 V", str(error), verdict="wrong")
            unasked = settings.model_copy(
                update={"laser": settings.laser.model_copy(update={"port": ""})}
            )
            return (
                broken,
                *instrument_findings(unasked, None, None),
                *reading_findings(settings, {}),
            )
        finally:
            rig.close()
        laser = settings.laser
        volts = laser.direction * readings["displacement"] * 1e3 / laser.mm_per_V
        monitors = Monitors(readings["voltage_monitor"], readings["current_monitor"])
        shown, driver = _simulated_laser(settings, readings["displacement"], FaultPlan(serial))
        shown, air = _simulated_room(shown, faults)
        return (
            *_card(settings, identity, rate),
            *instrument_findings(shown, monitors, volts, driver, air),
            *reading_findings(settings, readings),
        )


class _NotSimulated:
    """Driver of a laser whose instrument is not simulated; see ``LaserDriver``."""

    role: Literal["laser"] = "laser"

    def inspect(self, settings: LaserSettings) -> LaserInspection:
        """Return one finding: the instrument was not queried."""
        unasked = Finding(
            settings.model, "serial port", f"not asked: {settings.driver} is not simulated",
            verdict="not wired",
        )  # fmt: skip
        return LaserInspection((unasked,))


def _simulated_laser(
    settings: RigSettings, displacement: float, faults: FaultPlan
) -> tuple[RigSettings, LaserDriver | None]:
    """Return the driver for the inspection of a simulated rig's laser, and its settings.

    Only the Keyence controller is simulated. The port of the rig file is never opened.
    """
    laser = settings.laser
    if not laser.port or INSTRUMENTS.get(laser.driver) is None:
        return settings, None
    if laser.driver != "keyence":
        return settings, _NotSimulated()
    laser = laser.model_copy(update={"port": f"{laser.port} (simulated)"})
    controller = SimulatedController(laser, lambda _: displacement, faults=faults)
    line = SimulatedLine(controller, laser.baud_rate)

    def opened(_: LaserSettings) -> SimulatedLine:
        return line

    return settings.model_copy(update={"laser": laser}), KeyenceDriver(opened, line.now)


def _simulated_room(
    settings: RigSettings, faults: FaultPlan
) -> tuple[RigSettings, ThermohygrometerDriver | None]:
    """Return the driver for the inspection of a thermo-hygrometer, and the settings to show."""
    sensor = settings.thermohygrometer
    if sensor is None or not isinstance(room_driver(sensor.driver), VaisalaDriver):
        return settings, None
    source = SimulatedSource(sensor, air_of_run(settings.room, 0), faults=faults)
    shown = sensor.model_copy(update={"port": source.port})
    return settings.model_copy(update={"thermohygrometer": shown}), source.driver


def _at_zero(
    rig: Rig, settings: RigSettings, film: Film, channels: tuple[Channel, ...]
) -> tuple[float, dict[str, float]]:
    """Return the sample rate in Hz and the means of ``channels`` in SI units at 0 V output."""
    limits = settings.limits.gate_limits()
    rate = float(settings.card.conversion_rate_Hz)
    zero = np.zeros(max(_SAMPLES_MIN, round(_SECONDS * rate)))
    # any film's limits admit 0 V
    prediction = FilmForecast(np.full(zero.size, 1.0 / film.thickness), film.electric_volume)
    rate = rig.load(admit(zero, rate, limits, prediction))
    rig.arm()
    rig.start()
    blocks = []
    while (block := rig.read()) is not None:
        blocks.append(block.counts)
    counts = np.concatenate(blocks, axis=1)
    return rate, {
        channel.name: float(np.mean(channel.scaling.physical(row)))
        for channel, row in zip(channels, counts, strict=True)
    }


def _card(settings: RigSettings, identity: RigIdentity, rate: float) -> Iterator[Finding]:
    name = settings.card.model
    yield Finding(name, "type", f"simulated, at {identity.address}")
    yield Finding(name, "sample rate", f"{rate:.6g} Hz", f"{settings.card.conversion_rate_Hz:g} Hz")
    ranges = settings.ranges()
    for channel, terminal in settings.terminals().items():
        yield Finding(name, channel.replace("_", " "), f"{terminal}, +-{ranges[channel]:g} V")
    if settings.card.do_hv_enable is None:
        yield Finding(name, "high-voltage enable", "no line in the rig file", verdict="not wired")


#: Entry of the registry.
KIND = SimulatedKind()
