"""The first start: curves of the plan by kernels that are not compiled, from another process."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtWidgets import QWidget
from pytestqt.qtbot import QtBot

from dearig.config.rigfile import RigFile
from dearig.window.jobs.worker import Worker
from dearig.window.run.page import RunPage
from dearig.window.sequence.outline import outline
from dearig.window.sequence.page import SequencePage
from dearig.window.sequence.planner import Planner, make_preview
from dearig.window.sequence.preview_panel import OUTLINE
from dearig.window.session.state import Preview, Session
from tests.window.conftest import SHORT

WAIT = 120_000


@pytest.fixture
def planner(session: Session, keep: Callable[[QWidget], None]):
    made = Planner(session)
    yield made
    made.close()


def predicts(outline: Preview | None) -> bool:
    return outline is not None and outline.curves["displacement"][1].size > 0


@pytest.mark.deep
def test_an_outline_has_the_curves_of_the_plan_and_cannot_be_played(
    session: Session, planner: Planner, qtbot: QtBot
) -> None:
    session.set_sequence(SHORT, Path())
    shown: list[Preview] = []
    session.outline_changed.connect(lambda: shown.append(session.outline))
    planner.hold(True)
    qtbot.waitUntil(lambda: predicts(session.outline), timeout=WAIT)
    found, expected = session.outline, make_preview(SHORT, Path(), RigFile())
    assert session.preview is None
    # the voltage needs no model, and does not wait for the other process
    voltage = next(outline for outline in shown if outline is not None)
    assert voltage.curves["displacement"][1].size == 0
    assert not voltage.playable
    assert voltage.sentence == "one lobe"
    assert voltage.segments == found.segments
    np.testing.assert_allclose(voltage.curves["voltage"], found.curves["voltage"], atol=1e-9)
    assert not found.playable
    assert found.digest == ""
    assert found.sentence == "one lobe"
    assert found.duration == pytest.approx(expected.plan.duration)
    for name, (time, values) in expected.curves.items():
        np.testing.assert_allclose(found.curves[name][0], time, rtol=0, atol=1e-9)
        np.testing.assert_allclose(found.curves[name][1], values, rtol=1e-4, atol=1e-9)
    planner.hold(False)
    assert session.outline is None
    qtbot.waitUntil(lambda: session.preview is not None, timeout=WAIT)
    assert session.preview.playable


def test_the_pages_draw_it_and_nothing_can_be_armed(
    session: Session, planner: Planner, keep: Callable[[QWidget], None], qtbot: QtBot
) -> None:
    run, sequence = RunPage(session), SequencePage(session)
    keep(run)
    keep(sequence)
    session.set_sequence(SHORT, Path())
    planner.hold(True)
    qtbot.waitUntil(lambda: predicts(session.outline), timeout=WAIT)
    assert run.plots.curve("planned voltage")[1].max() == pytest.approx(6.0, abs=0.01)
    assert run.plots.curve("planned displacement")[1].max() > 0.0
    words = run.display.view.words.text()
    assert words == "Preview, the model is being compiled: one lobe, 1.0 s"
    assert sequence.preview.plots.drawn == ("voltage", "displacement", "field")
    assert sequence.preview.state.text() == OUTLINE
    assert not run.arm_button.isEnabled()
    assert run.display.digest == ""
    run.runner.arm(True)
    assert not run.start_button.isEnabled()
    run.runner.disarm("the test")


def test_an_outline_of_another_sequence_is_not_shown(
    session: Session, planner: Planner, monkeypatch: pytest.MonkeyPatch
) -> None:
    jobs = []
    submit = Worker.submit

    def note(worker, function, *given, **how):
        jobs.append(submit(worker, function, *given, **how))
        return jobs[-1]

    monkeypatch.setattr(Worker, "_send", lambda *_: None)
    monkeypatch.setattr(Worker, "submit", note)
    planner.hold(True)
    session.set_sequence(SHORT, Path())
    before, after = (Preview("", sentence=name, is_outline=True) for name in ("before", "after"))
    jobs[0].finished.emit(before)
    assert session.outline is None
    jobs[1].finished.emit(after)
    assert session.outline is after


def test_a_process_with_the_compiler_makes_none() -> None:
    assert "numba" in sys.modules
    before = dict(os.environ)
    assert outline(SHORT, ".", "") is None
    assert dict(os.environ) == before
