"""The ways a command can end early, each with its exit code and one sentence for a person."""

from __future__ import annotations

__all__ = [
    "DearigError",
    "DiskFault",
    "InputError",
    "InstrumentFault",
    "Interrupted",
    "NotSafe",
    "SafetyStop",
]


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


class NotSafe(InstrumentFault):
    """The voltage may still be up: neither the run nor its guardian could bring it down."""


class DiskFault(DearigError):  # noqa: N818
    """The disk took no more during a run; the rig was made safe.

    It counts with the instruments: the input was good, and something that records failed.
    """

    exit_code = 4


class Interrupted(DearigError):  # noqa: N818
    """The operator ended a run; the rig was made safe."""

    exit_code = 130
