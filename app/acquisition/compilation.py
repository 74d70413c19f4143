"""Progress of a compilation: the number of kernels compiled so far, and the number needed.

Numba compiles a kernel with all kernels that it calls, and sends an event for each. The kernels
that will be needed are found from the names in the code of each function, so that their number
is known before the first is ready.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from types import CodeType, FunctionType, ModuleType
from typing import Any

from numba.core import event
from numba.core.dispatcher import Dispatcher

from dearig.model.kernel.drive import drive_by_voltage
from dearig.model.kernel.rest import rest_stretch
from dearig.model.kernel.sensor import read_sensor

__all__ = ["compilation_reported", "kernels_of"]

_COMPILATION = "numba:compile"  # numba's name of the event
_MODEL: tuple[Callable[..., object], ...] = (drive_by_voltage, read_sensor, rest_stretch)


@contextmanager
def compilation_reported(
    report: Callable[[int, int], None], expected: Iterable[Callable[..., object]] = ()
) -> Iterator[None]:
    """Call ``report`` with kernels ready and needed, while the body runs and compiles any.

    Needed are those of the model and of ``expected``, functions that the body is going to call;
    others are counted once a call needs them. ``report`` is called in whichever thread compiles.
    """
    counter = _Counter(report, (*_MODEL, *expected))
    with event.install_listener(_COMPILATION, counter):
        yield


class _Counter(event.Listener):
    """Counts the kernels of the calls that had to compile something."""

    def __init__(
        self, report: Callable[[int, int], None], expected: Iterable[Callable[..., object]]
    ) -> None:
        self._report = report
        self._expected = expected
        self._needed: set[Dispatcher] = set()  # looked for once something is compiled
        self._lock = threading.Lock()

    def on_start(self, event: event.Event) -> None:
        self._count(event.data["dispatcher"])

    def on_end(self, event: event.Event) -> None:
        self._count(event.data["dispatcher"])

    def _count(self, compiled: Dispatcher) -> None:
        if not _is_kernel(compiled):
            return
        with self._lock:
            if not self._needed:
                self._needed = kernels_of(*self._expected)
            if compiled not in self._needed:
                self._needed |= kernels_of(compiled)
            needed = len(self._needed)
            ready = sum(bool(kernel.signatures) for kernel in self._needed)
        self._report(ready, needed)


def kernels_of(*functions: Callable[..., object] | Dispatcher) -> set[Dispatcher]:
    """Return the kernels that calls of ``functions`` can reach, themselves included.

    What is compiled into its callers is passed through and not counted.
    """
    met: set[int] = set()
    kernels: set[Dispatcher] = set()
    left: list[object] = list(functions)
    while left:
        function = left.pop()
        if id(function) in met:
            continue
        met.add(id(function))
        if isinstance(function, Dispatcher):
            if _is_kernel(function):
                kernels.add(function)
            function = function.py_func
        if isinstance(function, FunctionType):
            left += filter(_is_ours, _used(function))
    return kernels


def _is_ours(value: object) -> bool:
    """Return whether ``value`` is a kernel, or a function of this package that may call one."""
    if isinstance(value, FunctionType):
        return value.__module__.startswith("dearig.")
    return isinstance(value, Dispatcher)


def _is_kernel(function: Dispatcher) -> bool:
    """Return whether ``function`` is compiled as a kernel of its own."""
    options: dict[str, Any] = function.targetoptions
    if options.get("inline") == "always" or options.get("forceinline"):
        return False
    return not str(function.py_func.__module__).startswith("numba.")


def _used(function: FunctionType) -> Iterator[object]:
    """Yield the values that ``function`` refers to: globals, members of modules, closures."""
    names = _names(function.__code__)
    for cell in function.__closure__ or ():
        yield from _members(cell.cell_contents)
    for name in names & function.__globals__.keys():
        value = function.__globals__[name]
        if isinstance(value, ModuleType):
            yield from (getattr(value, within, None) for within in names)
        else:
            yield from _members(value)


def _members(value: object) -> Iterable[object]:
    return value if isinstance(value, tuple | list) else (value,)


def _names(code: CodeType) -> set[str]:
    """Return the names that ``code`` and the functions within it use."""
    within = [constant for constant in code.co_consts if isinstance(constant, CodeType)]
    return set(code.co_names).union(*map(_names, within))
