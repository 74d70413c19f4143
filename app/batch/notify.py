"""Tell a person that a run or a campaign has ended, by a command or a webhook.

Everything here happens after a run, and nothing waits for it before the next one: a command is
started between two runs and a webhook is called in the background, each with a time limit. What
fails is logged.
"""

from __future__ import annotations

import contextlib
import http.client
import json
import logging
import os
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
import urllib.error
import urllib.request
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

from dearig.acquisition.run import RunResult
from dearig.batch.queue import DONE, LOST, STOPPED, RunState
from dearig.config.notify import Event, Notify, redacted
from dearig.errors import DearigError, SafetyStop
from dearig.output_state import OutputState
from dearig.recording.content.layout import iso_time
from dearig.recording.files import one_line

if TYPE_CHECKING:
    from dearig.batch.queue import CampaignOutcome

__all__ = ["Notifier", "await_notifications"]

log = logging.getLogger(__name__)

FORMAT = "dearig-notification/1"
#: Notifications under way at once, at most, since runs may end faster than they are delivered: of
#: command and webhook one that is late, and the next one.
UNDER_WAY_MAX = 4
_TOLD = 300  # bytes of what a failed command wrote that are logged: some three lines


def _of_run(
    name: str,
    state: str,
    recording: str,
    reason: str = "",
    output: OutputState | None = None,
    numbers: dict[str, float] | None = None,
) -> dict[str, Any]:
    """Return the entry ``run`` of a notification."""
    return {
        "name": name,
        "state": state,
        "recording": recording,
        "reason": reason,
        "output": None if output is None else output.known.value,
        "numbers": numbers or {},
    }


