"""What no client can do to the simulated card's server: take its threads, memory or terminal."""

from __future__ import annotations

import logging
import re
import signal
import socket
import struct
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import ExitStack, suppress
from pathlib import Path

import grpc
import nidaqmx
import numpy as np
import pytest
from google.protobuf.descriptor import FieldDescriptor
from nidaqmx import GrpcSessionOptions
from nidaqmx._stubs import nidaqmx_pb2 as pb
from nidaqmx.constants import TaskMode
from nidaqmx.errors import DaqError, RpcError
from nidaqmx.system import Device

from dearig.sim_backend.clock import ManualClock, PacedClock
from tests.deep import mostly_deep
from tests.tools.certificates import make_certificates, needs_openssl
from tests.tools.daqmx import (
    HandClock,
    Served,
    add_inputs,
    add_output,
    clock_inputs,
    clock_output,
    connected,
    in_thread,
    open_channel,
    served,
    task,
)

LISTENERS, WAITERS = 64, 64  # that the server has places for
BUSY, NO_MEMORY, BAD_VALUE = -50101, -50352, -200077
METHODS = pb.DESCRIPTOR.services_by_name["NiDAQmx"].methods
_PREFACE = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n"


def answers(card: Served) -> bool:
    """A client with a connection of its own is answered."""
    with connected(card.server.port) as session:
        return Device("Dev1", grpc_options=session).product_type == "PCIe-6361"


def clocked(card: Served) -> nidaqmx.Task:
    made = nidaqmx.Task(grpc_options=card.session)
    add_inputs(made, "ai5")
    clock_inputs(made, 1000.0)
    return made


# threads


@pytest.mark.parametrize("event", mostly_deep(["done", "samples"], ["samples"]))
def test_who_listens_takes_no_thread_from_others_and_one_too_many_is_told_so(event: str) -> None:
    def listen(made: nidaqmx.Task) -> None:
        if event == "done":
            made.register_done_event(lambda *_: 0)
        else:
            made.register_every_n_samples_acquired_into_buffer_event(100, lambda *_: 0)

    with served() as card, ExitStack() as kept:
        tasks = [kept.enter_context(clocked(card)) for _ in range(LISTENERS + 1)]
        for made in tasks[:-1]:
            listen(made)
        assert answers(card)
        with pytest.raises(DaqError) as caught:
            listen(tasks[-1])
        assert caught.value.error_code == BUSY
        assert f"at most {LISTENERS} events" in str(caught.value)
        assert answers(card)
        # the place of one that leaves is free once the server has seen that no one listens
        if event == "done":
            tasks[0].register_done_event(None)
        else:
            tasks[0].register_every_n_samples_acquired_into_buffer_event(100, None)
        for _ in range(200):
            with suppress(DaqError):
                listen(tasks[-1])
                break
        else:
            pytest.fail("the place of a listener that left is still taken")


def test_who_waits_takes_no_thread_from_others_and_one_too_many_is_told_so() -> None:
    clock = HandClock()
    with served(clock=clock) as card, ExitStack() as kept:
        ao = kept.enter_context(nidaqmx.Task(grpc_options=card.session))
        add_output(ao)
        clock_output(ao, 1000.0, 2000)
        ao.write(np.zeros(2000))
        ao.start()
        pending = []
        for place in range(WAITERS):
            pending.append(in_thread(lambda: ao.wait_until_done(100.0)))
            with clock._moved:
                assert clock._moved.wait_for(lambda n=place: clock.waiters > n, timeout=30.0)
        assert answers(card)
        with pytest.raises(DaqError) as caught:
            ao.wait_until_done(100.0)
        assert caught.value.error_code == BUSY
        # what takes the output down does not wait
        assert answers(card)
        with task(card.session) as zero:
            add_inputs(zero, "ai0")
            assert abs(zero.read()) < 0.1
        clock.advance(10.0)
        for done in pending:
            done()


# requests


