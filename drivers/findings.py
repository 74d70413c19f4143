"""Findings of an inspection: what an instrument has, against what the rig file wants."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

__all__ = ["Finding", "Verdict"]

Verdict = Literal["ok", "warning", "wrong", "not wired"]


@dataclass(frozen=True)
class Finding:
    """One ``item`` of one ``instrument``: what was ``found`` and ``wanted``, and what to do.

    ``wrong`` keeps a run from starting, ``warning`` does not. ``not wired`` is what the rig file
    does not have, so that it was not inspected.
    """

    instrument: str
    item: str
    found: str
    wanted: str = ""
    verdict: Verdict = "ok"
    advice: str = ""

    @property
    def sentence(self) -> str:
        """The finding in one line."""
        wanted = f", {self.wanted} is wanted" if self.wanted and self.verdict != "ok" else ""
        advice = f"; {self.advice}" if self.advice else ""
        return f"{self.instrument}, {self.item}: {self.found}{wanted}{advice}"
