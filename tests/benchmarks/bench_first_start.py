"""Time to the first plot of a window on a computer that has compiled nothing yet.

``python -m tests.benchmarks.bench_first_start [--pairs 2]``: each start is a process of its own,
with an empty folder for compiled kernels, from its begin to the first painted curve of the plan. In
turns with the preview that needs no compiled kernel, and without it, when the plan waits for the
compilation. Both pay the same imports, and the compilation goes on in both.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from unittest.mock import patch

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")  # before Qt is loaded

PATIENCE = 3600.0  # s


def first_plot(preview: bool) -> None:
    """Show the window, and return once the plan is painted; ``preview`` as the window is."""
    from PySide6.QtCore import QEvent, QObject, QSettings, QTimer
    from PySide6.QtWidgets import QApplication

    from dearig.window.kit.theme import LIGHT, prepare_plots
    from dearig.window.sequence.planner import Planner
    from dearig.window.session.state import Session
    from dearig.window.shell.frame import MainWindow
    from tests.window.real_window import end

    class Painted(QObject):
        def eventFilter(self, watched: QObject, event: QEvent) -> bool:  # noqa: N802
            if event.type() == QEvent.Type.Paint and plots.curve("planned voltage")[0].size:
                QTimer.singleShot(0, application.quit)
            return super().eventFilter(watched, event)

    application = QApplication([])
    prepare_plots()
    with tempfile.TemporaryDirectory(prefix="dearig-first-") as folder:
        settings = QSettings(str(Path(folder, "x.ini")), QSettings.Format.IniFormat)
        session = Session(Path(folder), settings, theme=LIGHT)
        with patch.object(Planner, "_outline", Planner._outline if preview else lambda _: None):
            window = MainWindow(session)
            plots = window.run_page.plots
            painted = Painted()
            plots.area.canvas.viewport().installEventFilter(painted)
            window.show()
            application.exec()
        print("painted", flush=True)
        end(window)


def seconds(preview: bool) -> float:
    """Return the time in s from the begin of a process to the first painted curve."""
    with tempfile.TemporaryDirectory(prefix="dearig-kernels-") as kernels:
        began = time.perf_counter()
        child = subprocess.Popen(
            [sys.executable, "-m", __spec__.name, "--child", str(int(preview))],
            env={**os.environ, "NUMBA_CACHE_DIR": kernels},
            stdout=subprocess.PIPE,
            text=True,
        )
        assert child.stdout is not None
        for line in child.stdout:
            if line.strip() == "painted":
                took = time.perf_counter() - began
                break
        else:
            raise SystemExit("the window ended before it drew anything")
        child.wait(PATIENCE)
    return took


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--pairs", type=int, default=2)
    parser.add_argument("--child", type=int, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.child is not None:
        first_plot(bool(given.child))
        return
    print("| pair | with the preview, s | without, s | ratio |")
    print("|---|---|---|---|")
    for pair in range(given.pairs):
        with_preview, without = seconds(True), seconds(False)
        print(
            f"| {pair + 1} | {with_preview:.1f} | {without:.1f} | {without / with_preview:.1f} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
