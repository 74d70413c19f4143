"""Pages are made with pictures that are not drawn, unless a test is about the pictures."""

from tests.tools.sketches import pictures

__all__ = ["pictures"]
