"""What the Run page draws before, during and after a run, and the switch between them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import Qt
from pytestqt.qtbot import QtBot

from dearig.config.rigfile import RigFile
from dearig.drivers.settings import InterlockSettings, LimitsSettings
from dearig.window.high_voltage.state import HighVoltage
from dearig.window.run.page import RunPage
from dearig.window.sequence.planner import make_preview
from dearig.window.session.state import Session
from tests.deep import mostly_deep
from tests.window.conftest import SHORT, press
from tests.window.run.test_stories import RUN_MS, click, play, seconds

OTHER = SHORT.replace("one lobe", "smaller").replace("6.0", "2.5")


def drawn(page: RunPage, name: str) -> np.ndarray:
    """Values of a curve, in the unit of its plot."""
    return page.plots.curve(name)[1]


def test_before_a_run_the_plots_show_what_will_be_played(
    qtbot: QtBot, run_page: RunPage, plan_of: Callable[[str], None]
) -> None:
    plan_of(SHORT)
    view = run_page.display.view
    assert view.words.text() == "Planned: one lobe, peak 6.00 kV, 1.0 s"
    assert drawn(run_page, "planned voltage").max() == pytest.approx(6.0, abs=0.01)
    assert not view.last.isEnabled()
    play(qtbot, run_page)
    assert not view.shows_plan
    assert view.words.text().startswith("Last run: one lobe, finished at ")
    assert drawn(run_page, "planned voltage").size == 0
    plan_of(OTHER)  # whatever was drawn: this one would be played now
    assert view.words.text() == "Planned: smaller, peak 2.50 kV, 1.0 s"
    assert drawn(run_page, "planned voltage").max() == pytest.approx(2.5, abs=0.01)
    assert drawn(run_page, "monitor").size == 0
    click(qtbot, view.last)
    qtbot.waitUntil(lambda: drawn(run_page, "monitor").size > 0)
    assert drawn(run_page, "monitor").max() == pytest.approx(6.0, abs=0.1)
    assert view.words.text().startswith("Last run: one lobe")
    press(qtbot, run_page.arm_button)  # falls back to what will be played
    assert view.shows_plan
    assert view.words.text() == "Planned: smaller, peak 2.50 kV, 1.0 s"
    assert drawn(run_page, "monitor").size == 0
    assert drawn(run_page, "planned voltage").max() == pytest.approx(2.5, abs=0.01)


@pytest.mark.parametrize("change", mostly_deep(["sequence", "rig file", "film"], ["rig file"]))
def test_a_change_of_anything_that_is_played_removes_the_last_run_at_once(
    change: str, qtbot: QtBot, run_page: RunPage, plan_of: Callable[[str], None]
) -> None:
    session = run_page.session
    if change == "film":
        named = RigFile.model_validate({"film": {"name": "film 3"}})
        session.set_notes("Ada", "film 3", "")
        session.set_rig_file(None, "", named)
    plan_of(SHORT)
    qtbot.waitUntil(run_page.arm_button.isEnabled)
    play(qtbot, run_page)
    assert not run_page.display.view.shows_plan
    if change == "sequence":
        session.set_sequence(OTHER, Path())
    elif change == "rig file":
        session.set_rig_file(None, "", RigFile(limits=LimitsSettings(voltage_max_kV=7.0)))
    else:
        session.set_notes("Ada", "film 4", "")
    assert run_page.display.view.shows_plan
    assert run_page.display.view.words.text() == "Planned: the plan is being made …"
    assert drawn(run_page, "monitor").size == 0
    assert drawn(run_page, "planned voltage").size == 0
    assert run_page.display.digest == ""
    with qtbot.waitSignal(session.preview_changed, timeout=RUN_MS):
        pass
    assert run_page.display.view.words.text().startswith("Planned: ")


def test_start_is_refused_where_other_curves_are_drawn_than_would_be_played(
    qtbot: QtBot, run_page: RunPage, plan_of: Callable[[str], None], tmp_path: Path
) -> None:
    plan_of(SHORT)
    press(qtbot, run_page.arm_button)
    other = make_preview(OTHER, Path(), run_page.session.rig_file)
    run_page.plots.show_prediction(other)  # by whatever error
    run_page.start()
    assert not run_page.runner.running
    assert run_page.runner.state is HighVoltage.NOT_CONTACTED
    assert "the plots did not show what would have been played" in run_page.result.text()
    assert drawn(run_page, "planned voltage").max() == pytest.approx(6.0, abs=0.01)
    assert not list(run_page.session.folder.iterdir())
    # the run itself compares too: a plan that is no longer that of the sequence is not played
    preview = run_page.session.preview
    assert preview is not None
    run_page.session.preview = replace(preview, loaded=other.loaded)
    press(qtbot, run_page.arm_button)
    qtbot.waitUntil(lambda: run_page.runner.status.may_start)
    with qtbot.waitSignal(run_page.runner.ended, timeout=RUN_MS):
        run_page.start()
    assert run_page.result.text().startswith("Refused")
    assert "not the one that was armed" in run_page.result.text()
    assert run_page.runner.state is HighVoltage.NOT_CONTACTED


def test_a_refused_plan_is_drawn_and_said_to_be_refused(
    run_page: RunPage, plan_of: Callable[[str], None]
) -> None:
    plan_of(SHORT.replace("6.0", "9.0"))
    assert run_page.display.view.words.text() == (
        "Planned: one lobe, peak 9.00 kV, 1.0 s (refused by the limits)"
    )
    assert run_page.display.digest == ""


@pytest.mark.deep
def test_current_and_trip_levels_of_the_rig_file_are_drawn(
    qtbot: QtBot, run_page: RunPage, plan_of: Callable[[str], None]
) -> None:
    rig = RigFile(
        limits=LimitsSettings(voltage_max_kV=7.5, voltage_min_kV=-2.0),
        interlocks=InterlockSettings(
            current_max_mA=5.0, monitor_tolerance_kV=0.8, displacement_max_mm=0.3
        ),
    )
    run_page.session.set_rig_file(None, "", rig)
    plan_of(SHORT)
    plots = run_page.plots
    assert plots.overlays["current"].shown == ["trip 5 mA", "trip -5 mA"]
    assert "↑ limit 7.5 kV" in plots.overlays["voltage"].shown  # the plan goes to 6 kV
    assert "↓ limit -2 kV" in plots.overlays["voltage"].shown  # out of view: named at the edge
    assert plots.overlays["displacement"].shown == ["trip 0.3 mm", "↓ trip -20 mm"]
    play(qtbot, run_page)
    current, command = drawn(run_page, "current"), drawn(run_page, "command")
    assert current.size > 100
    assert np.abs(current).max() < 1.0  # mA
    time, upper = plots.band("upper")
    _, lower = plots.band("lower")
    assert upper.max() == pytest.approx(command.max() + 0.8, abs=0.01)
    assert lower.min() == pytest.approx(command.min() - 0.8, abs=0.01)
    assert time[-1] <= 1.0


def test_an_arc_stands_out_in_the_current_and_is_an_alarm(
    qtbot: QtBot, run_page: RunPage, plan_of: Callable[[str], None]
) -> None:
    plan_of(SHORT)
    run_page.operator.setText("Ada")
    run_page.faults = ("arc@0.45",)
    press(qtbot, run_page.arm_button)
    with qtbot.waitSignal(run_page.runner.ended, timeout=RUN_MS):
        press(qtbot, run_page.start_button)
    qtbot.waitUntil(lambda: drawn(run_page, "current").size > 0)
    assert np.abs(drawn(run_page, "current")).max() > 20.0  # mA, above the trip level
    _, high = run_page.plots.y_range("current")
    assert high > np.abs(drawn(run_page, "current")).max()
    faults = [a for a in run_page.alarms.alarms if a.level == "fault"]
    assert "interlock" in faults[0].message
    assert faults[0].run_time == pytest.approx(0.45, abs=0.1)
    assert "fault" in run_page.plots.marks


def test_plots_can_be_hidden_and_stay_so(qtbot: QtBot, run_page: RunPage, session: Session) -> None:
    assert run_page.plots.shown == ("voltage", "current", "displacement", "residual")
    actions = run_page.display.view.plot_actions
    actions["current"].trigger()
    assert run_page.plots.shown == ("voltage", "displacement", "residual")
    again = RunPage(session)
    qtbot.addWidget(again)
    assert again.plots.shown == ("voltage", "displacement", "residual")
    again.close_work()
    for name in ("voltage", "displacement", "residual"):
        actions[name].trigger()
    assert run_page.plots.shown == ("residual",)  # the last one stays
    assert actions["residual"].isChecked()


@pytest.mark.deep
def test_scrolling_back_holds_the_plots_while_the_run_goes_on(
    qtbot: QtBot, run_page: RunPage, plan_of: Callable[[str], None]
) -> None:
    plan_of(SHORT.replace("frequency_Hz = 2.0", "frequency_Hz = 0.1"))
    run_page.paced.setChecked(True)
    view, plots = run_page.display.view, run_page.plots
    view.span.setCurrentIndex(0)  # the last 2 s
    view.span.activated.emit(0)
    press(qtbot, run_page.arm_button)
    press(qtbot, run_page.start_button)
    qtbot.waitUntil(lambda: seconds(run_page) > 2.6, timeout=RUN_MS)
    follow = plots.area.tools.buttons[plots.area.tools.follow]
    assert not follow.isVisible()
    plots.area.canvas.setFocus()
    qtbot.keyClick(plots.area.canvas, Qt.Key.Key_Left)  # a quarter of the range
    held, came = plots.x_range(), seconds(run_page)
    assert held[1] < came
    qtbot.waitUntil(lambda: seconds(run_page) > came + 0.3, timeout=RUN_MS)
    assert plots.x_range() == held
    assert plots.curve("command")[0][-1] == pytest.approx(held[1], abs=0.1)
    click(qtbot, follow)
    qtbot.waitUntil(lambda: plots.x_range()[1] > came)
    assert plots.following
    run_page.stop()
    qtbot.waitUntil(lambda: not run_page.runner.running, timeout=RUN_MS)


def test_the_residual_axis_shrinks_again(session: Session, qtbot: QtBot) -> None:
    from dearig.window.run.plots import RunPlots

    plots = RunPlots(session)
    qtbot.addWidget(plots)
    plots.draw(_Given(residual=4e-4), 1.0)  # type: ignore[arg-type]
    assert plots.y_range("residual")[1] >= 400.0
    plots.draw(_Given(residual=2e-6), 2.0)  # type: ignore[arg-type]
    assert plots.y_range("residual")[1] < 10.0


def test_two_residuals_have_a_plot_each_with_one_range(session: Session, qtbot: QtBot) -> None:
    from dearig.window.run.plots import RunPlots

    plots = RunPlots(session)
    qtbot.addWidget(plots)
    plots.show()
    one, two = plots._plots["residual"], plots._second
    assert not two.isVisible()
    session.set_overlays((session.thesis_model,) * 2)
    plots.start()
    plots.draw(_Given(residual=4e-5), 1.0)  # type: ignore[arg-type]
    assert two.isVisible()
    assert [c.title for c in one.curves_in_key()] == [
        f"residual of {session.thesis_model.name}", "RMS, last 1 s",
    ]  # fmt: skip
    assert len(two.curves_in_key()) == 2
    assert plots.y_range("residual") == plots.y_range("second residual")
    assert plots.y_range("residual")[1] >= 40.0
    plots.show_plot("residual", shown=False)
    assert not two.isVisible()


class _Given:
    """Curves of one size each."""

    def __init__(self, **sizes: float) -> None:
        self._sizes = sizes

    def view(self, name: str, first: float, last: float) -> tuple[np.ndarray, np.ndarray]:
        size = self._sizes.get(name.split()[0], 0.0)
        return np.linspace(first, last, 50), size * np.sin(np.arange(50.0))


def test_the_room_is_shown_with_unit_and_age_where_it_is_measured(
    qtbot: QtBot, run_page: RunPage, plan_of: Callable[[str], None]
) -> None:
    controls = run_page.controls
    assert not controls.numbers["humidity"].isVisibleTo(controls)
    measured = RigFile.model_validate(
        {
            "thermohygrometer": {"interval_s": 0.5},
            "room": {"temperature_degC": 21.0, "relative_humidity_percent": 38.0},
        }
    )
    run_page.session.set_rig_file(None, "", measured)
    assert controls.numbers["humidity"].isVisibleTo(controls)
    plan_of(SHORT)
    qtbot.waitUntil(run_page.arm_button.isEnabled)
    play(qtbot, run_page)
    assert float(controls.numbers["temperature"].text) == pytest.approx(21.0, abs=0.2)
    assert float(controls.numbers["humidity"].text) == pytest.approx(38.0, abs=0.6)
    # SHORT lasts 4 s with lead-in and tail: the last reading is that of 3.5 or 4 s
    assert controls.room_title.text() in ("Room, 0 s ago", "Room, 1 s ago")
