"""Settings of every test run."""

import os

from hypothesis import settings

# No example is timed: the machine may be busy, or a kernel still to be compiled. The same answer
# twice, for whoever runs the tests; DEARIG_EXPLORE=1 lets hypothesis look further.
settings.register_profile("explore", deadline=None)
settings.register_profile("repeatable", deadline=None, derandomize=True, database=None)
settings.load_profile("explore" if os.environ.get("DEARIG_EXPLORE") else "repeatable")
