"""The command ``dearig`` as a test runs it: in this process, and what it wrote."""

from __future__ import annotations

import io
import json
import logging
import re
import signal
import sys
import threading
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import typer.main

from dearig.acquisition import interrupts
from dearig.cli.main import main
from dearig.config.modelfile import save_model
from dearig.config.presets import PRESETS
from dearig.model.film.material import TABLE_3, THESIS_FILM, THESIS_LOAD, Branch, Network, Spring
from dearig.model.simulation.actuator import Actuator
from dearig.model.simulation.strip import Strip

#: A short run: one lobe of 3 kV, 1.5 s in all.
LOBE = """\
name = "one lobe"
lead_in_s = 0.4
tail_s = 0.1
[[segment]]
kind = "half_sine"
amplitude_kV = 3.0
frequency_Hz = 1.0
"""
#: A rig that samples slowly: what is not about the clock need not wait for it.
SLOW_RIG = "[card]\nsample_rate_Hz = 200.0\n"
#: The presets, of the thesis's excitation one period of each lobe: half as long to fit.
SHORT_PRESETS = {**PRESETS, "thesis": PRESETS["thesis"].replace("periods = 2", "periods = 1")}

#: Words that belong to the program and not to its operator.
FOREIGN = re.compile(
    r"Traceback|Error\b|Errno|pydantic|Input should|after validation|NoneType|\bdict\b"
    r"|list should|valid list|object at 0x|<class"
)

FILM_NETWORK = Network(Spring(3e4, 200.0), (Branch(Spring(2e4, 150.0), 4.0),))


@dataclass(frozen=True)
class Answer:
    """Exit code and texts of one command."""

    code: int
    out: str
    err: str

    @property
    def json(self) -> dict[str, Any]:
        """What is on standard output, as strict JSON."""
        return strict_json(self.out)


#: Builds the commands once: a process of the program does so once too, in 70 ms.
_built = cache(typer.main.get_command)


def dearig(*arguments: str | Path) -> Answer:
    """Run the command in this process. An unexpected error is raised here, not only logged."""
    out, err = (io.TextIOWrapper(io.BytesIO(), "utf-8", newline="\n") for _ in range(2))
    argv = ["dearig", *(str(a) for a in arguments)]
    unexpected = _Unexpected()
    asked = signal.getsignal(signal.SIGINT)
    with (
        patch.object(sys, "argv", argv), redirect_stdout(out), redirect_stderr(err), unexpected,
        patch.object(interrupts, "_ends_program", False),
        patch.object(typer.main, "get_command", _built),
    ):  # fmt: skip
        try:
            main()
        except SystemExit as end:
            code = end.code
        finally:
            if threading.current_thread() is threading.main_thread():
                signal.signal(signal.SIGINT, asked)
    if unexpected.error is not None:
        raise unexpected.error
    texts = []
    for stream in (out, err):
        stream.flush()
        texts.append(stream.buffer.getvalue().decode())  # type: ignore[attr-defined]
    assert isinstance(code, int)
    return Answer(code, *texts)


class _Unexpected(logging.Handler):
    """Keeps the exception that the command reported to its log file."""

    error: BaseException | None = None

    def emit(self, record: logging.LogRecord) -> None:
        if record.levelno >= logging.ERROR and record.exc_info:
            self.error = record.exc_info[1]

    def __enter__(self) -> None:
        logging.getLogger("dearig.cli").addHandler(self)

    def __exit__(self, *_: object) -> None:
        logging.getLogger("dearig.cli").removeHandler(self)


def done(*arguments: str | Path) -> Answer:
    """The same, of a command that has to succeed."""
    answer = dearig(*arguments)
    assert answer.code == 0, answer.err
    assert "Traceback" not in answer.err
    return answer


def refused(answer: Answer, *words: str) -> str:
    """Return the sentence of ``answer``, a refusal that says all of ``words``."""
    assert answer.code == 2, (answer.code, answer.out, answer.err)
    assert answer.out == ""
    assert answer.err.startswith("dearig: ")
    assert answer.err.count("\n") == 1
    sentence = answer.err.removeprefix("dearig: ").strip()
    # the names of files are the operator's own words
    assert not FOREIGN.search(re.sub(r"\S*/\S*", "", sentence)), sentence
    for word in words:
        assert word in sentence, sentence
    return sentence


def strict_json(text: str) -> dict[str, Any]:
    """``text`` as JSON without the NaN and Infinity that JSON does not have."""

    def refuse(name: str) -> None:
        raise AssertionError(f"{name} is not JSON")

    found = json.loads(text, parse_constant=refuse)
    assert isinstance(found, dict)
    return found


def write(path: Path, text: str) -> Path:
    """A text file."""
    path.write_text(text, encoding="utf-8", newline="\n")
    return path


def thesis_model(path: Path) -> Path:
    """Model file of the thesis's actuator with Table 3's numbers, as the rig ``sim`` has them."""
    return save_model(path, "Table 3", Actuator(THESIS_FILM, THESIS_LOAD, TABLE_3), {}, True)


def film_model(path: Path) -> Path:
    """Model file of a bare film."""
    return save_model(path, "a film", Strip(FILM_NETWORK), {}, True)


def film_csv(path: Path, rate: float, seed: int, samples: int = 400) -> Path:
    """A tensile test of ``FILM_NETWORK``: to stretch 1.5 at ``rate`` 1/s and back, with noise."""
    time = np.linspace(0.0, 1.0 / rate, samples)
    stretch = 1.5 - 0.5 * np.abs(2.0 * rate * time - 1.0)
    answer = Strip(FILM_NETWORK).simulate(time, stretch)
    assert answer.ok
    noise = np.random.default_rng(seed).normal(0.0, 50.0, samples)
    table = np.column_stack([time, stretch, (answer.stress + noise) * 1e-3])
    np.savetxt(path, table, delimiter=",", comments="", header="time_s,stretch,nominal_stress_kPa")
    return path


def names(folder: Path) -> set[str]:
    """What lies in a folder."""
    return {p.name for p in folder.iterdir()}
