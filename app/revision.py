"""Version of this program, its revision in git, and how far that is from the release.

``setup.py`` runs this file, too: it imports the standard library alone. A wheel has the revision
of the checkout that it was built from in ``revision.json``.
"""

from __future__ import annotations

import json
import shutil
import subprocess
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path

__all__ = ["FILE", "Revision", "git_revision", "of_checkout", "revision", "version", "write"]

ROOT = Path(__file__).resolve().parents[1]
#: Name of the file with the revision, in the package of a wheel.
FILE = "revision.json"


@dataclass(frozen=True)
class Revision:
    """Revision of a checkout.

    ``commit`` is its hash, with ``-dirty`` if files changed, "" where it is not known. ``ahead``
    is the number of commits since the one that set the version, None where it is not known.
    """

    commit: str = ""
    ahead: int | None = None

    def text(self, version: str) -> str:
        """Return ``version``, how far this revision is from it, and the revision."""
        words = [version]
        if self.ahead:
            words.append(f"{self.ahead} commit{'s' if self.ahead > 1 else ''} after that release")
        if self.commit:
            words.append(f"revision {self.commit}")
        return ", ".join(words)


@cache
def version() -> str:
    """Return the version of the installed package, "unknown" where it is not installed."""
    from importlib.metadata import PackageNotFoundError, metadata  # takes longer than all else

    try:
        # an unfinished installation has a folder of metadata without a version
        return str(metadata("dearig")["Version"] or "unknown")
    except (PackageNotFoundError, KeyError):
        return "unknown"


@cache
def revision() -> Revision:
    """Return the revision of this program; asked once in a process, as it starts others."""
    if (ROOT / ".git").exists():
        return of_checkout(ROOT, version())
    try:
        noted = json.loads(Path(__file__).with_name(FILE).read_text(encoding="utf-8"))
        return Revision(str(noted["commit"]), noted["ahead"])
    except (OSError, ValueError, LookupError, TypeError):
        return Revision()


def of_checkout(root: Path, version: str) -> Revision:
    """Return the revision of the checkout at ``root``, whose release is ``version``."""
    commit = git_revision(root)
    return Revision(commit, _ahead(root, version) if commit else None)


def git_revision(root: Path) -> str:
    """Return the git revision at ``root``, with ``-dirty`` if files changed; "" if none."""
    # git would also find the repository of a parent folder, which is not that of this program
    if not (root / ".git").exists():
        return ""
    return _git(root, "describe", "--always", "--dirty", "--abbrev=40", "--exclude=*")


def _ahead(root: Path, version: str) -> int | None:
    if _git(root, "rev-parse", "--is-shallow-repository") != "false":
        return None  # commits are missing
    line = f'version = "{version}"'
    release = _git(root, "rev-parse", "--verify", "--quiet", f"refs/tags/v{version}^{{commit}}")
    release = release or _git(root, "log", "-1", "--format=%H", f"-S{line}", "--", "pyproject.toml")
    count = _git(root, "rev-list", "--count", f"{release}..HEAD") if release else ""
    return int(count) if count.isdecimal() else None


def _git(root: Path, *words: str) -> str:
    """Return what git answers, "" where it has no answer."""
    git = shutil.which("git")
    if git is None:
        return ""
    try:
        answer = subprocess.run(  # noqa: S603  (fixed arguments, no shell)
            [git, "-C", str(root), *words],
            capture_output=True, text=True, timeout=5.0, check=False,
        )  # fmt: skip
    except (OSError, subprocess.TimeoutExpired):
        return ""
    return answer.stdout.strip() if answer.returncode == 0 else ""


def write(found: Revision, path: Path) -> None:
    """Write the revision that was ``found`` to ``path``, for a distribution."""
    path.write_text(json.dumps(asdict(found)) + "\n", encoding="utf-8")
