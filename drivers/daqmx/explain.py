"""NI-DAQmx's errors as one sentence each: the code, the likely cause and what to do.

Codes and their meaning are those of ``nidaqmx.error_codes.DAQmxErrors``.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager

from dearig.drivers.errors import RigError

__all__ = ["INPUT_OVERWRITTEN", "RESERVED", "TIMEOUT", "explained", "instrument_errors"]

RESERVED = -50103  #: another task holds the card
TIMEOUT = -200284  #: samples did not come in time
INPUT_OVERWRITTEN = -200279  #: the reader came too late

#: code -> (what happened and why, what to do)
_KNOWN: dict[int, tuple[str, str]] = {
    -50103: (
        "it is in use by another program or another task",
        "close NI MAX test panels and other programs that use the card; if none is open, reset it",
    ),
    -200220: (
        "there is no device of that name",
        "look the name up in NI MAX and write it in the rig's address and card.device",
    ),
    -200170: (
        "it has no such terminal",
        "compare card.ao_command and card.ai_... with the card's pins",
    ),
    -200077: (
        "it cannot do what was asked: a range, rate or terminal configuration it does not have",
        "compare the ranges and rates in [card] with the card's manual",
    ),
    -200332: (
        "the sample rate is more than it can do on so many channels",
        "lower card.sample_rate_Hz",
    ),
    -200081: ("the sample rate is out of its range", "change card.sample_rate_Hz"),
    -200279: (
        "the inputs were read too late and the oldest samples were overwritten",
        "close other programs, lower card.sample_rate_Hz or enlarge card.ai_buffer_samples",
    ),
    -200361: (
        "its input memory overflowed: samples came faster than the computer took them",
        "lower card.sample_rate_Hz, or move the card to a bus that it does not share",
    ),
    -200290: (
        "the output ran out of samples: the program wrote too late, and the last value stood",
        "close other programs, lower card.sample_rate_Hz or enlarge card.ao_buffer_s",
    ),
    -200621: (
        "its output memory ran empty: the computer brought samples too slowly",
        "lower card.sample_rate_Hz, or move the card to a bus that it does not share",
    ),
    -200284: (
        "no samples came in time: its sample clock does not run",
        "see that nothing else uses the card's clocks; reset it and try again",
    ),
    -200561: (
        "it was written more channels than the task has",
        "this is a fault of the program; report it",
    ),
    -200560: (
        "the task did not end in the time it should take",
        "see that the card's clock runs; reset it and try again",
    ),
    -200088: (
        "its task is gone: the card was reset, or another program took it over",
        "see what else uses the card; the output was taken to 0 V if the guardian did it",
    ),
    -201003: (
        "it does not answer: unplugged, without power, or lost its bus",
        "see that the card is there in NI MAX",
    ),
    -88708: ("it was removed or reset during a task", "check that no other program uses it"),
    -88709: ("it was removed or reset during a task", "check that no other program uses it"),
}


def explained(device: str, code: int, said: str) -> str:
    """Return ``code`` on ``device`` as a sentence; for an unknown code, what DAQmx ``said``."""
    if code in _KNOWN:
        why, do = _KNOWN[code]
        return f"card {device}: {why} (DAQmx {code}); {do}"
    first = re.split(r"\n\s*\n|\n(?=Status Code|Task Name|Property:)", said.strip(), maxsplit=1)[0]
    words = " ".join(first.split()).rstrip(".")
    return f"card {device}: {words} (DAQmx {code}); look the code up in NI's knowledge base"


@contextmanager
def instrument_errors(device: str, server: str | None) -> Iterator[None]:
    """Turn whatever nidaqmx raises into ``RigError`` with a sentence."""
    import nidaqmx.errors

    try:
        yield
    except nidaqmx.errors.DaqNotFoundError as error:
        raise RigError(
            f"card {device}: NI-DAQmx is not installed on this computer; install the NI-DAQmx "
            f"runtime of NI's web site, or name a server: daqmx:{device}@HOST:PORT"
        ) from error
    except nidaqmx.errors.DaqNotSupportedError as error:
        raise RigError(
            f"card {device}: NI-DAQmx does not exist for this operating system; name a server: "
            f"daqmx:{device}@HOST:PORT"
        ) from error
    except nidaqmx.errors.DaqError as error:
        raise RigError(explained(device, error.error_code, str(error)), error.error_code) from error
    except nidaqmx.errors.RpcError as error:
        raise RigError(
            f"card {device}: its server {server} does not answer "
            f"({getattr(error.rpc_code, 'name', error.rpc_code)}); see that it runs and that the "
            f"network is there"
        ) from error
    except nidaqmx.errors.Error as error:
        raise RigError(f"card {device}: {error}") from error
