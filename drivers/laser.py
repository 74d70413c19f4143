"""A laser displacement sensor: what an inspection finds, and what every laser's driver can do."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, Protocol, runtime_checkable

from dearig.drivers.findings import Finding
from dearig.drivers.settings import LaserSettings

__all__ = ["LaserDriver", "LaserInspection", "analog_findings", "where_to_look"]

_IN_RANGE = 0.999  # of the range: the analog output stays at its end when the film is beyond it
_AGREEMENT = 0.005  # of the range, between two readings of a film that hangs still


@dataclass(frozen=True)
class LaserInspection:
    """What was found at the laser's interface; None what could not be asked.

    ``reading`` is in m, ``metres_per_volt`` the scale of its analog output.
    """

    findings: tuple[Finding, ...]
    reading: float | None = None
    metres_per_volt: float | None = None


@runtime_checkable
class LaserDriver(Protocol):
    """What every laser's driver can do; ``laser.driver`` is its name in the registry."""

    role: Literal["laser"]

    def inspect(self, settings: LaserSettings) -> LaserInspection:
        """Return what the laser at ``settings.port`` says; faults are findings.

        With an empty port nothing is asked, and one finding says so. The laser measures
        afterwards as it did before.
        """
        ...


def analog_findings(
    settings: LaserSettings, volts: float | None, inspection: LaserInspection
) -> tuple[Finding, ...]:
    """Return whether ``volts`` at the card's input is a reading, and the same as the laser's own.

    ``volts`` is None where the card could not be read. The second is judged only where the laser
    has told its reading: it shows that this output is wired to this input, and that the scale it
    tells is the one it applies.
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
                "" if same else "check that the film hangs still, that card.ai_displacement is "
                f"wired to the analog output of OUT{settings.output}, and that the laser's analog "
                "scaling is the one it reports",
            )
        )  # fmt: skip
    return tuple(findings)


def where_to_look(settings: LaserSettings) -> str:
    """Return what to check of a laser that does not see its target."""
    return (
        f"check that the laser is on, its spot falls on the target, and the target is "
        f"{settings.reference_distance_mm:g} mm away"
    )
