"""Recordings: written during a run, read back, brought in from elsewhere and handed on."""

from __future__ import annotations

from app.recording.exporters import EXPORTS, export_recording
from app.recording.importers import import_file
from app.recording.reader import open_recording
from app.recording.recording import RecordedEvent, Recording
from app.recording.recover import recover
from app.recording.save import save_recording
from app.recording.summary import describe, describe_rows
from app.recording.writer import RecordingWriter

__all__ = [
    "EXPORTS",
    "RecordedEvent",
    "Recording",
    "RecordingWriter",
    "describe",
    "describe_rows",
    "export_recording",
    "import_file",
    "open_recording",
    "recover",
    "save_recording",
]
