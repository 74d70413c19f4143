"""A disk that is full, gone, or may not be written: told before or in the run, nothing lost."""

from __future__ import annotations

import io
import os
import shutil
from collections import namedtuple
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
import pytest

from dearig.drivers.channels import Scaling
from dearig.drivers.rig import Block
from dearig.errors import DiskFault, InputError
from dearig.recording import open_recording, recover
from dearig.recording.content.journal import (
    Patched,
    _apply,
    carry_out,
    changed_in_place,
    journal_of,
    whole_journal,
)
from dearig.recording.lock import FileLock, lock_existing
from dearig.recording.verify import verify
from dearig.recording.writing.disk_space import (
    LEFT_FREE,
    advice,
    check_room,
    estimate_bytes,
    free_bytes,
)
from tests.deep import mostly_deep
from tests.tools.recordings import (
    CHANNELS,
    IDENTITY,
    RATE,
    Clock,
    run_counts,
    write_run,
    writer,
)

Usage = namedtuple("Usage", "total used free")


def room(monkeypatch: pytest.MonkeyPatch, free: float) -> None:
    monkeypatch.setattr(shutil, "disk_usage", lambda _: Usage(10**12, 0, int(free)))


@pytest.mark.parametrize("samples", [20_000, 500_000])
def test_the_estimate_is_near_the_file_of_a_very_long_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, samples: int
) -> None:
    for module in ("finish", "disk_space"):
        monkeypatch.setattr(f"dearig.recording.writing.{module}.PHYSICAL_MAX", 1000)
    path = tmp_path / "run.h5"
    write_run(path, run_counts(samples), block=10_000)
    size = path.stat().st_size
    assert size <= estimate_bytes(len(CHANNELS), RATE, samples) <= 1.2 * size + 600_000


#: A card's own scaling, whose values have no zeros at their ends.
BENT = Scaling((-4.62141825e-04, 3.05202888e-04, -2.47733456e-13, 5.43883236e-18), 4e-3)


@pytest.mark.parametrize(
    ("samples", "rate"), [(3000, RATE), (3000, 12345.678), (300_000, 12345.678)]
)
def test_the_end_of_a_run_of_noise_needs_no_more_than_the_estimate(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, samples: int, rate: float
) -> None:
    path = tmp_path / "run.h5"
    channels = tuple(replace(channel, scaling=BENT) for channel in CHANNELS)
    identity = replace(IDENTITY, channels=channels)
    noise = np.random.default_rng(0).integers(-(2**15), 2**15, (4, samples)).astype(np.int16)
    used: list[int] = []

    def apply(file: io.FileIO, end: int, pages: dict[int, bytes]) -> None:
        used.append(sum(each.stat().st_size for each in tmp_path.iterdir()))
        _apply(file, end, pages)

    monkeypatch.setattr("dearig.recording.content.journal._apply", apply)
    with writer(path, identity=identity, rate_Hz=rate, samples_expected=samples) as recorder:
        recorder.append(Block(0, noise))
    estimate = estimate_bytes(len(CHANNELS), rate, samples)
    assert max(used) <= estimate <= 1.2 * max(used) + 600_000
    assert path.stat().st_size <= estimate


def test_a_run_that_does_not_fit_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "run.h5"
    needed = estimate_bytes(3, 1e5, 10**8)
    room(monkeypatch, needed + LEFT_FREE)
    check_room(path, 3, 1e5, 10**8)
    room(monkeypatch, needed + LEFT_FREE - 1)
    with pytest.raises(InputError, match=r"needs 620 MB and the disk of .*run\.h5 has 688 MB free"):
        check_room(path, 3, 1e5, 10**8)


def test_room_on_a_disk_that_is_gone(tmp_path: Path) -> None:
    assert free_bytes(tmp_path / "run.h5") > 0
    with pytest.raises(InputError, match=r"the disk of .* does not answer: No such file"):
        free_bytes(tmp_path / "gone" / "run.h5")


