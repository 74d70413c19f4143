"""A look at the laser controller: is it there, set as the rig file says, does it see the film."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

from dearig.drivers.findings import Finding
from dearig.drivers.keyence.compare import ControllerSettings, compare, settings_findings
from dearig.drivers.keyence.controller import Keyence, LaserError, NoReading, Port, open_port
from dearig.drivers.settings import LaserSettings

__all__ = ["LaserInspection", "analog_findings", "inspect", "require_agreement"]

_IN_RANGE = 0.999  # of the range: the analog output stays at its end when the film is beyond it
_AGREEMENT = 0.005  # of the range, between two readings of a film that hangs still


@dataclass(frozen=True)
class LaserInspection:
    """What was found at the serial port; None what the controller could not be asked.

    ``reading`` is in m, ``metres_per_volt`` the scale of its analog output.
    """

    findings: tuple[Finding, ...]
    reading: float | None = None
    metres_per_volt: float | None = None


def inspect(
    settings: LaserSettings,
    opener: Callable[[LaserSettings], Port] = open_port,
    clock: Callable[[], float] = time.monotonic,
) -> LaserInspection:
    """Look at the controller at ``settings.port``; faults are findings.

    With an empty ``settings.port`` nothing is asked, and one finding says so.
    """
    name = settings.model
    if not settings.port:
        nobody = Finding(
            name, "serial port", "none in the rig file", verdict="not wired",
            advice="set laser.port to have the controller's settings compared; until then "
            "laser.mm_per_V, sampling_us and averaging are taken on trust",
        )  # fmt: skip
        return LaserInspection((nobody,))
    findings: list[Finding] = []
    reading: float | NoReading = NoReading.INVALID
    scale = None
    item = "serial port"
    try:
        with Keyence(opener(settings), settings, clock) as controller:
            program = controller.program()
            serial = f", serial {settings.serial} (rig file)" if settings.serial else ""
            findings.append(
                Finding(
                    name, item,
                    f"answers on {settings.port} at {settings.baud_rate} Bd, program {program}"
                    f"{serial}",
                )
            )  # fmt: skip
            item = "settings"
            found = controller.controller_settings()
            scale = found.metres_per_volt
            findings.extend(settings_findings(settings, found))
            item = f"reading of OUT{settings.output}"
            reading = controller.read()
            findings.append(_reading_finding(settings, item, reading))
    except LaserError as error:
        findings.append(Finding(name, item, error.what, verdict="wrong", advice=error.advice))
    seen = None if isinstance(reading, NoReading) else reading
    return LaserInspection(tuple(findings), seen, scale)


def _reading_finding(settings: LaserSettings, item: str, reading: float | NoReading) -> Finding:
    wanted = f"within +-{settings.range_mm:g} mm"
    if isinstance(reading, NoReading):
        return Finding(
            settings.model, item, reading.value, wanted, "wrong", _where_to_look(settings)
        )
    millimetres = reading * 1e3
    if abs(millimetres) <= settings.range_mm:
        return Finding(settings.model, item, f"{millimetres:.5g} mm", wanted)
    return Finding(
        settings.model, item, f"{millimetres:.5g} mm", wanted, "wrong",
        "move the head so that the film's whole travel lies within its range",
    )  # fmt: skip


def require_agreement(
    settings: LaserSettings,
    opener: Callable[[LaserSettings], Port] = open_port,
    clock: Callable[[], float] = time.monotonic,
) -> ControllerSettings | None:
    """Refuse a run whose rig file contradicts the controller; returns what is set in it.

    To be called before a run, never during one: the controller does not measure while it is asked.
    None where ``settings.port`` is empty. Raises ``LaserError`` with every contradiction, or where
    the controller cannot be asked.
    """
    if not settings.port:
        return None
    with Keyence(opener(settings), settings, clock) as controller:
        found = controller.controller_settings()
    contradictions = compare(settings, found)
    if contradictions:
        raise LaserError(
            "the laser controller is not set as the rig file says: " + "; ".join(contradictions),
            "nothing was started",
        )
    return found


def analog_findings(
    settings: LaserSettings, volts: float, controller: LaserInspection
) -> tuple[Finding, ...]:
    """Whether ``volts`` at the card's input is a reading, and the one that the controller gives.

    The second is asked only of a controller that has told its reading: it shows that this OUT is
    wired to this input, and that the scale it tells is the one it applies.
    """
    name = settings.model
    millimetres = volts * settings.mm_per_V
    seen = abs(millimetres) < _IN_RANGE * settings.range_mm
    findings = [
        Finding(
            name, "analog output", f"{millimetres + 0.0:.5g} mm ({volts + 0.0:.4g} V)",
            f"within +-{settings.range_mm:g} mm", "ok" if seen else "wrong",
            "" if seen else f"{_where_to_look(settings)}; if it does, at the cable and "
            f"card.ai_displacement",
        )
    ]  # fmt: skip
    if controller.reading is not None and controller.metres_per_volt is not None:
        analog = volts * controller.metres_per_volt * 1e3
        off = abs(analog - controller.reading * 1e3)
        same = off <= _AGREEMENT * settings.range_mm
        findings.append(
            Finding(
                name, "analog output against serial port", f"{off:.3f} mm apart",
                f"{_AGREEMENT * settings.range_mm:g} mm or less", "ok" if same else "wrong",
                "" if same else "look whether the film hangs still, card.ai_displacement is wired "
                f"to the analog output of OUT{settings.output}, and the controller's analog "
                "scaling is what it shows",
            )
        )  # fmt: skip
    return tuple(findings)


def _where_to_look(settings: LaserSettings) -> str:
    return (
        f"look whether the laser is on, its spot falls on the target, and the target is "
        f"{settings.reference_distance_mm:g} mm away"
    )
