"""Recordings whose runs ended early: warned of, cut or left out before they are fitted."""

from __future__ import annotations

from collections.abc import Sequence

from dearig.errors import InputError
from dearig.recording.reading.early_end import cut_end, early_end
from dearig.recording.reading.recording import Recording

__all__ = ["CHOICES", "choose", "early_end_warnings"]

#: What is done with a recording whose run ended early: it is used as it is, without the samples
#: that may show a fault, or not at all.
CHOICES = ("keep", "cut", "leave-out")


def choose(recordings: Sequence[Recording], choice: str) -> tuple[list[Recording], list[str]]:
    """Return the recordings to use, and a sentence on each that is left out.

    ``choice`` is one of ``CHOICES``. Raises ``InputError`` where none is left.
    """
    if choice not in CHOICES:
        raise InputError(f"ended_early = {choice!r} is not one of {', '.join(CHOICES)}")
    if choice == "cut":
        return [cut_end(r) for r in recordings], []
    used, said = [], []
    for recording in recordings:
        end = early_end(recording) if choice == "leave-out" else None
        if end is None:
            used.append(recording)
        else:
            said.append(f"{recording.name} {end.sentence}; it is left out")
    if recordings and not used:
        raise InputError(
            f"every recording is left out, as its run ended early: {'; '.join(said)}; use them "
            f"with their ends cut, or record again"
        )
    return used, said


def early_end_warnings(recordings: Sequence[Recording]) -> tuple[str, ...]:
    """Return a sentence on each recording whose run ended early."""
    ended = ((recording.name, early_end(recording)) for recording in recordings)
    return tuple(f"{name} {end.sentence}" for name, end in ended if end is not None)
