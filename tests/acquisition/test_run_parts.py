"""Options of a run: faults are read when the options are made, from any iterable."""

from __future__ import annotations

from dataclasses import replace

import pytest

from dearig.acquisition.run_parts import RunOptions
from dearig.errors import InputError


def test_faults_of_an_iterator_are_kept_in_changed_options() -> None:
    options = RunOptions(faults=(f"{kind}@0.5" for kind in ("arc", "amplifier-trip")))
    again = replace(options, seed=3)
    assert again.fault_plan == options.fault_plan
    assert [fault.kind for fault in again.fault_plan.faults] == ["arc", "amplifier-trip"]


def test_a_fault_that_cannot_be_read_is_refused_before_the_run() -> None:
    with pytest.raises(InputError, match="fault 'arc' is not understood"):
        RunOptions(faults=["arc"])
