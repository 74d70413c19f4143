"""Findings of an inspection: the state of an instrument compared with the rig file."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from dearig.drivers.zero_reading import ZeroReading

__all__ = ["Finding", "Verdict"]

Verdict = Literal["ok", "warning", "wrong", "not wired"]


@dataclass(frozen=True)
class Finding:
    """Finding on an ``item`` of an ``instrument``: ``found``, ``wanted``, and what to do.

    ``wrong`` prevents a run, ``warning`` does not. ``not wired`` marks an item that the rig file
    does not have and that was not inspected. ``reading`` is that of the voltage monitor with 0 V
    commanded, where the finding is about it.
    """

    instrument: str
    item: str
    found: str
    wanted: str = ""
    verdict: Verdict = "ok"
    advice: str = ""
    reading: ZeroReading | None = None

    @property
    def sentence(self) -> str:
        """Return the finding in one line."""
        wanted = f", expected {self.wanted}" if self.wanted and self.verdict != "ok" else ""
        advice = f"; {self.advice}" if self.advice else ""
        return f"{self.instrument}, {self.item}: {self.found}{wanted}{advice}"
