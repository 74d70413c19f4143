"""The high-voltage amplifier's monitors: what their volts say of the film, and whether it is at 0.

The amplifier has no interface of its own; it is known by its two monitors only. The accuracy taken
here for the current monitor is from memory of its maker's description.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from dearig.drivers.findings import Finding
from dearig.drivers.settings import AmplifierSettings, RigSettings

__all__ = ["Monitors", "scaling_findings", "zero_findings"]

#: Part of the current limit below which the current monitor counts as 0.
CURRENT_AT_ZERO = 0.02


@dataclass(frozen=True)
class Monitors:
    """What the monitors say: ``voltage`` in V at the film, ``current`` in A."""

    voltage: float
    current: float

    @staticmethod
    def of_volts(amplifier: AmplifierSettings, voltage: float, current: float) -> Monitors:
        """From the V at the two monitor outputs."""
        return Monitors(
            voltage * 1e3 / amplifier.monitor_V_per_kV,
            current * 1e-3 / amplifier.current_monitor_V_per_mA,
        )


def scaling_findings(settings: RigSettings) -> tuple[Finding, ...]:
    """The scaling that is applied; nothing can ask the amplifier for its own."""
    amplifier = settings.amplifier
    name = amplifier.model
    serial = f", serial {amplifier.serial}" if amplifier.serial else ""
    return (
        Finding(
            name, "drive",
            f"{amplifier.gain_V_per_V:g} V/V, +-{amplifier.range_kV:g} kV{serial} (rig file)",
        ),
        Finding(
            name, "monitors",
            f"{amplifier.monitor_V_per_kV:g} V/kV, {amplifier.current_monitor_V_per_mA:g} V/mA "
            f"(rig file)",
        ),
    )  # fmt: skip


def zero_findings(monitors: Monitors, settings: RigSettings) -> tuple[Finding, ...]:
    """Whether the ``monitors`` agree that there is no voltage on the film, with 0 V commanded.

    The voltage monitor must read within ``limits.zero_tolerance_kV``. A reading that is no number
    is not zero.
    """
    name = settings.amplifier.model
    kilovolts, allowed = monitors.voltage * 1e-3, settings.limits.zero_tolerance_kV
    milliamperes = monitors.current * 1e3
    bound = CURRENT_AT_ZERO * settings.amplifier.current_limit_mA
    findings = []
    for item, value, most, unit, advice in (
        (
            "voltage monitor at 0 V", kilovolts, allowed, "kV",
            "keep away from the film: there may be high voltage on it. Switch the amplifier's high "
            "voltage off; then look at the monitor's cable, card.ai_voltage_monitor and the "
            "amplifier's zero",
        ),
        (
            "current monitor at 0 V", milliamperes, bound, "mA",
            "keep away from the film and switch the amplifier's high voltage off; then look at the "
            "monitor's cable and card.ai_current_monitor, and for a film that leaks",
        ),
    ):  # fmt: skip
        zero = math.isfinite(value) and abs(value) < most
        findings.append(
            Finding(
                name, item, f"{round(value, 3) + 0.0:.3f} {unit}", f"less than {most:g} {unit}",
                "ok" if zero else "wrong", "" if zero else advice,
            )
        )  # fmt: skip
    return tuple(findings)
