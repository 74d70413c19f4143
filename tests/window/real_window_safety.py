"""STOP, its keys and the states of a real window, by the X server's own mouse and keys.

``python -m tests.window.real_window_safety FOLDER [PORT]``: writes what it saw as JSON to standard
output. With ``PORT``, it plays on a simulated card behind the server at that port, and writes
``running`` to standard error once the voltage is up: whoever started it kills the server then.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from pathlib import Path

from PySide6.QtCore import QEvent, QObject, QPoint, QSettings, QTimer
from PySide6.QtWidgets import QApplication, QDialog, QWidget

from dearig.config.rigfile import RigFile
from dearig.window.high_voltage.state import HighVoltage
from dearig.window.kit.theme import LIGHT, prepare_plots
from dearig.window.session.state import Session
from dearig.window.shell.frame import MainWindow
from dearig.window.study.page import StudyPage
from tests.window.conftest import SHORT
from tests.window.real_window import Hand, end, pixel, press, until

LONG = SHORT.replace("lead_in_s = 0.3", "lead_in_s = 1.0").replace(
    "frequency_Hz = 2.0", "frequency_Hz = 0.1"
)
CARD = RigFile.model_validate(
    {
        "film": {"name": "film 3"},
        "guardian": {"link_timeout_s": 0.5, "retry_s": 1.0},
        "limits": {"ramp_down_s": 0.2},
    }
)
QUICK = RigFile.model_validate({"limits": {"ramp_down_s": 0.2}})


class Released(QObject):
    """Counts the keys and buttons that were let go, as the screen reports them."""

    count = 0

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:  # noqa: N802
        kinds = (QEvent.Type.KeyRelease, QEvent.Type.MouseButtonRelease)
        self.count += event.spontaneous() and event.type() in kinds
        return super().eventFilter(watched, event)


class Story:
    """The window, its operator's hand, and what was seen."""

    def __init__(self, folder: Path) -> None:
        self.application = QApplication(sys.argv[:1])
        prepare_plots()
        self.folder = folder
        self.hand = Hand()
        self.saw: dict[str, object] = {"platform": self.application.platformName()}
        settings = QSettings(str(folder / "settings.ini"), QSettings.Format.IniFormat)
        self.session = Session(folder, settings, theme=LIGHT)
        self.window = MainWindow(self.session)
        self.page = self.window.run_page
        self.runner = self.page.runner
        self.window.show()  # of the size of a first start
        self.window.activateWindow()
        until(self.window.isActiveWindow, "the window becomes active")

    def click(self, widget: QWidget) -> None:
        self.hand.click(pixel(widget, widget.rect().center()))

    def arm(self) -> None:
        self.window.show_page(self.page)
        press(self.hand, self.page.arm_button, lambda: self.runner.armed, "armed")

    def start(self) -> None:
        self.arm()
        press(self.hand, self.page.start_button, lambda: self.runner.running, "started")
        until(lambda: self.seconds() > 0.0, "samples")

    def seconds(self) -> float:
        now = None if self.page.live is None else self.page.live.now()
        return 0.0 if now is None or not self.runner.running else now.samples / now.rate

    def ended(self) -> str:
        until(lambda: not self.runner.running, "the end of the run")
        return self.page.controls.time_left.text()

    def on_screen(self, widget: QWidget) -> str:
        """Colour of a corner of ``widget`` on the screen."""
        screen = self.application.primaryScreen().grabWindow(0).toImage()
        return str(screen.pixelColor(pixel(widget, QPoint(12, 10))).name())


