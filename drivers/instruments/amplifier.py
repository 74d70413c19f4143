"""High-voltage amplifier: readings of its monitors, and the interface of its drivers."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from typing import Literal, Protocol, runtime_checkable

from dearig.drivers.instruments.findings import Finding
from dearig.drivers.settings import AmplifierSettings, RigSettings
from dearig.drivers.zero_reading import ZeroReading

__all__ = ["AmplifierDriver", "Monitors", "zero_findings"]

#: Share of the current limit below which the current monitor counts as 0.
CURRENT_AT_ZERO = 0.02
_AT_ZERO = "voltage monitor at 0 V"


@dataclass(frozen=True)
class Monitors:
    """Readings of the monitors: ``voltage`` in V at the film, ``current`` in A."""

    voltage: float
    current: float

    @staticmethod
    def of_volts(amplifier: AmplifierSettings, voltage: float, current: float) -> Monitors:
        """Return the readings for the V at the two monitor outputs."""
        return Monitors(
            voltage * 1e3 / amplifier.monitor_V_per_kV,
            current * 1e-3 / amplifier.current_monitor_V_per_mA,
        )


@runtime_checkable
class AmplifierDriver(Protocol):
    """Interface of an amplifier's driver; ``amplifier.driver`` is its name in the registry."""

    role: Literal["amplifier"]

    def inspect(self, settings: RigSettings, monitors: Monitors | None) -> tuple[Finding, ...]:
        """Return the state of the amplifier with 0 V commanded; faults are findings.

        ``monitors`` are the card's readings of the two monitors, None where there are none.
        """
        ...


def zero_findings(monitors: Monitors, settings: RigSettings) -> tuple[Finding, ...]:
    """Return whether ``monitors`` show that the film has no voltage, with 0 V commanded.

    The voltage monitor must read within ``limits.zero_tolerance_kV``. NaN does not count as zero.
    """
    name = settings.amplifier.model
    kilovolts, allowed = monitors.voltage * 1e-3, settings.limits.zero_tolerance_kV
    milliamperes = monitors.current * 1e3
    bound = CURRENT_AT_ZERO * settings.amplifier.current_limit_mA
    findings = []
    for item, value, most, unit, advice in (
        (
            _AT_ZERO, kilovolts, allowed, "kV",
            "keep away from the film: there may be high voltage on it. Switch the amplifier's high "
            "voltage off; then check the monitor's cable, card.ai_voltage_monitor and the "
            "amplifier's zero",
        ),
        (
            "current monitor at 0 V", milliamperes, bound, "mA",
            "keep away from the film and switch the amplifier's high voltage off; then check the "
            "monitor's cable and card.ai_current_monitor, and whether the film leaks",
        ),
    ):  # fmt: skip
        zero = math.isfinite(value) and abs(value) < most
        read = None
        if item == _AT_ZERO and math.isfinite(value):
            read = ZeroReading(monitors.voltage, time.time(), zero)
        findings.append(
            Finding(
                name, item, f"{round(value, 3) + 0.0:.3f} {unit}", f"less than {most:g} {unit}",
                "ok" if zero else "wrong", "" if zero else advice, read,
            )
        )  # fmt: skip
    return tuple(findings)
