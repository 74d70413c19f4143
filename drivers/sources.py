"""Digests of the sources of this package, by which two processes notice that theirs differ.

A program that runs for days may start a child process from sources that were changed meanwhile.
"""

from __future__ import annotations

import hashlib
import sys
from pathlib import Path

__all__ = ["AT_START", "ROOT", "loaded", "version"]

#: Folder of this package.
ROOT = Path(__file__).resolve().parent
_DIGITS = 16  # of each digest: enough to detect an accidental change

#: Digests by path of all modules of this package when this process imported the first of them.
AT_START = {
    path.relative_to(ROOT).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest()[:_DIGITS]
    for path in ROOT.rglob("*.py")
}


def loaded() -> dict[str, str]:
    """Return the digests of those modules that this process has imported."""
    files = [getattr(module, "__file__", None) for module in list(sys.modules.values())]
    paths = {Path(file).resolve() for file in files if file}
    return {name: digest for name, digest in AT_START.items() if ROOT / name in paths}


def version() -> str:
    """Return the version of the installed distribution, or ``unknown`` where none is installed."""
    from importlib import metadata  # it takes longer to import than all else here

    try:
        return metadata.version("dearig")
    except metadata.PackageNotFoundError:
        return "unknown"
