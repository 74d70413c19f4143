"""One run and one fit of it, as a notebook makes them."""

from __future__ import annotations

import pytest

import dearig

#: A rig that samples slowly: less to simulate and to fit.
SLOW_RIG = {"card": {"sample_rate_Hz": 200.0}}


@pytest.fixture(scope="session")
def run() -> dearig.Recording:
    """The thesis's excitation, one period of it, on the simulated rig."""
    sequence = dearig.Sequence("short thesis").thesis(periods=1)
    return dearig.record(sequence, seed=1, rig_file=SLOW_RIG, film="F7", notes="a test")


@pytest.fixture(scope="session")
def fit(run: dearig.Recording) -> dearig.IdentifyResult:
    """A fit of ``run``."""
    return dearig.identify(run, branches=2)
