"""Lookup of NI's driver and of the cards in this computer, without access to a card."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["Installed", "installed"]


@dataclass(frozen=True)
class Installed:
    """Version of the NI-DAQmx driver, and its cards in the form ``Dev1 (PCIe-6353)``."""

    version: str
    cards: tuple[str, ...]


def installed() -> Installed:
    """Return the version and cards that NI's driver reports.

    Raises ``ModuleNotFoundError`` without the package ``nidaqmx``, ``LookupError`` without the
    driver, ``nidaqmx.errors.DaqError`` where the driver fails.
    """
    from nidaqmx.errors import DaqNotFoundError, DaqNotSupportedError
    from nidaqmx.system import System

    try:
        system = System.local()
        version = system.driver_version
        cards = tuple(f"{card.name} ({card.product_type})" for card in system.devices)
    except (DaqNotFoundError, DaqNotSupportedError) as error:
        raise LookupError("the NI-DAQmx driver is not installed on this computer") from error
    return Installed(
        f"{version.major_version}.{version.minor_version}.{version.update_version}", cards
    )
