"""The guardian as a process, seen from the run: answers, silence, sources, what it may do."""

import json
import os
import signal
import subprocess
import sys
import threading

import nidaqmx
import psutil
import pytest

from dearig.config.rigfile import RigFile
from dearig.drivers import sources
from dearig.drivers.daqmx.address import Address
from dearig.drivers.daqmx.explain import RESERVED
from dearig.drivers.daqmx.guardian import GuardianProcess
from dearig.drivers.errors import RigError
from tests.tools.daqmx import ENABLE, enabled_rig, served

ANSWERS_WITHIN = REPORTS_WITHIN = 60.0  # s, on a machine that is busy

posix = pytest.mark.skipif(sys.platform == "win32", reason="stops a process by a signal")


class Clock:
    """A clock that only a test moves."""

    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        return self.now


class Bench:
    """A simulated card, and a guardian process for it with a clock of the test's."""

    def __init__(self, card, settings=None) -> None:
        self.card = card
        self.clock = Clock()
        address = Address("Dev1", f"127.0.0.1:{card.server.port}")
        patient = RigFile.model_validate({"guardian": {"timeout_s": 10.0}})
        self.guardian = GuardianProcess(address, settings or patient, clock=self.clock)


@pytest.fixture(scope="module")
def card():
    with served(client_timeout=None) as made:
        yield made


@pytest.fixture
def bench(card):
    made = Bench(card)
    try:
        yield made
    finally:
        made.guardian.close()


def beat_for(bench, beats, interval=0.1):
    """Beat at ``interval`` s of the test's clock, each time when the beat before was answered."""
    for _ in range(beats):
        bench.clock.now += interval
        assert bench.guardian.beat()
        assert bench.guardian.answered(ANSWERS_WITHIN)


@posix
def test_stopped_guardian_is_noticed_and_blocks_nothing(bench, monkeypatch):
    monkeypatch.setattr("dearig.drivers.daqmx.guardian._TAKES_OVER_WITHIN", 0.0)
    bench.guardian.arm()
    beat_for(bench, 10)
    os.kill(bench.guardian.pid, signal.SIGSTOP)
    # the first beat goes out up to 0.1 s after the stop, and the fourth or fifth one is too late
    seen = []
    for _ in range(20_000):
        bench.clock.now += 0.1
        seen.append(bench.guardian.beat())
    assert seen[:3] == [True] * 3
    assert not any(seen[4:])
    # it may be in its attempts to reach the card, and is left to them for as long as they take
    with pytest.raises(RigError, match="it tries, or is stopped"):
        bench.guardian.take_over()
    assert bench.guardian.tries
    bench.clock.now += 100.0
    assert not bench.guardian.tries
    with pytest.raises(RigError, match="could not take the output to 0 V either"):
        bench.guardian.take_over()
    with pytest.raises(RigError, match=r"gives no answer .it is running"):
        bench.guardian.arm()
    bench.guardian.disarm()
    bench.guardian.close()
    assert not psutil.pid_exists(bench.guardian.pid)


@posix
def test_guardian_that_goes_on_answers_again(bench):
    bench.guardian.arm()
    os.kill(bench.guardian.pid, signal.SIGSTOP)
    assert bench.guardian.beat()
    bench.clock.now += 1.0
    assert not bench.guardian.beat()
    os.kill(bench.guardian.pid, signal.SIGCONT)
    bench.guardian.arm()
    assert bench.guardian.beat()


def test_guardian_says_what_the_system_granted_and_a_late_read_is_no_dead_guardian(bench):
    said = " ".join((*bench.guardian.granted, *bench.guardian.refused))
    assert "priority" in said
    assert "locked memory" in said
    bench.guardian.arm()
    beat_for(bench, 20, interval=30.0)


@pytest.mark.deep
def test_half_an_hour_of_beats_passes_and_nothing_grows(bench):
    guardian = psutil.Process(bench.guardian.pid)
    bench.guardian.arm()
    beat_for(bench, 2_000)
    before = guardian.memory_info().rss, guardian.num_threads()
    own = {thread.id for thread in psutil.Process().threads()}
    beat_for(bench, 18_000)
    after = guardian.memory_info().rss, guardian.num_threads()
    assert after[0] - before[0] < 1 << 20
    assert after[1] == before[1]
    # those of other tests may end meanwhile
    assert {thread.id for thread in psutil.Process().threads()} <= own
    assert bench.guardian.report() is None


