"""Files next to a recording that another program planted: no wait, no memory, no file lost."""

from __future__ import annotations

import os
import shutil
import sys
import tracemalloc
import zlib
from collections.abc import Callable
from pathlib import Path

import pytest

from dearig.batch.journal import read_lines
from dearig.errors import InputError
from dearig.input_file import parse_json
from dearig.recording import open_recording, recover
from dearig.recording.content.journal import HEAD, MAGIC, PIECE, journal_of, whole_journal
from dearig.recording.reading.index import index_folder
from dearig.recording.reading.tags import TAGS_FILE, read_tags
from tests.tools.recordings import write_run

MEMORY_MAX = 2**23  # bytes; far more than the recordings here need
posix = pytest.mark.skipif(sys.platform == "win32", reason="no pipes in folders")


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("good") / "run.h5"
    write_run(path)
    return path


def sealed(content: bytes) -> bytes:
    return content + zlib.crc32(content).to_bytes(4, "little")


def pipe(journal: Path, size: int) -> None:
    os.mkfifo(journal)


def folder(journal: Path, size: int) -> None:
    journal.mkdir()


def pointing_to_pipe(journal: Path, size: int) -> None:
    os.mkfifo(journal.with_name("pipe"))
    journal.symlink_to("pipe")


def false_length(journal: Path, size: int) -> None:
    journal.write_bytes(
        sealed(HEAD.pack(MAGIC, size, size, 1) + PIECE.pack(0, 2**32 - 1) + b"x" * 64)
    )


def false_count(journal: Path, size: int) -> None:
    journal.write_bytes(sealed(HEAD.pack(MAGIC, size, size, 2**63) + b"x" * 64))


def false_size(journal: Path, size: int) -> None:
    """The recovery would make the file a petabyte long."""
    journal.write_bytes(sealed(HEAD.pack(MAGIC, size, 2**50, 0)))


def huge(journal: Path, size: int) -> None:
    with journal.open("wb") as file:
        file.write(HEAD.pack(MAGIC, size, size, 1))
        file.truncate(2**34)  # a sparse file: nothing is on the disk


def one_page_too_far(journal: Path, size: int) -> None:
    journal.write_bytes(
        sealed(HEAD.pack(MAGIC, size, size, 1) + PIECE.pack(2**40, 4096) + bytes(2 * 4096))
    )


NOT_FILES = [pipe, folder, pointing_to_pipe]
FALSE = [false_length, false_count, false_size, huge, one_page_too_far]


@posix
@pytest.mark.parametrize("plant", [*NOT_FILES, *FALSE])
def test_a_planted_journal_spoils_no_folder(
    tmp_path: Path, run: Path, plant: Callable[[Path, int], None]
) -> None:
    for name in ("first.h5", "second.h5"):
        shutil.copyfile(run, tmp_path / name)
    victim = tmp_path / "first.h5"
    before = victim.read_bytes()
    plant(journal_of(victim), victim.stat().st_size)
    tracemalloc.start()
    try:
        entries = {entry.path: entry for entry in index_folder(tmp_path, cache=tmp_path / "cache")}
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak < MEMORY_MAX
    assert not entries["second.h5"].trouble
    if plant in NOT_FILES:
        assert "first.h5.journal is a" in entries["first.h5"].trouble
        for reads in (open_recording, recover):
            with pytest.raises(InputError, match=r"first\.h5\.journal is a"):
                reads(victim)
        # once it is gone, nothing of it is remembered
        journal_of(victim).rename(tmp_path / "gone")
        again = index_folder(tmp_path, cache=tmp_path / "cache")
        assert [entry.trouble for entry in again] == ["", ""]
    else:
        assert not entries["first.h5"].trouble
        assert whole_journal(victim) is None
        recover(victim)
    assert victim.read_bytes() == before


@posix
@pytest.mark.parametrize("read", [read_tags, lambda folder: read_lines(folder / TAGS_FILE)])
def test_other_files_beside_recordings_are_no_pipes(
    tmp_path: Path, read: Callable[[Path], object]
) -> None:
    os.mkfifo(tmp_path / TAGS_FILE)
    with pytest.raises(InputError, match="is a pipe, not a file"):
        read(tmp_path)


@posix
def test_a_cache_that_is_a_pipe_is_none(tmp_path: Path, run: Path) -> None:
    recordings = tmp_path / "recordings"
    recordings.mkdir()
    shutil.copyfile(run, recordings / "run.h5")
    os.mkfifo(tmp_path / "cache")
    assert [e.trouble for e in index_folder(recordings, cache=tmp_path / "cache")] == [""]


@pytest.mark.parametrize("text", ['{"a": 1, "a": 2}', '[{"b": {"c": 1, "d": 2, "c": 1}}]'])
def test_a_key_that_is_there_twice_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match=r"the key '[ac]' is there more than once"):
        parse_json(text)
