"""A run holds a lock on its file; everything that changes a file takes it first."""

from __future__ import annotations

import errno
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from dearig.drivers.rig import Block
from dearig.errors import DiskFault, InputError
from dearig.recording import RunMetadata, export_recording, open_recording, recover, save_recording
from dearig.recording.files import check_output
from dearig.recording.json_file import write_json
from dearig.recording.lock import create_locked, lock_existing
from dearig.recording.verify import verify
from dearig.recording.writing.finish import finish
from tests.tools.command import names
from tests.tools.recordings import Clock, run_counts, write_run, writer

posix = pytest.mark.skipif(sys.platform == "win32", reason="the system's locks are replaced here")
LONG_AGO = 1_000_000_000.0


def imported(path: Path) -> None:
    time = np.arange(10.0)
    values = {"time": time, "displacement": 0.0 * time, "voltage_command": time}
    save_recording(path, "actuator", values, RunMetadata(title="other"), overwrite=True)


#: Everything that could change a recording in place or put another file in its place.
CHANGES: dict[str, Callable[[Path, Path], object]] = {
    "recover": lambda path, _: recover(path),
    "record --force": lambda path, _: writer(path, overwrite=True),
    "import --force": lambda path, _: imported(path),
    "export --force": lambda path, other: export_recording(other, "csv", path, overwrite=True),
    "--json": lambda path, _: write_json({}, path),
    "any output": lambda path, _: check_output(path, overwrite=True),
}


def test_nothing_changes_the_file_of_a_live_run(tmp_path: Path) -> None:
    path, other = tmp_path / "run.h5", tmp_path / "other.h5"
    write_run(other)
    clock = Clock()
    recorder = writer(path, now=clock)
    clock.moment += 1.0
    recorder.append(Block(0, run_counts(2000)))
    before = names(tmp_path)
    # the time of the last change says nothing: a run can be stopped, a clock can be set
    os.utime(path, (LONG_AGO, LONG_AGO))
    for change, do in CHANGES.items():
        with pytest.raises(InputError, match=r"run\.h5 is in use: a run records to it"):
            do(path, other)
        assert names(tmp_path) == before, change
    recorder.append(Block(2000, run_counts(3000)[:, 2000:]))
    recorder.close()
    assert verify(path).sound
    assert open_recording(path).samples == 3000
    # the run has ended
    assert not recover(path)
    check_output(path, overwrite=True)


def test_a_viewer_opens_the_file_of_a_live_run(tmp_path: Path) -> None:
    path = tmp_path / "run.h5"
    clock = Clock()
    look = "import h5py, sys; print(h5py.File(sys.argv[1], 'r', swmr=True)['entry/title'][()])"
    with writer(path, now=clock) as recorder:
        clock.moment += 1.0
        recorder.append(Block(0, run_counts(3000)))
        assert open_recording(path).samples == 3000
        command = [sys.executable, "-c", look, str(path)]
        seen = subprocess.run(command, capture_output=True, text=True, check=False)
    assert "two lobes" in seen.stdout, seen.stderr


def test_a_recording_that_is_recovered_is_in_use(tmp_path: Path) -> None:
    path = killed_run(tmp_path)
    with lock_existing(path), pytest.raises(InputError, match="is in use"):
        recover(path)
    assert recover(path)
    assert verify(path).sound


def killed_run(folder: Path) -> Path:
    """A copy of a run's file, made before it was closed."""
    clock = Clock()
    with writer(folder / "live.h5", now=clock) as recorder:
        clock.moment += 1.0
        recorder.append(Block(0, run_counts(3000)))
        shutil.copyfile(recorder.path, folder / "killed.h5")
    return folder / "killed.h5"


def test_a_file_that_replaced_the_run_is_not_written_to(tmp_path: Path) -> None:
    path, other = tmp_path / "run.h5", tmp_path / "other.h5"
    write_run(other)
    content = other.read_bytes()
    recorder = writer(path)
    recorder.append(Block(0, run_counts(3000)))
    other.replace(path)
    with pytest.raises(DiskFault, match="another file has taken the place of"):
        recorder.close()
    assert path.read_bytes() == content
    assert names(tmp_path) == {"run.h5", "run-saved.h5"}
    assert verify(tmp_path / "run-saved.h5").sound


def test_a_run_without_samples_removes_only_its_own_file(tmp_path: Path) -> None:
    path, other = tmp_path / "run.h5", tmp_path / "other.h5"
    write_run(other)
    recorder = writer(path)
    other.replace(path)
    recorder.discard()
    assert open_recording(path).samples == 3000


