"""Start of the window, and the messages where it cannot start."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

from dearig.drivers.processes.children import child_environment
from dearig.errors import InputError
from dearig.window import NO_SCREEN

__all__ = ["require_qt", "require_screen", "run_window"]

# a closed terminal or a stopped service must not leave a voltage on
_SIGNALS = ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK")
_SIGNAL_INTERVAL = 200  # ms
_INSTALL = 'install it with: pip install "dearig[gui]"'
# Qt aborts when it cannot open a screen: another process tries first, without a core dump
_TRY = (
    "import resource; resource.setrlimit(resource.RLIMIT_CORE, (0, 0)); "
    "from PySide6.QtGui import QGuiApplication; QGuiApplication([])"
)
_TRY_FOR = 30.0  # s; a remote screen may be slow


def run_window(
    rig: str = "sim",
    rig_file: Path | None = None,
    folder: Path | None = None,
    fresh: bool = False,
) -> int:
    """Show the window until it is closed; returns the exit code.

    Recordings are written to ``folder``, by default that of the last session. With ``fresh``
    nothing of the last session is restored but sizes, operator and film. Raises ``InputError`` if
    Qt, a screen or the rig file is missing.
    """
    require_qt()
    require_screen()

    from PySide6.QtCore import QCoreApplication, QEvent, QTimer
    from PySide6.QtWidgets import QApplication

    from dearig.config.rigfile import load_rig_file
    from dearig.config.toml_input import read_text
    from dearig.window.jobs.collector import Collector
    from dearig.window.kit.theme import prepare_plots, system_theme
    from dearig.window.session.settings import open_settings
    from dearig.window.session.state import Session
    from dearig.window.shell.frame import MainWindow
    from dearig.window.shell.last_session import SessionKeeper, kept_folder, restore

    # before the window opens: faults of a file belong in the terminal where it was named
    settings = load_rig_file(rig_file)
    text = "" if rig_file is None else read_text(rig_file, "rig file")
    application = QApplication(sys.argv[:1])
    application.setApplicationName("dearig")
    application.setOrganizationName("dearig")
    prepare_plots()
    kept, said = open_settings(), []
    if folder is None:
        folder, gone = (Path().absolute(), "") if fresh else kept_folder(kept, Path().absolute())
        said += [gone] if gone else []
    session = Session(folder.absolute(), kept, address=rig, theme=system_theme())
    session.program_errors.install()
    if rig_file is not None:
        session.set_rig_file(rig_file.absolute(), text, settings)
    if not fresh:
        said += restore(session)
    SessionKeeper(session)
    window = MainWindow(session)
    if said:
        window.banners.show_text("restored", ". ".join(s[:1].upper() + s[1:] for s in said))
        for changed in (
            session.folder_changed, session.sequence_changed, session.overlays_changed,
            session.running_changed,
        ):  # fmt: skip
            changed.connect(lambda *_: window.banners.hide_text("restored"))
    for name in _SIGNALS:
        if (number := getattr(signal, name, None)) is not None:
            signal.signal(number, lambda *_: window.leave())
    # Python handles signals only while its interpreter runs, and an idle Qt loop does not run it
    wake = QTimer()
    wake.timeout.connect(_run_interpreter)
    wake.start(_SIGNAL_INTERVAL)
    collector = Collector(application)
    session.arming.connect(collector.settle)
    session.running_changed.connect(lambda running: None if running else collector.settle())
    window.show()
    QTimer.singleShot(0, window.offer_unsaved)
    try:
        return application.exec()
    finally:
        # while Python's objects are whole: Qt calls their methods when it lays out what is left
        # of a widget that is being destroyed, and crashes if they are gone
        window.deleteLater()
        QCoreApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete.value)
        collector.close()
        session.program_errors.close()


def _run_interpreter() -> None:
    """Do nothing: the call alone lets Python handle signals."""


def require_qt() -> None:
    """Raise ``InputError`` if Qt, or a system library that it needs, is missing."""
    try:
        import PySide6.QtGui  # first: the message of pyqtgraph names another package
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


def require_screen() -> None:
    """Raise ``InputError`` if Qt would abort the program because there is no screen."""
    asked = os.environ.get("QT_QPA_PLATFORM", "")
    if asked.startswith(NO_SCREEN) or not sys.platform.startswith("linux"):
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
    """Return the cause among the lines that Qt prints before it aborts."""
    lines = [line.strip().rstrip(".") for line in said.splitlines() if line.strip()]
    causes = [line for line in lines if "even though it was found" not in line]
    first = (causes or lines or ["Qt ended without a message"])[0]
    return first.partition(": ")[2] if first.startswith("qt.") else first