class Notifier:
    """Sends the notifications of ``notify``; ``await_notifications`` waits for those under way.

    Raises ``InputError`` for a command or a webhook that cannot work. ``now`` is Unix time in s.
    """

    def __init__(
        self,
        notify: Notify,
        now: Callable[[], float] = time.time,
    ) -> None:
        self._notify = notify.checked()
        self._now = now
        self._failing: set[str] = set()

    def tell(
        self,
        event: Event,
        text: str,
        *,
        run: dict[str, Any] | None = None,
        campaign: dict[str, Any] | None = None,
    ) -> None:
        """Tell of ``event``, if that is asked for; ``text`` is a sentence for a person.

        It returns at once, and raises nothing.
        """
        if event not in self._notify.on:
            return
        body = json.dumps(
            {
                "format": FORMAT, "event": event, "text": text, "at": iso_time(self._now()),
                "host": socket.gethostname(), "run": run, "campaign": campaign,
            }
        ).encode()  # fmt: skip
        if self._notify.command and self._has_place(event):
            self._start_command(body)
        if self._notify.webhook and self._has_place(event):
            self._start("webhook", lambda: self._call(body))

    def _has_place(self, event: Event) -> bool:
        _under_way[:] = [each for each in _under_way if each[0].is_alive()]
        # never dropped: no later notification follows the end of a queue
        if len(_under_way) < UNDER_WAY_MAX or event == "queue-stopped":
            return True
        self._failed("notifications", f"{UNDER_WAY_MAX} are under way, and this one is left out")
        return False

    def _start(self, name: str, work: Callable[[], None]) -> None:
        # a daemon: the end of the program does not wait for a server that never answers
        thread = threading.Thread(target=work, name=f"notify {name}", daemon=True)
        _under_way.append((thread, time.monotonic() + self._notify.timeout))
        thread.start()

    def _failed(self, what: str, why: str) -> None:
        """Log a failure: the first of a row as a warning, because hundreds of runs may follow."""
        level = logging.INFO if what in self._failing else logging.WARNING
        self._failing.add(what)
        log.log(level, "%s: %s", what, why)

    def tell_stop(self, outcome: CampaignOutcome) -> None:
        """Tell that no run of a campaign follows, and how the campaign stands."""
        facts = outcome.summary()
        reason = f": {outcome.reason}" if outcome.reason else ""
        self.tell(
            "queue-stopped",
            f"Campaign {outcome.name}: {outcome.status.replace('_', ' ')}, {facts['done']} of "
            f"{facts['planned']} runs done{reason}",
            campaign=facts,
        )

    def tell_run(
        self, outcome: CampaignOutcome, run: RunState, how: str, output: OutputState | None,
        *, tripped: bool,
    ) -> None:  # fmt: skip
        """Tell that the ``run`` of a campaign has ended as ``how``."""
        self.tell(
            "tripped" if tripped else "run-ended",
            f"Run {run.name} of campaign {outcome.name}: {how}"
            f"{f', {run.reason}' if run.reason else ''}",
            run=_of_run(
                run.name, how, str(outcome.folder / run.recording), run.reason, output, run.numbers
            ),
            campaign=outcome.summary(),
        )

    def tell_of(self, path: Path, play: Callable[[], RunResult]) -> RunResult:
        """Return what ``play`` returns, the result of a run to ``path``, and tell how it ended.

        A run that was refused before a rig was contacted did not end.
        """
        try:
            result = play()
        except DearigError as error:
            output = error.output_state
            if output is not None:
                stopped = isinstance(error, SafetyStop)
                self.tell(
                    "tripped" if error.needs_inspection else "run-ended",
                    f"Run {path.stem}: {error}",
                    run=_of_run(
                        path.stem, STOPPED if stopped else LOST, str(path), str(error), output
                    ),
                )
            raise
        path, output = result.path, result.output_state
        doubt = "" if output.confirmed else f", {output.sentence}"
        self.tell(
            "tripped" if doubt else "run-ended",
            f"Run {path.stem}: {result.outcome}{doubt}",
            run=_of_run(path.stem, DONE, str(path), doubt.lstrip(", "), output),
        )
        return result

    # ------------------------------------------------------------ command

    def _start_command(self, body: bytes) -> None:
        what = f"notify.command {os.path.basename(self._notify.command[0])}"  # noqa: PTH119
        said = tempfile.TemporaryFile()  # noqa: SIM115  (closed by the thread that reads it)
        try:
            process = subprocess.Popen(  # noqa: S603  (the operator's own program, without a shell)
                self._notify.command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL,
                stderr=said, **_APART,
            )  # fmt: skip
        except (OSError, ValueError) as error:
            said.close()
            self._failed(what, f"it cannot be started: {one_line(error)}")
            return
        self._start("command", lambda: self._await(what, process, body, said))

    def _await(
        self, what: str, process: subprocess.Popen[bytes], body: bytes, said: BinaryIO
    ) -> None:
        with said:
            try:
                process.communicate(body, self._notify.timeout)
            except subprocess.TimeoutExpired:
                _kill(process)
                if process.stdin is not None:
                    with contextlib.suppress(OSError):  # what it has not read
                        process.stdin.close()
                process.wait()
                self._failed(what, f"it was killed after {self._notify.timeout:g} s")
                return
            except OSError as error:
                _kill(process)
                self._failed(what, one_line(error))
                return
            if process.returncode:
                said.seek(0)
                text = said.read(_TOLD).decode("utf-8", "replace").strip()
                self._failed(what, f"it ended with {process.returncode}: {text}")
                return
        self._failing.discard(what)

    # ------------------------------------------------------------ webhook

    def _call(self, body: bytes) -> None:
        address = self._notify.webhook
        what = f"notify.webhook {redacted(address)}"
        request = urllib.request.Request(  # noqa: S310  (http or https: it was checked)
            address, body, {"Content-Type": "application/json", "User-Agent": "dearig"}
        )
        try:
            with _OPENER.open(request, timeout=self._notify.timeout):
                self._failing.discard(what)
                return
        except urllib.error.HTTPError as error:
            with error:
                why = f"it answered {error.code}"
        except urllib.error.URLError as error:
            reason = error.reason
            why = one_line(reason) if isinstance(reason, OSError) else "it cannot be reached"
        except TimeoutError:
            why = f"no answer within {self._notify.timeout:g} s"
        except (OSError, ValueError, http.client.HTTPException) as error:
            # the words of these errors may have the address in them
            why = type(error).__name__
        self._failed(what, why)


#: Threads of the notifications under way in this process, and the monotonic time of their limits.
_under_way: list[tuple[threading.Thread, float]] = []


def await_notifications() -> None:
    """Wait for the notifications under way, within their time limits; ctrl-C ends the wait."""
    # a command that was killed takes a moment to end
    end = max((limit for _, limit in _under_way), default=0.0) + 1.0
    reported = False
    with contextlib.suppress(KeyboardInterrupt):
        for thread, _ in _under_way:
            thread.join(1.0)
            if thread.is_alive() and not reported:
                reported = True
                log.warning(
                    "waiting for notifications, %g s at most; ctrl-C ends the wait",
                    end - time.monotonic(),
                )
            thread.join(max(end - time.monotonic(), 0.0))


class _NoRedirect(urllib.request.HTTPRedirectHandler):
    """Follows no redirection: it would lose the body, and tell another server."""

    def redirect_request(self, *_: Any) -> None:
        return None


_OPENER = urllib.request.build_opener(_NoRedirect)

# ctrl-C in the terminal is for the run, and not for the command
_APART: dict[str, Any]
if sys.platform == "win32":
    _APART = {"creationflags": subprocess.CREATE_NEW_PROCESS_GROUP | subprocess.CREATE_NO_WINDOW}

    def _kill(process: subprocess.Popen[bytes]) -> None:
        process.kill()

else:
    _APART = {"start_new_session": True}

    def _kill(process: subprocess.Popen[bytes]) -> None:
        """Kill the command and what it has started."""
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
