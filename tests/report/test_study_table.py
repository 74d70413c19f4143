"""The table of a study on a terminal."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

from dearig.batch.studies import StudyTable
from dearig.report.text.study_table import study_table_rows


def test_a_reason_does_not_repeat_the_name_before_it() -> None:
    failed = {
        "recording": "a.h5",
        "state": "failed",
        "reason": "a.h5: the voltage never leaves 0 V",
    }
    table = cast("StudyTable", SimpleNamespace(rows=(failed,)))
    (row,) = study_table_rows(table, 10).rows
    assert row.detail == "the voltage never leaves 0 V"
