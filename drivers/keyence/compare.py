"""Comparison of the laser controller's settings with those of the rig file."""

from __future__ import annotations

import math
from dataclasses import dataclass

from dearig.drivers.instruments.findings import Finding, Verdict
from dearig.drivers.settings import LaserSettings

__all__ = ["ControllerSettings", "compare", "settings_findings"]

_RATIO_TOLERANCE = 1e-4  # of a scale; the controller keeps six digits
_ZERO_TOLERANCE = 1e-3  # of the range


@dataclass(frozen=True)
class ControllerSettings:
    """Settings of a controller for one OUT, in SI units.

    ``sampling`` is in s; ``averaging`` is None where the filter is not an average. The points are
    two pairs: measured and displayed m for ``measurement_points``, m and V for ``analog_points``.
    """

    program: int
    sampling: float
    filter: str
    averaging: int | None
    calculation: str
    measurement_points: tuple[tuple[float, float], tuple[float, float]]
    analog_points: tuple[tuple[float, float], tuple[float, float]]

    @property
    def metres_per_volt(self) -> float:
        """Return the scale of the analog output, negative where it falls with the reading."""
        (x1, v1), (x2, v2) = self.analog_points
        return (x2 - x1) / (v2 - v1)

    @property
    def metres_at_0_volts(self) -> float:
        """Return the reading for which the analog output is 0 V."""
        x, volts = self.analog_points[0]
        return x - volts * self.metres_per_volt

    @property
    def measurement_gain(self) -> float:
        """Return displayed over measured displacement."""
        (x1, y1), (x2, y2) = self.measurement_points
        return (y2 - y1) / (x2 - x1)


def compare(settings: LaserSettings, found: ControllerSettings) -> list[str]:
    """Return one sentence for each setting that falsifies a recording made with ``settings``.

    Returns none where ``settings.port`` is empty, since no controller was queried.
    """
    if not settings.port:
        return []
    return [f.sentence for f in settings_findings(settings, found) if f.verdict == "wrong"]


def settings_findings(settings: LaserSettings, found: ControllerSettings) -> tuple[Finding, ...]:
    """Return a finding for every controller setting that the rig file has too."""
    name = settings.model

    def finding(
        item: str, got: str, wanted: str, same: bool, advice: str, otherwise: Verdict = "wrong"
    ) -> Finding:
        verdict: Verdict = "ok" if same else otherwise
        return Finding(name, item, got, wanted, verdict, "" if same else advice)

    def either(key: str) -> str:
        return f"set the controller so, or {key} in the rig file"

    # its sign depends on how the head is mounted, which laser.direction says
    scale = abs(found.metres_per_volt) * 1e3
    averages = "no average" if found.averaging is None else f"{found.averaging} samples"
    return (
        finding(
            "sampling", f"{found.sampling * 1e6:g} us", f"{settings.sampling_us:g} us",
            math.isclose(found.sampling * 1e6, settings.sampling_us, rel_tol=1e-6),
            either("laser.sampling_us"),
        ),
        finding(
            "averaging", averages, f"{settings.averaging} samples",
            found.averaging == settings.averaging, either("laser.averaging"),
        ),
        finding(
            "filter", found.filter, "moving average", found.filter == "moving average",
            "set the filter to averaging in the controller: the delay of readings is reckoned "
            "from it",
        ),
        finding(
            "analog scaling", f"{scale:.6g} mm/V", f"{settings.mm_per_V:g} mm/V",
            math.isclose(scale, settings.mm_per_V, rel_tol=_RATIO_TOLERANCE),
            f"{either('laser.mm_per_V')}: every displacement would be wrong by this ratio",
        ),
        finding(
            "analog output at 0 V", f"reads {found.metres_at_0_volts * 1e3 + 0.0:.5g} mm", "0 mm",
            abs(found.metres_at_0_volts) * 1e3 <= _ZERO_TOLERANCE * settings.range_mm,
            "set the analog scaling in the controller so that 0 mm is 0 V: otherwise one end of "
            "the range is cut off",
        ),
        finding(
            "calculation", found.calculation, "normal", found.calculation == "normal",
            "set the calculation mode to normal in the controller: a hold is not the displacement",
        ),
        finding(
            "measurement scaling", f"{found.measurement_gain:.6g}", "1",
            math.isclose(found.measurement_gain, 1.0, rel_tol=_RATIO_TOLERANCE),
            "make sure that this correction in the controller is meant", "warning",
        ),
    )  # fmt: skip
