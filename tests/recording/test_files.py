"""Outputs appear as a whole or not at all, and nothing is written through a link."""

from __future__ import annotations

import os
import signal
import stat
import subprocess
import sys
from pathlib import Path

import pytest

from dearig.errors import InputError
from dearig.recording.files import check_output, move, replaced_when_done
from dearig.recording.lock import lock_existing
from tests.tools.command import names

ROOT = Path(__file__).parents[2]
posix = pytest.mark.skipif(sys.platform == "win32", reason="no permissions, links, signals")


def write(path: Path, text: str, overwrite: bool = True) -> None:
    with replaced_when_done(path, overwrite) as partial:
        partial.write_text(text, "utf-8")


def test_an_output_is_replaced_as_a_whole(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    write(path, "old")
    with replaced_when_done(path, overwrite=True) as partial:
        partial.write_text("new", "utf-8")
        assert path.read_text("utf-8") == "old"
        assert partial.parent == tmp_path
    assert path.read_text("utf-8") == "new"
    assert names(tmp_path) == {"a.csv"}


@pytest.mark.parametrize("error", [OSError(28, "no"), RuntimeError("no"), KeyboardInterrupt()])
def test_a_failed_output_leaves_what_was_there(tmp_path: Path, error: BaseException) -> None:
    path = tmp_path / "a.csv"
    write(path, "old")

    def fail() -> None:
        with replaced_when_done(path, overwrite=True) as partial:
            partial.write_text("half", "utf-8")
            raise error

    expected = KeyboardInterrupt if isinstance(error, KeyboardInterrupt) else InputError
    with pytest.raises(expected):
        fail()
    assert path.read_text("utf-8") == "old"
    assert names(tmp_path) == {"a.csv"}


def test_two_outputs_of_one_name_at_once(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"

    def both(overwrite: bool) -> None:
        with replaced_when_done(path, overwrite) as first:
            first.write_text("first", "utf-8")
            write(path, "second, and longer", overwrite)

    with pytest.raises(InputError, match="exists already"):
        both(overwrite=False)
    assert path.read_text("utf-8") == "second, and longer"
    both(overwrite=True)
    assert path.read_text("utf-8") == "first"
    assert names(tmp_path) == {"a.csv"}


def test_a_file_that_is_locked_is_not_replaced(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    write(path, "old")
    with lock_existing(path):
        with pytest.raises(InputError, match="is in use"):
            write(path, "new")
        with pytest.raises(InputError, match="is in use"):
            check_output(path, overwrite=True)
    assert path.read_text("utf-8") == "old"
    assert names(tmp_path) == {"a.csv"}


@posix
def test_what_links_point_to_is_not_overwritten(tmp_path: Path) -> None:
    precious = tmp_path / "precious.txt"
    precious.write_text("precious", "utf-8")
    out = tmp_path / "out"
    out.mkdir()
    for name in ("a.csv", "a.csv.partial", "a.csv.journal", "a.csv.old"):
        (out / name).symlink_to(precious)
    with pytest.raises(InputError, match=r"is a symbolic link to .*precious"):
        check_output(out / "a.csv", overwrite=True)
    with pytest.raises(InputError):
        write(out / "a.csv", "new")
    (out / "a.csv").unlink()
    write(out / "a.csv", "new")
    (out / "missing").symlink_to(tmp_path / "not there")
    with pytest.raises(InputError, match="is a symbolic link"):
        check_output(out / "missing", overwrite=False)
    with pytest.raises(InputError):
        write(out / "missing", "new", overwrite=False)
    assert precious.read_text("utf-8") == "precious"
    assert not (tmp_path / "not there").exists()
    # a folder may be a link
    (tmp_path / "also out").symlink_to(out)
    check_output(tmp_path / "also out" / "a.csv", overwrite=True)


@posix
def test_permissions_are_kept_and_new_files_have_those_of_the_umask(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    before = os.umask(0o027)
    try:
        write(path, "new")
    finally:
        os.umask(before)
    assert stat.S_IMODE(path.stat().st_mode) == 0o640
    path.chmod(0o604)
    write(path, "newer")
    assert stat.S_IMODE(path.stat().st_mode) == 0o604


@posix
def test_the_unfinished_output_of_a_killed_program_is_removed(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    script = (
        "import os, sys; from pathlib import Path\n"
        "from dearig.recording.files import replaced_when_done\n"
        "with replaced_when_done(Path(sys.argv[1]), True) as partial:\n"
        "    partial.write_text('half')\n"
        "    print(flush=True); sys.stdin.read()\n"
    )
    with subprocess.Popen(
        [sys.executable, "-c", script, str(path)],
        cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE,
    ) as victim:  # fmt: skip
        assert victim.stdout is not None
        victim.stdout.readline()
        (left,) = names(tmp_path)
        # it may be somebody's who is still writing
        write(tmp_path / "b.csv", "whole")
        assert names(tmp_path) == {left, "b.csv"}
        victim.send_signal(signal.SIGKILL)
    write(tmp_path / "b.csv", "whole")
    assert names(tmp_path) == {"b.csv"}


def test_a_move_never_replaces(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    a, b = tmp_path / "a", tmp_path / "b"
    a.write_text("a", "utf-8")
    b.write_text("b", "utf-8")
    with pytest.raises(FileExistsError):
        move(a, b)
    move(a, tmp_path / "c")

    def refuse(*_: object) -> None:
        raise PermissionError(1, "no hard links")

    monkeypatch.setattr(os, "link", refuse)
    move(tmp_path / "c", a)
    if sys.platform != "win32":
        with pytest.raises(FileExistsError):
            move(a, b)
    assert (a.read_text("utf-8"), b.read_text("utf-8")) == ("a", "b")


def test_an_output_is_not_a_file_whose_name_is_a_dash(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for overwrite in (False, True):
        with pytest.raises(InputError, match="only JSON can be written to standard output"):
            check_output("-", overwrite)
