"""A look at the laser controller: is it there, set as the rig file says, does it see the film."""

from __future__ import annotations

import time
from collections.abc import Callable

from drivers.findings import Finding
from drivers.keyence.compare import settings_findings
from drivers.keyence.controller import Keyence, LaserError, NoReading, Port, open_port
from drivers.settings import LaserSettings

__all__ = ["inspect"]


def inspect(
    settings: LaserSettings,
    opener: Callable[[LaserSettings], Port] = open_port,
    clock: Callable[[], float] = time.monotonic,
) -> tuple[Finding, ...]:
    """Findings about the controller at ``settings.port``; faults are findings too.

    With an empty ``settings.port`` nothing is asked, and one finding says so.
    """
    name = settings.model
    if not settings.port:
        return (
            Finding(
                name, "serial port", "none in the rig file", verdict="not wired",
                advice="set laser.port to have the controller's settings compared; until then "
                "laser.mm_per_V, sampling_us and averaging are taken on trust",
            ),
        )  # fmt: skip
    findings: list[Finding] = []
    item = "serial port"
    try:
        with Keyence(opener(settings), settings, clock) as controller:
            program = controller.program()
            findings.append(
                Finding(
                    name, item,
                    f"answers on {settings.port} at {settings.baud_rate} Bd, program {program}",
                )
            )  # fmt: skip
            item = "settings"
            found = controller.controller_settings()
            findings.extend(settings_findings(settings, found))
            item = f"reading of OUT{settings.output}"
            findings.append(_reading(settings, item, controller.read()))
    except LaserError as error:
        findings.append(Finding(name, item, error.what, verdict="wrong", advice=error.advice))
    return tuple(findings)


def _reading(settings: LaserSettings, item: str, reading: float | NoReading) -> Finding:
    wanted = f"within +-{settings.range_mm:g} mm"
    if isinstance(reading, NoReading):
        return Finding(
            settings.model, item, reading.value, wanted, "wrong",
            f"move the head to {settings.reference_distance_mm:g} mm from its target, and look "
            f"whether the spot falls on it and the laser is on",
        )  # fmt: skip
    millimetres = reading * 1e3
    if abs(millimetres) <= settings.range_mm:
        return Finding(settings.model, item, f"{millimetres:.5g} mm", wanted)
    return Finding(
        settings.model, item, f"{millimetres:.5g} mm", wanted, "wrong",
        "move the head so that the film's whole travel lies within its range",
    )  # fmt: skip
