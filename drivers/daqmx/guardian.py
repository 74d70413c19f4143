"""The run's side of the guardian: a process that takes the output to 0 V when the run does not.

It sees the run die (the pipe between them closes), freeze (no beat comes), and is told when there
is nothing to guard. It has an interpreter and a connection to the card of its own.
"""

from __future__ import annotations

import contextlib
import json
import os
import queue
import subprocess
import sys
import threading
from typing import Protocol

from dearig.drivers.daqmx.address import Address
from dearig.drivers.errors import RigError
from dearig.drivers.settings import RigSettings

__all__ = ["Guardian", "GuardianProcess"]

_STARTS_WITHIN = 60.0  # s: an interpreter, the driver's library, a connection
_TAKES_OVER_WITHIN = 5.0  # s; it goes on trying after that, but the person must be told


class Guardian(Protocol):
    """Who takes over when a run dies or freezes."""

    def arm(self) -> None:
        """From now on, silence means trouble. Raises ``RigError`` where nobody guards."""
        ...

    def beat(self) -> bool:
        """Say that the run is alive; False when the guardian is not."""
        ...

    def disarm(self) -> None:
        """The output is at 0 V: nothing to guard."""
        ...

    def take_over(self) -> None:
        """Ask for 0 V now, because the run cannot bring it about."""
        ...

    def close(self) -> None:
        """End it."""
        ...


class GuardianProcess:
    """A guardian for the card at ``address``, started at once.

    Raises ``RigError`` when it cannot be started or does not reach the card.
    """

    def __init__(self, address: Address, settings: RigSettings) -> None:
        self._guards = self._trying = False
        self._said: queue.Queue[str] = queue.Queue()
        config = {
            "device": address.device,
            "server": address.server,
            # of a rig file, only what says how the instruments are wired and judged
            "settings": RigSettings.model_validate(
                {name: getattr(settings, name) for name in RigSettings.model_fields}
            ).model_dump(mode="json"),
        }
        self._process = subprocess.Popen(  # noqa: S603  (this interpreter, a module of ours)
            [
                sys.executable,
                "-P",
                "-m",
                "dearig.drivers.daqmx.guardian_process",
                json.dumps(config),
            ],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            encoding="utf-8",
            env={**os.environ, "PYTHONPATH": os.pathsep.join(p for p in sys.path if p)},
            # a ctrl-C at the terminal is for the run: the guardian must outlive it
            start_new_session=os.name == "posix",
            creationflags=getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0),
        )
        threading.Thread(target=self._listen, name="guardian", daemon=True).start()
        self._expect_word("ready", _STARTS_WITHIN)

    @property
    def pid(self) -> int:
        """Process number."""
        return self._process.pid

    def arm(self) -> None:
        """From now on, silence means trouble. Raises ``RigError`` where nobody guards."""
        if not self._tell("arm"):
            raise RigError(
                "the guardian process is gone: nobody would take the output to 0 V if this program "
                "died; start the run again"
            )
        self._guards = True

    def beat(self) -> bool:
        """Say that the run is alive; False when the guardian is not."""
        return self._tell("beat")

    def disarm(self) -> None:
        """The output is at 0 V: nothing to guard."""
        if self._guards:
            self._guards = False
            self._tell("disarm")

    def take_over(self) -> None:
        """Ask for 0 V now. Raises ``RigError`` where the guardian does not bring it about."""
        if self._trying:
            raise RigError("the guardian process is still trying to reach the card")
        if not self._tell("take over"):
            raise RigError("the guardian process is gone too")
        self._trying = True
        self._expect_word("safe", _TAKES_OVER_WITHIN)
        self._trying = False

    def close(self) -> None:
        """End it; one that still tries to reach the card is left to it, and says how that ends."""
        self._tell("bye")
        if self._process.stdin is not None:
            with contextlib.suppress(OSError):  # it is gone, with its end of the pipe
                self._process.stdin.close()
        if self._trying:
            return
        try:
            self._process.wait(5.0)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        if self._process.stdout is not None:
            self._process.stdout.close()

    def _tell(self, word: str) -> bool:
        if self._process.poll() is not None or self._process.stdin is None:
            return False
        try:
            self._process.stdin.write(word + "\n")
            self._process.stdin.flush()
        except (OSError, ValueError):
            return False
        return True

    def _expect_word(self, word: str, within: float) -> None:
        try:
            said = self._said.get(timeout=within)
        except queue.Empty:
            said = f"it did not answer within {within:g} s"
        if said != word:
            raise RigError(f"the guardian process cannot do its work: {said}")

    def _listen(self) -> None:
        if self._process.stdout is not None:
            for line in self._process.stdout:
                self._said.put(line.strip())
        self._said.put("it has ended")
