"""Pictures of every page: ``python -m tests.window.screenshots --out DIR [--guide DIR]``.

Everything in them is real: recordings made on simulated rigs, a diagnosis of one of them, a run
that goes on while it is photographed. ``--guide`` writes the few pictures of the guide, each once.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")  # before Qt is loaded

from PIL import Image
from PySide6.QtCore import QEventLoop, QSettings, QTimer
from PySide6.QtGui import QPixmap
from PySide6.QtWidgets import QApplication

from dearig.acquisition.run import RunOptions, record
from dearig.config.presets import PRESETS
from dearig.config.rigfile import RigFile
from dearig.config.sequencefile import load_sequence
from dearig.window.campaign.page import CampaignPage
from dearig.window.follow.page import FollowPage
from dearig.window.jobs.collector import Collector
from dearig.window.kit.theme import DARK, LIGHT, apply, prepare_plots
from dearig.window.recordings.page import RecordingsPage
from dearig.window.rig.page import RigPage
from dearig.window.session.state import Session
from dearig.window.session.text_file import EditedFile
from dearig.window.shell.frame import MainWindow
from dearig.window.study.page import StudyPage
from tests.window.real_window import end

#: A small notebook, a large screen, and the small one at a scale of 1.5 without a window's frame.
SIZES = ((1366, 768), (1920, 1080), (911, 484))
LOOKS = ("light", "dark")
#: It leaks, which the thesis's run alone cannot tell from a permittivity: so there is something to
#: propose.
LEAKING = "sim:30"
#: Much softer than the thesis's film: so there is something to learn.
SOFT = "sim:8"
LEARNED = 3  # runs that learn from the one before
PATIENCE = 600_000  # ms

REFUSED = """\
name = "too much"
[[segment]]
kind = "half_sine"
amplitude_kV = 7.0
frequency_Hz = 0.5
[[segment]]
kind = "steps"
levels_kV = [4.0, 12.5, 0.0]
dwell_s = 1.0
rise_s = 0.02
"""

#: Pictures of the guide: file to (what is seen, look).
GUIDE = {
    "run.png": ("run-going", "light"),
    "sequence.png": ("sequence-refused", "light"),
    "rig.png": ("rig", "light"),
    "recordings.png": ("recordings-several", "light"),
    "study.png": ("study-residual", "light"),
    "follow.png": ("follow-learned", "light"),
    "hold.png": ("hold-going", "light"),
    "campaign.png": ("campaign-going", "light"),
    "dark.png": ("run-going", "dark"),
}


def until(condition: Callable[[], bool], what: str) -> None:
    """Let the window work until ``condition``; ends the command where it never comes."""
    late = QTimer(singleShot=True, interval=PATIENCE)
    late.start()
    while not condition():
        if not late.isActive():
            sys.exit(f"waited in vain for {what}")
        _work(20)


def settled() -> None:
    """Let everything be laid out and drawn."""
    for _ in range(3):
        _work(40)


def _work(milliseconds: int) -> None:
    """Let the window work for a while."""
    loop = QEventLoop()
    QTimer.singleShot(milliseconds, loop.quit)
    loop.exec()


def make_recordings(folder: Path) -> None:
    """Runs of the thesis's rig, and of rigs that hide something."""
    rig_file = RigFile()
    runs = (
        ("sim", "thesis", "thesis-001", "Ada", "VHB 4910, no. 3"),
        ("sim", "validation-b-7.0", "b-7.0-001", "Ada", "VHB 4910, no. 3"),
        ("sim:11", "thesis", "thesis-002", "Grace", "VHB 4910, no. 11"),
        ("sim:3", "thesis", "thesis-003", "Grace", "VHB 4910, no. 7"),
        (LEAKING, "thesis", "thesis-004", "Grace", "VHB 4910, no. 8"),
        (LEAKING, "validation-a-0.6", "a-0.6-001", "Grace", "VHB 4910, no. 8"),
    )
    for seed, (address, preset, name, operator, film) in enumerate(runs):
        record(
            load_sequence(preset), address, rig_file, folder / f"{name}.h5",
            RunOptions(operator=operator, film_id=film, seed=seed),
        )  # fmt: skip


