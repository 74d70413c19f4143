"""Guardian, seen from the run: a process that sets 0 V when the run no longer can.

It detects that the run dies (the pipe between them closes) or freezes (no beat arrives). The run
detects that the guardian dies or freezes: every word is acknowledged, and a word that is not
acknowledged in time ends the run. The guardian has its own interpreter and connection to the card.
"""

from __future__ import annotations

import contextlib
import json
import os
import subprocess
import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from dearig.drivers import sources
from dearig.drivers.daqmx.address import Address
from dearig.drivers.errors import RigError
from dearig.drivers.processes.children import has_unread, isolated_command
from dearig.drivers.settings import RigSettings

__all__ = ["WORD", "Guardian", "GuardianProcess", "TakeOver"]

#: Prefix of the guardian's lines for the run. All other lines on its error stream come from Python
#: or from a library.
WORD = "guardian> "

_STARTS_WITHIN = 60.0  # s: an interpreter, the driver's library, a connection
# s from a beat to its acknowledgement. With ten beats a second, a guardian that stops is noticed
# within 0.5 s: up to 0.1 s to the next beat, this time, and up to 0.1 s to the read after it.
_HEARS_WITHIN = 0.3
_LATE = 0.05  # s for an acknowledgement that the listener has read at this moment
_ANSWERS_WITHIN = 0.5  # s from a word other than a beat to its acknowledgement
_TAKES_OVER_WITHIN = 5.0  # s; it keeps trying after that, but the operator is notified
_ENDS_WITHIN = 5.0  # s
# s; a process that has ended has written its error by then, and the message must not wait longer
_ERROR_WITHIN = 0.5
_LINES_KEPT = 20  # of its error stream; the last line of a traceback names the error
_LINE_MAX = 20_000  # characters of a line; "ready" has a digest for each module


@dataclass(frozen=True)
class TakeOver:
    """Guardian's report: it took the output to 0 V, or failed to.

    ``why`` is the reason, ``at`` the time in s since 1970, ``seconds`` the time that it took.
    ``error`` is empty if the voltage monitor confirmed 0 V; ``monitor`` is its reading in V at the
    film, None where it could not be read.
    """

    why: str
    at: float
    seconds: float
    error: str = ""
    monitor: float | None = None

    @property
    def confirmed(self) -> bool:
        """Return True if the voltage monitor showed 0 V."""
        return not self.error

    @property
    def sentence(self) -> str:
        """Return the report as a sentence."""
        when = time.strftime("%H:%M:%S", time.localtime(self.at))
        if self.error:
            return (
                f"the guardian acted at {when} ({self.why}), and THE OUTPUT COULD NOT BE TAKEN TO "
                f"0 V ({self.error})"
            )
        return (
            f"the guardian acted at {when} ({self.why}): the output was taken to 0 V within "
            f"{self.seconds:.2f} s, and the voltage monitor confirmed it"
        )


class Guardian(Protocol):
    """Guardian: takes over when a run dies or freezes. No call blocks longer than it says."""

    @property
    def granted(self) -> tuple[str, ...]:
        """Return what the system granted it, such as real-time priority, as text."""
        ...

    @property
    def refused(self) -> tuple[str, ...]:
        """Return what the system refused it, as text."""
        ...

    def arm(self) -> None:
        """Start to watch: silence means a frozen run.

        Raises ``RigError`` without an answer, and where it has acted and was not disarmed since.
        """
        ...

    def beat(self) -> bool:
        """Report that the run is alive; returns False if the guardian is not. Never blocks."""
        ...

    def fault(self) -> str:
        """Return why the guardian gives no answer, as far as that is known."""
        ...

    def report(self, within: float = 0.0) -> TakeOver | None:
        """Return its last take-over since ``arm``, waiting up to ``within`` s for one."""
        ...

    def disarm(self) -> None:
        """Stop watching: the output is at 0 V. After a take-over the card is released."""
        ...

    def take_over(self) -> TakeOver:
        """Request 0 V now, where the run cannot set it."""
        ...

    @property
    def tries(self) -> bool:
        """Return True from a ``take_over`` that was not answered in time until its outcome."""
        ...

    def outcome(self, within: float) -> TakeOver | None:
        """Return the outcome of such a ``take_over``, waiting up to ``within`` s for it."""
        ...

    def close(self) -> None:
        """End it."""
        ...


