"""Interface of a rig's inputs at rest: they are read, and nothing is output."""

from __future__ import annotations

from typing import Protocol, runtime_checkable

import numpy as np

from dearig.drivers.channels import Channel
from dearig.drivers.rig_kind import RigOptions
from dearig.drivers.settings import RigSettings

__all__ = ["BLOCK_S", "Inputs", "ReadsInputs"]

#: s of samples in one read: NI recommends ten reads a second.
BLOCK_S = 0.1


class Inputs(Protocol):
    """Inputs of a rig that plays nothing, on a sample clock of their own.

    No method creates, starts or writes an output or the enable line, so that a voltage that is
    there for another reason is shown, not changed. Faults of the card raise ``RigError``. ``close``
    may be called more than once; afterwards the card is free for a run.
    """

    @property
    def channels(self) -> tuple[Channel, ...]:
        """Return the channels in the order of the rows: those of the rig without the command."""
        ...

    @property
    def rate(self) -> float:
        """Return the actual sample rate in Hz."""
        ...

    def read(self) -> np.ndarray:
        """Return counts (channels, n) int16 that are new, n being 0 after a wait without any."""
        ...

    def close(self) -> None:
        """Release the inputs."""
        ...


@runtime_checkable
class ReadsInputs(Protocol):
    """Kind of rig whose inputs can be read at rest; see ``RigKind``, which need not have it."""

    def open_inputs(self, address: str, settings: RigSettings, options: RigOptions) -> Inputs:
        """Return the inputs of the rig at ``address``, in real time.

        Raises ``AddressError`` for an address that names no rig, ``RigError`` where instruments are
        missing or in use.
        """
        ...