def on_a_simulated_rig(story: Story) -> None:
    window, page, runner, saw = story.window, story.page, story.runner, story.saw
    bar, session = window.bar, story.session
    session.set_rig_file(None, "", QUICK)
    session.set_sequence(LONG, Path())
    until(lambda: session.preview is not None, "a plan")
    available = window.screen().availableGeometry()
    until(lambda: available.contains(window.frameGeometry()), "a window inside the screen")
    saw["first"] = bar.badge.state.name
    colours = set()
    for other in window.pages:
        window.show_page(other)
        until(other.isVisible, "the page")
        colours.add(story.on_screen(bar.stop_button))
    saw["stop on every page"] = sorted(colours)

    disarmed = []
    for key in ("Escape", " "):
        story.arm()
        story.hand.key(key)
        until(lambda: not runner.armed, f"disarmed by {key!r}")
        disarmed.append(runner.running)
    saw["a stop key has started"] = any(disarmed)
    # with the focus on Start, as a click on it would leave it elsewhere
    story.arm()
    page.start_button.setFocus()
    story.hand.key(" ")
    until(lambda: not runner.armed, "disarmed with the focus on Start")
    saw["Space on Start has started"] = runner.running

    ends = []
    story.start()
    window.move(2000, 1500)
    until(lambda: not available.contains(window.frameGeometry()), "a window next to the screen")
    until(lambda: available.contains(window.frameGeometry()), "a window that comes back")
    window.show_page(window.page(StudyPage))
    story.click(bar.stop_button)
    ends.append(story.ended())
    story.start()
    story.hand.key("Control", "2")
    until(window.sequence_page.isVisible, "another page")
    story.hand.key("Escape")
    ends.append(story.ended())
    # with the cursor in a field
    story.start()
    window.show_page(page)
    page.overlays.models[0].setFocus()
    story.hand.key(" ")
    ends.append(story.ended())
    saw["ends"] = ends
    saw["after"] = bar.badge.state.name
    saw["beside a dialog"] = beside_dialog(story)


def beside_dialog(story: Story) -> list[str]:
    """Stop by the bar while the dialog of an overlay model is open."""
    window, page, runner = story.window, story.page, story.runner
    saw: list[str] = []
    story.start()
    combo = page.overlays.models[0]
    wanted = combo.count() - 1  # "Open a model file …"

    def dialog() -> QDialog | None:
        shown = (w for w in QApplication.topLevelWidgets() if isinstance(w, QDialog))
        return next((w for w in shown if w.isVisible()), None)

    def during() -> None:
        opened = dialog()
        if opened is None:
            QTimer.singleShot(50, during)
            return
        saw.append("modal" if opened.isModal() else "not modal")
        story.click(window.bar.stop_button)
        look(opened)

    def look(opened: QDialog) -> None:
        if runner.state is HighVoltage.ON:
            QTimer.singleShot(20, lambda: look(opened))
        else:
            opened.reject()

    QTimer.singleShot(50, during)
    combo.setCurrentIndex(wanted)
    combo.activated.emit(wanted)
    saw.append(story.ended())
    return saw


def on_a_card(story: Story, port: int) -> None:
    window, page, runner, saw = story.window, story.page, story.runner, story.saw
    session, bar = story.session, window.bar
    page.film.setText("film 3")
    session.set_rig_file(None, "", CARD)
    session.set_sequence(LONG, Path())
    session.set_address(f"daqmx:Dev1@127.0.0.1:{port}")
    story.start()
    until(lambda: story.seconds() > 2.0, "voltage")
    print("running", file=sys.stderr, flush=True)
    saw["end"] = story.ended()
    saw["state"] = bar.badge.state.name
    saw["detail"] = bar.detail.text()
    saw["alarm"] = bar.alarm.full_text
    saw["time"] = bar.time.text()

    released = Released()
    story.application.installEventFilter(released)

    def refused(what: Callable[[], None]) -> bool:
        before = released.count
        what()
        # what arrives later would act on what comes after
        until(lambda: released.count > before, "the key or button is let go")
        return runner.state is HighVoltage.UNKNOWN and bar.alarm.isVisible()

    kept = []
    for other in window.pages:
        window.show_page(other)
        kept.append(refused(lambda: story.hand.key("F5")))
    window.show_page(page)
    kept.append(refused(lambda: story.click(page.arm_button)))
    saw["kept"] = kept
    bar.acknowledge("Grace")
    bar.close_work()
    until(page.arm_button.isEnabled, "acknowledged")
    saw["acknowledged"] = bar.badge.state.name  # known no better than before


def main() -> None:
    story = Story(Path(sys.argv[1]))
    if len(sys.argv) > 2:
        on_a_card(story, int(sys.argv[2]))
    else:
        on_a_simulated_rig(story)
    end(story.window)
    print(json.dumps(story.saw))


if __name__ == "__main__":
    main()
