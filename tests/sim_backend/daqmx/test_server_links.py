"""The simulated card's link: clients that die or fall silent, faults on purpose, the command."""

import logging
import signal
import socket
import subprocess
import sys
import threading
from contextlib import contextmanager

import grpc
import nidaqmx
import numpy as np
import pytest
from nidaqmx.errors import DaqError, DaqReadError, RpcError
from nidaqmx.system import Device

from dearig.drivers.contract.rig import RATE
from dearig.sim_backend.clock import ManualClock, PacedClock
from tests.deep import mostly_deep
from tests.tools.command import dearig
from tests.tools.daqmx import (
    ENABLE,
    HandClock,
    add_inputs,
    add_output,
    clock_inputs,
    clock_output,
    connected,
    enabled_rig,
    in_thread,
    read,
    served,
    task,
    write,
)


class _Heard(logging.Handler):
    """Knows when the server has said that it made the rig safe."""

    def __init__(self) -> None:
        super().__init__()
        self.messages: list[str] = []
        self.something = threading.Event()

    def emit(self, record: logging.LogRecord) -> None:
        self.messages.append(record.getMessage())
        self.something.set()


@pytest.fixture
def heard():
    handler = _Heard()
    log = logging.getLogger("dearig.sim_backend.daqmx.protocol.clients")
    log.addHandler(handler)
    yield handler
    log.removeHandler(handler)


