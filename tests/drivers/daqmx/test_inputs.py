"""Inputs of the card at rest: nothing but analog inputs is made on the server."""

from __future__ import annotations

import re
from collections.abc import Iterator

import pytest

from dearig.drivers.contract.inputs import InputsContract
from dearig.drivers.contract.rig import begin, lobes
from dearig.drivers.daqmx.inputs import DaqmxInputs
from dearig.drivers.daqmx.kind import KIND
from dearig.drivers.errors import RigError
from dearig.drivers.inputs import ReadsInputs
from dearig.drivers.rig import RigIdentity
from dearig.sim_backend.daqmx.protocol.interceptor import Interceptor
from tests.drivers.daqmx.test_rig import Bench

#: Calls of the server that make or write an output or a line, or reset the card.
OUTPUT = re.compile(r"Create(AO|DO|CO)|Write|ResetDevice|Watchdog|SelfTest")


@pytest.fixture(autouse=True)
def bench() -> Iterator[Bench]:
    with Bench() as bench:
        yield bench


@pytest.fixture(autouse=True)
def calls(monkeypatch: pytest.MonkeyPatch, bench: Bench) -> list[str]:
    """Names of the calls that reach the server after its rig was opened."""
    seen: list[str] = []
    before = Interceptor.intercept_service

    def note(self, continuation, details):
        seen.append(details.method.rpartition("/")[2])
        return before(self, continuation, details)

    monkeypatch.setattr(Interceptor, "intercept_service", note)
    return seen


class TestDaqmxInputs(InputsContract):
    @pytest.fixture(autouse=True)
    def _on(self, bench: Bench, calls: list[str]) -> None:
        self._bench, self._calls = bench, calls

    def open_inputs(self) -> DaqmxInputs:
        return DaqmxInputs(self._bench.address, self._bench.settings)

    def identity(self) -> RigIdentity:
        return self._bench.rig.identify()

    def outputs_touched(self) -> list[str]:
        assert "CreateAIVoltageChan" in self._calls
        return [name for name in self._calls if OUTPUT.search(name)]


def test_what_a_run_does_to_the_output_would_be_seen(bench: Bench, calls: list[str]) -> None:
    begin(bench.rig, lobes())
    assert any(OUTPUT.search(name) for name in calls)


def test_the_card_is_free_for_a_run_afterwards_and_taken_during_one(bench: Bench) -> None:
    assert isinstance(KIND, ReadsInputs)
    inputs = DaqmxInputs(bench.address, bench.settings)
    bench.rig.load(lobes())
    with pytest.raises(RigError, match="in use"):
        bench.rig.arm()
    inputs.close()
    bench.rig.make_safe()
    begin(bench.rig, lobes())
    with pytest.raises(RigError, match="in use"):
        DaqmxInputs(bench.address, bench.settings)
    assert bench.rig.read() is not None  # the run goes on
