"""TREK high-voltage amplifier, which has no interface: the card reads its two monitors.

The accuracy assumed for the current monitor is from memory of the maker's description.
"""

from __future__ import annotations

from typing import Literal

from dearig.drivers.instruments.amplifier import Monitors, zero_findings
from dearig.drivers.instruments.findings import Finding
from dearig.drivers.settings import RigSettings

__all__ = ["DRIVER", "TrekDriver"]


class TrekDriver:
    """Driver of an amplifier that has only two monitors; see ``AmplifierDriver``."""

    role: Literal["amplifier"] = "amplifier"

    def inspect(self, settings: RigSettings, monitors: Monitors | None) -> tuple[Finding, ...]:
        """Return the scaling in use, and whether the monitors read 0."""
        amplifier = settings.amplifier
        model = amplifier.model
        serial = f", serial {amplifier.serial}" if amplifier.serial else ""
        scaling = (
            Finding(
                model, "drive",
                f"{amplifier.gain_V_per_V:g} V/V, +-{amplifier.range_kV:g} kV{serial} (rig file)",
            ),
            Finding(
                model, "monitors",
                f"{amplifier.monitor_V_per_kV:g} V/kV, {amplifier.current_monitor_V_per_mA:g} V/mA "
                f"(rig file)",
            ),
        )  # fmt: skip
        if monitors is not None:
            return (*scaling, *zero_findings(monitors, settings))
        unread = Finding(
            model, "monitors at 0 V", "not read", verdict="warning",
            advice="correct what is wrong with the card first",
        )  # fmt: skip
        return (*scaling, unread)


#: Entry of the registry.
DRIVER = TrekDriver()