def views(window: MainWindow) -> Iterator[str]:
    """Bring one view after another to the screen; its name is what the picture is called."""
    session, run = window.session, window.run_page
    recordings, study = window.page(RecordingsPage), window.page(StudyPage)
    folder = session.folder
    window.show_page(window.page(RigPage))
    yield "rig"
    rig = window.page(RigPage)
    rig.instruments.setCurrentWidget(rig.live)
    rig.live.start()
    until(lambda: rig.live.table.rowCount() > 0, "the inputs")
    _work(3000)
    yield "rig-live"
    rig.live.stop()
    rig.instruments.setCurrentIndex(0)
    window.show_page(window.sequence_page)
    yield "sequence"
    planned(session, REFUSED)
    yield "sequence-refused"
    window.show_page(run)
    yield "run-refused"
    planned(session, PRESETS["thesis"])
    yield "run-ready"

    run.operator.setText("Ada")
    run.film.setText("VHB 4910, no. 3")
    run.paced.setChecked(True)
    run.arm_button.click()
    yield "run-armed"
    until(run.start_button.isEnabled, "the state ARMED to be seen")
    run.start_button.click()
    until(lambda: run.live is not None and far(run, 9.0), "the run")
    yield "run-going"
    run.stop_button.click()
    until(lambda: not run.runner.running, "the end of the run")
    settled()
    yield "run-stopped"

    window.show_page(recordings)
    until(
        lambda: (
            len(recordings._library.files) == 7
            and set(recordings._library.summaries) == set(recordings._library.files)
        ),
        "the recordings",
    )
    recordings.choose([folder / "thesis-003.h5"])
    until(lambda: [c.name for c in recordings.plot.shown] == ["thesis-003"], "a recording")
    yield "recordings"
    recordings.choose([folder / f"thesis-00{n}.h5" for n in (1, 2, 3)])
    until(
        lambda: len(recordings.plot.shown) == 3 and recordings.differences.rowCount() > 0,
        "the differences",
    )
    yield "recordings-several"

    window.show_page(study)
    yield "study"
    study.recordings.check([folder / "thesis-004.h5"], [folder / "a-0.6-001.h5"])
    study.begin()
    until(lambda: study.job.bar.value() > 250, "the search")
    yield "study-searching"
    until(lambda: study._shown is not None or bool(study.message.text()), "the diagnosis")
    if study.message.text():
        sys.exit(study.message.text())
    for index in range(study.tabs.count()):
        study.tabs.setCurrentIndex(index)
        yield f"study-{study.tabs.tabText(index).lower()}"
    yield from following(window)
    yield from holding(window)
    yield from campaigning(window)


def following(window: MainWindow) -> Iterator[str]:
    """The page Follow: a target that cannot be reached, and one that is learned."""
    session, run, follow = window.session, window.run_page, window.page(FollowPage)
    session.set_address(SOFT)
    run.paced.setChecked(False)
    window.show_page(follow)
    yield "follow"
    example = follow.target.toml
    for view, toml in (
        ("refused", example.replace("duration_s = 4.0", "duration_s = 0.3")),
        ("ready", example),
    ):
        follow.target.edit.setPlainText(toml)
        follow.compute()
        until(follow.compute_button.isEnabled, "a voltage")
        yield f"follow-{view}"
    for _ in range(LEARNED + 1):
        follow.run_button.click()
        until(run.arm_button.isEnabled, "the plan of a run")
        run.arm_button.click()
        until(run.start_button.isEnabled, "the state ARMED to be seen")
        run.start_button.click()
        until(lambda: not run.runner.running, "the end of a run")
        until(follow.compute_button.isEnabled, "what is learned")
    window.show_page(follow)
    yield "follow-learned"


def holding(window: MainWindow) -> Iterator[str]:
    """The hold on the page Follow: before it, refused, checked, while it runs, and measured."""
    run, follow = window.run_page, window.page(FollowPage)
    panel = follow.hold
    window.session.set_address("sim")
    window.show_page(follow)
    follow.modes.setCurrentWidget(panel)
    yield "hold"

    def checked(millimetres: float) -> None:
        panel.displacement.setValue(millimetres)
        panel.check()
        until(panel.check_button.isEnabled, "what can be held")

    checked(20.0)
    yield "hold-refused"
    panel.duration.setValue(30.0)
    checked(0.5)
    yield "hold-checked"
    panel.run_button.click()
    until(run.arm_button.isEnabled, "the plan of a run")
    run.paced.setChecked(True)
    run.arm_button.click()
    until(run.start_button.isEnabled, "the state ARMED to be seen")
    run.start_button.click()
    until(lambda: far(run, 20.0), "a hold")
    yield "hold-run"
    window.show_page(follow)
    yield "hold-going"
    until(lambda: panel.outcome is not None, "the end of a hold")
    until(panel.check_button.isEnabled, "the error of a hold")
    yield "hold-measured"