def test_silence_is_a_frozen_run_whatever_the_pipe_holds(card):
    settings = RigFile.model_validate({"guardian": {"timeout_s": 0.3}})
    quick = Bench(card, settings)
    quick.guardian.arm()
    report = quick.guardian.report(REPORTS_WITHIN)
    assert report.why == "the run is frozen"
    assert report.confirmed
    assert "the voltage monitor confirmed it" in report.sentence
    with pytest.raises(RigError, match=r"held at 0 V: the guardian acted at .* is frozen"):
        quick.guardian.arm()
    with nidaqmx.Task(grpc_options=card.session) as task:
        task.ao_channels.add_ao_voltage_chan("Dev1/ao0")
        with pytest.raises(nidaqmx.errors.DaqError) as refused:
            task.write(1.0, auto_start=True)
    assert refused.value.error_code == RESERVED
    quick.guardian.disarm()
    quick.guardian.arm()
    assert quick.guardian.report() is None
    quick.guardian.disarm()
    quick.guardian.close()


def test_take_over_reports_what_was_done(bench):
    report = bench.guardian.take_over()
    assert report.confirmed
    assert bench.guardian.report() == report


def test_the_outcome_of_a_take_over_that_took_too_long_is_told_later(bench, monkeypatch):
    monkeypatch.setattr("dearig.drivers.daqmx.guardian._TAKES_OVER_WITHIN", 0.0)
    monkeypatch.setattr("dearig.drivers.daqmx.guardian._ANSWERS_WITHIN", ANSWERS_WITHIN)
    write, answers = bench.card.device.outputs.write, threading.Event()

    def write_late(*arguments):
        answers.wait(ANSWERS_WITHIN)
        return write(*arguments)

    monkeypatch.setattr(bench.card.device.outputs, "write", write_late)
    with pytest.raises(RigError, match="goes on trying"):
        bench.guardian.take_over()
    assert bench.guardian.tries
    answers.set()
    report = bench.guardian.outcome(REPORTS_WITHIN)
    assert report is not None
    assert report.confirmed
    assert report.monitor is not None  # the reading that confirmed it
    assert not bench.guardian.tries


def test_guardian_of_other_sources_is_refused(card, monkeypatch):
    changed = {**sources.AT_START, "daqmx/outputs.py": "another"}
    monkeypatch.setattr(sources, "AT_START", changed)
    with pytest.raises(RigError, match=r"other sources than this program .daqmx/outputs\.py in "):
        Bench(card)


@pytest.mark.deep
def test_guardian_of_another_version_is_refused(card, monkeypatch):
    monkeypatch.setattr(sources, "version", lambda: "0.0.1")
    with pytest.raises(RigError, match=r"other sources than this program .version in "):
        Bench(card)


TAKES_OVER = """
import json, sys
from dearig.drivers.daqmx import guardian_process
from dearig.drivers.daqmx.link import Link
from dearig.drivers.daqmx.outputs import Outputs
from dearig.drivers.settings import RigSettings
settings = RigSettings.model_validate(json.loads(sys.argv[2]))
outputs = Outputs(Link(sys.argv[1], settings), "Dev1", settings)
outputs.prepare()
guardian_process._ready()
before = set(sys.modules)
print("prepared", flush=True)
sys.stdin.readline()
outputs.shut()
print(json.dumps(sorted(set(sys.modules) - before)))
"""


def test_take_over_of_a_card_in_use_imports_nothing():
    settings = enabled_rig()
    instruments = {name: getattr(settings, name) for name in RigFile.model_fields}
    config = {
        name: value.model_dump(mode="json")
        for name, value in instruments.items()
        if name in ("card", "guardian", "limits")
    }
    with served(settings, client_timeout=None) as card:
        child = subprocess.Popen(
            [sys.executable, "-c", TAKES_OVER, f"127.0.0.1:{card.server.port}", json.dumps(config)],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
        )  # fmt: skip
        assert child.stdout.readline().strip() == "prepared"
        with nidaqmx.Task(grpc_options=card.session) as task:
            task.ao_channels.add_ao_voltage_chan("Dev1/ao0")
            task.timing.cfg_samp_clk_timing(1000.0, samps_per_chan=1000)
            task.write([5.0] * 1000, auto_start=True)
            with nidaqmx.Task(grpc_options=card.session) as enable:
                enable.do_channels.add_do_chan(f"Dev1/{ENABLE}")
                enable.write(True, auto_start=True)
                said, _ = child.communicate("\n")
            assert card.device.wire_voltage() == 0.0
            assert not card.device.line(ENABLE)
    assert json.loads(said) == []


@posix
def test_system_that_grants_nothing_is_named():
    script = (
        "import os, sys\n"
        "from dearig.drivers.processes import priority\n"
        "import resource\n"
        "if os.geteuid() == 0: os.setuid(65534)\n"
        "for limit in (resource.RLIMIT_RTPRIO, resource.RLIMIT_NICE, resource.RLIMIT_MEMLOCK):\n"
        "    resource.setrlimit(limit, (0, 0))\n"
        "print(priority.claim())\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    granted, refused = eval(done.stdout)  # noqa: S307  (printed by the line above)
    assert granted == []
    assert [words.split(" (")[0] for words in refused] == [
        "real-time priority", "high priority", "locked memory",
    ]  # fmt: skip
