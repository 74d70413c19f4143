"""The decorators that compile the numerical kernels, with a disk cache that cannot go stale.

Numba checks only the file that holds a function, not the files of the functions that it calls, so
a cached kernel would survive an edit of the spring it calls. The cache folder is therefore named
after the text of every source file that kernels are made of, those of other distributions' effects
included: a changed file means a new folder and one compilation.

A cached kernel is machine code that this process will run, so the folder must be trusted
(``dearig.model.compiled.trusted_folder``). The cache only saves time: a kernel that cannot be read
from it is compiled, one that cannot be written to it is used all the same, and without a trusted
folder nothing is kept.
"""

from __future__ import annotations

import contextlib
import hashlib
import logging
import os
from collections.abc import Callable, Iterable
from functools import cache
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
import numpy as np
from numba.core.caching import (
    CompileResultCacheImpl,
    FunctionCache,
    UserProvidedCacheLocator,
)
from numba.core.runtime.nrt import rtsys

from dearig.model.compiled.addresses import names_in, provide
from dearig.model.compiled.plugins import entry_points_found, source_files
from dearig.model.compiled.trusted_folder import CacheFolder, cache_root, distrust_content, usable

__all__ = [
    "INTO_CALLER",
    "allocating",
    "cache_folder",
    "cache_note",
    "inlined",
    "is_compiled",
    "is_enabled",
    "jit",
    "read_only",
    "use_cache_without",
]

log = logging.getLogger(__name__)

_KERNEL_ROOT = Path(__file__).parents[1]
_WITHOUT_KERNELS = ("control", "diagnosis", "fitting", "residual")  # folders that compile nothing
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


def _folder(digest: str) -> CacheFolder:
    """Return the folder of the kernels, private and checked with all its content."""
    root = cache_root(os.environ.get("NUMBA_CACHE_DIR", ""))
    if root.path is None:
        return root
    # Another user may have written files before the folder was closed to others: a folder with
    # such files is left alone, and the next name is taken.
    for name in (f"kernels-{digest}", f"kernels-{digest}-private"):
        path, note = usable(root.path / name)
        if path is not None and (reason := distrust_content(path)):
            path, note = None, f"{path} is not used: {reason}"
        if path is not None:
            return CacheFolder(path, root.note)
        root = CacheFolder(root.path, "; ".join(filter(None, (root.note, note))))
    return CacheFolder(None, root.note)


_folders: list[CacheFolder] = []  # the last one is in use


def _use(digest: str) -> None:
    folder = _folder(digest)
    _folders[:] = [folder]
    _settings["CACHE_DIR"] = "" if folder.path is None else str(folder.path)
    # the variable NUMBA_CACHE_LOCATOR_CLASSES would send numba to folders that no one has checked
    _settings["CACHE_LOCATOR_CLASSES"] = ""
    if folder.note:
        log.info("cache of compiled kernels: %s", folder.note)


def cache_folder() -> Path | None:
    """Return the folder of the compiled kernels of exactly these sources; None without a cache.

    It is in ``NUMBA_CACHE_DIR`` where that is set, else in the user's cache folder; where that
    cannot be used it is in a private folder among the temporary files.
    """
    return _folders[-1].path


def cache_note() -> str:
    """Return why the cache is not in its usual place, or why there is none; "" if it is."""
    return _folders[-1].note


def use_cache_without(left_out: Iterable[str]) -> None:
    """Change to the cache folder of kernels without some of the effects that were found.

    Sizes of arrays are compiled into the kernels. An effect that cannot be imported today may be
    imported tomorrow from the same source, so its absence counts as the sources do.
    """
    _use(_sources_digest(left_out))


def is_enabled() -> bool:
    """Return False where numba was told to compile nothing (``NUMBA_DISABLE_JIT``)."""
    return not _settings["DISABLE_JIT"]


def is_compiled() -> bool:
    """Return True when a command starts at once, False when it must first compile the kernels."""
    folder = cache_folder()
    return folder is not None and any(folder.rglob("*.nbi"))


_use(_sources_digest())

# nogil: populations run on threads. Unlike numba's own parallel layer, these may be entered from
# several Python threads at once, as in a window with a live overlay.
# error_model="numpy": a division by zero gives inf, which the status checks catch, no exception.
# reassoc lets loops over branches use vector units; NaN and inf keep their meaning.
# no_cfunc_wrapper: no kernel is called as a function of C; a twelfth of the compilation.
_options: dict[str, Any] = {
    "nogil": True,
    "no_cfunc_wrapper": True,
    "error_model": "numpy",
    "fastmath": {"contract", "arcp", "nsz", "reassoc"},
}

