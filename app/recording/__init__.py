"""Recordings: written during a run, read, imported and exported."""

from __future__ import annotations

from dearig.recording.content.metadata import RunMetadata
from dearig.recording.exporters import EXPORTS, export_recording
from dearig.recording.importers import import_file
from dearig.recording.reading.follow import Follower
from dearig.recording.reading.reader import open_recording
from dearig.recording.reading.recording import RecordedEvent, Recording
from dearig.recording.reading.summary import describe, describe_rows
from dearig.recording.recover import recover
from dearig.recording.verify import Verification, verify
from dearig.recording.writing.disk_space import check_room, estimate_bytes, free_bytes
from dearig.recording.writing.save import save_recording
from dearig.recording.writing.writer import RecordingWriter

__all__ = [
    "EXPORTS",
    "Follower",
    "RecordedEvent",
    "Recording",
    "RecordingWriter",
    "RunMetadata",
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
