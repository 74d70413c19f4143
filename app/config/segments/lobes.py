"""Segments that start and end at 0 V: lobes, the thesis's excitation, triangles."""

from __future__ import annotations

from pathlib import Path
from typing import Any, ClassVar, Literal, Self

from pydantic import Field, model_validator

from dearig.config.segments.base import KV, Positive, SegmentTable, Voltage
from dearig.model.simulation import excitation
from dearig.model.simulation.excitation import THESIS_AMPLITUDES, THESIS_FREQUENCIES, Segment

__all__ = ["HalfSineSegment", "Thesis", "TriangleSegment"]


class HalfSineSegment(SegmentTable):
    """One unipolar lobe: the positive half of a sine."""

    example: ClassVar[dict[str, Any]] = {"amplitude_kV": 6.0, "frequency_Hz": 0.5}

    kind: Literal["half_sine"]
    amplitude_kV: Voltage = Field(description="voltage at the top of the lobe")
    frequency_Hz: Positive = Field(description="the lobe lasts 1/f")

    @property
    def highest_frequency(self) -> float:
        """The frequency: a lobe of f Hz lasts 1/f and takes at least two samples."""
        return self.frequency_Hz

    def build(self, folder: Path) -> Segment:  # noqa: ARG002
        """Return the lobe."""
        return excitation.HalfSine(self.amplitude_kV * KV, self.frequency_Hz)


class TriangleSegment(SegmentTable):
    """From 0 kV to the amplitude and back, both ways at one slope."""

    example: ClassVar[dict[str, Any]] = {"amplitude_kV": 6.0, "frequency_Hz": 0.5}

    kind: Literal["triangle"]
    amplitude_kV: Voltage = Field(description="voltage at the top")
    frequency_Hz: Positive = Field(description="the triangle lasts 1/f")

    def build(self, folder: Path) -> Segment:  # noqa: ARG002
        """Return the triangle."""
        return excitation.Triangle(self.amplitude_kV * KV, self.frequency_Hz)


class Thesis(SegmentTable):
    """The thesis's excitation (eq. 49): lobes of several amplitudes and frequencies in turn."""

    example: ClassVar[dict[str, Any]] = {"periods": 1}

    kind: Literal["thesis"]
    amplitudes_kV: list[Voltage] = Field(
        default=[a / KV for a in THESIS_AMPLITUDES],
        min_length=1,
        description="voltages at the tops of the lobes",
    )
    frequencies_Hz: list[Positive] = Field(
        default=list(THESIS_FREQUENCIES),
        min_length=1,
        description="one for each lobe, which lasts 1/f",
    )
    periods: int = Field(
        default=2, ge=1, le=1_000_000, description="how often all lobes are played in turn"
    )

    @model_validator(mode="after")
    def _pairs(self) -> Self:
        if len(self.amplitudes_kV) != len(self.frequencies_Hz):
            raise ValueError(
                f"{len(self.amplitudes_kV)} amplitudes_kV and {len(self.frequencies_Hz)} "
                f"frequencies_Hz: each lobe takes one of both"
            )
        return self

    @property
    def highest_frequency(self) -> float:
        """The highest of the lobes' frequencies."""
        return max(self.frequencies_Hz)

    def build(self, folder: Path) -> Segment:  # noqa: ARG002
        """Return all lobes as one segment."""
        amplitudes = tuple(a * KV for a in self.amplitudes_kV)
        return excitation.Lobes(amplitudes, tuple(self.frequencies_Hz), self.periods)
