"""The rig contract on a real card, for whoever has one: it puts up to 8 kV on the film.

DEARIG_CARD=daqmx:Dev1 DEARIG_RIG_FILE=my-rig.toml python -m pytest
tests/integration/test_real_card.py
"""

import os

import pytest

from dearig.config.rigfile import load_rig_file
from dearig.drivers.contract.rig import RigContract
from dearig.drivers.daqmx import open_daqmx_rig

pytestmark = pytest.mark.skipif(
    not os.environ.get("DEARIG_CARD"), reason="DEARIG_CARD names no card"
)


class TestRealCard(RigContract):
    MONITOR_TOLERANCE = 100.0

    def open_rig(self, *, block_samples=None, seed=0):  # noqa: ARG002  (a film has none)
        rig_file = load_rig_file(os.environ.get("DEARIG_RIG_FILE"))
        return open_daqmx_rig(os.environ["DEARIG_CARD"], rig_file, block_samples=block_samples)

    def test_same_seed_gives_the_same_bytes(self):
        pytest.skip("a real film has no seed")

    def test_another_seed_or_run_gives_other_noise(self):
        pytest.skip("a real film has no seed")

    def test_block_length_changes_nothing(self):
        pytest.skip("a real film never does the same thing twice")
