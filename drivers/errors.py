"""What a rig or its gate can refuse or report."""

from __future__ import annotations

__all__ = ["AddressError", "RefusedWaveform", "RigError", "RigStateError"]


class RigError(Exception):
    """An instrument fault: what failed, its code if it has one, the likely cause, what to do."""

    def __init__(self, message: str, code: int | None = None) -> None:
        super().__init__(message)
        self.code = code


class RigStateError(RigError):
    """A call that the rig cannot take in the state it is in."""


class AddressError(ValueError):
    """A rig address that no driver understands; the message says what is understood."""


class RefusedWaveform(ValueError):  # noqa: N818  (it is a refusal, and reads as one)
    """A waveform that the gate does not let pass; ``reasons`` has one sentence for each limit."""

    def __init__(self, reasons: tuple[str, ...]) -> None:
        super().__init__("; ".join(reasons))
        self.reasons = reasons
