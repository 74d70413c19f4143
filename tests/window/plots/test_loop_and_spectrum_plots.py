"""Views of displacement against voltage, of spectra, and of two residuals."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from dearig.analysis.loops import Loops, loops_of
from dearig.analysis.spectrum import amplitude_density
from dearig.analysis.summary import Curves
from dearig.window.kit.theme import DARK
from dearig.window.plots.loop_plot import LoopPlot
from dearig.window.plots.spectrum_plot import Density, SpectrumPlot
from dearig.window.recordings.curves_plot import CurvesPlot
from dearig.window.run.live_analysis import ANALYSES, LiveAnalysis
from dearig.window.run.traces import Newest

PHASE = np.linspace(0.0, 2.0 * np.pi, 2001)


def ellipse(name: str, lag: float = 0.2) -> Loops:
    """One cycle of 6 kV and 2 mm that lags by ``lag`` rad."""
    volts, moved = 3e3 * (1.0 - np.cos(PHASE)), 1e-3 * (1.0 - np.cos(PHASE - lag))
    return loops_of(PHASE, volts, moved, name)


def test_loop_has_its_area_per_cycle_with_the_unit(session, qtbot):
    view = LoopPlot(session)
    qtbot.addWidget(view)
    view.show_loops([ellipse("run 1")])
    area = math.pi * 3.0 * 1.0 * math.sin(0.2)  # kV mm
    (text,) = view.plot.key.texts
    assert text == f"run 1: area {area:.3g} kV\N{DOT OPERATOR}mm per cycle"
    x, y = view.plot.drawn[0].points
    assert x.max() == pytest.approx(6.0)
    assert y.max() == pytest.approx(2.0)
    view.against.setCurrentIndex(1)
    assert view.plot.key.texts[0].endswith(" kV\N{SUPERSCRIPT TWO}\N{DOT OPERATOR}mm per cycle")
    assert str(view.plot.axis_texts["bottom"]) == "Voltage squared (kV\N{SUPERSCRIPT TWO})"
    assert view.plot.drawn[0].points[0].max() == pytest.approx(36.0)


def test_several_loops_share_the_plot_and_change_with_the_theme(session, qtbot):
    view = LoopPlot(session)
    qtbot.addWidget(view)
    still = loops_of(PHASE, np.zeros(PHASE.size), np.zeros(PHASE.size), "still")
    view.show_loops([ellipse("a"), ellipse("b", -0.2), still])
    session.set_theme(DARK)
    first, second, third = view.plot.key.texts
    assert first.startswith("a: area ")
    assert "area \N{MINUS SIGN}" in second  # displacement leads
    assert third == "still: no complete cycle"
    assert [c.colour for c in view.plot.drawn] == list(DARK.curves[:3])


def test_spectrum_is_drawn_in_the_unit_of_its_axis(session, qtbot):
    view = SpectrumPlot(session)
    qtbot.addWidget(view)
    rng = np.random.default_rng(1)
    found = amplitude_density(rng.normal(0.0, 1e-6, 20_000), 1000.0)
    view.show_densities([Density("measured", "measured", *found)])
    label = str(view.plot.axis_texts["left"])
    assert label == "Amplitude density (\N{MICRO SIGN}m/\N{SQUARE ROOT}Hz)"
    expected = 1.0 / math.sqrt(500.0)  # um per root Hz of white noise of 1 um
    assert np.median(view.plot.drawn[0].points[1]) == pytest.approx(expected, rel=0.05)
    assert view.plot.log == (True, True)


def test_newest_samples_are_kept_in_the_order_of_time():
    ring = Newest(10)
    assert ring.last(5).size == 0
    for part in np.split(np.arange(25.0), [3, 4, 20]):
        ring.push(part)
        end = part[-1]
        np.testing.assert_array_equal(ring.last(3), np.arange(end - 2, end + 1))
    np.testing.assert_array_equal(ring.last(99), np.arange(15.0, 25.0))


# recordings


def recorded(name: str = "run") -> Curves:
    """Curves whose residual is large in the first half and small in the second."""
    time = np.linspace(0.0, 10.0, 20_001)
    moved = 1e-3 * np.sin(time)
    left = np.where(time < 5.0, 1e-4, 1e-6) * np.cos(40.0 * time)
    return Curves(
        Path(name), name, "actuator", (time, 1e3 * np.sin(time)), (time, moved),
        (time, moved - left), (time, left), None, (), (), "",
    )  # fmt: skip


def high_of(plot) -> float:
    plot.vb.prepareForPaint()
    return plot.vb.viewRange()[1][1]


def test_residual_axis_shrinks_and_grows_with_what_is_visible(session, qtbot):
    view = CurvesPlot(session)
    qtbot.addWidget(view)
    view.resize(800, 500)
    view.show()
    view.show_curves([recorded()])
    residual = view.plots[2]
    assert high_of(residual) > 100.0  # um
    view.area.show_span(6.0, 8.0)
    assert 1.0 <= high_of(residual) < 1.5
    view.area.show_span(0.0, 8.0)
    assert high_of(residual) > 100.0


def test_keys_name_the_curves_of_one_recording_and_the_recordings_of_several(session, qtbot):
    view = CurvesPlot(session)
    qtbot.addWidget(view)
    view.show_curves([recorded()])
    assert [p.key.texts for p in view.plots[:3]] == [
        ["commanded"], ["measured", "model"], ["residual"],
    ]  # fmt: skip
    view.show_curves([recorded("a"), replace(recorded("b"), model=None, residual=None)])
    assert [p.key.texts for p in view.plots[:3]] == [
        [],
        ["a", "b", "model of each recording"],
        [],
    ]
    text = view.area.csv_text()
    assert text.splitlines()[0].count(",") > 4  # the data have all of them
    view.show_model(shown=False)
    assert not view.plots[2].isVisible()
    assert view.plots[1].axis("bottom").style["showValues"]


# a run


class GivenRun:
    """Two lobes at 500 Hz, of which the newest samples are kept."""

    rate = 500.0

    def __init__(self) -> None:
        phase = np.linspace(0.0, 4.0 * np.pi, 4001)
        noise = np.random.default_rng(2).normal(0.0, 1e-6, phase.size)
        self.signals = {
            "command": 3e3 * (1.0 - np.cos(phase)),
            "displacement": 1e-3 * (1.0 - np.cos(phase - 0.2)),
            "residual 0": noise,
        }

    def now(self) -> SimpleNamespace:
        return SimpleNamespace(rate=self.rate, total=4001, samples=4001)

    def newest(self, name: str, seconds: float) -> np.ndarray:
        return self.signals.get(name, np.empty(0))[-round(seconds * self.rate) :]


def test_a_run_shows_loop_and_spectra_of_its_newest_samples(session, qtbot):
    view = LiveAnalysis(session)
    qtbot.addWidget(view)
    view.draw(GivenRun(), 4.0)  # nothing is shown, so nothing is computed
    assert view.loop.plot.drawn == []
    for name in ANALYSES:
        view.show_view(name, shown=True)
    view.draw(GivenRun(), None)
    assert view.loop.plot.key.texts[0].startswith("last 8 s: area 1.87")
    assert "(2 cycles" in view.loop.plot.key.texts[0]
    assert view.spectrum.plot.key.texts == ["measured, last 8 s", "residual of thesis (Table 3)"]
    assert np.median(view.spectrum.plot.drawn[1].points[1]) == pytest.approx(
        1.0 / math.sqrt(250.0), rel=0.1
    )
    # a range that the operator chose stays, while the samples change
    view.loop.area.canvas.zoomed.emit(view.loop.plot, (1.0, 2.0), None)
    view.draw(GivenRun(), 4.0)
    assert view.loop.area.span("voltage") == (1.0, 2.0)
    assert view.loop.plot.key.texts[0].startswith("last 4 s: area ")
    view.clear()
    assert view.loop.plot.key.texts == view.spectrum.plot.key.texts == []
    view.show_view("loop", shown=False)
    assert view.shown == ("spectrum",)
