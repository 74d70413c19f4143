"""Reports of the commands have pictures that are not drawn; those of a module's fixtures are."""

from tests.tools.sketches import pictures

__all__ = ["pictures"]
