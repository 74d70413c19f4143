"""The ways a command can end early, each with its exit code and one sentence for a person."""

from __future__ import annotations

__all__ = ["DearigError", "InputError", "InstrumentFault", "SafetyStop"]


class DearigError(Exception):
    """Something to tell the operator: what, where, and what to do; never a traceback."""

    exit_code = 1


class InputError(DearigError):
    """Bad input or usage; nothing was touched."""

    exit_code = 2


class SafetyStop(DearigError):  # noqa: N818  (the name of what happened)
    """A safety limit stopped the run; the rig was made safe."""

    exit_code = 3


class InstrumentFault(DearigError):  # noqa: N818
    """An instrument failed or is not there."""

    exit_code = 4