def test_a_disk_that_fills_up_ends_the_run_with_all_that_came(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, counts, clock = tmp_path / "run.h5", run_counts(4000), Clock()
    recorder = writer(path, now=clock)
    for i in range(3):
        clock.moment += 1.0
        recorder.append(Block(1000 * i, counts[:, 1000 * i : 1000 * i + 1000]))
    room(monkeypatch, 1e6)
    clock.moment += 1.0
    with pytest.raises(
        DiskFault, match=r"No space left .* free some space.* the 3000 samples until"
    ):
        recorder.append(Block(3000, counts[:, 3000:]))
    with pytest.raises(DiskFault, match="the 3000 samples until then are in the file"):
        recorder.close("ended early")
    assert recorder.closed
    run = open_recording(path)
    assert (run.samples, run.complete) == (3000, False)
    assert recover(path)
    assert verify(path).sound
    expected = CHANNELS[0].scaling.physical(counts[0, :3000])
    np.testing.assert_array_equal(open_recording(path).voltage_command, expected)


@pytest.mark.parametrize("after", [0, 1, 3])
def test_a_disk_that_refuses_every_write(tmp_path: Path, after: int) -> None:
    path, counts, clock = tmp_path / "run.h5", run_counts(4000), Clock()
    recorder = writer(path, now=clock)
    for i in range(after):
        clock.moment += 1.0
        recorder.append(Block(1000 * i, counts[:, 1000 * i : 1000 * i + 1000]))
    with path.open("rb") as unwritable:
        os.dup2(unwritable.fileno(), recorder._file.id.get_vfd_handle())
    clock.moment += 1.0
    with pytest.raises(DiskFault, match="cannot be written"):
        recorder.append(Block(1000 * after, counts[:, 1000 * after : 1000 * after + 1000]))
    assert recorder.samples == 1000 * after
    with pytest.raises(DiskFault):
        recorder.close()
    recorder.close()
    if after:
        assert open_recording(path).samples == 1000 * after
        recover(path)
        assert verify(path).sound


@pytest.mark.parametrize(
    ("before", "size"),
    mostly_deep(
        [pytest.param(*pair) for pair in product([1, 5, 13], [100, 300, 700, 1300])],
        [(13, 100), (1, 1300)],
    ),
)
def test_no_sample_is_made_up_where_the_disk_refuses_a_flush(
    tmp_path: Path, before: int, size: int
) -> None:
    resource = pytest.importorskip("resource", reason="files have no limit of size here")
    path, counts, clock = tmp_path / "run.h5", run_counts(60_000, quiet=10), Clock()
    recorder = writer(path, now=clock)
    blocks = iter([Block(i, counts[:, i : i + size]) for i in range(0, 60_000, size)])

    def append() -> None:
        clock.moment += 1.0
        recorder.append(next(blocks))

    def fill() -> None:
        while True:
            append()

    for _ in range(before):
        append()
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    # as on a full disk, what lies in the file already may still be written again
    resource.setrlimit(resource.RLIMIT_FSIZE, (path.stat().st_size, hard))
    try:
        with pytest.raises(DiskFault, match="the disk, or a limit"):
            fill()
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    safe = recorder.samples
    found = verify(path)
    assert found.sound, found.faults
    assert recover(path)
    found = verify(path)
    assert found.sound, found.faults
    run = open_recording(path)
    assert safe <= run.samples <= safe + size  # the refused one, where all of it fitted
    expected = CHANNELS[3].scaling.physical(counts[3, : run.samples])
    np.testing.assert_array_equal(run.displacement + run.rest_reading, expected)


class Full:
    """A file on a disk that takes so many bytes more."""

    def __init__(self, file: object, room: int) -> None:
        self.file, self.room = file, room

    def __getattr__(self, name: str) -> object:
        return getattr(self.file, name)

    def write(self, data: bytes) -> int:
        if self.room < len(data):
            raise OSError(28, "No space left on device")
        self.room -= len(data)
        return self.file.write(data)  # type: ignore[attr-defined]


@pytest.mark.parametrize("takes", mostly_deep([0, 100, 5_000, 20_000], [0, 5_000]))
def test_a_full_disk_at_the_end_changes_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, takes: int
) -> None:
    path = tmp_path / "run.h5"
    recorder = writer(path)
    recorder.append(Block(0, run_counts(3000)))
    before: list[bytes] = []

    def full(patched: object) -> None:
        before.append(path.read_bytes())
        patched._file = Full(patched._file, takes)  # type: ignore[attr-defined]

    @contextmanager
    def changed(path: Path, lock: FileLock, fsync: bool = False) -> Iterator[Patched]:
        with changed_in_place(path, lock, fsync) as patched:
            full(patched)
            yield patched

    monkeypatch.setattr("dearig.recording.writing.finish.changed_in_place", changed)
    with pytest.raises(DiskFault, match="No space left on device; the whole run is in the file"):
        recorder.close()
    assert path.read_bytes() == before[0]
    assert not journal_of(path).exists()
    assert open_recording(path).samples == 3000
    monkeypatch.undo()
    assert recover(path)
    assert verify(path).sound


@pytest.mark.parametrize("size", [0, 1, 4096, 10_000, 12_288, 12_289, 20_000])
@pytest.mark.parametrize("done", [0, 1, 2, 99])
def test_a_content_that_is_half_replaced_is_seen_and_made_whole(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, size: int, done: int
) -> None:
    path, new = tmp_path / "x", np.random.default_rng(1).bytes(size)
    path.write_bytes(np.random.default_rng(2).bytes(12_289))

    def killed(file: io.FileIO, end: int, pages: dict[int, bytes]) -> None:
        first = dict(sorted(pages.items())[:done])
        _apply(file, end if done == 99 else max(end, 12_289), first)
        raise KeyboardInterrupt

    monkeypatch.setattr("dearig.recording.content.journal._apply", killed)
    with (
        pytest.raises(KeyboardInterrupt),
        lock_existing(path) as lock,
        changed_in_place(path, lock) as patched,
    ):
        patched.replace(memoryview(new))
    monkeypatch.undo()
    found = whole_journal(path)
    assert found is not None
    with path.open("rb", buffering=0) as file:
        shown = Patched(file, found[0], {n: bytearray(page) for n, page in found[2].items()})
        shown.end = found[1]
        assert shown.read() == new
    with lock_existing(path) as lock:
        assert carry_out(path, lock)
    assert path.read_bytes() == new


