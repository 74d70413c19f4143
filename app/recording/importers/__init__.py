"""Importers of measured data: one small module for each format, one for what they share."""

from __future__ import annotations

from dearig.recording.importers.importing import import_file

__all__ = ["import_file"]
