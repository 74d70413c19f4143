"""Registry of the instruments' drivers, and their findings together."""

from __future__ import annotations

from typing import Any

from dearig.drivers.instruments.amplifier import AmplifierDriver, Monitors
from dearig.drivers.instruments.findings import Finding
from dearig.drivers.instruments.laser import LaserDriver, LaserInspection, analog_findings
from dearig.drivers.instruments.thermohygrometer import ThermohygrometerDriver
from dearig.drivers.registry import Registry
from dearig.drivers.settings import RigSettings

__all__ = [
    "INSTRUMENTS",
    "InstrumentDriver",
    "instrument_findings",
    "reading_findings",
    "room_driver",
]


InstrumentDriver = LaserDriver | AmplifierDriver | ThermohygrometerDriver

_ROLES = ("laser", "amplifier", "thermohygrometer")


def _check(name: str, driver: Any) -> None:
    # all kinds of drivers have these members; the role distinguishes them
    role = getattr(driver, "role", None)
    if role not in _ROLES or not callable(getattr(driver, "inspect", None)):
        roles = " or ".join(_ROLES)
        raise TypeError(f"{name} is not a driver: it needs a role ({roles}) and inspect")
    if role == "thermohygrometer" and not callable(getattr(driver, "open", None)):
        raise TypeError(f"{name} is not a driver of a thermohygrometer: it needs open too")


#: One line for each driver; other distributions add theirs by the entry point.
INSTRUMENTS: Registry[InstrumentDriver] = Registry(
    "dearig.instruments",
    {
        "keyence": "dearig.drivers.keyence.driver:DRIVER",
        "trek": "dearig.drivers.instruments.trek:DRIVER",
        "vaisala": "dearig.drivers.instruments.vaisala:DRIVER",
    },
    _check,
)


def instrument_findings(
    settings: RigSettings,
    monitors: Monitors | None,
    displacement_volts: float | None,
    laser: LaserDriver | None = None,
    room: ThermohygrometerDriver | None = None,
) -> tuple[Finding, ...]:
    """Return the findings of the instruments' drivers, with 0 V commanded.

    ``monitors`` and ``displacement_volts`` are the card's readings, None where there are none.
    ``laser`` and ``room`` replace the drivers that the rig file names.
    """
    found: list[Finding] = []
    name = settings.amplifier.driver
    amplifier = INSTRUMENTS.get(name)
    if amplifier is not None and amplifier.role == "amplifier":
        found += amplifier.inspect(settings, monitors)
    else:
        found.append(_unknown(settings.amplifier.model, "amplifier", name))
    name = settings.laser.driver
    inspection = LaserInspection(())
    driver = laser or INSTRUMENTS.get(name)
    if driver is not None and driver.role == "laser":
        inspection = driver.inspect(settings.laser)
        found += inspection.findings
    else:
        found.append(_unknown(settings.laser.model, "laser", name))
    found += analog_findings(settings.laser, displacement_volts, inspection)
    if settings.thermohygrometer is not None:
        sensor, name = settings.thermohygrometer, settings.thermohygrometer.driver
        air = room or room_driver(name)
        if air is None:
            found.append(_unknown(sensor.model, "thermohygrometer", name))
        else:
            found += air.inspect(sensor)
    return tuple(found)


def room_driver(name: str) -> ThermohygrometerDriver | None:
    """Return the driver ``name`` of a thermo-hygrometer, None where there is none."""
    driver = INSTRUMENTS.get(name)
    return driver if driver is not None and driver.role == "thermohygrometer" else None


def reading_findings(settings: RigSettings, readings: dict[str, float]) -> tuple[Finding, ...]:
    """Return the readings of the channels that the rig file declares, against their limits.

    ``readings`` maps the channels' names to values in their units; a channel without an entry could
    not be read.
    """
    found = []
    for channel in settings.channel:
        value = readings.get(channel.name)
        if value is None:
            advice = "correct what is wrong with the card first"
            found.append(Finding(channel.shown, "reading", "not read", "", "warning", advice))
            continue
        well = channel.allows(value)
        found.append(
            Finding(
                channel.shown, "reading", f"{value + 0.0:.4g} {channel.unit}", channel.limits_shown,
                "ok" if well else "wrong",
                "" if well else f"check what is wired to {channel.terminal}, and its scaling and "
                f"limits in [[channel]]",
            )
        )  # fmt: skip
    return tuple(found)


def _unknown(model: str, role: str, name: str) -> Finding:
    known = [known for known, driver in INSTRUMENTS.items() if driver.role == role]
    refused = [s for s in INSTRUMENTS.left_out if f"plug-in {name} " in s]
    return Finding(
        model, "driver", refused[0] if refused else f"there is no {role} driver {name!r}",
        " or ".join(known), "wrong", f"correct {role}.driver, or install what brings it",
    )  # fmt: skip
