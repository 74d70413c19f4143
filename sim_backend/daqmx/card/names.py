"""Names of channels: ranges, lists, those that are counted on, and those of new channels."""

from __future__ import annotations

import re
from collections.abc import Sequence

from dearig.sim_backend.daqmx.card.errors import Code, DaqmxError
from dearig.sim_backend.daqmx.card.tasks import Task

__all__ = ["counted_on", "expanded", "named", "physical_names"]

_RANGE = re.compile(r"^(.*?)(\d+):(?:\1)?(\d+)$", re.IGNORECASE)
_LONGEST_RANGE = 64  # names


def expanded(name: str) -> list[str]:
    """Return the names in a range such as ``ai0:2`` or ``ai0:ai2``, or the name itself.

    Leading zeros of the first number give the width of all: ``in08:10`` is in08, in09, in10.
    """
    found = _RANGE.match(name)
    if not found:
        return [name]
    first, last = int(found[2]), int(found[3])
    if abs(last - first) > _LONGEST_RANGE:
        raise DaqmxError(Code.UNKNOWN_CHANNEL, f"Physical Channel: {name}")
    step = 1 if last >= first else -1
    width = _width(found[2])
    return [f"{found[1]}{n:0{width}d}" for n in range(first, last + step, step)]


def _width(number: str) -> int:
    """Return the width to which DAQmx fills the numbers of a range that begins at ``number``."""
    return len(number) if number.startswith("0") and int(number) else 0


def counted_on(name: str, count: int) -> list[str]:
    """Return ``count`` names: DAQmx counts on from the number at the end of ``name``, or from 0."""
    base = name.rstrip("0123456789")
    number = name[len(base) :] or "0"
    width, first = _width(number), int(number)
    return [f"{base}{n:0{width}d}" for n in range(first, first + count)]


def physical_names(text: str, device: str) -> list[str]:
    """Return the names within ``device`` of physical channels such as ``Dev1/ai0:2, Dev1/ai5``.

    Raises ``DaqmxError`` for another device or an invalid syntax.
    """
    names: list[str] = []
    for part in text.split(","):
        owner, slash, rest = part.strip().lstrip("/").partition("/")
        if not slash or not rest:
            raise DaqmxError(Code.INVALID_SYNTAX, f"Input: {text!r}")
        if owner.lower() != device.lower():
            raise DaqmxError(Code.UNKNOWN_DEVICE, f"Device Specified: {owner}")
        names += [name.lower() for name in expanded(rest)]
    return names


def named(
    task: Task, device: str, terminals: Sequence[str], name: str
) -> Sequence[tuple[str, str]]:
    """Return each of ``terminals`` of ``device`` with the unique name of its channel in ``task``.

    ``name`` is what the program has assigned: empty, one name, a list, or a range.
    """
    names = [f"{device}/{terminal}" for terminal in terminals]
    given = [n for part in name.split(",") for n in expanded(part.strip())] if name else []
    if len(given) == 1 and len(terminals) > 1:
        names = counted_on(given[0], len(terminals))
    elif given:
        names = given + names[len(given) :]
    taken = {called.lower() for called in task.channel_names}
    lower = [called.lower() for called in names]
    for called in names:
        if called.lower() in taken or lower.count(called.lower()) > 1:
            raise DaqmxError(Code.CHANNEL_ALREADY_IN_TASK, f"Channel Name: {called}")
    return list(zip(terminals, names, strict=False))
