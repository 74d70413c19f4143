"""Kernels that others call by name: never code whose callee the linker cannot find."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numba
import numpy as np
import pytest
from numba.core.errors import TypingError

from dearig.model.compiled.addresses import names_in
from dearig.model.compiled.by_name import by_name
from dearig.model.compiled.jit import jit

#: A kernel that is called by name, one that calls it, and one that calls both.
KERNELS = """
from dearig.model.compiled.by_name import by_name
from dearig.model.compiled.jit import jit

@by_name("UniTuple(float64, 2)(int64, float64[::1])")
def ends(n, a):
    return a[0] * n, a[a.shape[0] - 1]

@by_name("float64(float64[::1])")
def span(a):
    first, last = ends(2, a)
    return last - first

@jit
def both(a):
    first, last = ends(1, a)
    return span(a) + first + last
"""
RUN = """
import sys
sys.path.insert(0, {folder!r})
import numpy as np
import kernels
a = np.array([1.0, 5.0, 7.0])
counted = getattr(kernels.both, "stats", None)
print(kernels.both(a), kernels.span(a), *kernels.ends(3, a))
print(sum(counted.cache_hits.values()) if counted else "not compiled")
"""


def run(folder: Path, **environment: str) -> list[str]:
    """What the kernels return in a process of their own, and how many were found compiled."""
    (folder / "kernels.py").write_text(KERNELS, encoding="utf-8")
    clean = {k: v for k, v in os.environ.items() if not k.startswith("NUMBA_")}
    ended = subprocess.run(
        [sys.executable, "-c", RUN.format(folder=str(folder))],
        env={**clean, "NUMBA_CACHE_DIR": str(folder / "cache"), **environment},
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert ended.returncode == 0, ended.stderr
    return ended.stdout.splitlines()


def test_callers_find_it_compiled_or_read_or_compiled_again(tmp_path: Path) -> None:
    values = "13.0 5.0 3.0 7.0"
    assert run(tmp_path) == [values, "0"]
    assert run(tmp_path) == [values, "1"]
    # the cache has the caller, and not the kernel that the caller calls
    gone = [p for p in (tmp_path / "cache").rglob("*.nb?") if p.name.startswith("kernels.ends")]
    assert len(gone) == 2
    for path in gone:
        path.unlink()
    assert run(tmp_path) == [values, "1"]
    assert run(tmp_path, NUMBA_DISABLE_JIT="1") == [values, "not compiled"]


@by_name("float64(float64, float64[::1])")
def scaled(factor: float, values: np.ndarray) -> float:
    total = 0.0
    for i in range(values.size):
        total += factor * values[i]
    return total


@jit
def caller(values: np.ndarray) -> float:
    return scaled(2, values)


@jit
def caller_of_any(values: np.ndarray) -> float:
    return scaled(2, values[::2])


def test_the_caller_has_the_name_and_not_the_code() -> None:
    values = np.arange(4.0)
    assert caller(values) == scaled(2.0, values) == 12.0
    # compiled here: the code of a kernel read from the cache is no longer there to be looked at
    anew = numba.njit(caller.py_func, _nrt=False)  # type: ignore[attr-defined]
    assert anew(values) == 12.0
    compiled = anew.overloads[anew.signatures[0]]
    assert names_in(compiled.library._final_module) == (f"{__name__}.scaled",)


def test_other_types_are_refused_when_the_caller_is_compiled() -> None:
    with pytest.raises(TypingError, match="scaled"):
        caller_of_any(np.arange(4.0))