#: The same of what becomes a part of its callers' machine code (``numba.extending.overload``).
INTO_CALLER = {**_options, "_nrt": False, "forceinline": True}

# To the type checker a compiled function is the function that it was compiled from: it takes the
# same arguments and returns the same values.
_Function = TypeVar("_Function", bound=Callable[..., object])


@cache
def _content_stamp(path: str) -> str:
    """Return a digest of the file and of its neighbours, whose functions a kernel may contain."""
    digest = hashlib.sha256(Path(path).read_bytes())
    folder = Path(path).parent
    # what is generated stands in the cache itself, which is named after all that it contains
    if folder != cache_folder():
        for neighbour in sorted(folder.glob("*.py")):
            digest.update(neighbour.read_bytes())
    return digest.hexdigest()


class _Locator(UserProvidedCacheLocator):
    """Keep a function's kernels under the name of its module and the content of its folder.

    Numba's own locators use the file's path and modification time, so that each checkout of the
    same sources would compile its kernels again.
    """

    def __init__(self, py_func: Callable[..., object], py_file: str) -> None:
        cast(Any, super()).__init__(py_func, py_file)
        self._cache_path = str(Path(_settings["CACHE_DIR"]) / py_func.__module__)

    def get_source_stamp(self) -> str:
        """Return what has to be the same for a kernel to be used again."""
        return _content_stamp(self._py_file)


class _Implementation(CompileResultCacheImpl):
    _locator_classes = [_Locator]  # noqa: RUF012  (numba's own type of it)

    def reduce(self, cres: Any) -> Any:
        """Return what is written of a kernel, with the names by which it calls others."""
        return names_in(cres.library._final_module), cast(Any, super()).reduce(cres)

    def rebuild(self, target_context: Any, payload: Any) -> Any:
        """Return the kernel that was read; first let the linker find those that it calls."""
        names, reduced = payload
        provide(*names)
        return cast(Any, super()).rebuild(target_context, reduced)


class _FunctionCache(FunctionCache):
    _impl_class = _Implementation

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return the kernel read for ``sig``; None where there is none.

        Numba's own method first imports all that its compiler knows. Code that is read needs only
        the names of numba's run-time library, and the compiler imports the rest where it has to
        compile.
        """
        rtsys.initialize(target_context)
        return cast(Any, super())._load_overload(sig, target_context)


class _Cache:
    """Numba's cache of one function, whose failures cost time and never a result.

    Numba itself raises at a damaged file (power failure), a full disk and a folder that has gone.
    """

    def __init__(self, function: Callable[..., object]) -> None:
        self._kept: Any = cast(Any, _FunctionCache)(function)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._kept, name)

    def load_overload(self, signature: object, target: object) -> Any:
        """Return the kernel compiled for ``signature``; None where there is none to be read."""
        try:
            return self._kept.load_overload(signature, target)
        except Exception as error:  # noqa: BLE001  (damaged pickles raise whatever they like)
            log.info("a compiled kernel cannot be read, and is compiled again: %r", error)
            with contextlib.suppress(OSError):
                self._kept.flush()  # else numba reads the damaged index again before it writes
            return None

    def save_overload(self, signature: object, compiled: object) -> None:
        """Write a kernel to the cache, if that is possible."""
        try:
            self._kept.save_overload(signature, compiled)
        except OSError as error:
            log.info("a compiled kernel is not kept: %s", error)


def _compile(function: _Function, **options: Any) -> _Function:
    dispatcher = numba.njit(function, **_options, **options)
    if is_enabled() and cache_folder() is not None:
        # RuntimeError: numba finds the folder no longer writable, or the function has no file
        with contextlib.suppress(RuntimeError):
            dispatcher._cache = _Cache(function)
    return cast(_Function, dispatcher)


def jit(function: _Function) -> _Function:
    """Compile ``function`` at its first call, and keep the machine code on disk.

    It must make no arrays: numba then needs no reference counts, which at each call of an effect
    would take longer than the effect.
    """
    return _compile(function, _nrt=False)


def allocating(function: _Function) -> _Function:
    """Compile as ``jit`` does a function that makes arrays."""
    return _compile(function)


def inlined(function: _Function) -> _Function:
    """Compile as ``jit`` does, into the caller: literal arguments become constants there."""
    return _compile(function, _nrt=False, inline="always")


def read_only(array: np.ndarray) -> np.ndarray:
    """Return a view of ``array`` that cannot be written.

    To numba an array that can be written is of another type, for which it compiles a kernel again:
    half a minute where a record comes from a file after one that was computed.
    """
    view = array.view()
    view.flags.writeable = False
    return view
