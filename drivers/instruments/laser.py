"""Laser displacement sensor: results of an inspection, and the interface of its drivers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, Protocol, runtime_checkable

from dearig.drivers.instruments.findings import Finding
from dearig.drivers.settings import LaserSettings

__all__ = ["LaserDriver", "LaserInspection", "analog_findings", "where_to_look"]

_IN_RANGE = 0.999  # of the range; beyond it the analog output stays at its end
_AGREEMENT = 0.005  # of the range, between two readings of a film at rest


@dataclass(frozen=True)
class LaserInspection:
    """Result of an inspection at the laser's interface; None where it could not be queried.

    ``reading`` is in m, ``metres_per_volt`` the scale of its analog output.
    """

    findings: tuple[Finding, ...]
    reading: float | None = None
    metres_per_volt: float | None = None


@runtime_checkable
class LaserDriver(Protocol):
    """Interface of a laser's driver; ``laser.driver`` is its name in the registry."""

    role: Literal["laser"]

    def inspect(self, settings: LaserSettings) -> LaserInspection:
        """Return the state of the laser at ``settings.port``; faults are findings.

        With an empty port the laser is not queried, and one finding says so. Afterwards the laser
        measures as before.
        """
        ...


def analog_findings(
    settings: LaserSettings, volts: float | None, inspection: LaserInspection
) -> tuple[Finding, ...]:
    """Return whether ``volts`` at the card's input are a reading and agree with the laser's own.

    ``volts`` is None where the card could not be read. The agreement is checked only where the
    laser has reported its reading. It shows that this output is wired to this input, and that the
    reported scale is the one in use.
    """
    name = settings.model
    if volts is None:
        unread = Finding(
            name, "analog output", "not read", verdict="warning",
            advice="correct what is wrong with the card first",
        )  # fmt: skip
        return (unread,)
    millimetres = volts * settings.mm_per_V
    seen = abs(millimetres) < _IN_RANGE * settings.range_mm
    findings = [
        Finding(
            name, "analog output", f"{millimetres + 0.0:.5g} mm ({volts + 0.0:.4g} V)",
            f"within +-{settings.range_mm:g} mm", "ok" if seen else "wrong",
            "" if seen else f"{where_to_look(settings)}; if it does, check the cable and "
            f"card.ai_displacement",
        )
    ]  # fmt: skip
    if inspection.reading is not None and inspection.metres_per_volt is not None:
        analog = volts * inspection.metres_per_volt * 1e3
        off = abs(analog - inspection.reading * 1e3)
        same = off <= _AGREEMENT * settings.range_mm
        findings.append(
            Finding(
                name, "analog output against serial port", f"{off:.3f} mm apart",
                f"{_AGREEMENT * settings.range_mm:g} mm or less", "ok" if same else "wrong",
                "" if same else "check that the film is at rest, that card.ai_displacement is "
                f"wired to the analog output of OUT{settings.output}, and that the laser's analog "
                "scaling is the one it reports",
            )
        )  # fmt: skip
    return tuple(findings)


def where_to_look(settings: LaserSettings) -> str:
    """Return what to check on a laser that does not see its target."""
    return (
        f"check that the laser is on, its spot falls on the target, and the target is "
        f"{settings.reference_distance_mm:g} mm away"
    )
