"""The one error that this package raises for values it cannot use."""

from __future__ import annotations

__all__ = ["ModelError"]


class ModelError(ValueError):
    """A value that no film, load, excitation or record can have; the message says which and why."""
