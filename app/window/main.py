"""Opens the window, and tells in a sentence why it cannot."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

from dearig.drivers.processes import child_environment
from dearig.errors import InputError

__all__ = ["run_window"]

# a closed terminal or a stopped service must not leave a voltage up
_SIGNALS = ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK")
_HEARD = 200  # ms
_INSTALL = "install it with: pip install 'dearig[gui]'"
# where Qt finds no way to a screen it aborts: so another process tries, and leaves no core behind
_TRY = (
    "import resource; resource.setrlimit(resource.RLIMIT_CORE, (0, 0)); "
    "from PySide6.QtGui import QGuiApplication; QGuiApplication([])"
)
_TRY_FOR = 30.0  # s, for a screen at the other end of a slow line
_NO_SCREEN = ("offscreen", "minimal")


def run_window(rig: str = "sim", rig_file: Path | None = None, folder: Path = Path()) -> int:
    """Show the window until it is closed; returns the exit code.

    Recordings go to ``folder``. Raises ``InputError`` where there is no Qt, no screen, or no such
    rig file.
    """
    _require_qt()
    _require_screen()

    from PySide6.QtCore import QSettings, QTimer
    from PySide6.QtWidgets import QApplication

    from dearig.config.rigfile import load_rig_file
    from dearig.config.toml_input import read_text
    from dearig.window.collector import Collector
    from dearig.window.frame import MainWindow
    from dearig.window.session import Session
    from dearig.window.theme import prepare_plots, system_theme

    # before anything is shown: what is wrong with a file belongs in the terminal it was given in
    settings = load_rig_file(rig_file)
    text = "" if rig_file is None else read_text(rig_file, "rig file")
    application = QApplication(sys.argv[:1])
    application.setApplicationName("dearig")
    application.setOrganizationName("dearig")
    prepare_plots()
    session = Session(folder.absolute(), QSettings(), address=rig, theme=system_theme())
    if rig_file is not None:
        session.set_rig_file(rig_file.absolute(), text, settings)
    window = MainWindow(session)
    for name in _SIGNALS:
        if (number := getattr(signal, name, None)) is not None:
            signal.signal(number, lambda *_: window.leave())
    # signals are heard when the interpreter runs, which an idle window does not let it do
    heard = QTimer()
    heard.timeout.connect(_nothing)
    heard.start(_HEARD)
    collector = Collector(application)
    window.show()
    try:
        return application.exec()
    finally:
        collector.close()


def _nothing() -> None:
    """Let the interpreter run."""


def _require_qt() -> None:
    """Raises ``InputError`` where Qt is not there, or a library of the system that it needs."""
    try:
        import PySide6.QtGui  # first: pyqtgraph would blame another package
        import PySide6.QtWidgets  # noqa: F401
    except ModuleNotFoundError as error:
        raise InputError(f"the window needs PySide6, which is not installed; {_INSTALL}") from error
    except ImportError as error:
        raise InputError(
            f"the window's toolkit (Qt) cannot be loaded: {error}; on Debian install libgl1 "
            f"libegl1 libxkbcommon0 libglib2.0-0 libfontconfig1 libdbus-1-3"
        ) from error
    try:
        import pyqtgraph  # noqa: F401
    except ModuleNotFoundError as error:
        raise InputError(
            f"the window needs pyqtgraph, which is not installed; {_INSTALL}"
        ) from error


def _require_screen() -> None:
    """Raises ``InputError`` where Qt would end the program for want of a screen."""
    asked = os.environ.get("QT_QPA_PLATFORM", "")
    if asked.startswith(_NO_SCREEN) or not sys.platform.startswith("linux"):
        return
    instead = "run dearig gui in a graphical session, or use dearig record"
    screens = [os.environ[n] for n in ("WAYLAND_DISPLAY", "DISPLAY") if os.environ.get(n)]
    if not asked and not screens:
        raise InputError(f"there is no screen (DISPLAY and WAYLAND_DISPLAY are empty); {instead}")
    screen = f"the screen {' or '.join(screens)}".rstrip()
    try:
        tried = subprocess.run(  # noqa: S603
            [sys.executable, "-P", "-c", _TRY],
            env=child_environment(),
            capture_output=True,
            text=True,
            errors="replace",
            timeout=_TRY_FOR,
            check=False,
        )
    except subprocess.TimeoutExpired as error:
        raise InputError(f"{screen} does not answer; {instead}") from error
    if tried.returncode:
        raise InputError(f"{screen} cannot be used: {_why(tried.stderr)}; {instead}")


def _why(said: str) -> str:
    """The cause, of all the lines that Qt says before it aborts."""
    lines = [line.strip().rstrip(".") for line in said.splitlines() if line.strip()]
    causes = [line for line in lines if "even though it was found" not in line]
    first = (causes or lines or ["Qt ended without a word"])[0]
    return first.partition(": ")[2] if first.startswith("qt.") else first
