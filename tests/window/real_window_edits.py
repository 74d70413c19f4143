"""Edits in a real window on an X server: wrong fields, decimal commas, unsaved files.

``python -m tests.window.real_window_edits FOLDER``: writes what it saw as JSON to standard output.
"""

from __future__ import annotations

import json
import sys
from functools import partial
from pathlib import Path

from PySide6.QtCore import QCoreApplication, QEvent, QPoint, QSettings, QTimer
from PySide6.QtWidgets import QApplication, QLineEdit, QMessageBox, QWidget

from dearig.config.rigform import SECTIONS
from dearig.window.kit.theme import LIGHT, prepare_plots
from dearig.window.rig.page import RigPage
from dearig.window.session.state import Session
from tests.window.real_window import Hand, shown, until

SEQUENCE = """\
# for film 7
name = "steps"
lead_in_s = 0.5
[[segment]]
kind = "steps"
levels_kV = [3.0, 0.0]  # kV
dwell_s = 0.50
"""


def main() -> None:
    # One piece: a story in one window, each step from where the one before ended.
    application = QApplication(sys.argv[:1])
    prepare_plots()
    folder = Path(sys.argv[1])
    (folder / "mine.toml").write_text(SEQUENCE)
    settings = QSettings(str(folder / "settings.ini"), QSettings.Format.IniFormat)
    session = Session(folder, settings, theme=LIGHT)
    window = shown(session)
    hand, rig, sequence, run = Hand(), window.page(RigPage), window.sequence_page, window.run_page
    saw: dict[str, object] = {}

    def click(widget: QWidget) -> None:
        places = [QPoint()]

        def stands() -> bool:  # a page that was just shown may still be laid out
            places.append(widget.mapToGlobal(widget.rect().center()))
            return widget.isVisible() and places[-1] == places[-2]

        until(stands, "a widget that stands still")
        hand.click(places[-1])

    def type_into(field: QWidget, text: str) -> None:
        click(field)
        until(field.hasFocus, f"a field for {text}")
        hand.key("Control", "a")
        for letter in text:
            hand.key(letter)

    until(window.isActiveWindow, "the window becomes active")
    hand.key("Control", "1")
    until(rig.isVisible, "the page of the rig")
    # a limit that is lowered while another field is wrong
    type_into(rig.form("film").field("length_mm"), "x")
    until(lambda: "rig file" in session.blocks, "a wrong length")
    click(rig.tabs.tab(list(SECTIONS).index("limits")))
    until(rig.form("limits").isVisible, "the limits")
    type_into(rig.form("limits").field("voltage_max_kV"), "5")
    until(lambda: "voltage_max_kV = 5" in rig.text, "a lower limit")
    hand.key("Control", "3")
    until(run.isVisible, "the page of the run")
    saw["banners"] = window.banners.texts
    saw["banner shown"] = window.banners.isVisible()
    saw["may arm"] = run.arm_button.isEnabled()
    application.primaryScreen().grabWindow(0).toImage().save(str(folder / "screen.png"))
    hand.key("Control", "1")
    until(rig.isVisible, "the page of the rig again")
    click(rig.tabs.tab(0))
    type_into(rig.form("film").field("length_mm"), "70,5")
    until(lambda: session.rig_file.film.length_mm == 70.5, "a right length")
    saw["limit"] = session.rig_file.limits.voltage_max_kV
    # decimal commas, and two saves of a file with comments
    sequence.open_file(folder / "mine.toml")
    hand.key("Control", "2")
    until(lambda: session.sequence_path is not None and sequence.isVisible(), "the sequence")
    assert sequence.editor.form is not None

    def levels() -> QLineEdit:
        assert sequence.editor.form is not None
        field = sequence.editor.form.field("levels_kV")
        assert isinstance(field, QLineEdit)
        return field

    for text in ("2,5; 3,5; 0", "3,5; 4,5; 0"):
        type_into(levels(), text)
        until(partial(lambda text: levels().text() == text, text), text)
        saw["read"] = sequence.editor.form.note("levels_kV")
        hand.key("Control", "s")
        until(lambda: rig_only(session), "saved")
    saw["file"] = (folder / "mine.toml").read_text()
    # closing asks, and Return loses nothing
    type_into(sequence.editor.form.field("dwell_s"), "0,25")
    until(lambda: not rig_only(session), "an unsaved change")
    asked: list[str] = []

    def answer() -> None:
        box = QApplication.activeModalWidget()
        if isinstance(box, QMessageBox) and box.isActiveWindow():
            look.stop()
            asked.append(box.text())
            hand.key("Return")

    look = QTimer(interval=20)
    look.timeout.connect(answer)
    look.start()
    saw["closed"] = window.close()
    saw["asked"] = asked
    window.leave()  # as a signal does
    saw["kept"] = [path.read_text() for path in (folder / "unsaved").glob("*.json")]
    print(json.dumps(saw))
    # as the program does, while Python's objects are whole
    window.deleteLater()
    QCoreApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete.value)


def rig_only(session: Session) -> bool:
    """Return True if nothing but the rig file is unsaved."""
    return all("rig file" in words for words in session.recovery.unsaved)


if __name__ == "__main__":
    main()
