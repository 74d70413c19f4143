"""Decorators that compile the numerical kernels, with a disk cache that cannot go stale.

Numba checks only the file that holds a function, not the files that this function calls: a cached
kernel would survive an edit of the spring it calls. So the cache folder is named after a digest of
every source file that kernels are made of, in all folders of ``dearig.model``. A changed file means
a new folder and one compilation.
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
    """Return the folder of the kernels compiled from these sources, or ``NUMBA_CACHE_DIR``."""
    if "NUMBA_CACHE_DIR" in os.environ:
        return Path(os.environ["NUMBA_CACHE_DIR"])
    return Path(platformdirs.user_cache_dir("dearig")) / f"kernels-{_sources_digest()}"


def is_compiled() -> bool:
    """Return True when kernels are on disk, False when a command must compile them first."""
    return any(Path(_settings["CACHE_DIR"]).rglob("*.nbi"))


if "NUMBA_CACHE_DIR" not in os.environ:
    _settings["CACHE_DIR"] = str(cache_folder())

# nogil: populations run on threads. Unlike numba's own parallel layer these may be entered from
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

# To the type checker a compiled function is the function that it was compiled from: it takes the
# same arguments and returns the same values.
_Function = TypeVar("_Function", bound=Callable[..., object])


def jit(function: _Function) -> _Function:
    """Compile ``function`` at its first call, and keep the machine code on disk.

    The function must not make arrays. Then numba need not count references to those that it is
    given; at each call of an effect the count would take longer than the effect.
    """
    return cast(_Function, _compiled(function, _nrt=False))


def allocating(function: _Function) -> _Function:
    """Compile as ``jit`` does a function that makes arrays."""
    return cast(_Function, _compiled(function))


def inlined(function: _Function) -> _Function:
    """Compile ``function`` into its caller, so that literal arguments become constants there."""
    return cast(_Function, _compiled(function, _nrt=False, inline="always"))
