"""The log file: shared by programs, rotated, and never in the way of a run."""

from __future__ import annotations

import errno
import io
import logging
import subprocess
import sys
from pathlib import Path

import pytest

from dearig import log_file

log = logging.getLogger("dearig.tests")


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv(log_file.FOLDER_VARIABLE, str(tmp_path / "log"))
    return tmp_path / "log"


def test_records_are_appended_and_the_handler_leaves_nothing_behind(folder: Path) -> None:
    handlers = list(logging.getLogger().handlers)
    for line in ("first", "second"):
        with log_file.attached():
            log.info(line)
    lines = log_file.log_path().read_text(encoding="utf-8").splitlines()
    assert [line.rpartition(": ")[2] for line in lines] == ["first", "second"]
    assert logging.getLogger().handlers == handlers


def test_news_of_other_packages_is_left_out_and_their_warnings_are_kept(folder: Path) -> None:
    with log_file.attached():
        logging.getLogger("another").info("news")
        logging.getLogger("another").warning("a warning")
    assert "news" not in log_file.log_path().read_text(encoding="utf-8")
    assert "a warning" in log_file.log_path().read_text(encoding="utf-8")


def test_nothing_is_made_before_there_is_something_to_write(folder: Path) -> None:
    with log_file.attached():
        assert not folder.exists()


def test_a_full_file_is_renamed_and_old_ones_are_deleted(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(log_file, "SIZE_MAX", 500)
    with log_file.attached():
        for n in range(100):
            log.info("line %03d", n)
    names = sorted(path.name for path in folder.iterdir())
    assert names == ["dearig.log", "dearig.log.1", "dearig.log.2", "dearig.log.3"]
    assert all(path.stat().st_size <= 500 for path in folder.iterdir())
    newest = [(folder / name).read_text(encoding="utf-8") for name in reversed(names)]
    numbers = [int(line[-3:]) for line in "".join(newest).splitlines()]
    assert numbers == list(range(numbers[0], 100))


def test_a_file_that_cannot_be_renamed_grows_and_loses_nothing(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(log_file, "SIZE_MAX", 500)

    def refuse(self: Path, target: object) -> None:
        raise PermissionError(13, "the file is used by another process")

    monkeypatch.setattr(Path, "replace", refuse)
    with log_file.attached() as handler:
        for n in range(40):
            log.info("line %03d", n)
        assert handler.problem is None
    lines = log_file.log_path().read_text(encoding="utf-8").splitlines()
    assert [int(line[-3:]) for line in lines] == list(range(40))


@pytest.mark.skipif(sys.platform == "win32", reason="Windows renames no file that is open")
def test_a_program_follows_when_another_one_has_renamed_the_file(folder: Path) -> None:
    with log_file.attached():
        log.info("before")
        log_file.log_path().rename(folder / "dearig.log.1")
        log.info("after")
    assert "after" in log_file.log_path().read_text(encoding="utf-8")
    assert "after" not in (folder / "dearig.log.1").read_text(encoding="utf-8")


def test_two_programs_write_whole_lines_to_one_file(folder: Path) -> None:
    code = (
        "import logging, sys\n"
        "from dearig import log_file\n"
        "with log_file.attached():\n"
        "    for n in range(200):\n"
        "        logging.getLogger('dearig.x').info('%s %03d end', sys.argv[1], n)\n"
    )
    programs = [subprocess.Popen([sys.executable, "-c", code, name]) for name in ("a", "b")]
    assert [program.wait(60) for program in programs] == [0, 0]
    lines = log_file.log_path().read_text(encoding="utf-8").splitlines()
    assert len(lines) == 400
    for name in ("a", "b"):
        own = [line.split() for line in lines if f": {name} " in line]
        assert [int(words[-2]) for words in own] == list(range(200))


def test_a_folder_that_cannot_be_made_is_told_and_raises_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setenv(log_file.FOLDER_VARIABLE, str(tmp_path / "file" / "log"))
    with log_file.attached() as handler:
        log.info("lost")
        assert handler.problem
    assert capsys.readouterr().err == ""


def test_a_file_that_cannot_be_opened_is_told_and_raises_nothing(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log_file.log_path().mkdir(parents=True)  # a folder where the file belongs
    with log_file.attached() as handler:
        log.info("lost")
        assert handler.problem
    assert capsys.readouterr().err == ""


class FullDisk(io.StringIO):
    """A stream whose disk takes nothing more."""

    def flush(self) -> None:
        raise OSError(errno.EFBIG, "File too large")

    def close(self) -> None:
        raise OSError(errno.EFBIG, "File too large")


def test_a_full_disk_at_the_end_is_told_and_raises_nothing(folder: Path) -> None:
    handler = log_file.LogFile(log_file.log_path())
    handler.stream = FullDisk()
    handler.close()
    assert handler.problem == "File too large"
