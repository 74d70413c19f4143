"""Fixture ``daqmx_card`` for pytest: a simulated DAQmx card, for each test a new one.

In ``conftest.py``: ``pytest_plugins = ["dearig.api.simulated_card_fixture"]``.
"""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from dearig.api.simulated_card import ServedCard, simulated_daqmx_card

__all__ = ["daqmx_card"]


@pytest.fixture
def daqmx_card() -> Iterator[ServedCard]:
    """Simulated PCIe-6361 called Dev1, as fast as it can be; see ``simulated_daqmx_card``."""
    with simulated_daqmx_card() as card:
        yield card