def campaigning(window: MainWindow) -> Iterator[str]:
    """The page Campaign: a plan, one that is refused, a campaign that goes on, and its end."""
    page, runner = window.page(CampaignPage), window.run_page.runner
    window.session.set_address("sim")
    window.show_page(page)
    example = page.plan.toml

    def checked(toml: str) -> None:
        page.plan.restore(toml, EditedFile("plan", toml))
        until(lambda: page._survey is not None and not page.surveyor.waits, "the runs of a plan")

    checked(example.replace("[7.0, 7.0", "[12.0, 7.0"))
    yield "campaign-refused"
    checked(example.replace("rest_s = 5.0", "rest_s = 0.0"))
    yield "campaign-ready"
    page.controls.operator.setText("Ada")
    page.controls.paced.setChecked(True)
    page.controls.arm.click()
    yield "campaign-armed"
    until(page.controls.start.isEnabled, "the state ARMED to be seen")
    page.controls.start.click()

    def playing(run: int, seconds: float) -> bool:
        """Return True once the campaign has come that far."""
        going = page.queue.order.index(page.queue.running.name) if page.queue.running else -1
        return going >= run and page._thread is not None and far(page._thread, seconds)

    until(lambda: playing(1, 6.0), "the second run of a campaign")
    page.table.choose([page.table.rows[4].name])
    page.controls.first.click()
    yield "campaign-going"
    window.run_page.stop_button.click()
    until(lambda: not runner.running, "the end of a campaign")
    until(lambda: page._survey is not None and not page.surveyor.waits, "the runs of a plan")
    yield "campaign-stopped"


def planned(session: Session, toml: str) -> None:
    """Put a sequence in, and wait for its plan."""
    session.set_sequence(toml, Path())
    until(lambda: session.preview is not None and session.preview.toml == toml, "a sequence's plan")


def far(run: object, seconds: float) -> bool:
    """True once a run has come that far."""
    live = run.live  # type: ignore[attr-defined]
    now = None if live is None else live.now()
    return now is not None and now.samples / now.rate > seconds


def small(picture: QPixmap, path: Path) -> None:
    """Save ``picture`` with no more colours than a window has: a third of the bytes."""
    picture.save(str(path))
    with Image.open(path) as image:
        few = image.convert("RGB").quantize(128, dither=Image.Dither.NONE)
    few.save(path, optimize=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, help="where every view goes, in all sizes and looks")
    parser.add_argument("--guide", type=Path, help="where the pictures of the guide go")
    parser.add_argument("--only", default="", help="views whose name begins so")
    asked = parser.parse_args()
    if asked.out is None and asked.guide is None:
        parser.error("give --out DIR, --guide DIR, or both")
    for folder in filter(None, (asked.out, asked.guide)):
        folder.mkdir(parents=True, exist_ok=True)

    application = QApplication(sys.argv[:1])
    prepare_plots()
    # as in the program: a collection at any time may end an object while Qt holds a lock of it
    collector = Collector(application)
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch) / "recordings"
        folder.mkdir()
        make_recordings(folder)
        settings = QSettings(str(Path(scratch) / "window.ini"), QSettings.Format.IniFormat)
        session = Session(folder, settings, theme=LIGHT)
        window = MainWindow(session)
        window.show()
        until(lambda: session.preview is not None, "the first plan")
        for name in views(window):
            if not name.startswith(asked.only):
                continue
            for look in LOOKS:
                theme = {"light": LIGHT, "dark": DARK}[look]
                apply(application, theme)
                session.set_theme(theme)
                for width, height in SIZES if asked.out else SIZES[:1]:
                    window.resize(width, height)
                    settled()
                    picture = window.grab()
                    if asked.out:
                        picture.save(str(asked.out / f"{name}-{look}-{width}x{height}.png"))
                    if asked.guide and (width, height) == SIZES[0]:
                        for file, view in GUIDE.items():
                            if view == (name, look):
                                small(picture, asked.guide / file)
        window.leave()
        until(lambda: not window.isVisible(), "the end of the last run")
        end(window)
    collector.close()
    application.quit()


if __name__ == "__main__":
    main()
