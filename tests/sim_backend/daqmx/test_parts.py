"""Parts of the simulated card by themselves, without a server; time is an argument."""

import inspect
import pkgutil
from importlib import import_module

import numpy as np
import pytest

from dearig.drivers.settings import RigSettings
from dearig.sim_backend import daqmx
from dearig.sim_backend.clock import ManualClock
from dearig.sim_backend.daqmx.card.channels import AnalogInput
from dearig.sim_backend.daqmx.card.errors import DaqmxError
from dearig.sim_backend.daqmx.card.names import named
from dearig.sim_backend.daqmx.card.state import CardState
from dearig.sim_backend.daqmx.card.tasks import Kind, Task
from dearig.sim_backend.daqmx.card.terminals import Terminals
from dearig.sim_backend.daqmx.card.work import CardSamples
from dearig.sim_backend.daqmx.digital.watchdogs import Watchdogs
from dearig.sim_backend.daqmx.setup.timing import Timing


def _state() -> CardState:
    return CardState(RigSettings(), ManualClock())


@pytest.mark.parametrize("room", [0, 1, 7, 100])
def test_samples_are_kept_for_as_long_as_the_buffer_holds_them(room):
    samples = CardSamples(1, room, np.int64)
    assert samples.between(0, 0).shape == (1, 0)
    for first in range(0, 1000, 3):
        samples.append(np.arange(first, first + 3)[np.newaxis])
        end = first + 3
        assert samples.total == end
        for start in range(max(0, end - room), end):
            assert samples.between(start, end)[0].tolist() == list(range(start, end))
    kept = sum(block.shape[1] for block in samples._blocks)
    assert kept <= max(1, room) + 2 * 3  # blocks are dropped whole


def test_what_passes_with_time_is_done_in_order_before_a_call():
    state, done = _state(), []
    state.steps = (lambda now: done.append(("first", now)), lambda now: done.append(("then", now)))
    with state.present() as now:
        assert done == [("first", now), ("then", now)]


def test_timing_of_a_task_without_a_card():
    state = _state()
    timing = Timing(state, Terminals(state.name))
    task = Task("t", "client", Kind.AI, [AnalogInput("a", "ai0", (-10.0, 10.0), 10.0, 10106)])
    timing.set_clock(task, 600e3, "", False, 1000)
    assert task.timing.rate == pytest.approx(1e8 / 166)
    assert timing.buffer_size(task) == 100_000
    with pytest.raises(DaqmxError, match="Maximum Value: 2e"):
        timing.set_clock(task, 2.1e6, "", False, 1000)


class _Levels:
    """Lines that note what is put on them."""

    def __init__(self):
        self.put_at = []

    def put(self, line, level, now):
        self.put_at.append((line, level, now))

    def lines_of(self, physical):
        return [physical]


def test_a_watchdog_takes_the_lines_when_its_time_is_over():
    state, levels = _state(), _Levels()
    watchdogs, task = Watchdogs(state, levels), Task("w", "client")
    state.tasks["w"] = task
    watchdogs.make(task, 0.5)
    watchdogs.set_expiration(task, "port0/line0", 10214)  # low
    task.work.start(1.0)
    watchdogs.settle(1.49)
    assert not watchdogs.holds
    assert watchdogs.next_expiry() == 1.5
    watchdogs.settle(7.0)
    assert watchdogs.holds
    assert levels.put_at == [("port0/line0", False, 1.5)]


def test_names_are_unique_in_a_task():
    task = Task("t", "client", Kind.AI, [AnalogInput("in10", "ai0", (-1.0, 1.0), 1.0, 10106)])
    assert named(task, "Dev1", ["ai1", "ai2"], "in11") == [("ai1", "in11"), ("ai2", "in12")]
    with pytest.raises(DaqmxError, match="IN10"):
        named(task, "Dev1", ["ai1", "ai2"], "IN09")


def test_the_card_is_composed_of_small_parts():
    """No class has a hundred methods again, and none inherits more than what its kind does."""
    found = 0
    for module in pkgutil.walk_packages(daqmx.__path__, f"{daqmx.__name__}."):
        if ".protocol" in module.name:
            continue  # NI's protocol is one service with hundreds of calls
        for name, kind in inspect.getmembers(import_module(module.name), inspect.isclass):
            if kind.__module__ != module.name:
                continue
            found += 1
            methods = [f for f in vars(kind).values() if inspect.isfunction(f)]
            assert len(methods) <= 25, name
            own = [base for base in kind.__mro__ if base.__module__.startswith(daqmx.__name__)]
            assert len(own) <= 4, name  # a work: Work, Input, SampledInput, and its own class
    assert found > 30
