"""Addresses of cards, and what DAQmx's codes become in words."""

import socket
import threading
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import grpc
import nidaqmx.errors
import numpy as np
import pytest
from grpc import StatusCode
from nidaqmx import GrpcSessionOptions
from nidaqmx.system import Device

from dearig.drivers.daqmx.address import Address
from dearig.drivers.daqmx.explain import _KNOWN, explained, instrument_errors
from dearig.drivers.errors import AddressError, RigError


@pytest.mark.parametrize(
    ("text", "device", "server"),
    [
        ("daqmx:Dev1", "Dev1", None),
        ("daqmx:rig_2", "rig_2", None),
        ("daqmx:Dev1@127.0.0.1:31763", "Dev1", "127.0.0.1:31763"),
        ("daqmx:Dev1@lab-pc.example:9", "Dev1", "lab-pc.example:9"),
    ],
)
def test_addresses(text, device, server):
    assert Address.parse(text) == Address(device, server)
    assert str(Address.parse(text)) == text


@pytest.mark.parametrize(
    "text",
    ["daqmx:", "daqmx:Dev1@", "daqmx:Dev1@host", "daqmx:Dev1@host:0", "daqmx:Dev1@host:99999",
     "daqmx:1Dev", "daqmx:Dev1/ao0", "daqmx:Dev 1", "daqmx:Dev1@a b:1", "sim"],
)  # fmt: skip
def test_addresses_that_are_none(text):
    with pytest.raises(AddressError, match="daqmx:Dev1@HOST:PORT"):
        Address.parse(text)


@pytest.mark.parametrize("code", sorted(_KNOWN))
def test_known_codes_are_codes_of_the_library(code):
    nidaqmx.error_codes.DAQmxErrors(code)  # raises where there is none
    said = explained("Dev1", code, "")
    assert said.startswith("card Dev1: ")
    assert f"(DAQmx {code}); " in said


def test_an_unknown_code_keeps_what_daqmx_said_of_it():
    said = explained("Dev1", -123456, "Something odd\nhappened.\n\nTask Name: _unnamed<0>")
    assert "Something odd happened (DAQmx -123456)" in said


@pytest.mark.parametrize(
    ("raised", "code", "said"),
    [
        (nidaqmx.errors.DaqError("x", -50103), -50103, "in use by another program"),
        (nidaqmx.errors.DaqReadError("x", -200279, 0), -200279, "read too late"),
        (nidaqmx.errors.DaqNotFoundError("x"), None, "NI-DAQmx is not installed"),
        (nidaqmx.errors.DaqNotSupportedError("x"), None, "does not exist for this operating"),
        (nidaqmx.errors.RpcError(StatusCode.UNAVAILABLE, "x"), None, r"host:1 does not .*UNAVAIL"),
        (nidaqmx.errors.DaqFunctionNotSupportedError("no such call"), None, "no such call"),
    ],
)
def test_whatever_the_library_raises_becomes_a_sentence(raised, code, said):
    with pytest.raises(RigError, match=said) as caught, instrument_errors("Dev1", "host:1"):
        raise raised
    assert caught.value.code == code


def test_other_errors_are_not_the_instruments():
    with pytest.raises(ZeroDivisionError), instrument_errors("Dev1", None):
        raise ZeroDivisionError


@contextmanager
def grpc_server() -> Iterator[int]:
    server = grpc.server(ThreadPoolExecutor(1))
    port = server.add_insecure_port("127.0.0.1:0")
    server.start()
    yield port
    server.stop(0).wait()


@contextmanager
def web_server() -> Iterator[int]:
    handler = type("Quiet", (BaseHTTPRequestHandler,), {"log_message": lambda *_: None})
    with ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        yield server.server_port
        server.shutdown()
        thread.join()


@contextmanager
def nobody() -> Iterator[int]:
    with socket.create_server(("127.0.0.1", 0)) as port:
        number = port.getsockname()[1]
    yield number


@pytest.mark.parametrize(
    ("peer", "said"),
    [
        (grpc_server, "a server that does not know this call .UNIMPLEMENTED.; it is not NI's"),
        (web_server, "a program that does not speak gRPC"),
        (nobody, "does not answer .UNAVAILABLE."),
    ],
)
def test_peer_that_is_no_daqmx_server_is_said_to_be_none(peer, said):
    with peer() as port, grpc.insecure_channel(f"127.0.0.1:{port}") as channel:
        device = Device("Dev1", grpc_options=GrpcSessionOptions(channel, ""))
        where = f"127.0.0.1:{port}"
        with pytest.raises(RigError, match=said) as caught, instrument_errors("Dev1", where):
            device.self_test_device()
    assert where in str(caught.value)


@pytest.mark.parametrize(
    ("code", "cause"), [(-200561, "beyond the range of its channel"), (-200081, "do not fit")]
)
def test_cause_is_that_of_the_librarys_table(code, cause):
    assert cause in explained("Dev1", code, "")


def test_a_garbled_reply_is_an_instrument_fault_and_no_mistake_of_the_program() -> None:
    from nidaqmx._grpc_interpreter import _assign_numpy_array

    with (
        pytest.raises(
            RigError, match=r"reply of the server host:1 makes no sense \(AssertionError\)"
        ),
        instrument_errors("Dev1", "host:1"),
    ):
        _assign_numpy_array(np.empty(1), np.empty(2))  # more samples than were asked for
