"""Ends of a run that an operator may allow to be repeated without a look at the rig."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Literal

from dearig.drivers.errors import RigError
from dearig.errors import DearigError

__all__ = ["SAFE_ENDS", "SafeEnd", "is_safe_end"]

SafeEnd = Literal["input-overflow", "output-underflow"]
#: DAQmx's codes of each: the computer was too slow for the card, and nothing else has failed.
SAFE_ENDS: Mapping[SafeEnd, tuple[int, ...]] = MappingProxyType(
    {"input-overflow": (-200279, -200361), "output-underflow": (-200290, -200621)}
)


def is_safe_end(error: DearigError, named: Sequence[SafeEnd]) -> bool:
    """Return True if ``error`` is one of the ``named`` ends of a run that set 0 V itself.

    The voltage monitor has to have confirmed 0 V.
    """
    fault, state = error.__cause__, error.output_state
    if not isinstance(fault, RigError) or state is None:
        return False
    codes = [code for name in named for code in SAFE_ENDS[name]]
    return fault.code in codes and state.confirmed and not state.by_guardian
