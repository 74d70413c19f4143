"""Inputs of the simulated rig at rest."""

from __future__ import annotations

import numpy as np
import pytest

from dearig.drivers.contract.inputs import InputsContract
from dearig.drivers.errors import RigError
from dearig.drivers.inputs import ReadsInputs
from dearig.drivers.rig import RigIdentity
from dearig.drivers.settings import RigSettings
from dearig.model.film.material import THESIS_FILM, THESIS_LOAD
from dearig.sim_backend.clock import ManualClock
from dearig.sim_backend.factory import open_simulated_inputs, open_simulated_rig
from dearig.sim_backend.inputs import SimulatedInputs
from dearig.sim_backend.kind import KIND
from dearig.sim_backend.rig import SimulatedRig
from dearig.sim_backend.signal_path import SignalPath


class TestSimulatedInputs(InputsContract):
    address = "sim"

    @pytest.fixture(autouse=True)
    def _watched(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self._touched: list[str] = []
        advance = SignalPath.advance

        def watched(path, chunk, command, state):
            if np.any(command):
                self._touched.append("a command other than 0")
            return advance(path, chunk, command, state)

        monkeypatch.setattr(SignalPath, "advance", watched)
        for call in ("load", "arm", "start"):
            monkeypatch.setattr(
                SimulatedRig, call, lambda *_, call=call: self._touched.append(call)
            )

    def open_inputs(self) -> SimulatedInputs:
        return open_simulated_inputs(
            self.address, RigSettings(), THESIS_FILM, THESIS_LOAD, clock=ManualClock()
        )

    def identity(self) -> RigIdentity:
        return open_simulated_rig(self.address, RigSettings(), THESIS_FILM, THESIS_LOAD).identify()

    def outputs_touched(self) -> list[str]:
        return self._touched


class TestInputsOfARigThatHidesSomething(TestSimulatedInputs):
    address = "sim:7"


def test_a_read_that_waits_ends_with_close() -> None:
    assert isinstance(KIND, ReadsInputs)
    inputs = open_simulated_inputs(
        "sim", RigSettings(), THESIS_FILM, THESIS_LOAD, clock=ManualClock()
    )
    inputs.read()
    inputs.close()
    with pytest.raises(RigError, match="closed"):
        inputs.read()


def test_samples_follow_each_other_without_a_gap() -> None:
    whole = open_simulated_inputs(
        "sim", RigSettings(), THESIS_FILM, THESIS_LOAD, clock=ManualClock()
    )
    counts = np.concatenate([whole.read() for _ in range(20)], axis=1)
    clock = ManualClock()
    other = open_simulated_inputs("sim", RigSettings(), THESIS_FILM, THESIS_LOAD, clock=clock)
    clock.advance(100.0)  # a late reader gets all of them
    np.testing.assert_array_equal(counts, np.concatenate([other.read() for _ in range(20)], axis=1))
