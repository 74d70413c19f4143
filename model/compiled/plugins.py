"""Effects of other distributions, found by their entry points, without importing them.

The compiled kernels depend on the source of every effect, so ``dearig.model.compiled.jit`` must
know these sources before the first effect is imported; ``dearig.model.effects.registry`` imports
them.
"""

from __future__ import annotations

import importlib.util
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path

__all__ = ["GROUP", "entry_points_found", "origin", "source_files"]

#: The group of entry points that name a module with an effect.
GROUP = "dearig.effects"


@cache
def entry_points_found() -> tuple[EntryPoint, ...]:
    """Return the entry points of other distributions' effects, by distribution and name."""
    return tuple(sorted(entry_points(group=GROUP), key=lambda e: (origin(e), e.name, e.value)))


def origin(entry_point: EntryPoint) -> str:
    """Return the name and version of the distribution that an entry point belongs to."""
    distribution = entry_point.dist
    return f"{distribution.name} {distribution.version}" if distribution else "unknown"


def source_files(entry_point: EntryPoint) -> list[Path]:
    """Return the Python files of the top-level package or module of an entry point.

    Nothing is imported: an effect may call functions of any module of its package, so all count.
    The list is empty where no source is found.
    """
    top = entry_point.module.partition(".")[0]
    try:
        spec = importlib.util.find_spec(top)
    except (ImportError, ValueError):  # ValueError: a module without a spec, as __main__
        return []
    if spec is None:
        return []
    if spec.submodule_search_locations is not None:
        folders = map(Path, spec.submodule_search_locations)
        return sorted(path for folder in folders for path in folder.rglob("*.py"))
    return [Path(spec.origin)] if spec.origin and Path(spec.origin).is_file() else []
