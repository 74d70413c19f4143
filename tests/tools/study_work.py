"""Work for the processes of a study that takes no time, kills its process, or has no end.

``python -m tests.tools.study_work`` begins two tasks without an end.
"""

from __future__ import annotations

import os
import threading
from dataclasses import dataclass

from dearig.batch.engines import LocalEngine


@dataclass(frozen=True)
class LightTask:
    name: str


def work(task: LightTask) -> dict[str, object]:
    if task.name == "poison":
        os._exit(1)
    return {"recording": task.name, "state": "ok", "reason": ""}


def endless(task: LightTask) -> dict[str, object]:
    """Say on standard output which process this is, and never end."""
    os.write(1, f"{os.getpid()}\n".encode())  # in one piece: another process writes there too
    threading.Event().wait()
    return {}


if __name__ == "__main__":
    from tests.tools import study_work

    tasks = [study_work.LightTask(name) for name in ("a", "b")]
    list(LocalEngine(2, study_work.endless).run(tasks))  # type: ignore[arg-type]