def _ni_error(error: grpc.RpcError) -> int | None:
    found = dict(error.trailing_metadata() or ())
    return int(found["ni-error"]) if "ni-error" in found else None


def _outcome(channel: grpc.Channel, name: str, data: bytes) -> tuple[grpc.StatusCode, int | None]:
    """Call ``name`` with the bytes ``data``; returns the status and DAQmx's code."""
    call = channel.unary_stream(
        f"/nidaqmx_grpc.NiDAQmx/{name}",
        request_serializer=lambda raw: raw,
        response_deserializer=lambda raw: raw,
    )
    try:
        list(call(data, timeout=20.0))
    except grpc.RpcError as error:
        return error.code(), _ni_error(error)
    return grpc.StatusCode.OK, None


@pytest.fixture(scope="module")
def channel() -> Iterator[grpc.Channel]:
    with served() as card:
        made = open_channel(card.server.port)
        yield made
        made.close()


@pytest.fixture(autouse=True)
def _no_traceback_in_the_terminal(caplog: pytest.LogCaptureFixture) -> Iterator[None]:
    caplog.set_level(logging.WARNING)
    yield
    assert [record.getMessage() for record in caplog.records if record.exc_info] == []


def _requests_with(kind: int) -> list[tuple[str, str]]:
    """Calls with a field of ``kind`` that holds one value."""
    return [
        (method.name, field.name)
        for method in METHODS
        for field in method.input_type.fields
        if field.type == kind and not field.is_repeated
    ]


@pytest.mark.parametrize("samples", [2**32 - 1, 10**9, 2**22 + 1])
def test_a_reply_beyond_the_servers_memory_is_refused(channel: grpc.Channel, samples: int) -> None:
    reads = [
        (method, field.name)
        for method in METHODS
        for field in method.input_type.fields
        if field.name.startswith("array_size")
    ]
    assert len(reads) > 30
    for method, field in reads:
        size = min(2**32 - 1, samples * (2 if field.endswith("bytes") else 1))
        request = getattr(pb, method.input_type.name)(**{field: size})
        outcome = _outcome(channel, method.name, request.SerializeToString())
        assert outcome == (grpc.StatusCode.UNKNOWN, NO_MEMORY), method.name


def test_a_read_of_a_billion_samples_says_what_to_do(card: Served, inputs: nidaqmx.Task) -> None:
    with pytest.raises(DaqError, match="read them in several calls") as caught:
        inputs.read(10**7)
    assert caught.value.error_code == NO_MEMORY
    assert answers(card)


def test_a_text_without_end_is_refused_in_every_call(channel: grpc.Channel) -> None:
    long = "x" * 100_000
    for name, field in _requests_with(FieldDescriptor.TYPE_STRING):
        method = next(m for m in METHODS if m.name == name)
        request = getattr(pb, method.input_type.name)(**{field: long})
        outcome = _outcome(channel, name, request.SerializeToString())
        assert outcome == (grpc.StatusCode.UNKNOWN, BAD_VALUE), (name, field)


def test_a_number_that_is_none_is_refused_in_every_call(channel: grpc.Channel) -> None:
    for name, field in _requests_with(FieldDescriptor.TYPE_DOUBLE):
        method = next(m for m in METHODS if m.name == name)
        request = getattr(pb, method.input_type.name)(**{field: float("nan")})
        outcome = _outcome(channel, name, request.SerializeToString())
        assert outcome == (grpc.StatusCode.UNKNOWN, BAD_VALUE), (name, field)


@pytest.mark.parametrize(
    "data", mostly_deep([b"\xff" * 40, b"\x0a", b"\x0a\x7f1", b""], [b"\x0a\x7f1", b""])
)
def test_bytes_that_are_no_message_and_empty_ones_are_answered(
    channel: grpc.Channel, data: bytes
) -> None:
    for method in METHODS:
        code, _ = _outcome(channel, method.name, data)
        assert code in (
            grpc.StatusCode.OK, grpc.StatusCode.UNKNOWN, grpc.StatusCode.UNIMPLEMENTED
        ), method.name  # fmt: skip


