"""Errors of rigs and of the gate."""

from __future__ import annotations

__all__ = ["AddressError", "RefusedWaveform", "RigError", "RigStateError"]


class RigError(Exception):
    """A fault of an instrument: what failed, its code if any, the likely cause, what to do."""

    def __init__(self, message: str, code: int | None = None) -> None:
        super().__init__(message)
        self.code = code


class RigStateError(RigError):
    """A call that the rig cannot take in its present state."""


class AddressError(ValueError):
    """An address that names no rig; the message says how addresses are written."""


class RefusedWaveform(ValueError):  # noqa: N818  (it is a refusal, and reads as one)
    """A waveform that the gate refuses; ``reasons`` has one sentence for each broken limit."""

    def __init__(self, reasons: tuple[str, ...]) -> None:
        super().__init__("; ".join(reasons))
        self.reasons = reasons
