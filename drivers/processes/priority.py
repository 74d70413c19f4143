"""Priority of this process over others, and memory that is not swapped out.

A system grants them to an administrator or by its settings: on Linux ``rtprio``, ``nice`` and
``memlock`` of ``/etc/security/limits.conf``, on Windows the right to increase scheduling priority.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import re
import sys
from collections.abc import Callable
from pathlib import Path

__all__ = ["claim", "lower_priority"]

_REALTIME = 20  # of 1 to 99: above ordinary processes, below the kernel's interrupt threads at 50
_NICE = -20  # the highest priority among ordinary processes
_LOWER = 10  # added to the nice value: on a busy core, a tenth of an ordinary process's time

# from <sys/mman.h>: present and future pages, each locked when it is first used
_MCL_CURRENT, _MCL_FUTURE, _MCL_ONFAULT = 1, 2, 4
_CAP_IPC_LOCK = 14  # from <linux/capability.h>: to lock memory beyond the limit


def claim() -> tuple[list[str], list[str]]:
    """Ask for the highest priority and for locked memory, for all threads of this process.

    Returns what was granted and what was refused, each as text.
    """
    granted: list[str] = []
    refused: list[str] = []
    for alternatives in _requests():
        for words, request in alternatives:
            try:
                request()
            except (OSError, AttributeError) as error:
                refused.append(f"{words} ({error})")
            else:
                granted.append(words)
                break
    return granted, refused


def lower_priority() -> None:
    """Lower the priority of this process, for long computations next to a window or a run.

    On Linux, threads that have started already keep theirs.
    """
    if sys.platform == "win32":
        with contextlib.suppress(OSError):  # a lower priority than that is in force
            _windows_class(_BELOW_NORMAL_CLASS)
    else:
        os.nice(_LOWER)


def _requests() -> list[list[tuple[str, Callable[[], None]]]]:
    """Return the requests as text, grouped: the first one granted of each group suffices."""
    if sys.platform == "win32":
        return [
            [("real-time priority", lambda: _windows_class(_REALTIME_CLASS)),
             ("high priority", lambda: _windows_class(_HIGH_CLASS))],
            [("locked memory", _windows_working_set)],
        ]  # fmt: skip
    return [
        [("real-time priority", _realtime), ("high priority", _nice)],
        [("locked memory", _lock_memory)],
    ]


# ---------------------------------------------------------------- POSIX


def _threads() -> list[int]:
    """Return the threads of this process; on Linux each one has its own priority."""
    try:
        return [int(thread.name) for thread in Path("/proc/self/task").iterdir()]
    except FileNotFoundError:
        return [0]  # the process


def _realtime() -> None:
    """Give every thread the policy SCHED_FIFO, at most at the priority that the limit allows."""
    import resource

    hard = resource.getrlimit(resource.RLIMIT_RTPRIO)[1]
    priority = _REALTIME
    if os.geteuid() != 0 and hard != resource.RLIM_INFINITY:
        resource.setrlimit(resource.RLIMIT_RTPRIO, (hard, hard))
        priority = max(1, min(_REALTIME, hard))
    for thread in _threads():
        os.sched_setscheduler(thread, os.SCHED_FIFO, os.sched_param(priority))


def _nice() -> None:
    for thread in _threads():
        os.setpriority(os.PRIO_PROCESS, thread, _NICE)


def _lock_memory() -> None:
    """Lock all memory, unless a limit could make a later allocation fail."""
    import resource

    unlimited = resource.getrlimit(resource.RLIMIT_MEMLOCK)[0] == resource.RLIM_INFINITY
    if not (unlimited or _may_lock_beyond_limit()):
        raise OSError("the limit memlock is not unlimited")
    library = ctypes.CDLL(None, use_errno=True)
    if library.mlockall(_MCL_CURRENT | _MCL_FUTURE | _MCL_ONFAULT) != 0:
        code = ctypes.get_errno()
        raise OSError(code, os.strerror(code))


def _may_lock_beyond_limit() -> bool:
    found = re.search(rb"^CapEff:\s*([0-9a-f]+)", Path("/proc/self/status").read_bytes(), re.M)
    return found is not None and bool(int(found[1], 16) >> _CAP_IPC_LOCK & 1)


# ---------------------------------------------------------------- Windows

# from winbase.h and memoryapi.h
_BELOW_NORMAL_CLASS, _HIGH_CLASS, _REALTIME_CLASS = 0x4000, 0x80, 0x100
_WORKING_SET_MINIMUM_IS_HARD = 0x1
_WORKING_SET_SPARE = 32 << 20  # bytes above the present size

if sys.platform == "win32":
    from ctypes import wintypes

    _kernel = ctypes.WinDLL("kernel32", use_last_error=True)
    _kernel.GetCurrentProcess.restype = wintypes.HANDLE
    _kernel.GetPriorityClass.argtypes = (wintypes.HANDLE,)
    _kernel.SetPriorityClass.argtypes = (wintypes.HANDLE, wintypes.DWORD)
    _kernel.SetProcessWorkingSetSizeEx.argtypes = (
        wintypes.HANDLE, ctypes.c_size_t, ctypes.c_size_t, wintypes.DWORD,
    )  # fmt: skip
    _kernel.K32GetProcessMemoryInfo.argtypes = (wintypes.HANDLE, ctypes.c_void_p, wintypes.DWORD)

    class _Counters(ctypes.Structure):
        """PROCESS_MEMORY_COUNTERS."""

        _fields_ = (
            ("cb", wintypes.DWORD),
            ("PageFaultCount", wintypes.DWORD),
            *((name, ctypes.c_size_t) for name in (
                "PeakWorkingSetSize", "WorkingSetSize", "QuotaPeakPagedPoolUsage",
                "QuotaPagedPoolUsage", "QuotaPeakNonPagedPoolUsage", "QuotaNonPagedPoolUsage",
                "PagefileUsage", "PeakPagefileUsage",
            )),
        )  # fmt: skip

    def _windows_class(wanted: int) -> None:
        """Set the priority class; Windows grants a lower one without an error."""
        process = _kernel.GetCurrentProcess()
        if not _kernel.SetPriorityClass(process, wanted):
            raise ctypes.WinError(ctypes.get_last_error())
        if _kernel.GetPriorityClass(process) != wanted:
            raise OSError("a lower priority was granted")

    def _windows_working_set() -> None:
        """Keep the present memory, and some more, in the working set."""
        process, counters = _kernel.GetCurrentProcess(), _Counters()
        counters.cb = ctypes.sizeof(counters)
        if not _kernel.K32GetProcessMemoryInfo(process, ctypes.byref(counters), counters.cb):
            raise ctypes.WinError(ctypes.get_last_error())
        least = counters.WorkingSetSize + _WORKING_SET_SPARE
        if not _kernel.SetProcessWorkingSetSizeEx(
            process, least, 2 * least, _WORKING_SET_MINIMUM_IS_HARD
        ):
            raise ctypes.WinError(ctypes.get_last_error())