def test_a_wait_that_is_longer_than_a_computer_can_wait(card: Served) -> None:
    with served(clock=PacedClock()) as paced, task(paced.session) as ai:
        add_inputs(ai, "ai0")
        clock_inputs(ai, 1000.0, 20, source="")
        ai.start()
        ai.wait_until_done(1e300)
        assert len(ai.read(20, timeout=1e300)) == 20
    assert answers(card)


def test_samples_that_a_request_does_not_hold(card: Served, output: nidaqmx.Task) -> None:
    from nidaqmx._stubs import nidaqmx_pb2_grpc as pb_grpc

    stub = pb_grpc.NiDAQmxStub(open_channel(card.server.port))
    for number in (-1, -(2**31), 2**31 - 1):
        for request, call in (
            (pb.WriteAnalogF64Request(task=output._handle, num_samps_per_chan=number,
                                      write_array=[0.0]), stub.WriteAnalogF64),
            (pb.WriteRawRequest(task=output._handle, num_samps=number,
                                write_array=b"123"), stub.WriteRaw),
        ):  # fmt: skip
            with pytest.raises(grpc.RpcError) as caught:
                call(request)
            assert _ni_error(caught.value) is not None


def test_a_call_that_is_not_simulated_is_no_death_of_its_client(card: Served) -> None:
    with task(card.session) as ao:
        add_output(ao)
        ao.write(5.0)
        for _ in range(50):
            with pytest.raises(RpcError, match="not supported"):
                Device("Dev1", grpc_options=card.session).delete_network_device()
        assert card.device.wire_voltage() == pytest.approx(5000.0, abs=1.0)


# what grows


def test_tasks_that_nobody_clears_are_bounded(card: Served) -> None:
    kept = [card.device.create("", "somebody")[0] for _ in range(1000)]
    with pytest.raises(DaqError, match="clear some") as caught:
        nidaqmx.Task(grpc_options=card.session)
    assert caught.value.error_code == NO_MEMORY
    card.device.clear(kept[0])
    with task(card.session) as made:
        assert made.name


def test_clients_that_left_are_forgotten() -> None:
    link = ManualClock()
    with served(link=link) as card:
        for _ in range(20):
            assert answers(card)
        with connected(card.server.port) as other, task(other) as kept:
            assert len(card.server.clients.known) == 21
            link.advance(61.0)
            card.server.clients.check()
            # who has a task may come back to it
            assert len(card.server.clients.known) == 1
            assert kept.name


def test_events_that_nobody_hears_do_not_pile_up() -> None:
    clock = HandClock()
    with served(clock=clock) as card, task(card.session) as ai:
        add_inputs(ai, "ai0")
        clock_inputs(ai, 1000.0, source="")
        there = card.device.task(ai.name)
        listening = card.device.listen(there, 1, object(), 1)
        ai.start()
        clock.advance(1e7)  # 10^10 samples
        due = card.device.due_events(there, listening)
        assert len(due) == 10_000
        assert len(card.device.due_events(there, listening)) == 10_000  # none is lost


@pytest.mark.deep
def test_the_card_remembers_a_bounded_past(card: Served, output: nidaqmx.Task) -> None:
    there = card.device.task(output.name)
    for place in range(100_100):
        card.device.wire.set_output("ao0", place % 2 * 1000, 0.0)
    assert len(card.device.history()) == 100_000
    assert there.name


def test_a_clock_that_jumps_far_costs_no_search_through_all_samples() -> None:
    with served() as card, task(card.session) as ao:
        add_output(ao)
        clock_output(ao, 2e6)
        ao.write(np.concatenate([np.ones(500), np.zeros(500)]))
        ao.start()
        with pytest.raises(DaqError) as caught:
            ao.wait_until_done(1e9)  # 2 * 10^15 samples
        assert caught.value.error_code == -200560
        assert answers(card)
        ao.stop()
        ao.control(TaskMode.TASK_UNRESERVE)
        with task(card.session) as zero:
            add_output(zero)
            zero.write(0.0)
        assert card.device.history()[-1].wire == 0.0


