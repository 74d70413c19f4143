"""Build step that notes the git revision in what is built; all else is in pyproject.toml."""

from __future__ import annotations

import importlib.util
import shutil
import sys
from pathlib import Path

from setuptools import setup
from setuptools.command.build_py import build_py
from setuptools.command.sdist import sdist

ROOT = Path(__file__).resolve().parent
_found = importlib.util.spec_from_file_location("dearig_revision", ROOT / "app" / "revision.py")
if _found is None or _found.loader is None:
    raise ImportError("app/revision.py cannot be read")
revision = importlib.util.module_from_spec(_found)
sys.modules["dearig_revision"] = revision  # dataclasses look the module up
_found.loader.exec_module(revision)


def note(version: str, folder: Path) -> None:
    """Write the revision to ``folder``: that of the checkout, or the one that this source has."""
    known, target = ROOT / "app" / revision.FILE, folder / revision.FILE
    found = revision.of_checkout(ROOT, version)
    if found.commit:
        revision.write(found, target)
    elif known.exists():
        shutil.copyfile(known, target)


class BuildPackages(build_py):
    """Add the revision to the package ``dearig``."""

    def run(self) -> None:
        """Build, and note the revision; an editable install asks git each time."""
        super().run()
        if not self.editable_mode:
            note(self.distribution.get_version(), Path(self.build_lib) / "dearig")


class SourceDistribution(sdist):
    """Add the revision to the folder ``app`` of a source distribution."""

    def make_release_tree(self, base_dir: str, files: list[str]) -> None:
        """Make the tree, and note the revision."""
        super().make_release_tree(base_dir, files)
        note(self.distribution.get_version(), Path(base_dir) / "app")


setup(cmdclass={"build_py": BuildPackages, "sdist": SourceDistribution})
