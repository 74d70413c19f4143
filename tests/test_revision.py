"""Version and revision, in a checkout and in a copy without one."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

import pytest

from dearig import revision as revisions
from dearig.revision import Revision, git_revision, of_checkout


def git(folder: Path, *words: str) -> str:
    """Run git as a person whose settings are not read."""
    who = ("-c", "user.name=T", "-c", "user.email=t@example.org", "-c", "commit.gpgsign=false")
    done = subprocess.run(
        ["git", *who, "-C", str(folder), *words], capture_output=True, text=True, check=True
    )
    return done.stdout.strip()


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    """A repository with a release 1.0.0 and three commits after it."""
    git(tmp_path, "init", "-q")
    for number, version in enumerate(["0.9.0", "1.0.0", "1.0.0", "1.0.0", "1.0.0"]):
        text = f'version = "{version}"\nother = {number}\n'
        (tmp_path / "pyproject.toml").write_text(text, encoding="utf-8")
        git(tmp_path, "add", ".")
        git(tmp_path, "commit", "-q", "-m", f"Commit {number}")
    return tmp_path


def test_a_checkout_knows_how_far_it_is_from_its_release(checkout: Path) -> None:
    head = git(checkout, "rev-parse", "HEAD")
    assert of_checkout(checkout, "1.0.0") == Revision(head, 3)
    assert of_checkout(checkout, "2.0.0") == Revision(head, None)


def test_a_tag_of_the_release_comes_first(checkout: Path) -> None:
    git(checkout, "tag", "v1.0.0", "HEAD~1")
    assert of_checkout(checkout, "1.0.0").ahead == 1


def test_changed_files_are_told(checkout: Path) -> None:
    (checkout / "pyproject.toml").write_text("changed\n", encoding="utf-8")
    assert of_checkout(checkout, "1.0.0").commit.endswith("-dirty")


def test_a_shallow_clone_does_not_count_commits(checkout: Path, tmp_path: Path) -> None:
    clone = tmp_path / "clone"
    git(tmp_path, "clone", "-q", "--depth", "1", checkout.as_uri(), str(clone))
    found = of_checkout(clone, "1.0.0")
    assert found.ahead is None
    assert len(found.commit) == 40


def test_a_copy_outside_a_checkout_has_no_revision(tmp_path: Path) -> None:
    assert git_revision(tmp_path) == ""
    assert of_checkout(tmp_path, "1.0.0") == Revision()


def test_an_installed_program_reads_the_revision_of_its_build(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(revisions, "ROOT", tmp_path)
    monkeypatch.setattr(revisions, "__file__", str(tmp_path / "revision.py"))
    asked = revisions.revision.__wrapped__
    assert asked() == Revision()
    revisions.write(Revision("abc", 7), tmp_path / revisions.FILE)
    assert asked() == Revision("abc", 7)
    for damaged in ("", "[]", json.dumps({"commit": "abc"})):
        (tmp_path / revisions.FILE).write_text(damaged, encoding="utf-8")
        assert asked() == Revision()


@pytest.mark.parametrize(
    ("found", "text"),
    [
        (Revision(), "1.0.0"),
        (Revision("abc", 0), "1.0.0, revision abc"),
        (Revision("abc", None), "1.0.0, revision abc"),
        (Revision("abc", 1), "1.0.0, 1 commit after that release, revision abc"),
        (Revision("abc", 12), "1.0.0, 12 commits after that release, revision abc"),
    ],
)
def test_the_text_says_how_far_it_is(found: Revision, text: str) -> None:
    assert found.text("1.0.0") == text