class GuardianProcess:
    """A guardian for the card at ``address``, started immediately.

    Raises ``RigError`` when it cannot be started, does not reach the card or runs other sources
    than this program, with the last line of its error stream. ``clock`` measures its answers.

    At most one beat is on its way, because the next one waits for the acknowledgement. The pipe to
    the guardian therefore never fills, and writing to it never blocks.
    """

    def __init__(
        self,
        address: Address,
        settings: RigSettings,
        *,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._clock = clock
        self._guards = self._trying = self._failed = False
        self._reports_before = 0  # those before the last ``take_over``
        self._tries_until = 0.0  # time at which its outcome must be there
        # s: its attempts, and the calls that the last of them makes without an answer
        self._tries_for = settings.guardian.retry_s + 3.0 * settings.guardian.link_timeout_s
        self._news = threading.Condition()  # guards what the listener changes, down to _ended
        self._unheard: deque[float] = deque()  # times of the words that are not acknowledged
        self._overdue = False  # True after a word was not acknowledged in time
        self._ready: dict[str, Any] | None = None
        self._refusal = ""  # sentence of a guardian that cannot start
        self._reports = 0
        self._report: TakeOver | None = None
        self._ended = False
        self._errors: deque[str] = deque(maxlen=_LINES_KEPT)
        config = {
            "device": address.device,
            "server": address.server,
            "folder": _working_folder(),
            # only the settings that give wiring, scaling and limits
            "settings": RigSettings.model_validate(
                {name: getattr(settings, name) for name in RigSettings.model_fields}
            ).model_dump(mode="json"),
        }
        self._process = subprocess.Popen(  # noqa: S603  (this interpreter, a module of ours)
            isolated_command("dearig.drivers.daqmx.guardian_process", json.dumps(config)),
            stdin=subprocess.PIPE,
            # its standard output is the terminal's error stream, which outlives the run: its
            # messages to the operator must not pass through this process
            stdout=_terminal(),
            stderr=subprocess.PIPE,
            encoding="utf-8",
            errors="replace",
            # libraries look for files in the working folder, and it may be deleted
            cwd=sources.ROOT,
            # ctrl-C at the terminal ends the run only: the guardian must outlive it
            start_new_session=os.name == "posix",
            creationflags=getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0),
        )
        self._listener = threading.Thread(target=self._listen, name="guardian", daemon=True)
        self._listener.start()
        try:
            self._await_ready()
        except BaseException:
            self.close()
            raise

    @property
    def pid(self) -> int:
        """Process number."""
        return self._process.pid

    @property
    def granted(self) -> tuple[str, ...]:
        """Return what the system granted it, such as real-time priority, as text."""
        return tuple(self._ready["granted"]) if self._ready else ()

    @property
    def refused(self) -> tuple[str, ...]:
        """Return what the system refused it, as text."""
        return tuple(self._ready["refused"]) if self._ready else ()

    def arm(self) -> None:
        """Start to watch: silence means a frozen run.

        Raises ``RigError`` without an answer, and where it has acted and was not disarmed since.
        """
        with self._news:
            self._report = None
        if not self._ask("arm"):
            raise RigError(
                f"the guardian process gives no answer ({self.fault()}): nothing would take the "
                f"output to 0 V if this program died; start the run again"
            )
        self._guards = True
        acted = self.report()
        if acted is not None:
            raise RigError(f"the card is held at 0 V: {acted.sentence}")

    def beat(self) -> bool:
        """Report that the run is alive; returns False if the guardian is not. Never blocks."""
        if self._process.poll() is not None:
            return False
        with self._news:
            waits = bool(self._unheard)
            if waits and self._clock() - self._unheard[0] <= _HEARS_WITHIN:
                return True
        if waits and not self._overdue:
            # the answer may be there, and the thread that reads it late on a busy computer
            self._overdue = not (has_unread(self._process.stderr) or self.answered(_LATE))
        elif not waits:
            self._overdue = False
        if waits:
            return not self._overdue
        return self._send("beat")

    def answered(self, within: float = 0.0) -> bool:
        """Return True once all words are acknowledged, False if not within ``within`` s."""
        with self._news:
            self._news.wait_for(lambda: not self._unheard or self._ended, within)
            return not (self._unheard or self._ended)

    def fault(self) -> str:
        """Return why the guardian gives no answer, as far as that is known."""
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(_ERROR_WITHIN)
        if self._process.poll() is None:
            return "it is running and does not answer: it is stopped, or the computer is overloaded"
        self._listener.join(_ERROR_WITHIN)
        lines = [line for line in self._errors if line]
        return f"exit code {self._process.returncode}" + (f", {lines[-1]}" if lines else "")

    def report(self, within: float = 0.0) -> TakeOver | None:
        """Return its last take-over since ``arm``, waiting up to ``within`` s for one."""
        with self._news:
            self._news.wait_for(lambda: self._report is not None or self._ended, within)
            return self._report

    def disarm(self) -> None:
        """Stop watching: the output is at 0 V. After a take-over the card is released."""
        if self.report() is not None:
            self._ask("disarm")
        elif self._guards:
            self._send("disarm")
        self._guards = False

    def take_over(self) -> TakeOver:
        """Request 0 V now. Raises ``RigError`` where the guardian does not set it."""
        if self.tries:
            raise RigError("the guardian process is still trying to reach the card")
        if self._failed:
            raise RigError("the guardian process could not take the output to 0 V either")
        self._reports_before = self._reports
        # one that has seen the run freeze is in its attempts already, and hears nothing meanwhile
        heard = self._ask("take over")
        if not heard and self._process.poll() is not None:
            raise RigError(f"the guardian process gives no answer either ({self.fault()})")
        self._trying, self._tries_until = True, self._clock() + self._tries_for
        report = self.outcome(_TAKES_OVER_WITHIN)
        if report is None and not heard:
            raise RigError(
                f"the guardian process has not taken the output to 0 V within "
                f"{_TAKES_OVER_WITHIN:g} s either: it tries, or is stopped"
            )
        if report is None:
            raise RigError(
                f"the guardian process has not taken the output to 0 V within "
                f"{_TAKES_OVER_WITHIN:g} s, and goes on trying"
            )
        if not report.confirmed:
            raise RigError(report.sentence)
        return report

    @property
    def tries(self) -> bool:
        """Return True from a ``take_over`` that was not answered in time until its outcome.

        One that does not answer for longer than its attempts take is stopped.
        """
        if self._trying and self._clock() >= self._tries_until:
            self._trying, self._failed = False, True
        return self._trying

    def outcome(self, within: float) -> TakeOver | None:
        """Return the outcome of the last ``take_over``, waiting up to ``within`` s for it."""
        before = self._reports_before
        with self._news:
            self._news.wait_for(lambda: self._reports > before or self._ended, within)
            report = self._report if self._reports > before else None
            if report is not None or self._ended:
                self._trying = False
        if report is not None:
            self._failed = not report.confirmed
        return report

    def close(self) -> None:
        """End the guardian; one that still tries to reach the card reports its end."""
        self._send("bye")
        if self._process.stdin is not None:
            with contextlib.suppress(OSError):  # it has ended and closed its end of the pipe
                self._process.stdin.close()
        if self.tries:
            return
        # one that does not answer is stopped; it must not wake up in a later run
        ends = self.answered(_ANSWERS_WITHIN) or self._ended
        try:
            self._process.wait(_ENDS_WITHIN if ends else 0.0)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._listener.join(_ENDS_WITHIN)

    def _await_ready(self) -> None:
        with self._news:
            self._news.wait_for(
                lambda: self._ready is not None or self._refusal or self._ended, _STARTS_WITHIN
            )
            ready, refusal, ended = self._ready, self._refusal, self._ended
        if refusal:
            raise RigError(f"the guardian process does not work: {refusal}")
        if ready is None and ended:
            raise RigError(f"the guardian process has ended ({self.fault()})")
        if ready is None:
            raise RigError(
                f"the guardian process does not work: it was not ready within {_STARTS_WITHIN:g} s"
            )
        own = {"version": sources.version(), **sources.AT_START}
        theirs = {"version": ready["version"], **ready["sources"]}
        other = sorted(name for name, value in theirs.items() if value != own.get(name))
        if other:
            raise RigError(
                f"the guardian process has other sources than this program ({', '.join(other)} in "
                f"{sources.ROOT}): dearig was changed while this program was running; start it "
                f"again"
            )

    def _ask(self, word: str) -> bool:
        """Send ``word``; returns True once the guardian has acknowledged all words."""
        return self._send(word) and self.answered(_ANSWERS_WITHIN)

    def _send(self, word: str) -> bool:
        if self._process.poll() is not None or self._process.stdin is None:
            return False
        with self._news:
            self._unheard.append(self._clock())
        try:
            self._process.stdin.write(word + "\n")
            self._process.stdin.flush()
        except (OSError, ValueError):
            return False
        return True

    def _listen(self) -> None:
        """Read the guardian's lines immediately, so that it never waits for this process.

        The stream stays open as long as the guardian lives, even after ``close``: one that still
        tries to reach the card must be able to write.
        """
        stream = self._process.stderr
        if stream is not None:
            with stream:
                while line := stream.readline(_LINE_MAX):
                    if line.startswith(WORD):
                        self._hear(*line.removeprefix(WORD).strip().split(" ", 1))
                    else:
                        self._errors.append(line.strip())
        with self._news:
            self._ended = True
            self._news.notify_all()

    def _hear(self, word: str, rest: str = "") -> None:
        with self._news:
            if word == "heard" and self._unheard:
                self._unheard.popleft()
            elif word == "ready":
                self._ready = json.loads(rest)
            elif word == "cannot":
                self._refusal = rest
            elif word == "acted":
                self._report = TakeOver(**json.loads(rest))
                self._reports += 1
            self._news.notify_all()


def _working_folder() -> str | None:
    """Return the folder for relative paths of the settings, None if it was deleted."""
    try:
        return str(Path.cwd())
    except OSError:
        return None


def _terminal() -> int:
    """Return the file descriptor of this program's error stream, or of the null device."""
    try:
        os.fstat(2)
    except OSError:  # a windowed program without a console has no error stream
        return subprocess.DEVNULL
    return 2
