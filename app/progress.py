"""The callback by which long work reports its progress."""

from __future__ import annotations

from collections.abc import Callable

__all__ = ["Progress", "part", "quiet"]

#: Called with the name of a stage and the fraction of it that is done, 0 to 1.
Progress = Callable[[str, float], None]


def part(progress: Progress, first: float, last: float) -> Progress:
    """Return a callback whose fractions, 0 to 1, are ``first`` to ``last`` of ``progress``.

    It never goes back.
    """
    furthest = 0.0

    def report(stage: str, fraction: float) -> None:
        nonlocal furthest
        furthest = max(furthest, min(fraction, 1.0))
        progress(stage, first + furthest * (last - first))

    return report


def quiet(stage: str, fraction: float) -> None:
    """Ignore the progress."""
