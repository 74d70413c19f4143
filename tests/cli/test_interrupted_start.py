"""Ctrl-C while a command is loaded: one sentence, exit code 130, and no run."""

import subprocess
import sys
from pathlib import Path

import pytest

_PRESS = """
import os, signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)

def press():
    os.kill(os.getpid(), signal.SIGINT)
    for _ in range(100):
        pass
"""
#: The module at whose import ctrl-C is pressed, and what becomes of the exception.
_CASES = {
    "raised by an import of the command": ("typer", "raise"),
    "dropped by compiled code": ("numpy.random._generator", "pass"),
    "wrapped into an error of a library": (
        "dearig.config.sequencefile",
        "raise ImportError('its other half failed to import')",
    ),
}
_FINDER = """
class Finder:
    def find_spec(self, name, path=None, target=None):
        if name == {module!r}:
            try:
                press()
            except KeyboardInterrupt:
                {answer}

sys.meta_path.insert(0, Finder())
"""


@pytest.mark.skipif(sys.platform == "win32", reason="Windows sends no signal to oneself")
@pytest.mark.parametrize("case", list(_CASES))
def test_ctrl_c_while_the_command_is_loaded_starts_nothing(case: str, tmp_path: Path) -> None:
    module, answer = _CASES[case]
    finder = _FINDER.format(module=module, answer=answer)
    code = f"{_PRESS}{finder}\nfrom dearig.__main__ import main\nmain()"
    done = subprocess.run(
        [sys.executable, "-P", "-c", code, "record", "thesis", "--out", "run.h5"],
        cwd=tmp_path, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "dearig: interrupted\n")
    assert not list(tmp_path.iterdir())


@pytest.mark.skipif(sys.platform == "win32", reason="Windows sends no signal to oneself")
def test_a_run_that_is_entered_after_a_dropped_ctrl_c_raises_it(tmp_path: Path) -> None:
    code = f"""{_PRESS}
from dearig.acquisition.interrupts import Interrupts, note_interrupts
note_interrupts()
try:
    press()
except KeyboardInterrupt:
    print("dropped")
before = signal.getsignal(signal.SIGINT)
try:
    with Interrupts():
        print("entered")
except KeyboardInterrupt:
    print("raised", signal.getsignal(signal.SIGINT) == before)
"""
    done = subprocess.run(
        [sys.executable, "-P", "-c", code],
        cwd=tmp_path, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.stdout.split() == ["dropped", "raised", "True"]
