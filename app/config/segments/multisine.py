"""The segment ``multisine``."""

from __future__ import annotations

from pathlib import Path
from typing import Any, ClassVar, Literal

from pydantic import Field

from dearig.config.segments.base import KV, Positive, SegmentTable, Voltage, in_volts
from dearig.model.simulation import excitation
from dearig.model.simulation.excitation import Segment

__all__ = ["MultisineSegment"]


class MultisineSegment(SegmentTable):
    """Several simultaneous sines about an offset, with phases that keep the peak low."""

    example: ClassVar[dict[str, Any]] = {
        "amplitude_kV": 2.0, "frequencies_Hz": [0.5, 1.1, 2.3], "duration_s": 10.0,
    }  # fmt: skip

    kind: Literal["multisine"]
    amplitude_kV: Voltage = Field(description="largest excursion from the offset")
    frequencies_Hz: list[Positive] = Field(min_length=1, description="frequencies of the sines")
    duration_s: Positive = Field(description="duration")
    offset_kV: Voltage | None = Field(
        default=None,
        description="voltage in the middle; by default where the segment before ends",
    )
    taper_s: Positive = Field(default=0.25, description="duration of fading in, and of fading out")

    @property
    def highest_frequency(self) -> float:
        """The highest of the sines' frequencies."""
        return max(self.frequencies_Hz)

    def build(self, folder: Path) -> Segment:  # noqa: ARG002
        """Return the multisine."""
        return excitation.Multisine(
            self.amplitude_kV * KV,
            tuple(self.frequencies_Hz),
            self.duration_s,
            in_volts(self.offset_kV),
            self.taper_s,
        )
