"""One state of the watched source for all watchers of the page, each at its own pace."""

from __future__ import annotations

import asyncio
import contextlib
import json
import logging
import time
from collections.abc import AsyncIterator, Callable
from typing import Any

__all__ = ["Feed"]

log = logging.getLogger(__name__)

#: Time in s after which a watcher is told that nothing is new, so that it knows of the connection.
BEAT = 1.0
#: Watchers at once, at most.
WATCHERS_MAX = 64


class Feed:
    """Looks every ``every`` s while there is a watcher, and passes on what is new.

    ``look`` returns the state, and the monotonic time in s at which its newest sample was written,
    None where there is none; it runs in a thread. A watcher that reads slowly gets the newest state
    when it has taken the one before: nothing is kept for it, and no other watcher waits for it.
    ``stopping`` becomes True when the server ends.
    """

    def __init__(
        self,
        look: Callable[[], tuple[dict[str, Any], float | None]],
        every: float,
        stopping: Callable[[], bool] = lambda: False,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._look, self._every, self._stopping, self._clock = look, every, stopping, clock
        self._watchers = 0
        self._task: asyncio.Task[None] | None = None
        self._fresh = asyncio.Event()
        self._version = 0
        self._state = ""
        self._changed: float | None = None

    @property
    def full(self) -> bool:
        """True while there is no place for another watcher."""
        return self._watchers >= WATCHERS_MAX

    async def stream(self) -> AsyncIterator[str]:
        """Yield server-sent events: the state where it is new, and the age of its newest sample."""
        self._watchers += 1
        try:
            sent = 0
            if self._task is None or self._task.done():
                # what was seen last is old
                self._fresh, self._state, self._changed = asyncio.Event(), "", None
                sent = self._version
                self._task = asyncio.create_task(self._follow())
            while not self._stopping():
                fresh = self._fresh
                if sent == self._version:
                    with contextlib.suppress(TimeoutError):
                        await asyncio.wait_for(fresh.wait(), BEAT)
                age = None if self._changed is None else max(self._clock() - self._changed, 0.0)
                news = f', "state": {self._state}' if sent != self._version else ""
                sent = self._version
                yield f'data: {{"age_s": {json.dumps(age)}{news}}}\n\n'
        finally:
            self._watchers -= 1

    async def _follow(self) -> None:
        while self._watchers and not self._stopping():
            try:
                state, changed = await asyncio.to_thread(self._look)
                text = json.dumps(state, allow_nan=False, separators=(",", ":"))
            except Exception:
                log.exception("the watched source could not be shown")
                text, changed = json.dumps({"trouble": "The page failed; see the log."}), None
            self._changed = changed
            if text != self._state:
                self._state = text
                self._version += 1
                fresh, self._fresh = self._fresh, asyncio.Event()
                fresh.set()
            await asyncio.sleep(self._every)