def test_another_recording_in_the_file_is_not_finished(tmp_path: Path) -> None:
    path = killed_run(tmp_path)
    before = path.read_bytes()
    with lock_existing(path) as lock, pytest.raises(InputError, match="has another content by now"):
        finish(path, lock=lock, complete=True, outcome="finished", ended=None, identifier="0")
    assert path.read_bytes() == before


def test_the_old_recording_is_not_put_back_over_another(tmp_path: Path) -> None:
    path, other = tmp_path / "run.h5", tmp_path / "other.h5"
    write_run(path)
    imported(other)
    recorder = writer(path, overwrite=True)
    other.replace(path)
    recorder.discard()
    assert open_recording(path).title == "other"
    assert open_recording(path.with_name("run.h5.old")).samples == 3000


def without_locks(monkeypatch: pytest.MonkeyPatch) -> None:
    """Make every lock fail as in a network folder without a lock server."""

    def refuse(*_: object) -> None:
        raise OSError(errno.ENOLCK, os.strerror(errno.ENOLCK))

    monkeypatch.setattr("fcntl.flock", refuse)
    monkeypatch.setattr("fcntl.fcntl", refuse)


@posix
@pytest.mark.parametrize("which", ["fcntl.flock", "fcntl.fcntl"])
def test_a_folder_without_locks_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, which: str
) -> None:
    path = tmp_path / "run.h5"

    def refuse(*_: object) -> None:
        raise OSError(errno.ENOLCK, os.strerror(errno.ENOLCK))

    monkeypatch.setattr(which, refuse)
    with pytest.raises(InputError, match=r"no file locks.* a local disk, or set HDF5_USE_FILE_LOC"):
        writer(path)
    assert names(tmp_path) == set()


@posix
def test_a_run_without_locks_where_the_operator_switched_them_off(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "run.h5"
    monkeypatch.setenv("HDF5_USE_FILE_LOCKING", "FALSE")
    without_locks(monkeypatch)
    write_run(path)
    assert verify(path).sound
    changed = path.stat().st_mtime
    with pytest.raises(InputError, match=r"changed 9\.0 s ago .* its folder has no file locks"):
        lock_existing(path, now=lambda: changed + 9.0)
    lock_existing(path, now=lambda: changed + 11.0).release()
    killed = killed_run(tmp_path)
    changed = killed.stat().st_mtime
    with pytest.raises(InputError, match=r"changed 1\.0 s ago and may still be recorded to"):
        recover(killed, now=lambda: changed + 1.0)
    assert recover(killed, now=lambda: changed + 11.0)


def test_values_of_two_recordings_are_not_mixed(tmp_path: Path) -> None:
    """A recording that was replaced after it had been opened has no other one's values."""
    path, other = killed_run(tmp_path), tmp_path / "other.h5"
    opened = open_recording(path)
    write_run(other, run_counts(3000, seed=1))
    other.replace(path)
    with pytest.raises(InputError, match="has been replaced by another recording since"):
        _ = opened.displacement
    with pytest.raises(InputError, match="has been replaced"):
        opened.overview("displacement", 10)


def test_a_file_that_a_run_creates_is_not_judged(tmp_path: Path) -> None:
    path = tmp_path / "run.h5"
    with create_locked(path), pytest.raises(InputError, match="is in use"):
        verify(path)
    assert not verify(path).sound


@posix
@pytest.mark.parametrize("which", ["fcntl.flock", "fcntl.fcntl"])
def test_a_lock_that_fails_is_a_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, which: str
) -> None:
    path, other = killed_run(tmp_path), tmp_path / "other.h5"
    before = path.read_bytes()

    def fail(*_: object) -> None:
        raise OSError(errno.EIO, os.strerror(errno.EIO))

    with monkeypatch.context() as patch:
        patch.setattr(which, fail)
        with pytest.raises(InputError, match="Input/output error"):
            writer(other)
        assert not other.exists()
        if which == "fcntl.fcntl":
            for change in ("recover", "record --force", "import --force"):
                with pytest.raises(InputError, match="Input/output error"):
                    CHANGES[change](path, other)
        assert open_recording(path).samples == 3000
        assert verify(path).sound
    assert path.read_bytes() == before
    assert names(tmp_path) == {"live.h5", "killed.h5"}
