"""Sign of a measured signal, seen by what drives it."""

from __future__ import annotations

import numpy as np

__all__ = ["sign_text"]

#: Correlation of signal and drive beyond which the sign is sure. That of displacement and squared
#: voltage is 0.7 to 1 for films with creep, friction or drift under sines, lobes and chirps, and
#: near 0 for noise alone.
_SURE = 0.5
#: Samples from which that correlation is computed, at most.
_THINNED = 2**17

_TEXTS = {
    "actuator": (
        "displacement falls where the voltage rises: is its sign right? A film gets longer under "
        "voltage, so its displacement grows"
    ),
    "film": (
        "stress falls where the stretch rises: is its sign right? A film that is pulled is in "
        "tension, and its stress is positive"
    ),
}


def sign_text(kind: str, drive: np.ndarray, signal: np.ndarray) -> str:
    """Return a sentence where ``signal`` (N,) falls while ``drive`` (N,) rises, else "".

    Missing readings are NaN, and do not count.
    ``kind`` is that of the recording. An actuator's drive is its voltage: the Maxwell stress goes
    with its square, so the sign of the voltage does not matter. A film's drive is its stretch.
    """
    # a part of the samples tells as much
    thinned = slice(None, None, max(-(-drive.size // _THINNED), 1))
    drive, signal = drive[thinned], signal[thinned]
    known = np.isfinite(signal)
    drive, signal = drive[known], signal[known]
    if drive.size == 0:
        return ""
    # relative to the largest: no square overflows
    relative = drive / max(float(drive.max()), -float(drive.min()), 1e-300)
    pull = relative if kind == "film" else relative**2
    pull = pull - pull.mean()
    moved = signal - signal.mean()
    size = float(np.linalg.norm(pull) * np.linalg.norm(moved))
    falls = size > 0.0 and float(pull @ moved) / size < -_SURE
    return _TEXTS[kind] if falls else ""
