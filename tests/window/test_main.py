"""The command ``dearig gui``: opens, ends when it is told to, and says why it cannot open."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from dearig.recording import open_recording
from tests.deep import mostly_deep


def gui(*arguments: object, code: str = "", **environment: str) -> subprocess.CompletedProcess[str]:
    """Run the command with ``code`` before it, in a process of its own."""
    base = {k: v for k, v in os.environ.items() if k not in ("DISPLAY", "WAYLAND_DISPLAY")}
    base.pop("QT_QPA_PLATFORM", None)
    script = f"{code}\nimport sys\nfrom dearig.cli.main import main\nsys.exit(main())"
    return subprocess.run(
        [sys.executable, "-c", script, "gui", *map(str, arguments)],
        env={**base, **environment},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="other systems have a screen")
def test_without_a_screen_it_says_so() -> None:
    done = gui()
    assert done.returncode == 2
    assert "there is no screen" in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="other systems have a screen")
@pytest.mark.parametrize(
    ("environment", "words"),
    mostly_deep(
        [
            pytest.param({"DISPLAY": ":59077"}, "the screen :59077 cannot be used: ", id="X11"),
            pytest.param(
                {"DISPLAY": ":59077", "WAYLAND_DISPLAY": "wayland-77"},
                "screen wayland-77 or :59077 cannot be",
            ),
            pytest.param(
                {"QT_QPA_PLATFORM": "nonsense"},
                'Could not find the Qt platform plugin "nonsense"',
            ),
        ],
        ["X11"],
    ),
)
def test_a_screen_that_is_not_there_is_told(environment: dict[str, str], words: str) -> None:
    done = gui(**environment)
    assert done.returncode == 2
    assert words in " ".join(done.stderr.split())
    assert "use dearig record" in " ".join(done.stderr.split())
    assert "This application failed to start" not in done.stderr


@pytest.mark.parametrize("missing", ["PySide6", "pyqtgraph"])
def test_without_its_packages_it_says_how_to_get_them(missing: str) -> None:
    code = (
        "import importlib.abc, sys\n"
        "class Missing(importlib.abc.MetaPathFinder):\n"
        "    def find_spec(self, name, path, target=None):\n"
        f"        if name.partition('.')[0] == {missing!r}:\n"
        "            raise ModuleNotFoundError(name, name=name)\n"
        "sys.meta_path.insert(0, Missing())\n"
    )
    done = gui(code=code, QT_QPA_PLATFORM="offscreen")
    assert done.returncode == 2
    assert f"needs {missing}, which is not installed" in done.stderr
    assert "dearig[gui]" in done.stderr


@pytest.mark.deep
def test_a_rig_file_that_is_none_is_told_in_the_terminal(tmp_path: Path) -> None:
    (tmp_path / "rig.toml").write_text("[film]\nlength_mm = -1.0\n")
    done = gui("--rig-file", tmp_path / "rig.toml", QT_QPA_PLATFORM="offscreen")
    assert done.returncode == 2
    assert "film.length_mm = -1.0 is not allowed" in done.stderr


# arms and starts a run as soon as there is a plan, and raises the signal in its lobe of 5 s
RUN = """\
import signal
from pathlib import Path
from PySide6.QtCore import QTimer
import dearig.window.main as main
from dearig.window.shell.frame import MainWindow
shown = MainWindow.show
LOBE = '''
name = "one lobe"
lead_in_s = 0.3
[[segment]]
kind = "half_sine"
amplitude_kV = 6.0
frequency_Hz = 0.2
'''
def show(self):
    shown(self)
    self.idle_pages.close()  # all pages would be made before the rig is armed
    self.session.set_sequence(LOBE, Path())
    page, timer = self.run_page, QTimer(self)
    def look():
        if page.live is None:
            if page.runner.armed:
                page.start_button.click()  # once ARMED was seen
            elif page.arm_button.isEnabled():
                page.arm_button.click()
        elif (now := page.live.now()) is not None and now.samples > 1000:
            timer.stop()
            signal.raise_signal(signal.SIGTERM)
    timer.timeout.connect(look)
    timer.start(20)
MainWindow.show = show
"""


def test_told_to_end_it_makes_safe_first(tmp_path: Path) -> None:
    done = gui(
        "--folder", tmp_path, code=RUN, QT_QPA_PLATFORM="offscreen",
        XDG_CONFIG_HOME=str(tmp_path / "config"),
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    (path,) = tmp_path.glob("*.h5")
    recording = open_recording(path)
    assert "interrupted by the operator" in recording.outcome
    assert recording.voltage_command is not None
    assert recording.voltage_command.max() > 1000.0
    assert abs(recording.voltage_command[-1]) < 1.0
