from __future__ import annotations

import sys
from dataclasses import replace

import pytest

from dearig.analysis.outcomes import Published
from dearig.recording.reading.origin import Origin
from dearig.report.as_json import outcome_json
from dearig.report.made import command_line
from dearig.report.pages.head import head_of
from dearig.report.pages.html import write_identify_report
from dearig.report.text.sentences import identify_summary
from dearig.report.text.tables import thesis_error_table
from dearig.report.text.thesis import SIMULATED_CAVEAT
from tests.report.pages.test_page import check
from tests.tools.reports import actuator_comparison, identify_outcome

SIMULATED = Origin(
    "train.h5", "ab" * 32, simulated=True, source="rig sim:8", seed=3, started="2026-11-27",
    operator="J. Fan", film="F12, 75 x 72 x 1 mm", rig_file="cd" * 32,
)  # fmt: skip
MEASURED = replace(
    SIMULATED, name="real.h5", sha256="ef" * 32, simulated=False, source="rig daqmx:Dev1", seed=None
)


def rows(*origins: Origin) -> dict[str, tuple[str, ...]]:
    return dict(head_of(origins).rows)


def test_head_names_program_command_film_operator_and_hashes(tmp_path, monkeypatch):
    monkeypatch.setattr(sys, "argv", ["/usr/bin/dearig", "identify", "a b.h5"])
    outcome = identify_outcome(train=(actuator_comparison(origin=SIMULATED),))
    write_identify_report(outcome, tmp_path / "page.html")
    words = check(tmp_path / "page.html").words
    assert "SIMULATED no measured data (rig sim:8, noise seed 3)" in words
    for word in ("dearig identify 'a b.h5'", "J. Fan", "F12, 75 x 72 x 1 mm", "ab" * 32, "cd" * 32):
        assert word in words.replace('"', "'")


def test_measured_data_have_no_banner():
    assert head_of([MEASURED]).banner == ""
    assert head_of([Origin("imported.h5")]).banner == ""


def test_a_mixture_names_the_simulated_recordings():
    banner = head_of([SIMULATED, MEASURED]).banner
    assert banner == "1 of 2 recordings: train.h5 (rig sim:8, noise seed 3)"


def test_what_is_not_known_is_said_to_be_not_recorded():
    found = rows(Origin("imported.h5"))
    assert found["Film"] == found["Operator"] == found["Rig file (SHA-256)"] == ("not recorded",)
    assert head_of([Origin("a")]).recordings[0].sha256 == "not computed"


def test_values_that_differ_name_their_recordings():
    other = replace(MEASURED, operator="")
    assert rows(SIMULATED, other)["Operator"] == ("J. Fan (train.h5)", "not recorded (real.h5)")


@pytest.mark.parametrize(
    ("argv", "command"),
    [
        (["/usr/lib/app/cli/__main__.py", "demo"], "dearig demo"),
        (["fits.py", "--fast"], "fits --fast"),
        ([""], "python"),
        (["dearig", "--notify-webhook", "https://a.org/SECRET"], "dearig --notify-webhook ..."),
        (["dearig", "--notify-webhook=https://a.org/SECRET"], "dearig --notify-webhook=..."),
    ],
)
def test_command_line_is_that_of_the_process(monkeypatch, argv, command):
    monkeypatch.setattr(sys, "argv", argv)
    assert command_line() == command


def test_simulated_errors_are_not_compared_with_the_thesis_without_a_word():
    theirs = Published(2.13, 4.07)
    for origin, said in ((MEASURED, False), (SIMULATED, True)):
        train = (actuator_comparison(origin=origin),)
        table = thesis_error_table("x", train, theirs)
        assert (table.note == SIMULATED_CAVEAT) == said
        outcome = identify_outcome(train=train)
        assert (SIMULATED_CAVEAT in identify_summary(outcome)) == said
        assert outcome_json(outcome)["train"][0]["simulated"] is said
