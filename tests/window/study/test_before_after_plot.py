"""The plot of a recording shows each channel with the models before and after."""

from __future__ import annotations

import numpy as np
from pytestqt.qtbot import QtBot

from dearig.window.session.state import Session
from dearig.window.study.before_after_plot import BeforeAfterPlot
from tests.tools.diagnosis import diagnose_outcome, electric_outcome


def shown(session: Session, qtbot: QtBot, outcome) -> BeforeAfterPlot:
    plot = BeforeAfterPlot(session)
    qtbot.addWidget(plot)
    plot.show_pairs(tuple(zip(outcome.before.train, outcome.after.train, strict=True)))
    return plot


def drawn(plot: BeforeAfterPlot, place: int) -> dict[str, np.ndarray]:
    return {c.title: c.points[1] for c in plot.plots[place].drawn}


def test_the_current_is_shown_with_its_predictions_and_residuals(session, qtbot):
    outcome = electric_outcome()
    plot = shown(session, qtbot, outcome)
    names = [plot.channel.itemText(i) for i in range(plot.channel.count())]
    assert names == ["Displacement", "Voltage monitor", "Current"]
    plot.channel.setCurrentText("Current")
    _, current = outcome.before.train[0].curves
    left = drawn(plot, 2)["residual, before"]
    np.testing.assert_allclose(np.ptp(left), 1e6 * np.ptp(current.residual), rtol=0.05)
    assert set(drawn(plot, 1)) == {"measured", "before", "after"}
    assert "µA RMS" in plot.error_summary.full_text
    plot.channel.setCurrentText("Displacement")
    assert "µm RMS" in plot.error_summary.full_text


def test_a_recording_without_channels_has_its_displacement_only(session, qtbot):
    plot = shown(session, qtbot, diagnose_outcome())
    assert not plot.channel.isEnabled()
    assert "µm RMS" in plot.error_summary.full_text
