"""Recordings: written during a run, read back, brought in from elsewhere and handed on."""

from __future__ import annotations

from app.recording.exporters import EXPORTS, export_recording
from app.recording.follow import Follower
from app.recording.importers import import_file
from app.recording.reader import open_recording
from app.recording.recording import RecordedEvent, Recording
from app.recording.recover import recover
from app.recording.room import check_room, estimate_bytes, free_bytes
from app.recording.save import save_recording
from app.recording.summary import describe, describe_rows
from app.recording.verify import Verification, verify
from app.recording.writer import RecordingWriter

__all__ = [
    "EXPORTS",
    "Follower",
    "RecordedEvent",
    "Recording",
    "RecordingWriter",
    "Verification",
    "check_room",
    "describe",
    "describe_rows",
    "estimate_bytes",
    "export_recording",
    "free_bytes",
    "import_file",
    "open_recording",
    "recover",
    "save_recording",
    "verify",
]
