"""Addresses of cards, and what DAQmx's codes become in words."""

import nidaqmx.errors
import pytest
from grpc import StatusCode

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
