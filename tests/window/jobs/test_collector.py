"""Garbage goes in the interface thread only, and it does go."""

from __future__ import annotations

import gc
import threading
import weakref

from pytestqt.qtbot import QtBot

from dearig.window.jobs.collector import Collector


class Ring:
    """Something that only the collector can undo; says in which thread it went."""

    def __init__(self, went: list[int]) -> None:
        self.me = self
        weakref.finalize(self, lambda: went.append(threading.get_ident()))


def as_the_tests_have_it() -> None:
    """Leave what is alive out of collections again: libraries keep a million objects."""
    gc.disable()
    gc.freeze()


def test_what_another_thread_leaves_goes_in_this_one(qtbot: QtBot) -> None:
    collector = Collector()
    went: list[int] = []

    def leave() -> None:
        for _ in range(5000):
            Ring(went)

    other = threading.Thread(target=leave)
    other.start()
    other.join()
    assert went == []
    qtbot.waitUntil(lambda: len(went) == 5000, timeout=10_000)
    assert set(went) == {threading.get_ident()}
    collector.close()
    assert gc.isenabled()
    as_the_tests_have_it()


def test_what_is_alive_before_the_rig_is_armed_costs_no_later_collection(qtbot: QtBot) -> None:
    collector = Collector()
    went: list[int] = []
    kept = [Ring(went) for _ in range(5000)]
    collector.settle()
    assert len(gc.get_objects()) < len(kept)
    kept.clear()
    gc.collect()
    assert went == []
    collector.settle()  # after the run
    assert len(went) == 5000
    collector.close()
    as_the_tests_have_it()
