"""Addresses of the kernels that others call by name (``dearig.model.compiled.by_name``).

Before the linker makes or loads the code of a kernel, it needs the address of each kernel that this
one calls by name: a name that it cannot find ends the program.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

__all__ = ["PROVIDERS", "names_in", "provide"]

#: What compiles or loads a kernel and gives its address to the linker, by its name.
PROVIDERS: dict[str, Callable[[], None]] = {}
_provided: set[str] = set()


def provide(*names: str) -> None:
    """Let the linker find the kernels of these ``names``; the caller has numba's lock."""
    for name in names:
        if name not in _provided:
            PROVIDERS[name]()
            _provided.add(name)


def names_in(module: Any) -> tuple[str, ...]:
    """Return the names by which the code of an LLVM ``module`` calls kernels."""
    return tuple(f.name for f in module.functions if f.is_declaration and f.name in PROVIDERS)
