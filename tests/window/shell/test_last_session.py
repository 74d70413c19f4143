"""The next start after a close, a restart or a crash."""

from __future__ import annotations

from pathlib import Path

import pytest
from PySide6.QtCore import QSettings
from pytestqt.qtbot import QtBot

from dearig.acquisition.feedback import Feedback
from dearig.analysis.hold import HoldPlan
from dearig.config.modelfile import save_model
from dearig.config.rigfile import RigFile, load_rig_file
from dearig.config.sequencefile import parse_sequence
from dearig.drivers.settings import LimitsSettings
from dearig.model.film.material import TABLE_3, THESIS_FILM, THESIS_LOAD
from dearig.model.simulation.actuator import Actuator
from dearig.window.kit.theme import LIGHT, prepare_plots
from dearig.window.recordings.page import RecordingsPage
from dearig.window.run.overlay_chooser import read_overlay
from dearig.window.session.state import Session
from dearig.window.shell.frame import MainWindow
from dearig.window.shell.last_session import SessionKeeper, kept_folder, restore
from tests.window.conftest import SHORT

LONGER = SHORT.replace("one lobe", "hold 1 mm")


@pytest.fixture
def ini(tmp_path: Path, qapp: object) -> Path:
    prepare_plots()
    return tmp_path / "window.ini"


def start(ini: Path, here: Path) -> tuple[Session, list[str]]:
    """A start of the program in the folder ``here``: as ``run_window`` does it."""
    settings = QSettings(str(ini), QSettings.Format.IniFormat)
    folder, gone = kept_folder(settings, here)
    session = Session(folder, settings, theme=LIGHT)
    said = [gone] if gone else []
    said += restore(session)
    SessionKeeper(session)
    return session, said


def crash(session: Session) -> None:
    """End without a close: only what has reached the disk by then is left."""
    session.settings.sync()


def a_hold(folder: Path) -> HoldPlan:
    feedback = Feedback(
        setpoint=1e-3, sensitivity=2e-3, lead_in=1.0, start=2.0, stop=12.0, authority=0.1,
        rate_limit=0.01, response=1.0, ahead=0.5, laser_loss=2.0, block=0.1,
    )  # fmt: skip
    return HoldPlan(parse_sequence(LONGER, "hold", folder), feedback, 6000.0)


@pytest.fixture
def model(tmp_path: Path) -> Path:
    actuator = Actuator(THESIS_FILM, THESIS_LOAD, TABLE_3)
    return save_model(tmp_path / "model.toml", "stiff film", actuator, {})


def test_folder_sequence_file_and_overlays_come_back(
    ini: Path, tmp_path: Path, model: Path
) -> None:
    here, runs, file = tmp_path / "here", tmp_path / "runs", tmp_path / "lobe.toml"
    here.mkdir()
    runs.mkdir()
    file.write_text(SHORT)
    session, said = start(ini, here)
    assert said == []
    assert session.folder == here
    session.set_folder(runs)
    session.set_sequence(SHORT, tmp_path, file)
    session.set_overlays((session.thesis_model, read_overlay(model)), "monitor")
    crash(session)

    file.write_text(SHORT.replace("one lobe", "changed elsewhere"))
    again, said = start(ini, here)
    assert said == []
    assert again.folder == runs
    # a file is read again: it may have been changed meanwhile
    assert "changed elsewhere" in again.sequence_toml
    assert again.sequence_path == file
    assert [overlay.path for overlay in again.overlays] == [None, model]
    assert again.overlay_drive == "monitor"


def test_a_sequence_without_a_file_comes_back_with_its_text(ini: Path, tmp_path: Path) -> None:
    session, _ = start(ini, tmp_path)
    text = SHORT.replace("one lobe", 'µ, "quotes"; 3 = x') + "# ende\n" * 2000
    session.set_sequence(text, tmp_path / "beside")
    session.set_overlays((), "command")
    crash(session)
    again, said = start(ini, tmp_path)
    assert said == []
    assert (again.sequence_toml, again.sequence_folder) == (text, tmp_path / "beside")
    assert again.sequence_path is None
    assert again.overlays == ()


def test_what_is_gone_is_said_and_the_rest_comes_back(
    ini: Path, tmp_path: Path, model: Path
) -> None:
    runs, file = tmp_path / "runs", tmp_path / "lobe.toml"
    runs.mkdir()
    file.write_text(SHORT)
    session, _ = start(ini, tmp_path)
    session.set_folder(runs)
    session.set_sequence(SHORT, tmp_path, file)
    session.set_overlays((read_overlay(model), session.thesis_model))
    crash(session)
    runs.rmdir()
    file.unlink()
    model.write_text("no model")
    again, said = start(ini, tmp_path)
    assert again.folder == tmp_path
    assert "thesis" in again.sequence_toml
    assert [overlay.path for overlay in again.overlays] == [None]
    assert len(said) == 3
    assert [words in " ".join(said) for words in ("runs", "lobe.toml", "model.toml")] == [True] * 3


def test_an_armed_window_starts_disarmed_on_the_rig_that_is_asked_for(
    ini: Path, tmp_path: Path, qtbot: QtBot
) -> None:
    session, _ = start(ini, tmp_path)
    session.set_address("sim:7")
    window = MainWindow(session)
    qtbot.addWidget(window)
    window.show_page(window.page(RecordingsPage))
    session.set_armed(True)
    crash(session)
    kept = QSettings(str(ini), QSettings.Format.IniFormat)
    assert not any("arm" in key or "acknowledge" in key for key in kept.allKeys())
    session.set_armed(False)
    window.close()

    again, _ = start(ini, tmp_path)
    second = MainWindow(again)
    qtbot.addWidget(second)
    assert second.stack.currentWidget() is second.page(RecordingsPage)
    assert again.address == "sim"
    assert not again.armed
    assert not second.run_page.runner.running
    second.close()


