"""Names of strain energies for a person."""

from __future__ import annotations

__all__ = ["spring_name"]

_NAMES = {
    "gent": "Gent",
    "neo-hookean": "neo-Hookean",
    "arruda-boyce": "Arruda-Boyce",
    "yeoh": "Yeoh",
    "mooney-rivlin": "Mooney-Rivlin",
    "ogden": "Ogden",
    "ogden-two-terms": "Ogden (two terms)",
}


def spring_name(kind: str) -> str:
    """Return the name of a strain energy, as papers write it."""
    return _NAMES.get(kind, kind.replace("-", " "))
