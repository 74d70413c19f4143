"""Names of new channels in a task."""

from __future__ import annotations

from collections.abc import Sequence

from dearig.sim_backend.daqmx.card.errors import Code, DaqmxError
from dearig.sim_backend.daqmx.card.tasks import Task, counted_on, expanded

__all__ = ["named"]


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
