"""Guardian, seen from the run: a process that sets 0 V when the run no longer can.

It detects that the run dies (the pipe between them closes) or freezes (no beat arrives). The run
tells it when there is nothing to guard. It has its own interpreter and connection to the card.
"""

from __future__ import annotations

import contextlib
import json
import os
import queue
import subprocess
import sys
import threading
from collections import deque
from typing import Protocol

from dearig.drivers.daqmx.address import Address
from dearig.drivers.errors import RigError
from dearig.drivers.processes import child_environment
from dearig.drivers.settings import RigSettings

__all__ = ["WORD", "Guardian", "GuardianProcess"]

#: Prefix of the guardian's lines for the run. All other lines on its error stream come from Python
#: or from a library.
WORD = "guardian> "

_STARTS_WITHIN = 60.0  # s: an interpreter, the driver's library, a connection
_TAKES_OVER_WITHIN = 5.0  # s; it keeps trying after that, but the operator must be told
_ENDS_WITHIN = 5.0  # s
# s; a process that has ended has written its error by then, and the message must not wait longer
_ERROR_WITHIN = 0.5
_LINES_KEPT = 20  # of its error stream; the last line of a traceback names the error
_LINE_MAX = 2000  # characters of a line


class Guardian(Protocol):
    """Guardian: takes over when a run dies or freezes."""

    def arm(self) -> None:
        """Start to watch: silence means a frozen run. Raises ``RigError`` if it has ended."""
        ...

    def beat(self) -> bool:
        """Report that the run is alive; returns False if the guardian is not."""
        ...

    def last_error(self) -> str:
        """Return why the guardian has ended, as far as that is known."""
        ...

    def disarm(self) -> None:
        """Stop watching: the output is at 0 V."""
        ...

    def take_over(self) -> None:
        """Request 0 V now, where the run cannot set it."""
        ...

    def close(self) -> None:
        """End it."""
        ...


class GuardianProcess:
    """A guardian for the card at ``address``, started at once.

    Raises ``RigError`` when it cannot be started or does not reach the card, with the last line
    of its error stream.
    """

    def __init__(self, address: Address, settings: RigSettings) -> None:
        self._guards = self._trying = False
        self._said: queue.Queue[str | None] = queue.Queue()  # None: the guardian has ended
        self._errors: deque[str] = deque(maxlen=_LINES_KEPT)
        config = {
            "device": address.device,
            "server": address.server,
            # only the settings that give wiring, scaling and limits
            "settings": RigSettings.model_validate(
                {name: getattr(settings, name) for name in RigSettings.model_fields}
            ).model_dump(mode="json"),
        }
        self._process = subprocess.Popen(  # noqa: S603  (this interpreter, a module of ours)
            [
                sys.executable,
                "-P",
                "-X",
                "utf8",
                "-m",
                "dearig.drivers.daqmx.guardian_process",
                json.dumps(config),
            ],
            stdin=subprocess.PIPE,
            # its standard output is the terminal's error stream, which outlives the run: its
            # messages to the operator must not pass through this process
            stdout=_terminal(),
            stderr=subprocess.PIPE,
            encoding="utf-8",
            errors="replace",
            env=child_environment(),
            # ctrl-C at the terminal ends the run only: the guardian must outlive it
            start_new_session=os.name == "posix",
            creationflags=getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0),
        )
        self._listener = threading.Thread(target=self._listen, name="guardian", daemon=True)
        self._listener.start()
        try:
            self._expect_word("ready", _STARTS_WITHIN)
        except RigError:
            self.close()
            raise

    @property
    def pid(self) -> int:
        """Process number."""
        return self._process.pid

    def arm(self) -> None:
        """Start to watch: silence means a frozen run. Raises ``RigError`` if it has ended."""
        if not self._send("arm"):
            raise RigError(
                f"the guardian process has ended ({self.last_error()}): nothing would take the "
                f"output to 0 V if this program died; start the run again"
            )
        self._guards = True

    def beat(self) -> bool:
        """Report that the run is alive; returns False if the guardian is not."""
        return self._send("beat")

    def last_error(self) -> str:
        """Return why the guardian has ended, as far as that is known."""
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(_ERROR_WITHIN)
        self._listener.join(_ERROR_WITHIN)
        lines = [line for line in self._errors if line]
        return f"exit code {self._process.returncode}" + (f", {lines[-1]}" if lines else "")

    def disarm(self) -> None:
        """Stop watching: the output is at 0 V."""
        if self._guards:
            self._guards = False
            self._send("disarm")

    def take_over(self) -> None:
        """Request 0 V now. Raises ``RigError`` where the guardian does not set it."""
        if self._trying:
            raise RigError("the guardian process is still trying to reach the card")
        if not self._send("take over"):
            raise RigError(f"the guardian process has ended too ({self.last_error()})")
        self._trying = True
        self._expect_word("safe", _TAKES_OVER_WITHIN)
        self._trying = False

    def close(self) -> None:
        """End the guardian; one that still tries to reach the card goes on and reports the end."""
        self._send("bye")
        if self._process.stdin is not None:
            with contextlib.suppress(OSError):  # it has ended and closed its end of the pipe
                self._process.stdin.close()
        if self._trying:
            return
        try:
            self._process.wait(_ENDS_WITHIN)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._listener.join(_ENDS_WITHIN)

    def _send(self, word: str) -> bool:
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
        if said is None:
            raise RigError(f"the guardian process has ended ({self.last_error()})")
        if said != word:
            raise RigError(f"the guardian process does not work: {said}")

    def _listen(self) -> None:
        """Read the guardian's lines at once, so that it never waits for this process.

        The stream stays open as long as the guardian lives, even after ``close``: one that still
        tries to reach the card must be able to write.
        """
        stream = self._process.stderr
        if stream is not None:
            with stream:
                while line := stream.readline(_LINE_MAX):
                    if line.startswith(WORD):
                        self._said.put(line.removeprefix(WORD).strip())
                    else:
                        self._errors.append(line.strip())
        self._said.put(None)


def _terminal() -> int:
    """Return the file descriptor of this program's error stream, or of the null device."""
    try:
        os.fstat(2)
    except OSError:  # a windowed program without a console has no error stream
        return subprocess.DEVNULL
    return 2
