"""The decorators that compile the numerical kernels, with a disk cache that cannot go stale.

Numba checks only the file that holds a function, not the files of the functions that it calls, so
a cached kernel would survive an edit of the spring it calls. The cache folder is therefore named
after the text of every source file that kernels are made of, those of other distributions' effects
included: a changed file means a new folder and one compilation.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
import platformdirs

from dearig.model.plugins import entry_points_found, source_files

__all__ = [
    "allocating",
    "cache_folder",
    "inlined",
    "is_compiled",
    "is_enabled",
    "jit",
    "use_cache_without",
]

_KERNEL_ROOT = Path(__file__).parent
_WITHOUT_KERNELS = ("diagnosis", "fitting")  # folders that compile nothing
# numba fills this module from the environment when it is imported: a type checker finds it empty
_settings: dict[str, Any] = vars(numba.config)


def _sources_digest(left_out: Iterable[str] = ()) -> str:
    digest = hashlib.sha256(numba.__version__.encode())
    for path in sorted(_KERNEL_ROOT.rglob("*.py")):
        if path.relative_to(_KERNEL_ROOT).parts[0] not in _WITHOUT_KERNELS:
            digest.update(path.read_bytes())
    for entry_point in entry_points_found():
        digest.update(f"{entry_point.name}={entry_point.value}".encode())
        for path in source_files(entry_point):
            digest.update(path.read_bytes())
    for name in left_out:
        digest.update(f"without {name}".encode())
    return digest.hexdigest()[:16]


def _folder(digest: str) -> Path:
    given = os.environ.get("NUMBA_CACHE_DIR", "")
    root = Path(given) if given else Path(platformdirs.user_cache_dir("dearig"))
    return root / f"kernels-{digest}"


def cache_folder() -> Path:
    """Return the folder of the compiled kernels of exactly these sources.

    It is in ``NUMBA_CACHE_DIR`` where that is set, else in the user's cache folder.
    """
    return Path(_settings["CACHE_DIR"])


def use_cache_without(left_out: Iterable[str]) -> None:
    """Change to the cache folder of kernels without some of the effects that were found.

    Sizes of arrays are compiled into the kernels. An effect that cannot be imported today may be
    imported tomorrow from the same source, so its absence counts as the sources do.
    """
    _settings["CACHE_DIR"] = str(_folder(_sources_digest(left_out)))


def is_enabled() -> bool:
    """Return False where numba was told to compile nothing (``NUMBA_DISABLE_JIT``)."""
    return not _settings["DISABLE_JIT"]


def is_compiled() -> bool:
    """Return True when a command starts at once, False when it must first compile the kernels."""
    return any(cache_folder().rglob("*.nbi"))


_settings["CACHE_DIR"] = str(_folder(_sources_digest()))

# nogil: populations run on threads. Unlike numba's own parallel layer, these may be entered from
# several Python threads at once, as in a window with a live overlay.
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

    It must make no arrays: numba then needs no reference counts, which at each call of an effect
    would take longer than the effect.
    """
    return cast(_Function, _compiled(function, _nrt=False))


def allocating(function: _Function) -> _Function:
    """Compile as ``jit`` does a function that makes arrays."""
    return cast(_Function, _compiled(function))


def inlined(function: _Function) -> _Function:
    """Compile as ``jit`` does, into the caller: literal arguments become constants there."""
    return cast(_Function, _compiled(function, _nrt=False, inline="always"))
