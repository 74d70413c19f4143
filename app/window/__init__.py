"""Operator's window."""

__all__ = ["NO_SCREEN"]

#: Platforms of Qt whose windows no one sees.
NO_SCREEN = ("offscreen", "minimal")
