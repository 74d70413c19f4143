"""Folders for caches: only those whose content no other user can change.

Compiled kernels are loaded as machine code, so a user who can write to their folder runs code as
the user. The rule is that of OpenSSH's ``StrictModes``: the folder and every folder above it, with
links resolved, belong to this user or to root, and neither group nor others may write to them. Two
cases are allowed besides that: a folder with the sticky bit above the last one (``/tmp``: only the
owner of an entry can rename it), and write permission for the user's private group (the group that
has the user's name and no other member, with which some systems create every folder).

On Windows a folder is trusted if it lies in the user's profile, to which the system gives other
users no access. The Windows rule is tested only as a rule of paths, on Linux.
"""

from __future__ import annotations

import os
import stat
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import platformdirs

__all__ = ["CacheFolder", "cache_root", "distrust", "distrust_content", "distrust_file", "usable"]

_GROUP_OR_OTHERS = stat.S_IWGRP | stat.S_IWOTH


@dataclass(frozen=True)
class CacheFolder:
    """A trusted folder that can be written; ``path`` is None where there is none.

    ``note`` says why it is not the usual folder; "" if it is.
    """

    path: Path | None
    note: str = ""


def cache_root(asked: str = "") -> CacheFolder:
    """Return the folder for caches, made if it was missing.

    It is ``asked`` if that is not empty, else the user's cache folder. Where that is not
    ``usable`` it is a private folder among the temporary files, which other processes of the user
    find again.
    """
    notes: list[str] = []
    for folder in (
        Path(asked) if asked else Path(platformdirs.user_cache_dir("dearig")),
        *_temporary(),
    ):
        path, reason = usable(folder)
        if path is not None:
            return CacheFolder(path, "; ".join(notes))
        notes.append(reason)
    return CacheFolder(None, "; ".join(notes))


def usable(folder: Path) -> tuple[Path | None, str]:
    """Return ``folder`` with links resolved, made if it was missing, or None and the reason.

    It is usable if it is trusted (``distrust``) and can be written.
    """
    if not folder.is_absolute() and folder.parts[:1] == ("~",):
        return None, "the user has no home folder"
    try:
        path = folder.resolve()
        reason = distrust(path)  # before anything is made there
        if not reason:
            _make(path)
            reason = distrust(path)
        if reason:
            return None, f"{folder} is not used: {reason}"
        if not os.access(path, os.W_OK | os.X_OK):
            return None, f"{folder} cannot be written"
    except (OSError, ValueError, RuntimeError) as error:  # a zero byte, a loop of links
        return None, f"{folder} cannot be written: {getattr(error, 'strerror', '') or error}"
    return path, ""


def distrust(path: Path) -> str:
    """Return why another user could change what lies in ``path``; "" where none can.

    ``path`` has no links. Where it does not exist yet, the nearest folder above it counts.
    """
    if os.name == "nt":
        return _outside_profile(path, Path.home())
    for place in (path, *path.parents):
        try:
            found = place.lstat()
        except (FileNotFoundError, NotADirectoryError):
            continue
        if not stat.S_ISDIR(found.st_mode):
            return f"{place} is not a folder"
        if reason := _open_to_others(place, found, sticky=place != path):
            return reason
    return ""


def distrust_content(folder: Path) -> str:
    """Return why something in ``folder`` may be another user's work; "" where nothing is.

    Files that came there while the folder was open to others stay when it is closed.
    """
    if os.name == "nt":
        return ""
    for place in _all_in(folder):
        try:
            reason = distrust_file(place)
        except FileNotFoundError:
            continue  # another process that compiles too has renamed it meanwhile
        if reason:
            return reason
    return ""


def distrust_file(path: Path) -> str:
    """Return why ``path`` itself, not what is above it, may be another user's work."""
    if os.name == "nt":
        return ""
    found = path.lstat()
    if not (stat.S_ISDIR(found.st_mode) or stat.S_ISREG(found.st_mode)):
        return f"{path} is neither a file nor a folder"
    return _open_to_others(path, found, sticky=False)


def _all_in(folder: Path) -> Iterator[Path]:
    for where, folders, files in os.walk(folder):
        yield from (Path(where, name) for name in (*folders, *files))


def _open_to_others(place: Path, found: os.stat_result, sticky: bool) -> str:
    me = os.geteuid()
    if found.st_uid not in (0, me):
        return f"{place} belongs to {_user_name(found.st_uid)}, who could put other code there"
    if not found.st_mode & _GROUP_OR_OTHERS or (sticky and found.st_mode & stat.S_ISVTX):
        return ""
    if not found.st_mode & stat.S_IWOTH and _is_private(found.st_gid, me):
        return ""
    who = "everyone" if found.st_mode & stat.S_IWOTH else "its group"
    return f"{who} may write to {place}, and could put other code there"


def _is_private(group: int, user: int) -> bool:
    """Return True for the group that has the user's name and no other member."""
    import grp
    import pwd

    try:
        mine, entry = pwd.getpwuid(user), grp.getgrgid(group)
    except KeyError:
        return False
    named = entry.gr_name == mine.pw_name and group == mine.pw_gid
    return named and set(entry.gr_mem) <= {mine.pw_name}


def _user_name(user: int) -> str:
    import pwd

    try:
        return pwd.getpwuid(user).pw_name
    except KeyError:
        return f"user {user}"


def _outside_profile(path: Path, profile: Path) -> str:
    """Return why ``path`` is not trusted on Windows."""
    if path.is_relative_to(profile.resolve()):
        return ""
    return f"{path} lies outside of {profile}, so other users may be able to write to it"


def _make(path: Path) -> None:
    """Create ``path`` and the folders above it for this user alone, whatever the umask is."""
    missing = [place for place in (path, *path.parents) if not place.exists()]
    for place in reversed(missing):
        place.mkdir(mode=0o700, exist_ok=True)


def _temporary() -> Iterator[Path]:
    """Yield private folders among the temporary files.

    Python's own search ends with the current folder, where a cache does not belong.
    """
    if os.name == "nt":
        yield Path(tempfile.gettempdir()) / "dearig"
        return
    for folder in filter(None, (os.environ.get("TMPDIR"), "/tmp", "/var/tmp")):  # noqa: S108
        yield Path(folder) / f"dearig-{os.geteuid()}"
