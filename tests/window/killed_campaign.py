"""A campaign of the window whose process is killed again and again, on a simulated card.

``python -m tests.window.killed_campaign --kills 5 --out DIR`` plays a campaign by mouse and keys in
a real window on an X server of its own (Xvfb), kills the window's process at random moments, and
opens the campaign in a new window, where it is continued. The film is on a simulated card behind a
server in this process: the voltage at the film is read off the simulated wire. Checked are that no
run is lost or doubled, that each kill ends at 0 V with the enable line low, and what the page says.
The pictures of the page after each start and the words on it are left in ``DIR``.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import psutil
from PySide6.QtCore import QCoreApplication, QPoint, QSettings
from PySide6.QtWidgets import QApplication, QLineEdit, QWidget

from dearig.batch.journal import JOURNAL
from dearig.batch.watching import seen
from dearig.config.rigfile import load_rig_file
from dearig.recording import open_recording
from dearig.sim_backend.clock import PacedClock
from dearig.sim_backend.daqmx.opening import open_device
from dearig.sim_backend.daqmx.protocol.server import DaqmxServer
from dearig.sim_backend.daqmx.simulated_card import SimulatedCard
from dearig.window.campaign.page import CampaignPage
from dearig.window.kit.theme import LIGHT, prepare_plots
from dearig.window.session.state import Session
from dearig.window.session.text_file import EditedFile
from tests.window.real_window import Hand, end, shown, until

RIG = """\
[film]
name = "campaign"
[card]
do_hv_enable = "port0/line0"
hv_enable_watchdog_s = 1.0
[limits]
ramp_down_s = 0.3
"""
LOBE = """\
name = "lobe"
lead_in_s = 0.3
tail_s = 0.2
[[segment]]
kind = "half_sine"
amplitude_kV = 4.0
frequency_Hz = 0.5
"""
PLAN = """\
name = "killed"
sequence = "lobe.toml"
repeat = {runs}
repeat_lost = 10
"""
ZERO = 50.0  # V at the film that count as 0
WITHIN = 0.5 + 0.3  # s: the guardian's detection of a killed client, and the ramp to 0 V
PATIENCE = 180.0  # s, on a machine that is busy


# ------------------------------------------------------------ the window


def play(folder: Path, port: int, picture: str) -> None:
    """Begin the campaign in ``folder``, or continue it, until it ends or this process is killed."""
    application = QApplication(sys.argv[:1])
    prepare_plots()
    settings = QSettings(str(folder / "settings.ini"), QSettings.Format.IniFormat)
    session = Session(folder, settings, theme=LIGHT)
    window = shown(session)
    hand, page = Hand(), window.page(CampaignPage)
    controls = page.controls
    until(window.isActiveWindow, "the window becomes active")
    session.set_rig_file(folder / "rig.toml", RIG, load_rig_file(folder / "rig.toml"))
    session.set_address(f"daqmx:Dev1@127.0.0.1:{port}")
    window.show_page(page)

    def click(widget: QWidget) -> None:
        until(widget.isEnabled, "what is clicked is offered")
        place: list[tuple[int, int]] = []

        def rests() -> bool:
            """Return True once the widget has not moved for some looks."""
            place.append(widget.mapToGlobal(QPoint()).toTuple())
            return len(place) > 30 and len(set(place[-30:])) == 1

        until(rests, "the layout rests")
        hand.click(widget.mapToGlobal(QPoint(12, widget.height() // 2)))

    def write(field: QLineEdit, word: str) -> None:
        click(field)
        until(field.hasFocus, "the cursor in a field")
        field.selectAll()
        for letter in word:
            hand.key(letter)
        until(lambda: field.text() == word, f"the word {word}")

    def tell(what: str) -> None:
        QCoreApplication.processEvents()
        window.grab().save(str(folder / f"{picture}-{what}.png"))
        told = {
            "at": what,
            "headline": page.headline.text(),
            "message": page.message.text(),
            "halt": controls.halt.text() if page.queue.halted else "",
            "badge": window.bar.badge.state.name,
        }
        print(json.dumps(told), flush=True)

    begun = folder / "campaign-1"
    if (begun / JOURNAL).exists():
        page.open_campaign(begun)
        until(lambda: page.folder == begun, "the campaign is opened")
    else:
        plan = (folder / "plan.toml").read_text("utf-8")
        page.plan.restore(plan, EditedFile("plan", plan, None, folder))
    first = True
    while page.folder is None or page.queue.waiting or page.queue.running is not None:
        write(controls.operator, "ada")
        if window.bar.alarm.isVisible():
            tell("alarm")
            window.bar.acknowledge("ada")
        until(lambda: page.ready or bool(page.queue.halted), "the runs are checked")
        if first or page.queue.halted:
            tell("opened" if first else "halted")
        first = False
        if page.queue.halted:
            write(controls.seen, "fine")
        until(lambda: controls.arm.isEnabled() and controls.arm.answers, "the batch can be armed")
        click(controls.arm)
        until(lambda: controls.start.isEnabled() and controls.start.answers, "ARMED was seen")
        click(controls.start)
        until(lambda: window.run_page.runner.running, "started")
        print(json.dumps({"at": "started"}), flush=True)
        until(lambda: not window.run_page.runner.running, "the end of the campaign")
    tell("ended")
    end(window)
    application.quit()


# ------------------------------------------------------------ who kills it


@contextmanager
def display() -> Iterator[str]:
    """Give the address of an X server of its own."""
    read, write = os.pipe()
    server = subprocess.Popen(
        ["Xvfb", "-displayfd", str(write), "-screen", "0", "1366x768x24", "-nolisten", "tcp"],
        pass_fds=(write,), stderr=subprocess.DEVNULL,
    )  # fmt: skip
    os.close(write)
    try:
        with os.fdopen(read) as told:
            yield f":{told.readline().strip()}"
    finally:
        server.terminate()
        server.wait()


def wait(condition: Callable[[], bool], what: str) -> None:
    end = time.monotonic() + PATIENCE
    while not condition():
        if time.monotonic() > end:
            raise SystemExit(f"waited in vain: {what}")
        time.sleep(0.005)


def window_of(folder: Path, port: int, number: int, screen: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-m", "tests.window.killed_campaign", "--window", str(folder), str(port),
         f"{number:02d}"],
        env={**os.environ, "DISPLAY": screen, "QT_QPA_PLATFORM": "xcb"},
        stdout=subprocess.PIPE, text=True,
    )  # fmt: skip


def until_started(window: subprocess.Popen[str]) -> None:
    """Print what the window tells until its campaign plays."""
    assert window.stdout is not None
    halted = False
    for line in window.stdout:
        told = json.loads(line)
        print("   ", {k: v for k, v in told.items() if v}, flush=True)
        if told["at"] == "started" and not halted:
            return
        # the start after a kill only finds the halt; the one after its answer plays
        halted = told["at"] == "opened" and "during run" in told["message"]


def kill_at_voltage(
    folder: Path,
    device: SimulatedCard,
    clock: PacedClock,
    window: subprocess.Popen[str],
    moment: float,
) -> str:
    """Kill ``window`` so many s after the next rise of the voltage; return what was seen."""
    journal = folder / "campaign-1" / JOURNAL
    size = journal.stat().st_size if journal.exists() else 0
    wait(
        lambda: window.poll() is not None or (journal.exists() and journal.stat().st_size > size
        and abs(device.wire_voltage()) > ZERO),
        "a run with voltage",
    )  # fmt: skip
    begin = clock.now()
    wait(lambda: clock.now() >= begin + moment, "the moment")
    voltage, struck = device.wire_voltage(), clock.now()
    children = psutil.Process(window.pid).children(recursive=True)
    window.kill()
    window.wait()
    wait(lambda: abs(device.wire_voltage()) <= ZERO, "0 V")
    took = clock.now() - struck
    psutil.wait_procs(children, timeout=30)
    assert abs(device.wire_voltage()) <= ZERO, "the voltage has come back"
    assert not device.line("port0/line0"), "the enable line is high"
    assert took < WITHIN + 1.0, f"0 V after {took:.2f} s"
    return f"killed at {voltage:.0f} V; 0 V after {took:.2f} s, the enable line is low"


def check(folder: Path, runs: int) -> Counter[str]:
    """Check that every run is there once and whole; return the entries of the journal."""
    out = folder / "campaign-1"
    queue = seen(out).queue
    assert [run.state for run in queue.listed] == ["done"] * runs
    entries = [json.loads(line) for line in (out / JOURNAL).read_text("utf-8").splitlines()]
    done = Counter(e["run"] for e in entries if e["event"] == "ended" and e["state"] == "done")
    assert done == Counter(queue.order), done
    whole = {p.name for p in out.glob("*.h5") if open_recording(p).outcome == "finished"}
    assert whole == {run.recording for run in queue.listed}
    return Counter(e["event"] for e in entries)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--kills", type=int, default=5)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path, help="a new folder [a temporary one]")
    parser.add_argument("--window", nargs=3, metavar=("FOLDER", "PORT", "NAME"))
    asked = parser.parse_args()
    if asked.window:
        folder, port, name = asked.window
        play(Path(folder), int(port), name)
        return
    runs = asked.kills + 1
    if asked.out is None:
        folder = Path(tempfile.mkdtemp(prefix="dearig-killed-"))
    elif asked.out.exists():
        parser.error(f"{asked.out} exists: give --out a folder that does not")
    else:
        folder = asked.out.resolve()
        folder.mkdir(parents=True)
    print(f"in {folder}")
    for name, text in (("rig", RIG), ("lobe", LOBE), ("plan", PLAN.format(runs=runs))):
        (folder / f"{name}.toml").write_text(text, "utf-8")
    rng = random.Random(asked.seed)  # noqa: S311
    settings, clock = load_rig_file(folder / "rig.toml"), PacedClock()
    film, load = settings.as_film(), settings.as_load()
    device = open_device("sim", settings, film, load, seed=asked.seed, clock=clock)
    with display() as screen, DaqmxServer(device) as server:
        for number in range(asked.kills):
            window = window_of(folder, server.port, number, screen)
            try:
                until_started(window)
                # a run has 2 s with voltage, and then the next one begins
                print(kill_at_voltage(folder, device, clock, window, rng.uniform(0.0, 4.0)))
            finally:
                window.kill()
                window.communicate()
        window = window_of(folder, server.port, asked.kills, screen)
        try:
            until_started(window)
            said, _ = window.communicate(timeout=600)
            print("   ", said.strip())
        finally:
            window.kill()
            window.wait()
    entries = check(folder, runs)
    print(
        f"{asked.kills} kills of the window (seed {asked.seed}), {runs} runs: none lost or "
        f"doubled, 0 V each time; {entries['ended'] - runs} recordings cut off and repeated, "
        f"{entries['halted']} halts acknowledged by a person"
    )


if __name__ == "__main__":
    main()
