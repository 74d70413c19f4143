"""Process of the guardian: it reads beats on standard input, and sets 0 V when they stop.

Words in, one a line: ``arm``, ``beat``, ``disarm``, ``take over``, ``bye``. Words out, on the error
stream with the prefix ``WORD``: ``ready`` with a JSON object (version and digests of the sources,
what the system granted) or ``cannot`` with a sentence; ``heard`` for each word; ``acted`` with a
JSON object after a take-over. Standard output goes to the terminal, for the operator.
"""

from __future__ import annotations

import contextlib
import gc
import json
import queue
import signal
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, field

from dearig.drivers import sources
from dearig.drivers.daqmx.guardian import WORD, TakeOver
from dearig.drivers.daqmx.link import Link
from dearig.drivers.daqmx.outputs import Outputs
from dearig.drivers.errors import NotAtZero, RigError
from dearig.drivers.processes import priority
from dearig.drivers.settings import RigSettings
from dearig.drivers.zero_reading import ZeroReading

__all__ = ["Guard", "main"]


@dataclass
class Guard:
    """Guardian's response to each word and to silence.

    ``zero`` takes the output to 0 V and returns the voltage monitor's reading. ``say`` replies to
    the run, ``tell`` informs the operator at the terminal.

    After a take-over output and enable line stay reserved, so that the card refuses whatever a run
    does that was frozen and goes on. ``disarm``, which a run sends when it has made itself safe,
    calls ``release``. Until then ``arm`` is answered by the report of the take-over.
    """

    zero: Callable[[], ZeroReading | None]
    say: Callable[[str], None]
    tell: Callable[[str], None]
    release: Callable[[], None] = field(default=lambda: None)
    armed: bool = field(default=False)
    acted: str = field(default="")  # report of a take-over that was not followed by ``disarm``

    def hear(self, word: str | None) -> bool:
        """Act on ``word``, None for the end of the run's pipe; returns False to end."""
        # the answer to these two comes first, so that the run has it when they are acknowledged
        if word == "arm":
            self.armed = not self.acted
            if self.acted:
                self.say(self.acted)
        elif word == "disarm":
            self.armed = False
            if self.acted:
                self.acted = ""
                self.release()
        if word is not None:
            self.say("heard")
        if word == "take over":
            self.take_over("the run could not bring the output to 0 V itself")
        elif word is None or word == "bye":
            if word is None and self.armed:
                self.take_over("the run has died")
            return False
        return True

    def silence(self) -> None:
        """Act on silence: no word arrived in time."""
        self.take_over("the run is frozen")

    def take_over(self, why: str) -> None:
        """Set 0 V and the enable line low, then report it to the run and to the operator."""
        self.armed = False
        at, start, error = time.time(), time.monotonic(), ""
        monitor = None
        try:
            reading = self.zero()
            monitor = None if reading is None else reading.voltage
        except NotAtZero as failed:
            error, monitor = str(failed), failed.voltage
        except RigError as failed:
            error = str(failed)
        report = TakeOver(why, at, time.monotonic() - start, error, monitor)
        self.acted = f"acted {json.dumps(asdict(report))}"
        self.say(self.acted)
        self.tell(report.sentence)


def main(configuration: str) -> int:
    """Guard until the run says ``bye`` or ends."""
    # ctrl-C ends the run only; the guardian must outlive it
    for name in ("SIGINT", "SIGHUP", "SIGBREAK"):
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), signal.SIG_IGN)
    config = json.loads(configuration)
    settings = RigSettings.model_validate(config["settings"], context=config)
    try:
        link = Link(config["server"], settings)
        outputs = Outputs(link, config["device"], settings)
        outputs.prepare()
    except RigError as error:
        _say(f"cannot {error}")
        return 1

    guard = Guard(lambda: _insist(outputs, settings.guardian.retry_s), _say, _tell, outputs.release)
    words: queue.SimpleQueue[str | None] = queue.SimpleQueue()
    threading.Thread(target=_listen, args=(words,), daemon=True).start()
    _say(f"ready {json.dumps(_ready())}")
    while True:
        try:
            word = words.get(timeout=settings.guardian.timeout_s if guard.armed else None)
        except queue.Empty:
            guard.silence()
            continue
        if not guard.hear(word):
            break
    outputs.close()
    link.close()
    return 0


def _ready() -> dict[str, object]:
    """Prepare to act without delay, and return what the run must know of this process."""
    gc.collect()
    gc.freeze()
    gc.disable()  # the loop makes no cycles, and a collection would delay a take-over
    granted, refused = priority.claim()
    return {
        "version": sources.version(),
        "sources": sources.loaded(),
        "granted": granted,
        "refused": refused,
    }


def _insist(outputs: Outputs, seconds: float) -> ZeroReading | None:
    """Set 0 V, and repeat it for ``seconds`` while the card or its server does not answer."""
    until = time.monotonic() + seconds
    while True:
        try:
            outputs.shut()
        except RigError:
            if time.monotonic() > until:
                raise
            time.sleep(0.05)
        else:
            return outputs.zero_reading


def _listen(words: queue.SimpleQueue[str | None]) -> None:
    for line in sys.stdin:
        words.put(line.strip())
    words.put(None)


def _say(word: str) -> None:
    with contextlib.suppress(OSError):  # the run has ended
        print(WORD + " ".join(word.split()), file=sys.stderr, flush=True)


def _tell(sentence: str) -> None:
    with contextlib.suppress(OSError):  # the terminal is closed
        print(_printable(sentence), flush=True)


def _printable(text: str) -> str:
    """Return ``text`` with control characters, which a terminal obeys, as escapes.

    A server's sentences are another program's. No codec is used: that would import a module.
    """
    return "".join(c if c.isprintable() else f"\\u{ord(c):04x}" for c in text)
