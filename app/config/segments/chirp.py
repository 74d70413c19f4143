"""The segment ``chirp``."""

from __future__ import annotations

from pathlib import Path
from typing import Any, ClassVar, Literal

from pydantic import Field

from dearig.config.segments.base import KV, Positive, SegmentTable, Voltage, in_volts
from dearig.model.simulation import excitation
from dearig.model.simulation.excitation import Segment

__all__ = ["ChirpSegment"]


class ChirpSegment(SegmentTable):
    """A sine about an offset whose frequency sweeps from one value to another."""

    example: ClassVar[dict[str, Any]] = {
        "amplitude_kV": 2.0, "from_Hz": 0.5, "to_Hz": 5.0, "duration_s": 10.0,
    }  # fmt: skip

    kind: Literal["chirp"]
    amplitude_kV: Voltage = Field(description="largest excursion from the offset")
    from_Hz: Positive = Field(description="frequency at the start")
    to_Hz: Positive = Field(description="frequency at the end")
    duration_s: Positive = Field(description="duration")
    offset_kV: Voltage | None = Field(
        default=None,
        description="voltage in the middle; by default where the segment before ends",
    )
    taper_s: Positive = Field(default=0.25, description="duration of fading in, and of fading out")
    sweep: Literal["exponential", "linear"] = Field(
        default="exponential", description="how the frequency changes with time"
    )

    @property
    def highest_frequency(self) -> float:
        """The higher end of the sweep."""
        return max(self.from_Hz, self.to_Hz)

    def build(self, folder: Path) -> Segment:  # noqa: ARG002
        """Return the chirp."""
        return excitation.Chirp(
            self.amplitude_kV * KV,
            self.from_Hz,
            self.to_Hz,
            self.duration_s,
            in_volts(self.offset_kV),
            self.taper_s,
            self.sweep == "linear",
        )
