"""Custom scales by name."""

from __future__ import annotations

from collections.abc import Sequence

from dearig.sim_backend.daqmx.card.errors import Code, DaqmxError
from dearig.sim_backend.daqmx.card.scales import Scale
from dearig.sim_backend.daqmx.card.state import CardState

__all__ = ["CustomScales"]


class CustomScales:
    """Custom scales that programs have made."""

    def __init__(self, state: CardState) -> None:
        self._state = state
        self._scales: dict[str, Scale] = {}  # by name in lower case

    def add(self, scale: Scale) -> None:
        """Add ``scale``, or replace the one of the same name."""
        scale.check()
        with self._state.lock:
            self._scales[scale.name.lower()] = scale

    def remove(self, name: str) -> None:
        """Forget the custom scale called ``name``."""
        with self._state.lock:
            del self._scales[self.find(name).name.lower()]

    def find(self, name: str) -> Scale:
        """Return the custom scale called ``name``."""
        with self._state.lock:
            if name.lower() not in self._scales:
                raise DaqmxError(Code.UNKNOWN_SCALE, f"Custom Scale Name: {name}")
            return self._scales[name.lower()]

    def saved(self) -> Sequence[str]:
        """Return the names of the saved ones."""
        with self._state.lock:
            return [scale.name for scale in self._scales.values() if scale.saved]
