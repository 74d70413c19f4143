"""What every kind of segment has in common: the base class of its keys in a sequence file."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, ClassVar

from pydantic import Field

from dearig.config.toml_input import TomlTable
from dearig.model.simulation.excitation import Segment

__all__ = ["KV", "SEGMENTS_MAX", "Positive", "SegmentTable", "Voltage", "in_volts"]

#: V in a kilovolt.
KV = 1e3
#: Segments with their repeats, at most; the periods of thesis segments do not count.
SEGMENTS_MAX = 10_000

#: A voltage in kV. The rig file sets the limits; this bound only catches a value given in V.
Voltage = Annotated[float, Field(ge=-1e3, le=1e3)]
#: A time in s, a frequency in Hz or a count above 0.
Positive = Annotated[float, Field(gt=0.0)]


class SegmentTable(TomlTable, ABC):
    """Keys of one ``[[segment]]``; a subclass is a kind.

    A subclass gives ``kind`` the type ``Literal["name"]``, adds its keys as fields (unit at the end
    of the name, a ``description``, bounds), and builds the segment. The first line of its docstring
    explains the kind wherever kinds are listed.

    Attributes
    ----------
    example : mapping
        Keys of a new segment, ``kind`` left out; it can be played as it stands.
    """

    example: ClassVar[Mapping[str, Any]]

    kind: str = Field(description="kind of segment")
    repeats: int = Field(
        default=1, ge=1, le=SEGMENTS_MAX, description="how often the segment is played"
    )

    @abstractmethod
    def build(self, folder: Path) -> Segment:
        """Return the segment; files that it names lie in ``folder``.

        Raises ``InputError`` or ``ModelError`` with a sentence.
        """

    @property
    def highest_frequency(self) -> float:
        """Highest frequency in Hz, for the check against the sample rate; 0 if it has none."""
        return 0.0

    @property
    def files(self) -> tuple[str, ...]:
        """Names of the files that the segment reads, relative to the sequence's folder."""
        return ()


def in_volts(value_kV: float | None) -> float | None:
    """Return a voltage given in kV in V; None stays None."""
    return None if value_kV is None else value_kV * KV
