"""What is told of electrical channels: page, terminal and figures say the same."""

from __future__ import annotations

import re

import pytest

from dearig.cli.terminal import diagnosis_tables
from dearig.report.figures.channels import channel_figure, evidence_figure
from dearig.report.pages.diagnosis import write_diagnosis_report
from tests.cli.test_terminal import shown
from tests.report.pages.test_page import check
from tests.tools.diagnosis import diagnose_outcome, electric_outcome


def test_the_page_has_what_each_channel_leaves_and_says(tmp_path):
    read = check(write_diagnosis_report(electric_outcome(), tmp_path / "report.html"))
    assert "Voltage monitor and current" in read.words
    assert "not recorded" in read.words
    assert "the voltage monitor denies it" in read.words
    assert "What each channel adds to the criterion" in read.words
    assert "train.h5: current, means at 200 Hz, with the prediction" in read.words


def test_a_recording_without_channels_has_no_such_section(tmp_path):
    read = check(write_diagnosis_report(diagnose_outcome(), tmp_path / "report.html"))
    assert "Voltage monitor and current" not in read.words


def test_the_terminal_lists_the_channels():
    told = shown(diagnosis_tables(electric_outcome()), width=100)
    current = re.search(r"current +([\d.]+) +([\d.]+) +([\d.]+) +.A", told)
    assert current is not None
    assert float(current[1]) == pytest.approx(2.0 * float(current[2]), rel=0.01)


def test_bars_have_the_length_of_the_evidence():
    evidence = electric_outcome().finding.channel_evidence
    (ax,) = evidence_figure(evidence).axes
    drawn = sorted(patch.get_width() for patch in ax.patches)
    assert drawn == sorted(odds for _, said in evidence for _, odds in said)


def test_the_figure_of_a_channel_draws_readings_and_residuals():
    (current,) = (c for c in electric_outcome().before.train[0].curves if c.name == "current")
    both, left = channel_figure([("model", "#D55E00", current)]).axes
    assert {line.get_label() for line in both.lines} == {"measured", "model"}
    assert max(line.get_ydata().max() for line in left.lines if len(line.get_ydata()) > 2) == (
        pytest.approx(1e6 * current.residual.max())
    )
