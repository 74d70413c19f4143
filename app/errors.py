"""Errors that end a command early, each with its exit code and a sentence for the operator."""

from __future__ import annotations

from dearig.output_state import OutputState

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
    """An error whose text tells the operator what happened, where, and what to do.

    ``output_state`` is what is known of the rig's output where the error ended a run, and None
    where no rig was contacted.
    """

    exit_code = 1
    output_state: OutputState | None = None

    @property
    def needs_inspection(self) -> bool:
        """Whether a person must look at the rig before it is used again.

        True where an interlock or a fault ended a run, and where 0 V is not confirmed after it;
        False where no rig was contacted.
        """
        if self.output_state is None:
            return isinstance(self, NotSafe)
        return isinstance(self, SafetyStop | InstrumentFault) or not self.output_state.confirmed


class InputError(DearigError):
    """Wrong input or usage; nothing was changed."""

    exit_code = 2


class SafetyStop(DearigError):  # noqa: N818  (the name of what happened)
    """A safety limit stopped the run; the rig was made safe."""

    exit_code = 3


class InstrumentFault(DearigError):  # noqa: N818
    """An instrument failed or is missing."""

    exit_code = 4


class NotSafe(InstrumentFault):
    """The voltage may still be on: neither the run nor its guardian could bring it to 0 V."""


class DiskFault(DearigError):  # noqa: N818
    """The disk could not be written during a run; the rig was made safe.

    It has the exit code of an instrument fault: the input was right and the equipment failed.
    """

    exit_code = 4


class Interrupted(DearigError):  # noqa: N818
    """The operator stopped the work; after a run the rig was made safe."""

    exit_code = 130
