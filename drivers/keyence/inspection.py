"""Inspection of the laser controller: its replies, its settings, and its view of the film."""

from __future__ import annotations

import time
from collections.abc import Callable

from dearig.drivers.instruments.findings import Finding
from dearig.drivers.instruments.laser import LaserInspection, where_to_look
from dearig.drivers.keyence.compare import settings_findings
from dearig.drivers.keyence.controller import Keyence, LaserError, NoReading, Port, open_port
from dearig.drivers.settings import LaserSettings

__all__ = ["inspect"]


def inspect(
    settings: LaserSettings,
    opener: Callable[[LaserSettings], Port] = open_port,
    clock: Callable[[], float] = time.monotonic,
) -> LaserInspection:
    """Inspect the controller at ``settings.port``; faults are findings.

    With an empty ``settings.port`` the controller is not queried, and one finding says so.
    """
    name = settings.model
    if not settings.port:
        silent = Finding(
            name, "serial port", "none in the rig file", verdict="not wired",
            advice="set laser.port to compare the controller's settings; until then "
            "laser.mm_per_V, sampling_us and averaging are not checked",
        )  # fmt: skip
        return LaserInspection((silent,))
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
            settings.model, item, reading.value, wanted, "wrong", where_to_look(settings)
        )
    millimetres = reading * 1e3
    if abs(millimetres) <= settings.range_mm:
        return Finding(settings.model, item, f"{millimetres:.5g} mm", wanted)
    return Finding(
        settings.model, item, f"{millimetres:.5g} mm", wanted, "wrong",
        "move the head so that the film's whole travel lies within its range",
    )  # fmt: skip
