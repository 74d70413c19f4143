"""Segments made of straight lines: ramp, hold and steps."""

from __future__ import annotations

from pathlib import Path
from typing import Any, ClassVar, Literal

from pydantic import Field

from dearig.config.segments.base import KV, Positive, SegmentTable, Voltage, in_volts
from dearig.model.simulation import excitation
from dearig.model.simulation.excitation import Segment

__all__ = ["HoldSegment", "RampSegment", "StepsSegment"]


class RampSegment(SegmentTable):
    """A straight line from one voltage to another."""

    example: ClassVar[dict[str, Any]] = {"to_kV": 0.0, "duration_s": 1.0}

    kind: Literal["ramp"]
    to_kV: Voltage = Field(description="voltage at the end")
    duration_s: Positive = Field(description="duration")
    from_kV: Voltage | None = Field(
        default=None, description="voltage at the start; by default where the segment before ends"
    )

    def build(self, folder: Path) -> Segment:  # noqa: ARG002
        """Return the ramp."""
        return excitation.Ramp(self.to_kV * KV, self.duration_s, in_volts(self.from_kV))


class HoldSegment(SegmentTable):
    """One voltage for some time."""

    example: ClassVar[dict[str, Any]] = {"duration_s": 1.0}

    kind: Literal["hold"]
    duration_s: Positive = Field(description="duration")
    voltage_kV: Voltage | None = Field(
        default=None, description="voltage; by default where the segment before ends"
    )

    def build(self, folder: Path) -> Segment:  # noqa: ARG002
        """Return the hold."""
        return excitation.Hold(self.duration_s, in_volts(self.voltage_kV))


class StepsSegment(SegmentTable):
    """A staircase: each level is reached by a short ramp and held."""

    example: ClassVar[dict[str, Any]] = {
        "levels_kV": [3.0, 6.0, 0.0], "dwell_s": 1.0, "rise_s": 0.02,
    }  # fmt: skip

    kind: Literal["steps"]
    levels_kV: list[Voltage] = Field(min_length=1, description="voltages, one after another")
    dwell_s: Positive = Field(description="time at each level, the ramp to it included")
    rise_s: Positive = Field(default=0.01, description="duration of the ramp to each level")

    def build(self, folder: Path) -> Segment:  # noqa: ARG002
        """Return the staircase."""
        return excitation.Steps(tuple(v * KV for v in self.levels_kV), self.dwell_s, self.rise_s)
