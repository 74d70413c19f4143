"""Importers of measured data: one file for each format, one line here.

Another distribution adds a format through an entry point in the group ``dearig.importers``.
``README.md`` next to this file shows how.
"""

from __future__ import annotations

from dearig.recording.importers.importer import Importer
from dearig.recording.importers.importing import Imported, ImportOptions, import_file
from dearig.recording.importers.registry import IMPORTERS

__all__ = ["IMPORTERS", "ImportOptions", "Imported", "Importer", "import_file"]
