"""NI-DAQmx's errors in one sentence each: code, likely cause, what to do.

Codes and meanings are those of ``nidaqmx.error_codes.DAQmxErrors``.
"""

from __future__ import annotations

import re
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from dearig.drivers.errors import RigError

if TYPE_CHECKING:
    from nidaqmx.errors import RpcError

__all__ = [
    "ABORTED",
    "INPUT_OVERWRITTEN",
    "RESERVED",
    "TIMEOUT",
    "WATCHDOG_EXPIRED",
    "explained",
    "instrument_errors",
]

ABORTED = (-88708, -88709, -200088)  #: a reset ended the task, or a program cleared it
RESERVED = -50103  #: another task holds the card
TIMEOUT = -200284  #: samples did not arrive in time
WATCHDOG_EXPIRED = -200644  #: the card's watchdog has acted
INPUT_OVERWRITTEN = -200279  #: the reader was too late

#: gRPC's words on a peer that answers -> what it is, and what to do
_ANSWERS = {
    r"(?i)wrong_version_number": "answers a server without TLS: set up TLS there, or remove "
    "card.tls_ca",
    r"(?i)certificate_verify_failed": "answers a server whose certificate is not trusted: compare "
    "card.tls_ca with the authority that signed it, and its date",
    r"(?i)hostname verification|peer name": "answers a server whose certificate is for another "
    "name: use a name that it has, in the rig's address",
    r"(?i)failed to connect.*(socket closed|connection reset)": "the connection is closed by what "
    "answers: if it is a server with TLS, set card.tls_ca, and card.tls_cert and card.tls_key if "
    "it asks for them",
    r"(?i)http/?2|http status|unexpected content-type": "answers a program that does not speak "
    "gRPC; it is not a DAQmx server: check the port",
}

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
        "it does not have the requested range, rate or terminal configuration",
        "compare the ranges and rates in [card] with the card's manual",
    ),
    -200332: (
        "the sample rate is too high for so many channels",
        "lower card.sample_rate_Hz or card.average",
    ),
    -200081: (
        "the conversions of all inputs do not fit between two samples",
        "lower card.sample_rate_Hz, card.average or card.convert_interval_us, or read fewer inputs",
    ),
    -200279: (
        "the inputs were read too late and the oldest samples were overwritten",
        "close other programs, lower card.sample_rate_Hz or card.average, or enlarge "
        "card.ai_buffer_samples",
    ),
    -200361: (
        "its input memory overflowed: samples came faster than the computer read them",
        "lower card.sample_rate_Hz or card.average, or move the card to a bus that it does not "
        "share",
    ),
    -200290: (
        "the output ran out of samples: the program wrote too late, and the last value was held",
        "close other programs, lower card.sample_rate_Hz or card.average, or enlarge "
        "card.ao_buffer_s",
    ),
    -200621: (
        "its output memory ran empty: the computer sent samples too slowly",
        "lower card.sample_rate_Hz or card.average, or move the card to a bus that it does not "
        "share",
    ),
    -200284: (
        "no samples came in time: its sample clock does not run",
        "check that nothing else uses the card's clocks; reset it and try again",
    ),
    -200561: (
        "a value to be output is beyond the range of its channel",
        "compare card.ao_range_V, amplifier.gain_V_per_V and amplifier.offset_V with the rig",
    ),
    -200560: (
        "the task did not end in the expected time",
        "check that the card's clock runs; reset it and try again",
    ),
    -200088: (
        "its task is gone: the card was reset, or another program took it over",
        "check what else uses the card; the output is at 0 V if the guardian took over",
    ),
    -200644: (
        "its watchdog has taken the enable line low, because the program was silent for too long",
        "find out what kept the program from running; close other programs",
    ),
    -200678: (
        "its watchdog has expired and holds the enable line low",
        "start the run again, which ends the watchdog",
    ),
    -201003: (
        "it does not answer: unplugged, without power, or lost its bus",
        "check that NI MAX shows the card",
    ),
    -88708: ("it was removed or reset during a task", "check that no other program uses it"),
    -88709: ("it was removed or reset during a task", "check that no other program uses it"),
}


def explained(device: str, code: int, said: str) -> str:
    """Return ``code`` on ``device`` as a sentence; for an unknown code DAQmx's text ``said``."""
    if code in _KNOWN:
        why, do = _KNOWN[code]
        return f"card {device}: {why} (DAQmx {code}); {do}"
    first = re.split(r"\n\s*\n|\n(?=Status Code|Task Name|Property:)", said.strip(), maxsplit=1)[0]
    words = " ".join(first.split()).rstrip(".")
    return f"card {device}: {words} (DAQmx {code}); look the code up in NI's knowledge base"


@contextmanager
def instrument_errors(device: str, server: str | None, *, answered: bool = False) -> Iterator[None]:
    """Convert every error of nidaqmx into ``RigError`` with a sentence.

    ``answered``: the ``server`` has answered on this connection, so what fails is not its set-up.
    """
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
        raise RigError(f"card {device}: {_server_fault(server, error, answered)}") from error
    except nidaqmx.errors.Error as error:
        raise RigError(f"card {device}: {error}") from error
    except Exception as error:
        # a reply that was garbled on its way fails anywhere in the client library
        if server is None or not _raised_in_library(error):
            raise
        raise RigError(
            f"card {device}: the reply of the server {server} makes no sense "
            f"({type(error).__name__}); check the network between this computer and the server"
        ) from error


#: Packages that decode the replies of a server.
_LIBRARIES = ("nidaqmx", "grpc", "google")


def _raised_in_library(error: Exception) -> bool:
    """Return True if ``error`` was raised in a library that decodes replies, not here."""
    innermost = list(traceback.walk_tb(error.__traceback__))[-1][0]
    return str(innermost.f_globals.get("__name__", "")).partition(".")[0] in _LIBRARIES


def _server_fault(server: str | None, error: RpcError, answered: bool) -> str:
    """Return the fault of ``server`` as a clause, with what to do."""
    code = getattr(error.rpc_code, "name", str(error.rpc_code))
    if code == "UNIMPLEMENTED":
        return (
            f"at {server} answers a server that does not know this call ({code}); it is not NI's "
            f"gRPC device server with NI-DAQmx, or an older one: check the port, update the server"
        )
    details = getattr(error.__context__, "details", None)  # nidaqmx replaces gRPC's own words
    words = "" if details is None else details() or ""
    if answered:
        return (
            f"its server {server} does not answer ({code}), and has answered before: the network "
            f"between is cut or disturbed, or the server has ended"
        )
    for pattern, sentence in _ANSWERS.items():
        if re.search(pattern, words):
            return f"at {server} {sentence} ({code})"
    return (
        f"its server {server} does not answer ({code}); check that it runs and that the network "
        f"works"
    )
