"""Make .links/dearig, the package as it is imported, out of links to the folders of the checkout.

The import name is ``dearig`` and the folders are ``app/``, ``drivers/``, ``model/`` and
``sim_backend/``. Python finds them through the editable install. A tool that reads files instead of
importing them (mypy, import-linter, an editor) finds them under ``.links``. Folders are linked as
folders, so that a new file needs no new link; only files directly in ``app/`` are linked one by
one.
"""

from __future__ import annotations

import os
import shutil
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
LINKS = ROOT / ".links"


def make() -> Path:
    """Make the links again, and return the folder to search for packages."""
    package = LINKS / "dearig"
    if package.exists():
        for entry in package.iterdir():
            _remove(entry)
        package.rmdir()
    package.mkdir(parents=True)
    for source in sorted((ROOT / "app").iterdir()):
        if source.name != "__pycache__":
            _link(source, package / source.name)
    for name in ("drivers", "model", "sim_backend"):
        _link(ROOT / name, package / name)
    return LINKS


def _link(source: Path, link: Path) -> None:
    if os.name != "nt":
        link.symlink_to(os.path.relpath(source, link.parent), target_is_directory=source.is_dir())
    elif source.is_dir():
        import _winapi  # a junction needs no privilege; a symbolic link does

        _winapi.CreateJunction(str(source), str(link))
    else:
        try:
            link.symlink_to(source)
        except OSError:
            os.link(source, link)


def _remove(entry: Path) -> None:
    if entry.is_symlink() or entry.is_file():
        entry.unlink()
    elif os.name == "nt":
        entry.rmdir()  # a junction goes, what it leads to stays
    else:
        shutil.rmtree(entry)


if __name__ == "__main__":
    print(make())
