"""Errors of rigs and of the gate."""

from __future__ import annotations

__all__ = [
    "AddressError",
    "ChangedWaveform",
    "LinkRefused",
    "NotAtZero",
    "RefusedWaveform",
    "RigError",
    "RigStateError",
]


class RigError(Exception):
    """Fault of an instrument: what failed, its code if any, the likely cause, what to do."""

    def __init__(self, message: str, code: int | None = None) -> None:
        super().__init__(message)
        self.code = code


class NotAtZero(RigError):  # noqa: N818  (the name says what was measured)
    """Voltage monitor that reads ``voltage`` V at the film after the output was set to 0 V."""

    def __init__(self, message: str, voltage: float) -> None:
        super().__init__(message)
        self.voltage = voltage


class RigStateError(RigError):
    """Call that is not allowed in the rig's present state."""


class LinkRefused(RigError):  # noqa: N818  (the name says that it is a refusal)
    """Connection to a card that the rig file does not allow or does not describe completely."""


class ChangedWaveform(RigError):  # noqa: N818  (the name says what happened)
    """Waveform whose samples, computed again, are not those that passed the gate."""


class AddressError(ValueError):
    """Address that names no rig; the message says how addresses are written."""


class RefusedWaveform(ValueError):  # noqa: N818  (the name says that it is a refusal)
    """Waveform that the gate refuses; ``reasons`` has one sentence for each broken limit."""

    def __init__(self, reasons: tuple[str, ...]) -> None:
        super().__init__("; ".join(reasons))
        self.reasons = reasons
