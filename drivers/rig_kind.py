"""Interface of a kind of rig: its addresses, and how it is opened and inspected."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

from dearig.drivers.instruments.findings import Finding
from dearig.drivers.rig import Rig
from dearig.drivers.settings import RigSettings

__all__ = ["RigKind", "RigOptions"]


@dataclass(frozen=True)
class RigOptions:
    """Options of a simulated rig; a real one ignores them.

    ``film`` and ``load`` come from the rig file; ``actuator`` replaces them. Their types belong to
    the model, which this layer does not import. ``seed`` is that of the noise, ``paced`` means real
    time, ``faults`` is the plan of faults.
    """

    film: Any
    load: Any
    actuator: Any = None
    seed: int = 0
    paced: bool = False
    faults: Any = None


@runtime_checkable
class RigKind(Protocol):
    """Kind of rig.

    Its addresses begin with its name in the registry; ``addresses`` are their forms, for messages.
    With ``simulated`` no instrument is accessed; faults and noise can then be requested, and the
    film needs no name.
    """

    addresses: tuple[str, ...]
    simulated: bool

    def open(self, address: str, settings: RigSettings, options: RigOptions) -> Rig:
        """Return the rig at ``address``, its output at 0 V.

        Raises ``AddressError`` for an address that names none, ``RigError`` where instruments are
        missing.
        """
        ...

    def inspect(
        self, address: str, settings: RigSettings, options: RigOptions
    ) -> tuple[Finding, ...]:
        """Return the instruments' state compared with ``settings``, without any output voltage.

        Faults are findings. Raises ``AddressError`` for an address that names no rig.
        """
        ...
