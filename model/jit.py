"""The one decorator that compiles the numerical kernels, with a disk cache that cannot go stale.

Numba checks only the file that holds a function, not the files that function calls, so a cached
kernel would survive an edit of the spring it calls. The cache folder is therefore named after the
text of every source file of this package: a changed file means a new folder and one compilation.
"""

from __future__ import annotations

import hashlib
import os
from pathlib import Path

import numba
import platformdirs

__all__ = ["cache_folder", "inlined", "is_compiled", "jit"]

_KERNEL_ROOT = Path(__file__).parent


def _sources_digest() -> str:
    digest = hashlib.sha256(numba.__version__.encode())
    for path in sorted(_KERNEL_ROOT.rglob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def cache_folder() -> Path:
    """Folder of the compiled kernels of exactly these sources."""
    return Path(platformdirs.user_cache_dir("dearig")) / f"kernels-{_sources_digest()}"


def is_compiled() -> bool:
    """True when a command will start at once, False when it must first compile the kernels."""
    return any(Path(numba.config.CACHE_DIR).rglob("*.nbi"))


if "NUMBA_CACHE_DIR" not in os.environ:
    numba.config.CACHE_DIR = str(cache_folder())

# nogil: populations run on threads, which (unlike numba's own parallel layer) may be entered from
# several Python threads at once, as a window with a live overlay does.
# error_model="numpy": a division by zero gives inf, which the status checks catch, not an exception.
# reassoc lets loops over branches use vector units; NaN and inf keep their meaning.
_OPTIONS = {
    "cache": True,
    "nogil": True,
    "error_model": "numpy",
    "fastmath": {"contract", "arcp", "nsz", "reassoc"},
}
jit = numba.njit(**_OPTIONS)
#: For pieces that are compiled into their caller, so that literal arguments become constants there.
inlined = numba.njit(inline="always", **_OPTIONS)
