"""Settings of every test run."""

import gc
import os
import signal
import tempfile
import threading
from collections import Counter
from pathlib import Path

import pytest
from hypothesis import settings

from tests.deep.share import VARIABLE, share_of

# the published tests explain their failures as those here do
pytest.register_assert_rewrite("dearig.drivers.contract")

# What a shell runs in the background ignores ctrl-C, and hands that down: the tests send it.
if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

# Searching for garbage while modules are imported and tests collected takes a third of that time,
# and finds none.
gc.disable()

# The commands that the tests run must not write to the log of the person who runs the tests.
os.environ["DEARIG_LOG_DIR"] = str(Path(tempfile.gettempdir()) / "dearig-tests-log")

# No example is timed: the machine may be busy, or a kernel still to be compiled. The same answer
# twice, for whoever runs the tests; DEARIG_EXPLORE=1 lets hypothesis look further.
settings.register_profile("explore", deadline=None)
settings.register_profile("repeatable", deadline=None, derandomize=True, database=None)
settings.load_profile("explore" if os.environ.get("DEARIG_EXPLORE") else "repeatable")


def pytest_runtest_setup() -> None:
    """Let ctrl-C be answered in each test: what an earlier one ran may have it ignored."""
    on_main = threading.current_thread() is threading.main_thread()
    if on_main and signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_collection_finish() -> None:
    """Collect garbage from now on, among what the tests make."""
    gc.freeze()
    gc.enable()


def pytest_configure(config: pytest.Config) -> None:
    """Let distributed tests run in the order of ``pytest_collection_modifyitems``."""
    config.option.loadscopereorder = False


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Put the longest files first, and deselect deep tests that are not of the chosen share.

    A long file that comes last keeps one process busy while the others have nothing left. Those
    with a slow test are the longest, then those with many tests.
    """
    sizes = Counter(item.path for item in items)
    slow = {item.path for item in items if item.get_closest_marker("slow")}
    items.sort(key=lambda item: (item.path not in slow, -sizes[item.path], item.path))
    if VARIABLE not in os.environ:
        return
    marks = ("deep", "more_examples")
    deep = [item for item in items if any(map(item.get_closest_marker, marks))]
    chosen = share_of([item.nodeid for item in deep], os.environ[VARIABLE])
    config.hook.pytest_deselected(items=[i for i in items if i.nodeid not in chosen])
    items[:] = [item for item in items if item.nodeid in chosen]
