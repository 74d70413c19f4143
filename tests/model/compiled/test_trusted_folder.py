"""Caches lie only where no other user can change them."""

from __future__ import annotations

import os
import stat
from pathlib import Path

import pytest

from dearig.model.compiled import trusted_folder
from dearig.model.compiled.trusted_folder import cache_root, distrust_content, distrust_file, usable

posix = pytest.mark.skipif(os.name == "nt", reason="Windows has no owners and modes of this kind")
as_root = pytest.mark.skipif(
    os.name == "nt" or os.geteuid() != 0, reason="only root can give files to another user"
)
#: A user that does not exist on any machine.
STRANGER = 54321


@pytest.fixture
def home(tmp_path: Path) -> Path:
    """A folder that is trusted: pytest's own is, unless its parents have been opened."""
    path, reason = usable(tmp_path)
    if path is None:
        pytest.skip(reason)
    return path


def test_a_missing_folder_is_made_for_this_user_alone(home: Path) -> None:
    before = os.umask(0)
    try:
        path, reason = usable(home / "a" / "b")
    finally:
        os.umask(before)
    assert (path, reason) == (home / "a" / "b", "")
    if os.name != "nt":
        for made in (home / "a", home / "a" / "b"):
            assert stat.S_IMODE(made.stat().st_mode) == 0o700


@posix
@pytest.mark.parametrize(
    ("mode", "who"), [(0o777, "everyone"), (0o757, "everyone"), (0o1777, "everyone")]
)
def test_a_folder_that_others_may_write_to_is_not_used(home: Path, mode: int, who: str) -> None:
    (home / "open").mkdir()
    (home / "open").chmod(mode)
    path, reason = usable(home / "open")
    assert path is None
    assert f"{who} may write to {home / 'open'}" in reason


@posix
def test_a_folder_above_it_counts_too(home: Path) -> None:
    (home / "open" / "mine").mkdir(parents=True)
    (home / "open").chmod(0o777)
    assert usable(home / "open" / "mine")[0] is None
    assert usable(home / "open" / "not there yet")[0] is None
    assert not (home / "open" / "not there yet").exists()


@posix
def test_a_folder_above_it_with_the_sticky_bit_is_allowed(home: Path) -> None:
    (home / "tmp").mkdir()
    (home / "tmp").chmod(0o1777)
    assert usable(home / "tmp" / "mine")[0] == home / "tmp" / "mine"


@posix
def test_a_group_may_write_only_if_it_is_the_users_own(
    home: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (home / "shared").mkdir()
    (home / "shared").chmod(0o775)
    monkeypatch.setattr(trusted_folder, "_is_private", lambda *_: False)
    path, reason = usable(home / "shared")
    assert path is None
    assert f"its group may write to {home / 'shared'}" in reason
    monkeypatch.setattr(trusted_folder, "_is_private", lambda *_: True)
    assert usable(home / "shared")[0] == home / "shared"


@as_root
def test_a_group_with_another_name_is_not_private(home: Path) -> None:
    (home / "shared").mkdir()
    (home / "shared").chmod(0o775)
    os.chown(home / "shared", 0, 1)
    assert usable(home / "shared")[0] is None


@as_root
def test_a_folder_of_another_user_is_not_used_by_root(home: Path) -> None:
    """``sudo`` with the user's HOME; a folder that a user made in /tmp before."""
    theirs = home / "theirs"
    (theirs / "dearig").mkdir(parents=True, mode=0o755)
    os.chown(theirs, STRANGER, STRANGER)
    for folder in (theirs, theirs / "dearig", theirs / "new"):
        path, reason = usable(folder)
        assert path is None
        assert f"{theirs} belongs to user {STRANGER}" in reason
    assert not (theirs / "new").exists()


@as_root
def test_a_link_is_followed_before_owners_are_looked_at(home: Path) -> None:
    theirs, link = home / "theirs", home / "link"
    theirs.mkdir()
    os.chown(theirs, STRANGER, STRANGER)
    link.symlink_to(theirs)
    assert usable(link)[0] is None
    mine = home / "mine"
    mine.mkdir()
    link.unlink()
    link.symlink_to(mine)
    # the link may be changed later, so what is used is where it led
    assert usable(link)[0] == mine


@posix
@pytest.mark.parametrize("name", ["/dev/null/x", "/proc/x", "a\0b", "~/.cache/dearig"])
def test_a_folder_that_cannot_be_made_is_a_sentence(name: str) -> None:
    path, reason = usable(Path(name))
    assert path is None
    assert reason
    assert not Path("~").exists()


@posix
def test_a_loop_of_links_is_a_sentence(home: Path) -> None:
    (home / "a").symlink_to(home / "b")
    (home / "b").symlink_to(home / "a")
    assert usable(home / "a" / "c")[0] is None


@posix
def test_files_in_it_count_too(home: Path) -> None:
    inside = home / "kernels" / "sub"
    inside.mkdir(parents=True)
    good = inside / "good.nbi"
    good.touch(mode=0o644)
    assert distrust_content(home / "kernels") == ""
    good.chmod(0o666)
    assert "everyone may write to" in distrust_content(home / "kernels")
    good.unlink()
    good.symlink_to(home / "elsewhere.nbi")
    assert "neither a file nor a folder" in distrust_content(home / "kernels")
    good.unlink()
    if os.geteuid() == 0:
        good.touch(mode=0o644)
        os.chown(good, STRANGER, STRANGER)
        assert "belongs to user" in distrust_file(good)
        assert "belongs to user" in distrust_content(home / "kernels")


@posix
def test_a_file_that_another_process_renames_meanwhile_is_passed_over(
    home: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = home / "kernels"
    folder.mkdir(mode=0o700)
    partial = folder / "kernel.nbc.tmp"
    partial.touch(mode=0o600)
    seen = trusted_folder.distrust_file

    def renamed_first(path: Path) -> str:
        if path == partial:
            partial.rename(folder / "kernel.nbc")
        return seen(path)

    monkeypatch.setattr(trusted_folder, "distrust_file", renamed_first)
    assert distrust_content(folder) == ""


def test_where_the_usual_folder_is_not_trusted_a_private_one_is_found_again(
    home: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (home / "open").mkdir()
    (home / "open").chmod(0o777)
    (home / "tmp").mkdir()
    (home / "tmp").chmod(0o1777)
    monkeypatch.setenv("TMPDIR", str(home / "tmp"))
    first = cache_root(str(home / "open"))
    assert first.path == home / "tmp" / f"dearig-{os.geteuid()}"
    assert str(home / "open") in first.note
    assert cache_root(str(home / "open")) == first
    assert cache_root(str(home / "mine")).note == ""


@posix
def test_without_any_place_there_is_no_cache_and_a_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(trusted_folder, "_temporary", lambda: iter([Path("/dev/null/tmp")]))
    found = cache_root("/dev/null/x")
    assert found.path is None
    assert "/dev/null/x" in found.note
    assert "/dev/null/tmp" in found.note


def test_on_windows_a_folder_must_lie_in_the_profile(tmp_path: Path) -> None:
    """Tried as a rule of paths only; no Windows was at hand."""
    profile = tmp_path / "Users" / "Ada"
    profile.mkdir(parents=True)
    assert trusted_folder._outside_profile(profile / "AppData" / "x", profile) == ""
    assert "lies outside" in trusted_folder._outside_profile(tmp_path / "Temp", profile)
    assert "lies outside" in trusted_folder._outside_profile(tmp_path / "Users" / "Ada2", profile)