def test_a_change_that_fails_leaves_the_file(tmp_path: Path) -> None:
    path = tmp_path / "x"
    path.write_bytes(bytes(range(256)) * 40)

    def fail() -> None:
        with lock_existing(path) as lock, changed_in_place(path, lock) as patched:
            patched.seek(5)
            patched.write(b"changed")
            patched.seek(0, 2)
            patched.write(b"more")
            raise ValueError("no")

    with pytest.raises(ValueError, match="no"):
        fail()
    assert path.read_bytes() == bytes(range(256)) * 40
    with lock_existing(path) as lock, changed_in_place(path, lock) as patched:
        patched.seek(4090)
        patched.write(b"across two pages")
        patched.seek(4088)
        assert patched.read(20) == b"\xf8\xf9across two pages\x0a\x0b"
        patched.truncate(5000)
    assert path.stat().st_size == 5000
    assert path.read_bytes()[4090:4106] == b"across two pages"
    assert not journal_of(path).exists()


def test_the_journal_of_another_file_is_ignored(tmp_path: Path) -> None:
    first, second = tmp_path / "first.h5", tmp_path / "second.h5"
    recorder = writer(first, samples_expected=500)
    recorder.append(Block(0, run_counts(500)))
    kept: list[bytes] = []
    real = Path.unlink

    def unlink(path: Path, missing_ok: bool = False) -> None:
        if path == journal_of(first) and path.exists():
            kept.append(path.read_bytes())
        real(path, missing_ok)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Path, "unlink", unlink)
        recorder.close()
    write_run(second)
    whole = second.read_bytes()
    for content in (kept[0], kept[0][:-100], b"", b"dearig-journal/1" + bytes(100)):
        journal_of(second).write_bytes(content)
        assert open_recording(second).samples == 3000
        assert not recover(second)
        assert second.read_bytes() == whole
    # its own, found after all of it has been done
    journal_of(first).write_bytes(kept[0])
    assert open_recording(first).complete
    assert recover(first)
    assert not journal_of(first).exists()
    assert verify(first).sound


def test_the_old_recording_stays_until_the_new_one_has_samples(tmp_path: Path) -> None:
    path, old = tmp_path / "run.h5", tmp_path / "run.h5.old"
    write_run(path)
    before = path.read_bytes()
    clock = Clock()
    recorder = writer(path, overwrite=True, now=clock)
    assert old.read_bytes() == before
    with pytest.raises(
        InputError, match=r"no samples: .* it would have replaced is .*run\.h5\.old"
    ):
        open_recording(path)
    recorder.append(Block(0, run_counts(100)))
    assert old.exists()
    clock.moment += 1.0
    recorder.append(Block(100, run_counts(100)))
    assert not old.exists()
    recorder.close()
    assert open_recording(path).samples == 200
    before = path.read_bytes()
    recorder = writer(path, overwrite=True)
    recorder.discard()
    assert path.read_bytes() == before
    assert not old.exists()
    old.write_bytes(b"precious")
    with pytest.raises(InputError, match=r"run\.h5\.old exists already, left by a run"):
        writer(path, overwrite=True)
    assert (path.read_bytes(), old.read_bytes()) == (before, b"precious")


def test_what_is_on_the_disk_with_fsync(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    synced: list[int] = []
    real = os.fsync
    monkeypatch.setattr(os, "fsync", lambda fd: (synced.append(fd), real(fd)))
    for fsync in (False, True):
        clock = Clock()
        path = tmp_path / f"{fsync}.h5"
        with writer(path, fsync=fsync, now=clock) as recorder:
            for i in range(4):
                clock.moment += 0.3
                recorder.append(Block(100 * i, run_counts(100)))
        # the last one is that of the folder, for the name of the journal
        assert len(synced) == (9 + (os.name != "nt") if fsync else 0)
        assert open_recording(path).samples == 400


@pytest.mark.parametrize("length", [248, 255, 300])
def test_a_name_that_is_too_long(tmp_path: Path, length: int) -> None:
    path = tmp_path / ("x" * (length - 3) + ".h5")
    with pytest.raises(InputError, match=r"cannot be written: (its name has more|File name too)"):
        writer(path)
    assert not list(tmp_path.iterdir())
    write_run(tmp_path / ("x" * 244 + ".h5"))


@pytest.mark.parametrize(
    ("error", "match"),
    [
        (OSError(28, ""), "the disk is full"),
        (OSError(30, ""), "is read-only"),
        (
            RuntimeError("unable to extend file properly, errno = 27, error m"),
            "no file of this size",
        ),
        (OSError(5, ""), "fails, or was removed"),
        (RuntimeError("cannot flush"), "check that the disk has space"),
    ],
)
def test_what_to_do(error: Exception, match: str) -> None:
    assert match in advice(error)