# the terminal


@needs_openssl
@pytest.mark.skipif(sys.platform == "win32", reason="a process cannot be asked to end there")
def test_nothing_that_a_client_does_writes_a_traceback_to_the_terminal(tmp_path: Path) -> None:
    there = make_certificates(tmp_path / "certificates")
    options = ["--tls-cert", "server.pem", "--tls-key", "server.key", "--tls-client-ca", "ca.pem"]
    process = subprocess.Popen(
        [sys.executable, "-m", "dearig", "serve-daqmx", "--fast", *options],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=there,
    )  # fmt: skip
    try:
        assert process.stdout is not None
        line = process.stdout.readline()
        assert "--rig daqmx:Dev1@127.0.0.1:" in line
        port = int(re.findall(r":(\d+);", line)[0])
        for data in (b"\x00" * 1000, _PREFACE, b""):
            with socket.create_connection(("127.0.0.1", port)) as plain:
                plain.sendall(data)
        with connected(port) as session, pytest.raises(RpcError):
            nidaqmx.Task(grpc_options=session)
        credentials = grpc.ssl_channel_credentials(
            *((there / name).read_bytes() for name in ("ca.pem", "client.key", "client.pem"))
        )
        with grpc.secure_channel(f"127.0.0.1:{port}", credentials) as channel:
            device = Device("Dev1", grpc_options=GrpcSessionOptions(channel, ""))
            assert device.product_type == "PCIe-6361"
            for name, data in (
                ("CfgHandshakingTiming", b""), ("CreateTask", b"\xff" * 9), ("ReadRaw", b""),
                ("RegisterDoneEvent", b""), ("WriteRaw", b"\x0a\x02\x0a\x00"), ("NoSuchCall", b""),
            ):  # fmt: skip
                assert _outcome(channel, name, data)[0] is not grpc.StatusCode.OK
        process.send_signal(signal.SIGTERM)
        _, said = process.communicate(timeout=60.0)
    finally:
        process.kill()
        process.communicate()
    assert process.returncode == 0
    lines = said.splitlines()
    assert len(lines) == 1, said
    assert "CfgHandshakingTiming is not simulated" in lines[0]


# connections


def test_connections_that_say_nothing_or_nonsense_cost_others_nothing(card: Served) -> None:
    half = _PREFACE + struct.pack(">I", 0x4000)[1:] + b"\x00\x00" + struct.pack(">I", 1)
    for first in (b"", b"\x00" * 10_000, b"GET / HTTP/1.1\r\n\r\n", _PREFACE[:10], half):
        with ExitStack() as sockets:
            there = [
                sockets.enter_context(socket.create_connection(("127.0.0.1", card.server.port)))
                for _ in range(30)
            ]
            for one in there:
                one.sendall(first)
            assert answers(card)
            if len(first) < len(_PREFACE):
                there[0].settimeout(30.0)
                while there[0].recv(4096):  # dropped, as its settings do not come
                    pass


def test_connections_without_end_do_not_take_the_servers_files(card: Served) -> None:
    assert Device("Dev1", grpc_options=card.session).product_type == "PCIe-6361"
    with ExitStack() as sockets:
        for _ in range(400):
            sockets.enter_context(socket.create_connection(("127.0.0.1", card.server.port)))
        # a connection that is there goes on
        assert Device("Dev1", grpc_options=card.session).product_type == "PCIe-6361"
    ended = threading.Event()
    for _ in range(100):
        try:
            assert answers(card)
            break
        except RpcError:
            ended.wait(0.1)
    else:
        pytest.fail("no client is let in after the others have left")
