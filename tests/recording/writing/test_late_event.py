"""Events that are added to a finished recording."""

from __future__ import annotations

from pathlib import Path

import pytest

from dearig.acquisition.run import record
from dearig.config.rigfile import RigFile
from dearig.config.sequencefile import parse_sequence
from dearig.errors import InputError
from dearig.recording import open_recording
from dearig.recording.lock import lock_existing
from dearig.recording.verify import verify
from dearig.recording.writing.late_event import add_event
from tests.tools.command import LOBE


@pytest.fixture
def path(tmp_path: Path) -> Path:
    loaded = parse_sequence(LOBE, "lobe", tmp_path)
    return record(loaded, "sim", RigFile(), tmp_path / "run.h5").path


def test_an_event_is_added_at_the_last_sample(path: Path) -> None:
    before = open_recording(path)
    add_event(path, "info", "Ada acknowledged: a µ-arc")
    add_event(path, "info", "and once more")
    after = open_recording(path)
    assert [e.message for e in after.events[len(before.events) :]] == [
        "Ada acknowledged: a µ-arc", "and once more",
    ]  # fmt: skip
    assert after.events[-1].sample == before.samples - 1
    assert verify(path).sound
    assert [name.name for name in path.parent.iterdir()] == ["run.h5"]


def test_a_recording_in_use_is_left_alone(path: Path) -> None:
    content = path.read_bytes()
    with lock_existing(path), pytest.raises(InputError, match="in use"):
        add_event(path, "info", "never")
    assert path.read_bytes() == content


def test_what_is_no_recording_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError):
        add_event(tmp_path / "missing.h5", "info", "never")
    (tmp_path / "other.h5").write_bytes(b"no recording")
    with pytest.raises(InputError):
        add_event(tmp_path / "other.h5", "info", "never")
