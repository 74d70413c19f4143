"""Table of the LK-G5000's commands on RS-232C, with the meaning of its numbers.

Nothing here was tried on hardware, and the controller's own manual was not available. The table is
compiled from published sources; correct it here where the manual differs.

- Framing, the error reply ``ER,command,code``, the form of values, ``+FFFFFFF`` and ``XXXXXXXX``:
  user's manual of the older LK-G series (LK-G-M-NO5-E, pages 5-5, 5-6).
- ``MS`` with two digits for OUT, ``Q0``, ``R0``, codes 50 to 99, times of mode changes: open-source
  programs for the LK-G5000, which use them. ``VS``, ``WS``, ``PR``, ``SR,CA``, ``SR,OC``: likewise.
- ``SR,OB``, ``OD``, ``OG``, ``OI``: programs that read all settings of an LK-G5000, and for each
  another program that names it. ``SR,OH`` as the analog scaling is the only one left over in that
  list, whose order is that of the functions in the maker's library. It is the least certain one.
- The numbers of the sampling cycles, filters and the like: header of the maker's library.

In its measuring mode the controller accepts measurement commands only. In its setting mode it
accepts settings only and does not measure. It reports no type, serial number or firmware version.
Which analog output carries which OUT (``SR,CG``) is not queried: sources disagree about the order
of its numbers.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

__all__ = [
    "AVERAGING",
    "CALCULATIONS",
    "COMMANDS",
    "DISPLAY_UNITS",
    "ERRORS",
    "FILTERS",
    "QUANTITIES",
    "SAMPLING_US",
    "STATUS_ERROR",
    "SerialCommand",
]

_VALUE = re.compile(r"[+-](?=.{7}$)\d+\.?\d*|[+-]F{7}|X{8}|-{8}")  # a sign and seven characters
_SETTING = re.compile(r"[+-](?=.{6,8}$)\d+\.?\d*")
_CHOICE = re.compile(r"\d")  # one digit; two digits are the OUT of a truncated reply
_NUMBER = re.compile(r"\d{1,2}")

_REPLY = 0.5  # s; replies take some 20 ms, or the time of a new average
_MODE_CHANGE = 6.0  # s; a change takes 0.6 s, and 0.75 s more for each extension unit


@dataclass(frozen=True)
class SerialCommand:
    """Command: ``letters`` with a place for OUT, ``values`` of the reply, s to wait for it."""

    letters: str
    values: tuple[re.Pattern[str], ...] = ()
    timeout: float = _REPLY

    def text(self, out: int) -> str:
        """Return the command for OUT ``out``, without its terminator."""
        return self.letters.format(out=out)


COMMANDS = {
    "program": SerialCommand("PR", (_NUMBER,)),
    "measured value": SerialCommand("MS,{out:02d}", (_VALUE,)),
    "setting mode": SerialCommand("Q0", timeout=_MODE_CHANGE),
    "measuring mode": SerialCommand("R0", timeout=_MODE_CHANGE),
    # the following commands work in the setting mode only
    "sampling cycle": SerialCommand("SR,CA", (_CHOICE,)),
    "measurement scaling": SerialCommand("SR,OB,{out:02d}", (_SETTING,) * 4),
    "filter": SerialCommand("SR,OC,{out:02d}", (_CHOICE,) * 2),
    "calculation": SerialCommand("SR,OD,{out:02d}", (_CHOICE,)),
    "display unit": SerialCommand("SR,OG,{out:02d}", (_CHOICE,)),
    "analog scaling": SerialCommand("SR,OH,{out:02d}", (_SETTING,) * 4),
    "quantity": SerialCommand("SR,OI,{out:02d}", (_CHOICE,)),
}

SAMPLING_US = (2.55, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0)
AVERAGING = tuple(4**i for i in range(10))
FILTERS = ("moving average", "low-pass filter", "high-pass filter")
CALCULATIONS = (
    "normal", "peak hold", "bottom hold", "peak-to-peak hold", "sample hold", "average hold",
)  # fmt: skip
QUANTITIES = ("displacement", "speed", "acceleration")
#: Unit of a displayed value and its smallest step, both in m.
DISPLAY_UNITS = (
    (1e-3, 1e-5), (1e-3, 1e-6), (1e-3, 1e-7), (1e-3, 1e-8),
    (1e-6, 1e-7), (1e-6, 1e-8), (1e-6, 1e-9),
)  # fmt: skip

STATUS_ERROR = 51  #: the command is not valid in the controller's present mode

_DIFFERS = (
    "the letters may differ in this unit: compare drivers/keyence/commands.py with its manual"
)
_OLDER = "an older LK-G, which has other commands, replies like this"
#: Meaning of each error code, and what to do.
ERRORS = {
    0: ("command error or no head", f"check the head's cable; {_OLDER}"),
    1: ("status error or fault of head 1", f"check the head's cable; {_OLDER}"),
    2: ("fault of head 2", "check the head's cable"),
    13: ("fault of the controller", "switch it off and on; if it stays, ask its maker"),
    15: ("fault of the controller's memory", "switch it off and on, and check its settings"),
    20: ("command length error", _OLDER),
    21: ("parameter count error", _OLDER),
    22: ("invalid parameter", _OLDER),
    50: ("command error", _DIFFERS),
    STATUS_ERROR: (
        "not in this state",
        "leave the controller's menus and close other programs that set it, then try again",
    ),
    60: ("command length error", _DIFFERS),
    61: ("parameter count error", _DIFFERS),
    62: ("parameter out of range", "check laser.output: the controller may not have that OUT"),
    88: ("timeout in the controller", "try again; a controller that waits for a trigger does not"),
    99: ("other error", "read the controller's display"),
}
