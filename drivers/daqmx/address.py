"""Addresses of cards: ``daqmx:Dev1``, ``daqmx:Dev1@host:port``."""

from __future__ import annotations

import re
from dataclasses import dataclass

from dearig.drivers.errors import AddressError

__all__ = ["Address"]


@dataclass(frozen=True)
class Address:
    """Address: ``device`` is the name in NI MAX, ``server`` is ``host:port`` or None (local)."""

    device: str
    server: str | None = None

    @staticmethod
    def parse(text: str) -> Address:
        """Return the address in ``text``; raises ``AddressError`` where it names no card."""
        found = re.fullmatch(
            r"daqmx:([A-Za-z][\w-]*)(?:@([\w.-]+|\[[\da-fA-F:.]+\]):(\d{1,5}))?", text
        )
        if not found or not (found[3] is None or 0 < int(found[3]) < 65536):
            raise AddressError(
                f"rig {text!r} is not the address of a card: write daqmx:Dev1 for a card in this "
                f"computer, or daqmx:Dev1@HOST:PORT for one behind a server"
            )
        return Address(found[1], None if found[2] is None else f"{found[2]}:{found[3]}")

    def __str__(self) -> str:
        """Return the address as on the command line."""
        return f"daqmx:{self.device}" + (f"@{self.server}" if self.server else "")
