"""The last line of a command that fails is its own sentence."""

from __future__ import annotations

import os
import subprocess
import sys
import threading

import pytest

from dearig.cli.last_words import leave
from dearig.recording.writing.recorder import _THREAD

TALKATIVE = """
import atexit, os, sys, warnings
from dearig.cli import main as command
from dearig.errors import InstrumentFault

class Task:
    def __del__(self):
        warnings.warn("a task was not closed", ResourceWarning)
        raise ValueError("no link")

def fails(*_, **__):
    Task()
    raise InstrumentFault("0 V IS NOT CONFIRMED")

warnings.simplefilter("always")
atexit.register(os.write, 2, b"E0000 chttp2 transport closed")
command.app = fails
sys.argv = ["dearig", "record"]
kept = Task()
command.main()
"""


def test_nothing_of_a_library_comes_after_the_sentence() -> None:
    done = subprocess.run(
        [sys.executable, "-c", TALKATIVE], capture_output=True, text=True, check=False
    )
    assert done.returncode == 4
    assert done.stderr == "dearig: 0 V IS NOT CONFIRMED\n"


def test_a_program_ends_while_a_disk_does_not_answer(monkeypatch: pytest.MonkeyPatch) -> None:
    class Left(BaseException):
        pass

    def left(status: int) -> None:
        raise Left(status)

    answer = threading.Event()
    writing = threading.Thread(target=answer.wait, name=_THREAD)
    writing.start()
    try:
        with monkeypatch.context() as patch:
            patch.setattr(os, "_exit", left)
            with pytest.raises(Left, match="4"):
                leave(4)
    finally:
        answer.set()
        writing.join()
    with pytest.raises(SystemExit) as end:
        leave(3)
    assert end.value.code == 3
