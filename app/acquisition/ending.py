"""Ways in which a run leaves a rig: a ramp to 0 V, 0 V at once, closed."""

from __future__ import annotations

import logging

from dearig.acquisition.output import after_run, unknown
from dearig.drivers.errors import RigError
from dearig.drivers.rig import Rig
from dearig.errors import DearigError, NotSafe

__all__ = ["close", "make_safe", "ramp_down"]

log = logging.getLogger(__name__)

_NOT_CONFIRMED = "0 V IS NOT CONFIRMED, switch the amplifier's high voltage off by hand"


def ramp_down(rig: Rig) -> None:
    """Ramp down to 0 V in the set time; the samples read meanwhile are discarded."""
    try:
        rig.stop()
        while rig.read() is not None:
            pass
    except RigError as error:
        log.warning("the ramp down failed (%s); the output is taken to 0 V at once", error)


def make_safe(rig: Rig) -> None:
    """Take the output to 0 V at once. Raises ``NotSafe`` where that failed."""
    try:
        rig.make_safe()
    except RigError as error:
        raise NotSafe(f"THE RIG COULD NOT BE MADE SAFE ({error}): {_NOT_CONFIRMED}") from error


def close(rig: Rig, ended_by: BaseException | None) -> None:
    """Close the rig after a run that ended by an error, or by none."""
    try:
        rig.close()
    except RigError as error:
        if isinstance(ended_by, NotSafe):
            log.warning("the rig could not be closed either: %s", error)
            return
        also = f"; {ended_by}" if isinstance(ended_by, DearigError) else ""
        fault = NotSafe(f"THE RIG COULD NOT BE CLOSED ({error}): {_NOT_CONFIRMED}{also}")
        fault.output_state = unknown(rig)
        raise fault from error
    if isinstance(ended_by, DearigError) and ended_by.output_state is None:
        # the run ended before its first sample: opening and closing the rig has set 0 V
        ended_by.output_state = after_run(rig)
