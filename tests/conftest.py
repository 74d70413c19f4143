"""Settings of every test run."""

import os
import signal
import tempfile
from pathlib import Path

import pytest
from hypothesis import settings

# the published tests explain their failures as those here do
pytest.register_assert_rewrite("dearig.drivers.contract")

# What a shell runs in the background ignores ctrl-C, and hands that down: the tests send it.
if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

# The commands that the tests run must not write to the log of the person who runs the tests.
os.environ["DEARIG_LOG_DIR"] = str(Path(tempfile.gettempdir()) / "dearig-tests-log")

# No example is timed: the machine may be busy, or a kernel still to be compiled. The same answer
# twice, for whoever runs the tests; DEARIG_EXPLORE=1 lets hypothesis look further.
settings.register_profile("explore", deadline=None)
settings.register_profile("repeatable", deadline=None, derandomize=True, database=None)
settings.load_profile("explore" if os.environ.get("DEARIG_EXPLORE") else "repeatable")
