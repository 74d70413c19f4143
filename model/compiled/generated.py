"""Compiled functions whose source a program writes: numba needs real functions, and a file of them.

The file lies next to the compiled kernels, in the folder that is named after all sources.
"""

from __future__ import annotations

import os
import sys
import tempfile
from pathlib import Path
from types import ModuleType

from dearig.model.compiled.jit import cache_folder

__all__ = ["generated_module"]


def generated_module(name: str, text: str) -> ModuleType:
    """Return the module ``name`` with the source ``text``; numba can cache its functions.

    Where the file cannot be written, the functions are compiled in each process.
    """
    path = _written(f"{name.rpartition('.')[2]}.py", text)
    module = ModuleType(name)
    module.__file__ = str(path) if path else None
    sys.modules[name] = module
    code = compile(text, str(path) if path else f"<{name}>", "exec")
    exec(code, module.__dict__)  # noqa: S102  (callers make the text from names that are checked)
    return module


def _written(name: str, text: str) -> Path | None:
    """Return the file ``name`` with ``text`` in the cache folder; None if it cannot be written."""
    folder = cache_folder()
    if folder is None:
        return None
    path = folder / name
    # Written once and atomically: numba compares its modification time with the compiled kernels'.
    try:
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            handle, partial = tempfile.mkstemp(dir=folder, suffix=".py")
            try:
                with os.fdopen(handle, "w", encoding="utf-8") as file:
                    file.write(text)
                Path(partial).replace(path)
            finally:
                Path(partial).unlink(missing_ok=True)
    except (OSError, UnicodeDecodeError):
        return None
    return path
