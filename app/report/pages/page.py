"""Report page of any outcome: identification, validation or diagnosis."""

from __future__ import annotations

from pathlib import Path

from dearig.analysis.outcomes import DiagnoseOutcome, IdentifyOutcome, ValidateOutcome

__all__ = ["write_report"]


def write_report(
    outcome: IdentifyOutcome | ValidateOutcome | DiagnoseOutcome, path: str | Path
) -> Path:
    """Write the report of ``outcome`` to the HTML file ``path`` and return its path."""
    # the pages import Matplotlib, which takes a second
    from dearig.report.pages.diagnosis import write_diagnosis_report
    from dearig.report.pages.html import write_identify_report, write_validate_report

    if isinstance(outcome, DiagnoseOutcome):
        return write_diagnosis_report(outcome, path)
    if isinstance(outcome, ValidateOutcome):
        return write_validate_report(outcome, path)
    return write_identify_report(outcome, path)
