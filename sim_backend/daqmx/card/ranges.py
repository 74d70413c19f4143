"""Limits of a channel in V, and the range of the card that includes them."""

from __future__ import annotations

from collections.abc import Sequence

from dearig.sim_backend.daqmx.card.errors import Code, DaqmxError

__all__ = ["check_order", "fitting_range", "smallest_range"]


def smallest_range(limits: tuple[float, float], offered: Sequence[float]) -> float:
    """Return the smallest of the ranges ``offered`` in V that includes ``limits``."""
    check_order(limits)
    return fitting_range(limits, offered)


def check_order(limits: tuple[float, float]) -> None:
    """Refuse limits whose minimum is not below their maximum."""
    low, high = limits
    if not low < high:
        raise DaqmxError(
            Code.MIN_NOT_LESS_THAN_MAX, f"Minimum Value: {low:g}; Maximum Value: {high:g}"
        )


def fitting_range(limits: tuple[float, float], offered: Sequence[float]) -> float:
    """Return the smallest of the ranges ``offered`` in V that includes both ``limits``."""
    low, high = limits
    fitting = [r for r in offered if max(abs(low), abs(high)) <= r * (1.0 + 1e-9)]
    if not fitting:
        raise DaqmxError(
            Code.INVALID_VALUE,
            f"Property: Max or Min; Requested Values: {low:g}, {high:g}; Largest Range: "
            f"+-{max(offered):g} V",
        )
    return min(fitting)
