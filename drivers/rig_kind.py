"""A kind of rig: how its addresses are written, and how it is opened and inspected."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

from dearig.drivers.findings import Finding
from dearig.drivers.rig import Rig
from dearig.drivers.settings import RigSettings

__all__ = ["RigKind", "RigOptions"]


@dataclass(frozen=True)
class RigOptions:
    """How a simulated rig is made; a real one has no use for any of it.

    ``film`` and ``load`` are the rig file's, ``actuator`` what takes their place, each as the model
    has them, which this layer does not know. ``seed`` is that of the noise, ``paced`` means real
    time, ``faults`` is the plan of what goes wrong.
    """

    film: Any
    load: Any
    actuator: Any = None
    seed: int = 0
    paced: bool = False
    faults: Any = None


@runtime_checkable
class RigKind(Protocol):
    """A kind of rig.

    Its addresses begin with its name in the registry; ``addresses`` are how they are written, for
    messages. ``simulated``: no instrument is touched; then faults and noise can be
    asked for, and the film needs no name.
    """

    addresses: tuple[str, ...]
    simulated: bool

    def open(self, address: str, settings: RigSettings, options: RigOptions) -> Rig:
        """Return the rig at ``address``, its output at 0 V.

        Raises ``AddressError`` for an address that names none, ``RigError`` where the instruments
        are not there.
        """
        ...

    def inspect(
        self, address: str, settings: RigSettings, options: RigOptions
    ) -> tuple[Finding, ...]:
        """Return what the instruments say, compared with ``settings``, without raising a volt.

        What is wrong is a finding. Raises ``AddressError`` for an address that names no rig.
        """
        ...
