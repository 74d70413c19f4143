"""Buttons and progress of a job: what they show while it goes on, and what Cancel does."""

from __future__ import annotations

import math

import pytest
from pytestqt.qtbot import QtBot

from dearig.window.jobs.job_controls import JobControls
from dearig.window.jobs.worker import Job, Worker
from dearig.window.jobs.worker_process import Request
from dearig.window.kit.widgets import button


def _job(whole: bool = True) -> Job:
    return Job(Worker(), Request(1, print, ()), whole)


@pytest.mark.parametrize(
    ("whole", "left", "text"),
    [
        (True, 12.2, "Fitting, about 12 s left"),
        (False, 12.2, "Fitting, about 12 s of this step left"),
        (True, 600.0, "Fitting, about 10 min left"),
        (True, math.nan, "Fitting"),
    ],
)
def test_stage_and_time_left_are_shown(qtbot: QtBot, whole: bool, left: float, text: str) -> None:
    controls, job = JobControls(button("Start", ""), "Cancel"), _job(whole)
    qtbot.addWidget(controls)
    controls.begin(job)
    job.progressed.emit("fitting", 0.25, left)
    assert controls.stage.text() == text
    assert controls.bar.value() / controls.bar.maximum() == 0.25
    controls.end()
    assert controls.stage.text().strip() == ""
    assert controls.bar.value() <= 0


def test_a_job_without_fractions_has_a_bar_that_only_moves(qtbot: QtBot) -> None:
    controls, job = JobControls(button("Start", ""), "Cancel"), _job()
    qtbot.addWidget(controls)
    controls.begin(job)
    job.progressed.emit("computing the voltage", 0.0, math.nan)
    assert (controls.bar.minimum(), controls.bar.maximum()) == (0, 0)


def test_cancel_can_be_pressed_while_a_job_goes_on(qtbot: QtBot) -> None:
    controls = JobControls(button("Start", ""), "Cancel")
    qtbot.addWidget(controls)
    assert not controls.cancel_button.isEnabled()
    controls.begin(_job())
    assert controls.cancel_button.isEnabled()
    controls.end()
    assert not controls.cancel_button.isEnabled()


def test_cancel_of_a_dialog_can_be_pressed_always_and_asks_the_dialog(qtbot: QtBot) -> None:
    asked: list[str] = []
    controls = JobControls(button("Import", ""), "Cancel", cancelled=lambda: asked.append("cancel"))
    qtbot.addWidget(controls)
    controls.cancel_button.click()
    controls.begin(_job())
    controls.cancel_button.click()
    assert asked == ["cancel", "cancel"]
