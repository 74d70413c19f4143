"""A real window on a real X server, with a real mouse and keys."""

from __future__ import annotations

import ctypes.util
import json
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from dearig.recording import open_recording
from dearig.recording.reading.marks import marks_in

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(
        not (shutil.which("Xvfb") and ctypes.util.find_library("Xtst")),
        reason="needs Xvfb and libXtst",
    ),
]


@pytest.fixture
def display() -> Iterator[str]:
    """An X server of its own."""
    read, write = os.pipe()
    server = subprocess.Popen(
        ["Xvfb", "-displayfd", str(write), "-screen", "0", "1366x768x24", "-nolisten", "tcp"],
        pass_fds=(write,),
        stderr=subprocess.DEVNULL,
    )
    os.close(write)
    try:
        with os.fdopen(read) as told:
            number = told.readline().strip()
        assert number, "the X server did not start"
        yield f":{number}"
    finally:
        server.terminate()
        server.wait()


@pytest.mark.deep
def test_a_run_by_mouse_and_keys(display: str, tmp_path: Path) -> None:
    # one unreadable file raised errors in slots, on standard error, with every new recording
    (tmp_path / "letter.h5").write_text("dear reader")
    done = subprocess.run(
        [sys.executable, "-m", "tests.window.real_window", str(tmp_path)],
        env={**os.environ, "DISPLAY": display, "QT_QPA_PLATFORM": "xcb"},
        capture_output=True,
        text=True,
        timeout=280,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    # the run tells that it was stopped; nothing from Qt
    words = [line for line in done.stderr.splitlines() if "interrupted by the operator" not in line]
    assert words == []
    saw = json.loads(done.stdout)
    assert saw["platform"] == "xcb"
    assert saw["operator"] == "ada"
    assert saw["planned"] == "Planned: thesis identification, peak 8.00 kV, 25.8 s"
    assert saw["current drawn"]
    assert (saw["armed"], saw["started"], saw["ended"]) == ("ARMED", "ON", "CONFIRMED")
    assert saw["stop"] == "#b3001b"  # large and red, on the screen
    assert "ramped down to 0 V" in saw["result"]
    runs = [name for name in saw["recordings"] if name != "letter.h5"]
    assert len(runs) == 2
    recording = open_recording(tmp_path / runs[0])
    assert recording.provenance["operator"] == "ada"
    assert [mark.note for mark in marks_in(recording.events)] == ["my spark"]
    assert recording.voltage_command is not None
    assert abs(recording.voltage_command[-1]) < 1.0


@pytest.mark.deep
def test_edits_by_mouse_and_keys(display: str, tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "tests.window.real_window_edits", str(tmp_path)],
        env={**os.environ, "DISPLAY": display, "QT_QPA_PLATFORM": "xcb"},
        capture_output=True,
        text=True,
        timeout=280,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    saw = json.loads(done.stdout)
    (banner,) = saw["banners"]
    assert "film: length (mm)" in banner
    assert "previous limits are in force: 0 to 8.5 kV" in banner
    assert (saw["banner shown"], saw["may arm"]) == (True, False)
    assert saw["limit"] == 5.0
    assert saw["read"] == "3.5, 4.5, 0 kV: 3 values"
    assert saw["file"] == (
        '# for film 7\nname = "steps"\nlead_in_s = 0.5\n[[segment]]\nkind = "steps"\n'
        "levels_kV = [3.5, 4.5, 0.0]  # kV\ndwell_s = 0.50\n"
    )
    assert saw["closed"] is False
    assert "segment 1 dwell (s)" in saw["asked"][0]
    (kept,) = saw["kept"]
    assert "dwell_s = 0.25" in kept


def story(display: str, folder: Path, *more: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-m", "tests.window.real_window_safety", str(folder), *more],
        env={**os.environ, "DISPLAY": display, "QT_QPA_PLATFORM": "xcb"},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def test_stop_is_everywhere_and_its_keys_start_nothing(display: str, tmp_path: Path) -> None:
    out, err = story(display, tmp_path).communicate(timeout=280)
    assert out, err
    saw = json.loads(out)
    assert saw["first"] == "NOT_CONTACTED"
    assert saw["stop on every page"] == ["#b3001b"]  # the same red at its place on each page
    assert not saw["a stop key has started"]
    assert not saw["Space on Start has started"]
    assert saw["ends"] == ["Stopped"] * 3
    assert saw["after"] == "CONFIRMED"
    assert saw["beside a dialog"] == ["not modal", "Stopped"]


@pytest.mark.deep
def test_a_killed_server_leaves_an_unknown_output_and_a_latched_alarm(
    display: str, tmp_path: Path
) -> None:
    server = subprocess.Popen(
        [sys.executable, "-m", "dearig", "serve-daqmx", "--port", "0"],
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        assert server.stdout is not None
        port = server.stdout.readline().split(":")[1].split(";")[0]
        window = story(display, tmp_path, port)
        assert window.stderr is not None
        said = []
        for line in window.stderr:
            said.append(line)
            if line.strip() == "running":
                break
    finally:
        server.kill()
        server.communicate()  # which closes its pipe too
    out, err = window.communicate(timeout=280)
    assert out, "".join(said) + err
    saw = json.loads(out)
    assert saw["end"] == "Instrument fault"
    assert saw["state"] == "UNKNOWN"
    assert "switch the amplifier off" in saw["detail"]
    assert "COULD NOT BE MADE SAFE" in saw["alarm"]
    assert saw["time"].startswith("last sample,")
    assert saw["kept"] == [True] * 8  # F5 on every page, and a click on Arm
    assert saw["acknowledged"] == "UNKNOWN"
    recording = open_recording(next(tmp_path.glob("*.h5")))
    messages = [event.message for event in recording.events]
    assert any(message.startswith("output: unknown since") for message in messages)
    assert any("COULD NOT BE TAKEN TO 0 V" in message for message in messages)  # the guardian
    assert messages[-1].startswith("Grace acknowledged: Instrument fault")