@contextmanager
def victim(port: int, how: str):
    """A client in a process of its own that has put 5 V on the output."""
    process = subprocess.Popen(
        [sys.executable, "-m", "tests.tools.daqmx_client", str(port), how],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        assert process.stdout is not None
        assert process.stdout.readline() == "5 V\n"
        yield process
    finally:
        process.kill()
        process.communicate()


def high(device) -> bool:
    return device.wire_voltage() == pytest.approx(5000.0, abs=0.2)


@pytest.mark.parametrize("how", mostly_deep(["listening", "reading", "silent"], ["silent"]))
def test_a_killed_client_has_its_voltage_taken_away(heard, how):
    clock = HandClock()
    link = PacedClock()
    with served(clock=clock, link=link) as card, victim(card.server.port, how) as process:
        assert high(card.device)
        if how == "reading":
            clock.until_somebody_waits()
        process.kill()
        assert heard.something.wait(30.0)
        assert card.device.wire_voltage() == 0.0
        expected = "silent" if how == "silent" else "connection has ended"
        assert expected in heard.messages[0]
        # the last change is to 0 V, and nothing is left of what the client held
        assert card.device.history()[-1].wire == 0.0
        with task(card.session) as ao:
            add_output(ao)
            ao.write(1.0)


@pytest.mark.skipif(sys.platform == "win32", reason="a process cannot be halted there")
def test_a_client_that_is_halted_has_its_voltage_taken_away(heard):
    """Its link is up and its calls do not come: the pings that no one answers tell."""
    with (
        served(client_timeout=3600.0, link_timeout=1.0) as card,
        victim(card.server.port, "listening") as process,
    ):
        process.send_signal(signal.SIGSTOP)
        assert heard.something.wait(30.0)
        assert "connection has ended" in heard.messages[0]
        assert card.device.wire_voltage() == 0.0
        process.send_signal(signal.SIGCONT)


@pytest.mark.deep
def test_without_tracking_the_voltage_stays_as_on_the_real_server():
    with served(client_timeout=None) as card:
        with victim(card.server.port, "listening") as process:
            process.kill()
            process.wait()
        with connected(card.server.port) as other:
            assert Device("Dev1", grpc_options=other).product_type == "PCIe-6361"
            assert high(card.device)


def test_silence_is_counted_on_the_links_clock_and_only_with_a_voltage(heard):
    link = ManualClock()
    with served(enabled_rig(), link=link) as card:
        session = card.session
        with task(session) as line, task(session) as ao:
            line.do_channels.add_do_chan(f"Dev1/{ENABLE}")
            line.write(True)
            add_output(ao)
            ao.write(0.0)
            link.advance(5.0)
            card.server.clients.check()
            assert card.device.line(ENABLE) is True
            ao.write(5.0)
            link.advance(0.9)
            card.server.clients.check()
            assert high(card.device)
            assert not heard.something.is_set()
            assert ao.name  # it has spoken
            link.advance(0.9)
            card.server.clients.check()
            assert high(card.device)
            link.advance(0.2)
            card.server.clients.check()
            assert heard.something.wait(30.0)
            assert card.device.wire_voltage() == 0.0
            assert card.device.output_voltage() == 0.0
            assert card.device.line(ENABLE) is False
            ao.write(2.0)  # it was only silent


def test_who_waits_for_an_answer_is_not_silent():
    clock, link = HandClock(), ManualClock()
    with served(clock=clock, link=link) as card, task(card.session) as ao:
        add_output(ao)
        clock_output(ao, RATE, 2000)
        ao.write(np.full(2000, 5.0))
        ao.start()
        pending = in_thread(lambda: ao.wait_until_done(10.0))
        clock.until_somebody_waits()
        link.advance(5.0)
        card.server.clients.check()
        assert high(card.device)
        clock.advance(3.0)
        pending()


def test_another_clients_voltage_is_not_taken_from_it():
    link = ManualClock()
    with served(link=link) as card, connected(card.server.port) as other:
        with task(card.session) as first:
            add_output(first)
            first.write(1.0)
        with task(other) as second:
            add_output(second)
            second.write(5.0)
            link.advance(0.9)
            assert second.name  # it speaks, the first one does not
            link.advance(0.9)
            card.server.clients.check()
            assert high(card.device)


def test_clearing_a_task_with_an_event_is_no_death(heard):
    with served() as card:
        with task(card.session) as ao:
            add_output(ao)
            ao.register_done_event(lambda *_: 0)
            ao.write(5.0)
        assert Device("Dev1", grpc_options=card.session).serial_num
        assert high(card.device)
        assert not heard.something.is_set()


def test_a_client_that_gives_up_waiting_is_not_gone():
    with served() as card, task(card.session) as ao, task(card.session) as ai:
        add_output(ao)
        ao.write(5.0)
        add_inputs(ai)
        clock_inputs(ai, RATE)
        ai.start()
        stub = ai._interpreter._client
        from nidaqmx._stubs import nidaqmx_pb2 as pb

        with pytest.raises(grpc.RpcError) as caught:
            stub.ReadRaw(
                pb.ReadRawRequest(
                    task=ai._handle, num_samps_per_chan=5, timeout=-1.0, array_size_in_bytes=30
                ),
                timeout=0.2,
            )
        assert caught.value.code() is grpc.StatusCode.DEADLINE_EXCEEDED
        assert ai.name
        assert high(card.device)
        ai.stop()


def test_closing_the_server_takes_the_output_to_zero():
    with served(enabled_rig()) as card:
        ao, line = (nidaqmx.Task(grpc_options=card.session) for _ in range(2))
        add_output(ao)
        ao.write(5.0)
        line.do_channels.add_do_chan(f"Dev1/{ENABLE}")
        line.write(True)
        assert high(card.device)
        card.server.close()
        assert card.device.wire_voltage() == card.device.output_voltage() == 0.0
        assert card.device.line(ENABLE) is False
        for made in (ao, line):
            with pytest.raises(RpcError):
                made.close()


# faults


@contextmanager
def running(*faults: str, clock=None, link=None):
    """Inputs and output on one clock, at 5 V for 3 s, with ``faults``."""
    with (
        served(clock=clock, faults=faults, link=link) as card,
        task(card.session) as ao,
        task(card.session) as ai,
    ):
        add_output(ao)
        add_inputs(ai)
        clock_output(ao, RATE, 3000, buffer=3000)
        clock_inputs(ai, RATE)
        write(ao, np.full(3000, 5.0))
        ai.start()
        ao.start()
        yield card, ao, ai


def test_an_input_overflow_comes_when_it_is_due():
    with running("ai-overflow@0.5") as (_, __, ai):
        assert read(ai, 499).shape == (3, 499)
        with pytest.raises(DaqReadError) as caught:
            read(ai, 100)
        assert caught.value.error_code == -200279
        with pytest.raises(DaqError):
            ai.stop()


def test_an_output_underflow_comes_when_it_is_due():
    with running("ao-underflow@0.5") as (card, ao, ai):
        assert read(ai, 500).shape == (3, 500)
        with pytest.raises(DaqReadError) as caught:
            read(ai, 100, timeout=0.2)
        assert caught.value.error_code == -200284
        with pytest.raises(DaqError) as failed:
            ao.is_task_done()
        assert failed.value.error_code == -200290
        assert high(card.device)
        with pytest.raises(DaqError):
            ao.stop()


def test_a_short_read_says_how_short_it_is_and_loses_nothing():
    with running() as (_, __, ai):
        whole = read(ai, 600)
    with running("short-read@0.3") as (_, __, ai):
        parts = [read(ai, 100) for _ in range(6)]
        assert [part.shape[1] for part in parts] == [100, 100, 50, 100, 100, 100]
    np.testing.assert_array_equal(np.concatenate(parts, axis=1), whole[:, :550])


def test_a_late_reply_comes_in_the_end():
    link = HandClock()
    with running("late-reply@0.3+2.0", link=link) as (card, _, ai):
        read(ai, 299)
        pending = in_thread(lambda: read(ai, 10))
        link.until_somebody_waits()
        link.advance(1.5)
        card.server.clients.check()
        assert high(card.device)  # who waits for a reply is not silent
        link.advance(0.5)
        assert pending().shape == (3, 10)
        assert read(ai, 10).shape == (3, 10)


def test_a_frozen_server_holds_its_replies_and_a_deadline_ends_the_wait():
    from nidaqmx._stubs import nidaqmx_pb2 as pb

    link = ManualClock()
    with running("server-frozen@0.3", link=link) as (card, ao, ai):
        read(ai, 299)
        with pytest.raises(grpc.RpcError) as caught:
            ai._interpreter._client.ReadRaw(
                pb.ReadRawRequest(
                    task=ai._handle, num_samps_per_chan=5, timeout=1.0, array_size_in_bytes=30
                ),
                timeout=0.2,
            )
        assert caught.value.code() is grpc.StatusCode.DEADLINE_EXCEEDED
        # what does not get through is silence
        assert high(card.device)
        link.advance(1.1)
        card.server.clients.check()
        assert card.device.wire_voltage() == 0.0
        card.server.close()
        for made in (ao, ai):
            with pytest.raises(RpcError):
                made.close()


def test_a_server_that_is_gone_drops_its_connections_and_makes_safe(heard):
    clock = HandClock()
    with running("server-gone@0.3", clock=clock) as (card, ao, ai):
        clock.advance(0.2995)
        assert read(ai, 299).shape == (3, 299)
        assert high(card.device)
        clock.advance(0.001)
        assert heard.something.wait(30.0)
        assert "connection has ended" in heard.messages[0]
        assert card.device.wire_voltage() == 0.0
        for made in (ao, ai):
            with pytest.raises(RpcError):
                made.close()


# the command


@contextmanager
def command(*arguments: str):
    process = subprocess.Popen(
        [sys.executable, "-m", "dearig", "serve-daqmx", *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        yield process
    finally:
        process.kill()
        process.communicate()


@pytest.mark.skipif(sys.platform == "win32", reason="no such signals there")
@pytest.mark.parametrize("number", mostly_deep([signal.SIGINT, signal.SIGTERM], []))
def test_the_command_says_where_it_is_and_ends_when_told(number):
    with command("--fast", "--rig", "sim:3") as process:
        line = process.stdout.readline()
        assert "--rig daqmx:Dev1@127.0.0.1:" in line
        port = int(line.split("daqmx:Dev1@127.0.0.1:")[1].split(";")[0])
        with connected(port) as session:
            assert Device("Dev1", grpc_options=session).product_type == "PCIe-6361"
        process.send_signal(number)
        out, err = process.communicate(timeout=60.0)
    assert process.returncode == 0
    assert (out, err) == ("", "")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--host", "0.0.0.0"], ["host 0.0.0.0", "--anywhere"]),  # noqa: S104
        (["--rig", "sim:x"], ["sim:x", "sim:7"]),
        (["--fault", "sparks@3"], ["sparks@3", "KIND@SECONDS"]),
        (["--port", "70000"], ["--port", "65535"]),
        (["--client-timeout", "0"], ["client-timeout"]),
        (["--rig-file", "nowhere.toml"], ["nowhere.toml"]),
    ],
)
def test_what_the_command_cannot_do_it_says_in_words(arguments, words):
    answer = dearig("serve-daqmx", *arguments)
    assert answer.code == 2
    assert all(word in answer.err for word in words), answer.err
    assert answer.err.count("\n") == 1


def test_a_port_in_use_is_named():
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        answer = dearig("serve-daqmx", "--port", str(port))
    assert answer.code == 2
    assert f"port {port} on 127.0.0.1" in answer.err
    assert "port 0 takes any that is free (--port)" in answer.err
