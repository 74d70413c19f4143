"""A real window on an X server, driven by the server's own mouse and keys.

``python -m tests.window.real_window FOLDER``: writes what it saw as JSON to standard output. Every
event goes the long way, through the X server (XTEST), as if a hand had made it.
"""

from __future__ import annotations

import ctypes
import json
import sys
from collections.abc import Callable
from pathlib import Path

from PySide6.QtCore import QCoreApplication, QEvent, QEventLoop, QPoint, QSettings, QTimer
from PySide6.QtWidgets import QApplication, QWidget

from dearig.window.kit.theme import LIGHT, prepare_plots
from dearig.window.run.controls import StepButton
from dearig.window.session.state import Session
from dearig.window.shell.frame import MainWindow

PATIENCE = 120_000  # ms
SEEN = 1  # the code of an event loop that ends because of what it waits for
KEYSYMS = {
    "Escape": 0xFF1B,
    "Control": 0xFFE3,
    "Alt": 0xFFE9,
    "Tab": 0xFF09,
    " ": 0x20,
    "Return": 0xFF0D,
    "F5": 0xFFC2,
}


class Hand:
    """Mouse and keys at the X server."""

    def __init__(self) -> None:
        self._x = ctypes.CDLL("libX11.so.6")
        self._test = ctypes.CDLL("libXtst.so.6")
        self._x.XOpenDisplay.restype = ctypes.c_void_p
        self._x.XKeysymToKeycode.argtypes = (ctypes.c_void_p, ctypes.c_ulong)
        self._x.XKeysymToKeycode.restype = ctypes.c_ubyte
        self._x.XFlush.argtypes = (ctypes.c_void_p,)
        number, flag, delay = ctypes.c_uint, ctypes.c_int, ctypes.c_ulong
        self._test.XTestFakeMotionEvent.argtypes = (
            ctypes.c_void_p, ctypes.c_int, ctypes.c_int, ctypes.c_int, delay,
        )  # fmt: skip
        for name in ("XTestFakeButtonEvent", "XTestFakeKeyEvent"):
            getattr(self._test, name).argtypes = (ctypes.c_void_p, number, flag, delay)
        self._display = self._x.XOpenDisplay(None)
        if not self._display:
            raise SystemExit("no X server")

    def click(self, at: QPoint) -> None:
        self._test.XTestFakeMotionEvent(self._display, -1, at.x(), at.y(), 0)
        for pressed in (1, 0):
            self._test.XTestFakeButtonEvent(self._display, 1, pressed, 0)
        self._x.XFlush(self._display)

    def key(self, *names: str) -> None:
        """Press them one after another, and let go."""
        codes = [
            self._x.XKeysymToKeycode(self._display, KEYSYMS.get(name) or ord(name))
            for name in names
        ]
        for code in codes:
            self._test.XTestFakeKeyEvent(self._display, code, 1, 0)
        for code in reversed(codes):
            self._test.XTestFakeKeyEvent(self._display, code, 0, 0)
        self._x.XFlush(self._display)


def shown(session: Session) -> MainWindow:
    """Return the window of ``session``, shown at the size of a small screen, to be the active one.

    The window system makes it active, so that the caller waits for that.
    """
    window = MainWindow(session)
    window.setGeometry(0, 0, 1366, 768)
    window.show()
    window.activateWindow()
    return window


def until(condition: Callable[[], bool], what: str) -> None:
    loop, late = QEventLoop(), QTimer()
    look = QTimer(interval=10)
    # seen once is enough: that a button answers may be over at the next look on a busy machine
    look.timeout.connect(lambda: condition() and loop.exit(SEEN))
    late.setSingleShot(True)
    late.timeout.connect(loop.quit)
    look.start()
    late.start(PATIENCE)
    if loop.exec() != SEEN:
        said = ""
        for window in QApplication.topLevelWidgets():
            if isinstance(window, MainWindow):
                said = f"; the window says: {window.status.full_text}, {window.bar.detail.text()}"
                window.leave()
                window.run_page.runner.wait()  # its thread must not be destroyed while it runs
                end(window)
        raise SystemExit(f"waited in vain: {what}{said}")


