"""Settings of every test run."""

import os

from hypothesis import settings

# the same answer twice, for whoever runs the tests; DEARIG_EXPLORE=1 lets hypothesis look further
settings.register_profile("repeatable", derandomize=True, database=None)
if not os.environ.get("DEARIG_EXPLORE"):
    settings.load_profile("repeatable")
