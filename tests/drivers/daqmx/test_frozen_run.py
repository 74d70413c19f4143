"""A run that is frozen before any call to the card, and goes on after its guardian has acted."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Iterator

import grpc
import pytest

from dearig.config.rigfile import RigFile
from dearig.drivers.contract.rig import begin, drain, lobes, play
from dearig.drivers.daqmx import link
from dearig.drivers.daqmx.guardian import TakeOver
from dearig.drivers.daqmx.guardian_process import Guard
from dearig.drivers.daqmx.link import Link
from dearig.drivers.daqmx.outputs import Outputs
from dearig.drivers.daqmx.rig import DaqmxRig
from dearig.drivers.errors import RigError
from dearig.drivers.rig import RigState
from tests.deep import mostly_deep
from tests.drivers.daqmx.test_rig import WIRED, Bench, Watcher

ENABLE = "port0/line0"
LONG = lobes(peaks=(8000.0,) * 12)
#: Calls to the card from ``arm`` to the end of a ramp, among them all that output something.
STEPS = {"StartTask", "StopTask", "WriteAnalogF64", "TaskControl", "CfgSampClkTiming"}
CALLS_MAX = 400  # of a run from its arming to its end; far more than it makes


class SameProcess(Watcher):
    """The guardian's own judgement and its own connection to the card, without a process."""

    def __init__(self, bench: Bench) -> None:
        super().__init__()
        self._outputs = Outputs(Link(bench.address.server, bench.settings), "Dev1", bench.settings)
        self._outputs.prepare()
        self.guard = Guard(self._zero, self._hear, lambda _: None, self._outputs.release)

    def arm(self) -> None:
        self.reported = None
        self.guard.hear("arm")
        if self.reported is not None:
            raise RigError(f"the card is held at 0 V: {self.reported.sentence}")

    def beat(self) -> bool:
        return self.guard.hear("beat")

    def disarm(self) -> None:
        self.guard.hear("disarm")

    def close(self) -> None:
        self._outputs.close()

    def _zero(self):
        self._outputs.shut()
        return self._outputs.zero_reading

    def _hear(self, word: str) -> None:
        if word.startswith("acted "):
            self.reported = TakeOver(**json.loads(word.removeprefix("acted ")))


class Freeze(grpc.UnaryUnaryClientInterceptor):
    """Freezes a run before its call number ``number`` from now on, for as long as ``act`` takes.

    ``raised`` has what the card shows after each later call that is not at 0 V and disabled.
    """

    def __init__(self) -> None:
        self.number = 0
        self.bench: Bench | None = None
        self.struck = False
        self.step = ""  # call before which it was frozen
        self.raised: list[tuple[str, float, bool]] = []

    def intercept_unary_unary(self, call, details, request):
        self.number -= 1
        if self.number == 0 and self.bench.guardian.guard.armed:
            self.bench.guardian.guard.silence()
            self.struck, self.step = True, details.method.rpartition("/")[2]
        answer = call(details, request)
        if self.struck:
            volts, enabled = self.bench.device.output_voltage(), self.bench.device.line(ENABLE)
            if volts or enabled:
                self.raised.append((details.method, volts, enabled))
        return answer


@pytest.fixture
def freeze() -> Freeze:
    return Freeze()


@contextlib.contextmanager
def guarded(freeze: Freeze, settings: RigFile) -> Iterator[Bench]:
    with Bench(settings, client_timeout=1e9) as bench, pytest.MonkeyPatch.context() as patch:
        bench.rig.close()
        bench.guardian = SameProcess(bench)
        # only the calls of the run are counted
        make = link._channel_with_deadline
        patch.setattr(
            link, "_channel_with_deadline", lambda *a: grpc.intercept_channel(make(*a), freeze)
        )
        freeze.bench = bench
        bench.rig = DaqmxRig(bench.address, bench.settings, bench.guardian)
        yield bench


def run_to_its_ramp(rig: DaqmxRig) -> None:
    """Go through every step of the run of a loaded ``rig``, up to the end of a stop's ramp."""
    rig.arm()
    rig.start()
    rig.read()
    rig.read()
    rig.stop()
    drain(rig)


@pytest.mark.parametrize(
    "settings",
    mostly_deep(
        [pytest.param(WIRED, id="enable-line"), pytest.param(RigFile(), id="no-enable-line")],
        ["enable-line"],
    ),
)
def test_run_that_goes_on_after_its_guardian_acted_never_raises_a_voltage(freeze, settings):
    with guarded(freeze, settings) as bench:
        steps = set()
        for number in range(1, CALLS_MAX):
            bench.rig.load(LONG)  # before it is armed, the guardian does not watch
            freeze.number, freeze.struck, freeze.raised = number, False, []
            error = ""
            try:
                run_to_its_ramp(bench.rig)
            except RigError as failed:
                error = str(failed)
            if freeze.number > 0:
                break  # the run made fewer calls than this
            if freeze.struck:
                steps.add(freeze.step)
                assert "the guardian acted" in error
                assert bench.rig.state is not RigState.DONE
                # nor by a program that tries again without making itself safe
                for call in (bench.rig.arm, bench.rig.start, lambda: bench.rig.load(LONG)):
                    with pytest.raises(RigError):
                        call()
            bench.rig.make_safe()
            assert bench.rig.state is RigState.SAFE
            assert freeze.raised == []
        assert steps >= STEPS | ({"WriteDigitalLines"} if settings is WIRED else set())
        assert freeze.number > 0
        # what is admitted again is played
        freeze.number, freeze.struck = 0, False
        assert play(bench.rig, LONG).counts.shape[1] == LONG.samples


@pytest.mark.parametrize("held", [True, False], ids=["guardian-holds", "guardian-ended"])
def test_run_that_goes_on_leaves_the_next_programs_run_alone(freeze, held):
    with guarded(freeze, WIRED) as bench:
        begin(bench.rig, LONG)
        bench.rig.read()
        bench.rig.read()
        bench.guardian.guard.silence()
        if held:
            with pytest.raises(RigError, match="in use by another program"):
                DaqmxRig(bench.address, bench.settings, Watcher())
            bench.rig.make_safe()
        else:
            bench.guardian.close()
        following = DaqmxRig(bench.address, bench.settings, Watcher())
        begin(following, LONG)
        following.read()
        if not held:
            with pytest.raises(RigError, match="the guardian acted"):
                bench.rig.read()
        bench.rig.make_safe()
        assert bench.rig.state is RigState.SAFE
        assert bench.device.line(ENABLE)
        assert drain(following).counts.shape[1] == LONG.samples - 100
        following.make_safe()
        following.close()


def test_idle_rig_that_is_closed_does_not_reset_the_card_of_a_run(freeze):
    with guarded(freeze, WIRED) as bench:
        other = DaqmxRig(bench.address, bench.settings, Watcher())
        begin(other, LONG)
        other.read()
        bench.rig.close()
        assert drain(other).counts.shape[1] == LONG.samples - 100
        other.close()