def press(hand: Hand, step: StepButton, done: Callable[[], bool], what: str) -> None:
    """Click a step towards voltage, once more where the window says that it was busy."""
    dropped: list[str] = []
    step.dropped.connect(dropped.append)
    while not done():
        dropped.clear()
        until(lambda: done() or (step.isEnabled() and step.answers), f"{what}: {step.text()}")
        if not done():
            hand.click(pixel(step, step.rect().center()))
            until(lambda: done() or bool(dropped), what)
    step.dropped.disconnect(dropped.append)


def pixel(widget: QWidget, at: QPoint) -> QPoint:
    """Pixel of the screen at a place of ``widget``; a scaled screen has more of them."""
    place, scale = widget.mapToGlobal(at), widget.devicePixelRatioF()
    return QPoint(round(place.x() * scale), round(place.y() * scale))


def end(window: MainWindow) -> None:
    """Close ``window`` and destroy it while Python's objects are whole, as the program does."""
    window.close()
    window.deleteLater()
    QCoreApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete.value)


def main() -> None:
    application = QApplication(sys.argv[:1])
    prepare_plots()
    folder = Path(sys.argv[1])
    settings = QSettings(str(folder / "settings.ini"), QSettings.Format.IniFormat)
    session = Session(folder, settings, theme=LIGHT)
    window = shown(session)
    hand, page = Hand(), window.run_page
    saw: dict[str, object] = {"platform": application.platformName()}

    def click(widget: QWidget) -> None:
        hand.click(pixel(widget, widget.rect().center()))

    until(window.isActiveWindow, "the window becomes active")
    until(lambda: page.arm_button.isEnabled() and page.arm_button.answers, "a plan")
    item = window.list.visualItemRect(window.list.item(1)).center()
    hand.click(window.list.viewport().mapToGlobal(item))
    until(window.sequence_page.isVisible, "the page of the sequence")
    hand.key("Control", "3")
    until(page.isVisible, "the page of the run")
    click(page.operator)
    until(page.operator.hasFocus, "the field of the operator")
    for letter in "ada":
        hand.key(letter)
    until(lambda: page.operator.text() == "ada", "the operator's name")
    saw["operator"] = session.operator
    saw["planned"] = page.display.view.words.text()
    until(lambda: window.idle_pages.done, "all pages")
    press(hand, page.arm_button, page.start_button.isEnabled, "armed")
    saw["armed"] = window.bar.badge.state.name
    press(hand, page.start_button, lambda: page.runner.running, "started")
    saw["started"] = window.bar.badge.state.name

    def seconds() -> float:
        now = None if page.live is None else page.live.now()
        return 0.0 if now is None else now.samples / now.rate

    until(lambda: seconds() > 2.5, "half a second of the first lobe")
    screen = application.primaryScreen().grabWindow(0).toImage()
    screen.save(str(folder / "screen.png"))
    hand.key("m")
    until(page.display.mark_bar.note.hasFocus, "the field of the note")
    for letter in "my spark":
        hand.key(letter)
    until(lambda: page.display.mark_bar.note.text() == "my spark", "the note")
    hand.key("Return")
    until(lambda: page.plots.marks == ["my spark"], "the mark in the plots")
    saw["current drawn"] = page.plots.curve("current")[0].size > 100
    corner = page.stop_button.mapToGlobal(QPoint(12, 46))
    saw["stop"] = screen.pixelColor(corner).name()
    hand.key("Escape")
    until(lambda: not page.runner.running, "stopped by the key")
    saw["ended"] = window.bar.badge.state.name
    saw["result"] = page.result.text()
    # and once more, stopped with the mouse
    press(hand, page.arm_button, page.start_button.isEnabled, "armed again")
    press(hand, page.start_button, lambda: page.runner.running, "started again")
    until(lambda: seconds() > 0.0, "samples again")
    click(page.stop_button)
    until(lambda: not page.runner.running, "stopped by the mouse")
    saw["recordings"] = sorted(path.name for path in folder.glob("*.h5"))
    end(window)
    print(json.dumps(saw))


if __name__ == "__main__":
    main()
