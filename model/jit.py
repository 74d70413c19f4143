"""The one decorator that compiles the numerical kernels, with a disk cache that cannot go stale.

Numba checks only the file that holds a function, not the files that function calls, so a cached
kernel would survive an edit of the spring it calls. The cache folder is therefore named after the
text of every source file that kernels are made of: a changed file means a new folder and one
compilation.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
import platformdirs

__all__ = ["allocating", "cache_folder", "inlined", "is_compiled", "jit"]

_KERNEL_ROOT = Path(__file__).parent
_WITHOUT_KERNELS = ("diagnosis", "fitting")  # folders that compile nothing
# numba fills this module from the environment when it is imported: a type checker finds it empty
_settings: dict[str, Any] = vars(numba.config)


def _sources_digest() -> str:
    digest = hashlib.sha256(numba.__version__.encode())
    for path in sorted(_KERNEL_ROOT.rglob("*.py")):
        if path.relative_to(_KERNEL_ROOT).parts[0] not in _WITHOUT_KERNELS:
            digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def cache_folder() -> Path:
    """Folder of the compiled kernels of exactly these sources, or the one numba was told of."""
    if "NUMBA_CACHE_DIR" in os.environ:
        return Path(os.environ["NUMBA_CACHE_DIR"])
    return Path(platformdirs.user_cache_dir("dearig")) / f"kernels-{_sources_digest()}"


def is_compiled() -> bool:
    """True when a command will start at once, False when it must first compile the kernels."""
    return any(Path(_settings["CACHE_DIR"]).rglob("*.nbi"))


if "NUMBA_CACHE_DIR" not in os.environ:
    _settings["CACHE_DIR"] = str(cache_folder())

# nogil: populations run on threads, which (unlike numba's own parallel layer) may be entered from
# several Python threads at once, as a window with a live overlay does.
# error_model="numpy": a division by zero gives inf, which the status checks catch, no exception.
# reassoc lets loops over branches use vector units; NaN and inf keep their meaning.
_compiled = partial(
    numba.njit,
    cache=True,
    nogil=True,
    error_model="numpy",
    fastmath={"contract", "arcp", "nsz", "reassoc"},
)

# To the type checker a compiled function is the function it was compiled from: it is called with
# the same arguments and returns the same values.
_Function = TypeVar("_Function", bound=Callable[..., object])


def jit(function: _Function) -> _Function:
    """Compile ``function`` at its first call, and keep the machine code on disk.

    It makes no arrays. Then who owns those that it is handed need not be counted, which at each
    call of an effect would take longer than the effect.
    """
    return cast(_Function, _compiled(function, _nrt=False))


def allocating(function: _Function) -> _Function:
    """As ``jit``, of a function that makes arrays."""
    return cast(_Function, _compiled(function))


def inlined(function: _Function) -> _Function:
    """As ``jit``, compiled into its caller, so that literal arguments become constants there."""
    return cast(_Function, _compiled(function, _nrt=False, inline="always"))
