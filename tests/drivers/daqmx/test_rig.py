"""The driver for the card, as it runs at a rig, against the simulated card behind a server."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from contextlib import contextmanager

import grpc
import nidaqmx
import numpy as np
import pytest
from nidaqmx import GrpcSessionOptions

from dearig.config.rigfile import RigFile
from dearig.drivers.contract.rig import RigContract, begin, drain, lobes, play
from dearig.drivers.daqmx import inspect, link
from dearig.drivers.daqmx.address import Address
from dearig.drivers.daqmx.guardian import TakeOver
from dearig.drivers.daqmx.rig import DaqmxRig
from dearig.drivers.daqmx.tasks import ClockedTasks
from dearig.drivers.errors import RefusedWaveform, RigError, RigStateError
from dearig.drivers.rig import RigState
from dearig.model.film.material import THESIS_FILM, THESIS_LOAD
from dearig.sim_backend.clock import ManualClock
from dearig.sim_backend.daqmx.opening import open_device
from dearig.sim_backend.daqmx.protocol.server import DaqmxServer
from dearig.sim_backend.factory import open_simulated_rig
from dearig.sim_backend.faults import FaultPlan


class Watcher:
    """A guardian without a process: it takes the output down when asked, and can be ended."""

    def __init__(self) -> None:
        self.words: list[str] = []
        self.dead = False
        self.fails = ""
        self.granted: tuple[str, ...] = ()
        self.refused: tuple[str, ...] = ()
        self.reported: TakeOver | None = None

    def arm(self) -> None:
        self.words.append("arm")

    def beat(self) -> bool:
        return not self.dead

    def fault(self) -> str:
        return "exit code -9"

    def report(self, within: float = 0.0) -> TakeOver | None:  # noqa: ARG002
        return self.reported

    def disarm(self) -> None:
        self.words.append("disarm")

    def take_over(self) -> TakeOver:
        self.words.append("take over")
        if self.fails:
            raise RigError(self.fails)
        return TakeOver("asked", 0.0, 0.1)

    @property
    def tries(self) -> bool:
        return False

    def outcome(self, within: float) -> TakeOver | None:  # noqa: ARG002
        return self.reported

    def close(self) -> None:
        self.words.append("close")


class Bench:
    """A simulated card behind a server of its own, and rigs on it."""

    def __init__(
        self,
        settings: RigFile | None = None,
        *,
        there: RigFile | None = None,
        seed: int = 0,
        faults=(),
        client_timeout: float | None = None,
        **options,
    ) -> None:
        """``there`` is what is really there, where it is not what ``settings`` say."""
        self.settings = settings or RigFile()
        there = there or self.settings
        self.clock = ManualClock()
        self.device = open_device(
            "sim", there, there.as_film(), there.as_load(), seed=seed, clock=self.clock,
            faults=FaultPlan.parse(faults),
        )  # fmt: skip
        self.server = DaqmxServer(self.device, client_timeout=client_timeout)
        self.address = Address("Dev1", f"127.0.0.1:{self.server.start()}")
        self.guardian = Watcher()
        try:
            self.rig = DaqmxRig(self.address, self.settings, self.guardian, **options)
        except RigError:
            self.server.close()
            raise

    def __enter__(self) -> Bench:
        return self

    def __exit__(self, *_: object) -> None:
        self.rig.close()
        self.server.close()


class TestDaqmxRig(RigContract):
    @contextmanager
    def opened(self, *, block_samples=None, seed=0) -> Iterator[DaqmxRig]:
        with Bench(seed=seed, block_samples=block_samples) as bench:
            yield bench.rig


@pytest.fixture
def bench() -> Iterator[Bench]:
    with Bench() as bench:
        yield bench


def with_card(**card: object) -> RigFile:
    return RigFile.model_validate({"card": card})


WIRED = with_card(do_hv_enable="port0/line0", hv_enable_watchdog_s=1.0)
LONG = lobes(peaks=(8000.0,) * 12)


def test_what_the_card_delivers_is_what_the_simulated_rig_delivers(bench):
    rig = open_simulated_rig("sim", bench.settings, THESIS_FILM, THESIS_LOAD)
    np.testing.assert_array_equal(play(bench.rig, LONG).counts, play(rig, LONG).counts)


def test_a_long_waveform_is_streamed_and_loses_nothing():
    with Bench() as whole, Bench(with_card(ao_buffer_s=0.5)) as streamed:
        waveform = lobes(peaks=(8000.0,) * 40)
        one, other = play(whole.rig, waveform), play(streamed.rig, waveform)
    assert waveform.duration > 4.0  # the default buffer is streamed too
    np.testing.assert_array_equal(one.counts, other.counts)


def test_a_streamed_waveform_can_be_stopped():
    with Bench(with_card(ao_buffer_s=0.5)) as bench:
        waveform = lobes(peaks=(8000.0,) * 40)
        begin(bench.rig, waveform)
        head = [bench.rig.read() for _ in range(23)]
        bench.rig.stop()
        tail = drain(bench.rig)
        command = np.concatenate([*(b.counts[0] for b in head), tail.counts[0]])
        assert command.size < waveform.samples
        assert command[-1] == 0
        assert bench.device.wire_voltage() == 0.0
        assert any("the sample clock stood still" in event.message for event in tail.events)


def test_identity_is_the_cards_own(bench):
    card = bench.rig.identify().instruments[0]
    assert card.model == "PCIe-6361"
    assert int(card.serial, 16) > 0
    assert ("wiring of displacement", "DIFF") in card.settings


def test_a_voltage_that_somebody_left_is_taken_down_at_opening(bench):
    bench.rig.close()
    with (
        grpc.insecure_channel(bench.address.server) as channel,
        nidaqmx.Task(grpc_options=GrpcSessionOptions(channel, "")) as task,
    ):
        task.ao_channels.add_ao_voltage_chan("Dev1/ao0")
        task.write(3.0, auto_start=True)
    assert bench.device.wire_voltage() == pytest.approx(3000.0, abs=1.0)
    DaqmxRig(bench.address, bench.settings, Watcher()).close()
    assert bench.device.wire_voltage() == 0.0


def test_a_card_in_use_is_left_alone(bench):
    begin(bench.rig, LONG)
    bench.rig.read()
    guardian = Watcher()
    with pytest.raises(RigError, match="in use by another program"):
        DaqmxRig(bench.address, bench.settings, guardian)
    assert guardian.words == ["close"]
    assert drain(bench.rig).counts.shape[1] == LONG.samples - 100


def test_the_enable_line_is_high_from_arming_to_the_end():
    with Bench(WIRED) as bench:
        line = lambda: bench.device.line("port0/line0")  # noqa: E731
        bench.rig.load(lobes())
        assert not line()
        bench.rig.arm()
        assert line()
        bench.rig.start()
        drain(bench.rig)
        assert line()
        bench.rig.make_safe()
        assert not line()


def test_the_watchdog_takes_the_line_low_when_nobody_reads():
    with Bench(WIRED) as bench:
        begin(bench.rig, LONG)
        bench.rig.read()
        bench.rig.read()
        assert bench.device.wire_voltage() > 1000.0
        bench.clock.advance(1.5)
        assert not bench.device.line("port0/line0")
        assert bench.device.wire_voltage() == 0.0


def test_words_to_the_guardian(bench):
    begin(bench.rig, lobes())
    drain(bench.rig)
    assert bench.guardian.words == ["arm"]
    bench.rig.make_safe()
    bench.rig.close()
    assert bench.guardian.words == ["arm", "disarm", "disarm", "close"]


def test_a_dead_guardian_ramps_the_run_down(bench):
    blocks = []

    def go_on() -> None:
        while (block := bench.rig.read()) is not None:
            blocks.append(block)
            assert bench.rig.ramping == (len(blocks) > 2)
            bench.guardian.dead = len(blocks) > 1

    begin(bench.rig, LONG)
    with pytest.raises(
        RigError, match=r"guardian process gave no answer during the run \(exit code -9\)"
    ):
        go_on()
    command = np.concatenate([block.counts[0] for block in blocks])
    assert command[-1] == 0
    assert 500 <= command.size < 0.5 * LONG.samples
    events = [event for block in blocks for event in block.events]
    assert "no answer from the guardian process" in events[0].message
    assert bench.device.wire_voltage() == 0.0


def test_fault_of_an_unguarded_run_names_the_guardian_too():
    with Bench(faults=["ai-overflow@0.3"]) as bench:
        begin(bench.rig, LONG)
        bench.rig.read()
        bench.guardian.dead = True
        with pytest.raises(RigError, match=r"read too late.*no answer from the guardian process"):
            drain(bench.rig)


def test_the_monitor_is_read_after_zero_volts_were_set(bench: Bench) -> None:
    bench.rig.make_safe()
    reading = bench.rig.zero_reading
    assert reading is not None
    assert reading.confirmed
    assert abs(reading.voltage) < 200.0  # V, with the noise and the offsets of the converter


REPORT = TakeOver("the run is frozen", 0.0, 0.06)


@pytest.mark.parametrize("call", ["read", "stop", "waiting"])
def test_run_that_the_guardian_ended_says_so(bench, call):
    begin(bench.rig, LONG)
    bench.rig.read()
    bench.device.reset("Dev1")
    bench.guardian.reported = REPORT
    calls = {
        "read": lambda: drain(bench.rig),
        "stop": bench.rig.stop,
        "waiting": lambda: bench.rig.waiting,
    }
    said = r"^(\w+: )?the guardian acted at .* .the run is frozen.: the output"
    with pytest.raises(RigError, match=said):
        calls[call]()
    assert bench.rig.taken_over == REPORT


def test_what_the_system_refused_the_guardian_is_an_event_of_the_run(bench):
    bench.guardian.refused = ("locked memory (the limit memlock is not unlimited)",)
    events = [e for block in play(bench.rig, lobes()).blocks for e in block.events]
    assert [(e.sample, e.level) for e in events] == [(0, "info")]
    assert "refused the guardian: locked memory (the limit" in events[0].message


class Striker(grpc.UnaryUnaryClientInterceptor):
    """Does ``act`` before the call number ``number`` from now on."""

    def __init__(self) -> None:
        self.number = 0
        self.act = lambda: None

    def intercept_unary_unary(self, call, details, request):
        self.number -= 1
        if self.number == 0:
            self.act()
        return call(details, request)


STRUCK_CALLS = 24  # of a stop or a read, and of the way to 0 V after it


# both acts together strike at two of five calls of each way, in tests.deep each at all of them
@pytest.mark.parametrize(
    ("act", "first", "step"),
    [
        pytest.param("reset", 1, 5),
        pytest.param("clear", 3, 5),
        pytest.param("reset", 1, 1, marks=pytest.mark.deep),
        pytest.param("clear", 1, 1, marks=pytest.mark.deep),
    ],
)
@pytest.mark.parametrize("way", ["read", "stop", "make_safe"])
def test_run_and_guardian_that_act_at_once_end_safe_with_sentences(
    monkeypatch, act, first, step, way
):
    striker, make = Striker(), link._channel_with_deadline
    monkeypatch.setattr(
        link, "_channel_with_deadline", lambda *a: grpc.intercept_channel(make(*a), striker)
    )
    with Bench(WIRED, client_timeout=1e9) as bench:

        def strike() -> None:
            bench.device.reset("Dev1")  # as the guardian does
            if act == "clear":  # as a server does with the tasks of a client that it lost
                bench.server.clients.all_gone()

        striker.act = strike
        for number in range(first, STRUCK_CALLS, step):
            begin(bench.rig, LONG)
            bench.rig.read()
            striker.number = number
            with contextlib.suppress(RigError):
                if way == "stop":
                    bench.rig.stop()
                if way != "make_safe":
                    while striker.number > 0 and bench.rig.read() is not None:
                        pass
                    bench.rig.read()
            bench.rig.make_safe()
            assert bench.device.wire_voltage() == 0.0
            assert not bench.device.line("port0/line0")


def test_nothing_starts_without_a_guardian(bench):
    def gone() -> None:
        raise RigError("the guardian process is gone")

    bench.guardian.arm = gone
    bench.rig.load(lobes())
    with pytest.raises(RigError, match="guardian process is gone"):
        bench.rig.arm()
    assert bench.rig.state is RigState.LOADED


@pytest.mark.parametrize(
    ("fault", "code", "said"),
    [
        ("ai-overflow@0.5", -200279, "read too late"),
        ("ao-underflow@0.5", -200290, "ran out of samples"),
    ],
)
def test_faults_of_the_card(fault, code, said):
    with Bench(faults=[fault]) as bench:
        begin(bench.rig, LONG)
        with pytest.raises(RigError, match=said) as caught:
            drain(bench.rig)
        assert caught.value.code == code
        bench.rig.make_safe()
        assert bench.device.wire_voltage() == 0.0


def test_a_card_that_has_only_another_rate_plays_nothing(bench, monkeypatch):
    def faster(tasks, command, rate):
        return 1.6 * prepare(tasks, command, rate)

    prepare = ClockedTasks.prepare
    monkeypatch.setattr(ClockedTasks, "prepare", faster)
    with pytest.raises(RefusedWaveform, match="1600 Hz in place of 1000 Hz"):
        bench.rig.load(LONG)
    assert bench.rig.state is RigState.SAFE
    with pytest.raises(RigStateError):
        bench.rig.arm()
    monkeypatch.undo()
    bench.rig.load(LONG)  # its tasks were cleared, so that the card is free


def test_a_mistake_while_making_safe_still_asks_the_guardian(monkeypatch):
    def mistaken(_: object) -> None:
        raise ZeroDivisionError("a mistake")

    with Bench() as bench:
        begin(bench.rig, LONG)
        monkeypatch.setattr(type(bench.rig), "_bring_down", mistaken)
        with pytest.raises(ZeroDivisionError):
            bench.rig.make_safe()
        assert "take over" in bench.guardian.words
        assert bench.rig.state is RigState.SAFE
        monkeypatch.undo()


def test_a_short_read_loses_nothing():
    with Bench(faults=["short-read@0.5"]) as short, Bench() as whole:
        one, other = play(short.rig, LONG), play(whole.rig, LONG)
        assert [b.start for b in one.blocks] != [b.start for b in other.blocks]
        np.testing.assert_array_equal(one.counts, other.counts)


def test_a_server_that_is_gone_leaves_it_to_the_guardian(bench):
    begin(bench.rig, LONG)
    bench.rig.read()
    bench.server.close()
    # it has answered, so neither its kind nor its certificates are to blame
    with pytest.raises(RigError, match=r"server 127\.0\.0\.1:.* does not answer .*the network"):
        drain(bench.rig)
    bench.rig.make_safe()
    assert bench.guardian.words[-2:] == ["take over", "disarm"]


def test_when_the_guardian_cannot_either_it_is_said(bench):
    begin(bench.rig, LONG)
    bench.rig.read()
    bench.server.close()
    bench.guardian.fails = "the guardian's link is dead too"
    with pytest.raises(RigError, match=r"does not answer.*the guardian's link is dead too"):
        bench.rig.make_safe()
    assert bench.rig.state is RigState.RUNNING
    bench.guardian.fails = ""


def test_a_monitor_that_does_not_come_down_is_said():
    here, there = RigFile(), RigFile.model_validate({"amplifier": {"offset_V": 90.0}})
    here = here.model_copy(
        update={"limits": here.limits.model_copy(update={"zero_tolerance_kV": 0.05})}
    )
    with pytest.raises(RigError, match=r"still reads 0\.0[89]\d* kV \(0\.05 kV is allowed\)"):
        Bench(here, there=there)


def test_a_rig_file_that_the_card_contradicts():
    settings = RigFile.model_validate({"card": {"ao_command": "ao3"}})
    with pytest.raises(RigError, match="no such terminal"):
        Bench(settings, there=RigFile())


def test_a_device_that_is_not_there(bench):
    with pytest.raises(RigError, match="no device of that name"):
        DaqmxRig(Address("Dev9", bench.address.server), bench.settings, Watcher())


def test_a_server_that_is_not_there():
    with pytest.raises(RigError, match="does not answer"):
        DaqmxRig(Address("Dev1", "127.0.0.1:9"), RigFile(), Watcher())


def test_a_card_without_its_driver():
    guardian = Watcher()
    with pytest.raises(RigError, match="NI-DAQmx"):
        DaqmxRig(Address("Dev1"), RigFile(), guardian)
    assert guardian.words == ["close"]


class TestInspection:
    def test_a_card_that_fits(self, bench):
        bench.rig.close()
        found = inspect("Dev1", bench.address.server, bench.settings)
        assert {finding.verdict for finding in found.findings} <= {"ok", "not wired"}
        assert abs(found.monitors.voltage) < 50.0
        assert abs(found.displacement_volts) < 10.0
        assert bench.device.history()[-1].wire == 0.0

    def test_a_card_in_use(self, bench):
        begin(bench.rig, LONG)
        bench.rig.read()
        found = inspect("Dev1", bench.address.server, bench.settings)
        assert [f.verdict for f in found.findings if "in use" in f.found] == ["wrong"]
        # and whoever uses it goes on undisturbed
        assert drain(bench.rig).counts.shape[1] == LONG.samples - 100

    @pytest.mark.parametrize(
        ("card", "item", "verdict"),
        [
            ({"ao_command": "ao7"}, "card.ao_command = ao7", "wrong"),
            ({"ai_displacement": "ai23"}, "card.ai_displacement = ai23", "wrong"),
            ({"range_current_monitor_V": 3.0}, "card.range_current_monitor_V = 3", "wrong"),
            ({"model": "NI USB-6001"}, "type", "wrong"),
            ({"do_hv_enable": "port7/line30"}, "card.do_hv_enable = port7/line30", "wrong"),
        ],
    )
    def test_a_rig_file_that_the_card_contradicts(self, bench, card, item, verdict):
        settings = RigFile.model_validate({"card": card})
        found = inspect("Dev1", bench.address.server, settings)
        assert {f.item: f.verdict for f in found.findings}[item] == verdict
        assert found.monitors is None

    def test_no_such_device(self, bench):
        found = inspect("Dev7", bench.address.server, bench.settings)
        state = next(f for f in found.findings if f.item == "state")
        assert state.verdict == "wrong"
        assert "no device of that name" in state.found

    def test_no_driver(self):
        found = inspect("Dev1", None, RigFile())
        state = next(f for f in found.findings if f.item == "state")
        assert state.verdict == "wrong"
        assert "NI-DAQmx" in state.found
