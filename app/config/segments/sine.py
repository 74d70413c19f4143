"""The segment ``sine``."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, ClassVar, Literal

from pydantic import Field

from dearig.config.segments.base import KV, Positive, SegmentTable, Voltage
from dearig.model.simulation import excitation
from dearig.model.simulation.excitation import Segment

__all__ = ["SineSegment"]


class SineSegment(SegmentTable):
    """A sine about an offset."""

    # from its least value, 0 kV: it joins a segment that ends at 0 kV and never becomes negative
    example: ClassVar[dict[str, Any]] = {
        "amplitude_kV": 2.0, "frequency_Hz": 0.5, "cycles": 2.0, "offset_kV": 2.0,
        "phase_deg": -90.0,
    }  # fmt: skip

    kind: Literal["sine"]
    amplitude_kV: Voltage = Field(description="largest excursion from the offset")
    frequency_Hz: Positive = Field(description="frequency of the sine")
    cycles: Positive = Field(default=1.0, description="number of periods")
    offset_kV: Voltage = Field(default=0.0, description="voltage in the middle")
    phase_deg: float = Field(default=0.0, ge=-360.0, le=360.0, description="phase at the start")

    @property
    def highest_frequency(self) -> float:
        """The frequency."""
        return self.frequency_Hz

    def build(self, folder: Path) -> Segment:  # noqa: ARG002
        """Return the sine."""
        return excitation.Sine(
            self.amplitude_kV * KV,
            self.frequency_Hz,
            self.cycles,
            self.offset_kV * KV,
            math.radians(self.phase_deg),
        )
