"""Runs that die, freeze or lose something; the campaign does many more of them."""

import sys

import pytest

from tests.campaign.cases import run_case
from tests.deep import mostly_deep

# a busy machine is late, and lateness is not what is tested here: the campaign measures it
PATIENCE = 20.0


@pytest.mark.skipif(sys.platform == "win32", reason="stops and kills processes by signals")
@pytest.mark.parametrize(
    "kind",
    mostly_deep(
        ["hold-client-killed", "client-frozen", "guardian-killed", "amplifier-trip", "disk-full",
         "operator-stops", "serial-garbage"],
        kept=["guardian-killed"],
    ),
)  # fmt: skip
def test_it_ends_at_zero_volts_with_what_was_recorded(kind, tmp_path):
    outcome = run_case(kind, 1, tmp_path, PATIENCE)
    assert outcome.wrong == []
