"""Which ends of a run need a person who looks at the rig."""

from __future__ import annotations

import pytest

from dearig.errors import (
    DearigError,
    DiskFault,
    InputError,
    InstrumentFault,
    Interrupted,
    NotSafe,
    SafetyStop,
)
from dearig.output_state import Known, OutputState


@pytest.mark.parametrize(
    ("kind", "at_zero", "in_doubt", "not_contacted"),
    [
        (SafetyStop, True, True, False),
        (InstrumentFault, True, True, False),
        (NotSafe, True, True, True),
        (DiskFault, False, True, False),
        (Interrupted, False, True, False),
        (InputError, False, True, False),
    ],
)
def test_a_person_must_look_after_interlocks_faults_and_doubts_about_zero_volts(
    kind: type[DearigError], at_zero: bool, in_doubt: bool, not_contacted: bool
) -> None:
    error = kind("what happened")
    assert error.needs_inspection is not_contacted
    for known, expected in (
        (Known.CONFIRMED, at_zero), (Known.COMMANDED, in_doubt), (Known.UNKNOWN, in_doubt)
    ):  # fmt: skip
        error.output_state = OutputState(known, 0.0)
        assert error.needs_inspection is expected