@pytest.mark.parametrize(
    "content",
    [
        "[session]\nfolder=@ByteArray(\\x1\\0)\noverlays=@Variant(\\0)\n",
        "[session]\nfolder=\\0\nsequence%20file=\\0x\noverlays=a, b, c, d\ndrive=up\n",
        "[session]\nfolder=/nowhere\nsequence%20text=x\n",
    ],
)
def test_damaged_settings_stop_no_start(ini: Path, tmp_path: Path, content: str) -> None:
    ini.write_text(content)
    session, _ = start(ini, tmp_path)
    assert session.folder == tmp_path
    assert session.overlay_drive == "command"


@pytest.mark.deep
def test_the_rig_file_comes_back_and_is_named(ini: Path, tmp_path: Path, qtbot: QtBot) -> None:
    file = tmp_path / "lab.toml"
    file.write_text("[limits]\nvoltage_max_kV = 4.5\n")
    session, _ = start(ini, tmp_path)
    session.set_rig_file(file, file.read_text(), load_rig_file(file))
    crash(session)
    file.write_text("[limits]\nvoltage_max_kV = 4.0\n")  # read again, as a sequence is
    again, said = start(ini, tmp_path)
    assert said == []
    assert again.rig_path == file
    assert again.rig_file.limits.voltage_max_kV == 4.0
    window = MainWindow(again)
    qtbot.addWidget(window)
    assert "rig sim, lab.toml" in window.rig_and_folder.full_text
    assert window.run_page.controls.rig.full_text == "sim with lab.toml"
    again.set_rig_file(None, "", RigFile())
    assert "rig sim, the rig file of the thesis" in window.rig_and_folder.full_text
    window.leave()
    assert start(ini, tmp_path)[0].rig_path is None


def test_a_rig_file_that_cannot_come_back_blocks_arming(ini: Path, tmp_path: Path) -> None:
    file = tmp_path / "lab.toml"
    file.write_text("[limits]\nvoltage_max_kV = 4.5\n")
    session, _ = start(ini, tmp_path)
    session.set_rig_file(file, file.read_text(), load_rig_file(file))
    crash(session)
    for broken in ("[limits]\nvoltage_max_kV = true\n", None):
        if broken is None:
            file.unlink()
        else:
            file.write_text(broken)
        again, said = start(ini, tmp_path)
        assert ["lab.toml" in words for words in said] == [True]
        (block,) = again.blocks.values()
        assert block.page == "Rig"
        assert "lab.toml" in block.sentence
        again.set_address("sim:3")  # another rig is no other rig file
        assert again.blocks
        crash(again)
    again.set_rig_file(None, "", RigFile())
    assert not again.blocks


def test_a_rig_file_that_is_asked_for_stays(ini: Path, tmp_path: Path) -> None:
    old, new = tmp_path / "old.toml", tmp_path / "new.toml"
    for file in (old, new):
        file.write_text("[limits]\nvoltage_max_kV = 4.5\n")
    session, _ = start(ini, tmp_path)
    session.set_rig_file(old, old.read_text(), load_rig_file(old))
    crash(session)
    asked = Session(tmp_path, QSettings(str(ini), QSettings.Format.IniFormat), theme=LIGHT)
    asked.set_rig_file(new, new.read_text(), load_rig_file(new))
    restore(asked)
    SessionKeeper(asked)
    assert asked.rig_path == new
    crash(asked)
    assert start(ini, tmp_path)[0].rig_path == new


def test_a_hold_does_not_come_back_as_its_ramps(ini: Path, tmp_path: Path) -> None:
    session, _ = start(ini, tmp_path)
    session.set_sequence(SHORT, tmp_path)
    hold = a_hold(tmp_path)
    session.set_sequence(hold.sequence.toml, tmp_path)
    session.set_hold(hold)
    session.set_notes("Ada", "film 3", "")  # which removes it
    crash(session)
    again, said = start(ini, tmp_path)
    assert again.sequence_toml == SHORT
    assert again.hold is None
    assert said == ["the hold of the last session is not restored: prepare it again on Follow"]
    # a sequence that was chosen after it is kept as any other
    chosen = SHORT.replace("6.0", "5.0")
    session.set_sequence(chosen, tmp_path)
    crash(session)
    again, said = start(ini, tmp_path)
    assert (again.sequence_toml, said) == (chosen, [])


def test_the_ramps_of_a_hold_without_its_feedback_cannot_be_armed(
    ini: Path, tmp_path: Path
) -> None:
    session, _ = start(ini, tmp_path)
    hold = a_hold(tmp_path)
    for change in (
        lambda: session.set_address("sim:3"),
        lambda: session.set_rig_file(None, "", RigFile(limits=LimitsSettings(ramp_down_s=0.1))),
        lambda: session.set_notes("Ada", "another film", ""),
    ):
        session.set_sequence(hold.sequence.toml, tmp_path)
        session.set_hold(hold)
        assert not session.blocks
        change()
        (block,) = session.blocks.values()
        assert "feedback of the hold was removed" in block.sentence
        assert block.page == "Follow"
        session.set_sequence(SHORT, tmp_path)
        assert not session.blocks
