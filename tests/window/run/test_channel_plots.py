"""Declared channels on the screen: live on the Run page, and of a recording."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from dearig.acquisition.run import record
from dearig.analysis.summary import curves
from dearig.config.rigfile import RigFile
from dearig.config.sequencefile import parse_sequence
from dearig.recording import open_recording
from dearig.window.plots.area import PlotArea
from dearig.window.recordings.curves_plot import CurvesPlot
from dearig.window.run.channel_plots import ChannelPlots
from dearig.window.run.live import Live
from tests.window.conftest import SHORT

RIG = RigFile.model_validate(
    {
        "channel": [
            {"name": "load_cell", "label": "Load cell", "terminal": "ai4", "unit": "N",
             "unit_per_V": 5.0, "simulated_value": 1.96},
            {"name": "monitor", "terminal": "ai5", "unit": "V", "unit_per_V": 1.0},
        ]
    }
)  # fmt: skip


@pytest.fixture
def recorded(tmp_path: Path) -> tuple[Path, Live]:
    live = Live()
    result = record(
        parse_sequence(SHORT, "short", Path()), "sim", RIG, tmp_path / "run.h5", observer=live
    )
    live.close()
    return result.path, live


def test_live_curves_of_a_run_are_what_was_recorded(recorded, session, qtbot):
    path, live = recorded
    recording = open_recording(path)
    area = PlotArea(session, "Run")
    qtbot.addWidget(area)
    plots = ChannelPlots(session, area, 0)
    plots.show_channels([(c.shown, c.unit) for c in RIG.channel])
    plots.draw(live, [c.name for c in RIG.channel], 0.0, recording.duration)
    assert [str(p.axis_texts["left"]) for p in plots.plots] == ["Load cell (N)", "monitor (V)"]
    _, force = plots.curves[0].points
    assert force.min() >= recording.values["load_cell"].min()
    assert force.max() <= recording.values["load_cell"].max()
    assert force.mean() == pytest.approx(1.96, abs=0.02)
    # a channel may have the name of a curve of the run
    _, other = plots.curves[1].points
    np.testing.assert_allclose(other, 0.0, atol=0.01)
    assert np.abs(live.view("monitor", 0.0, recording.duration)[1]).max() > 100.0


def test_recording_shows_them_below_the_others(recorded, session, qtbot):
    plot = CurvesPlot(session)
    qtbot.addWidget(plot)
    assert not plot.channels.plots
    plot.show_curves([curves(recorded[0], None)])
    assert plot.channels.plots
    time, force = plot.channels.curves[0].points
    assert time[-1] == pytest.approx(open_recording(recorded[0]).duration, rel=0.01)
    assert force.mean() == pytest.approx(1.96, abs=0.02)
    plot.show_curves([])
    assert not plot.channels.plots


def test_channels_of_another_rig_replace_the_first(session, qtbot):
    area = PlotArea(session, "Run")
    qtbot.addWidget(area)
    area.add_plot(0, left="Voltage (kV)")
    plots = ChannelPlots(session, area, 1)
    plots.show_channels([("A", "N"), ("B", "V")])
    assert len(area.plots) == 3
    plots.show_channels([])
    assert len(area.plots) == 1
