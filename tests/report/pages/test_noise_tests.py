"""The tests of a residual for noise: next to each other before and after, and never denied."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from dearig.analysis.outcomes import DiagnoseOutcome
from dearig.report.as_json import diagnosis_json
from dearig.report.pages.diagnosis import write_diagnosis_report
from dearig.report.text.diagnosis import headline
from tests.tools.diagnosis import diagnose_outcome, nothing_missing


@pytest.mark.parametrize("outcome", [diagnose_outcome(), nothing_missing()])
def test_a_residual_that_is_small_but_no_noise_is_said_to_be_none(outcome: DiagnoseOutcome) -> None:
    assert "does not look like it" not in headline(outcome)
    small = replace(
        outcome.finding.after[0], is_noise=False, ljung_box_p=1e-18, words=("1.0 um RMS",)
    )
    doubted = replace(outcome, finding=replace(outcome.finding, after=(small,)))
    assert "does not look like it" in headline(doubted)
    assert diagnosis_json(doubted)["residual_after"]["is_noise"] is False


def test_the_tests_after_stand_beside_those_before(tmp_path: Path) -> None:
    page = write_diagnosis_report(diagnose_outcome(), tmp_path / "report.html")
    _, _, after = page.read_text(encoding="utf-8").partition("(Ljung-Box test)")
    assert "(Ljung-Box test)" in after
    assert "After: the correlation time" in after
