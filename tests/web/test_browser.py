"""The page in a browser without a screen."""

from __future__ import annotations

import re
import sys
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

pytest.importorskip("uvicorn", reason='takes the extra "web"')

from dearig.batch.watching import SourceWatch
from dearig.drivers.rig import Block, Event
from dearig.web.server import WatchServer
from tests.tools.browser import CHROMIUM, Browser
from tests.tools.recordings import run_counts, writer

HOSTILE = "<img src=x onerror=document.title=1>"

pytestmark = pytest.mark.skipif(
    not CHROMIUM or sys.platform == "win32", reason="takes Chromium, and pipes of POSIX"
)


@pytest.fixture
def address(tmp_path: Path) -> Iterator[str]:
    """The page of a recording with an alarm, whose run goes on."""
    recorder = writer(tmp_path / "run.h5", samples_expected=3000)
    recorder.append(Block(0, run_counts(3000)[:, :1500], (Event(9, "fault", HOSTILE),)))
    recorder._flush_all(1.8e9)
    server = WatchServer(SourceWatch(tmp_path), "127.0.0.1", 0, None, 0.1)
    thread = threading.Thread(target=server.run)
    thread.start()
    yield server.address
    server.stop()
    thread.join()
    recorder.close()


def test_a_browser_draws_what_the_stream_says(address: str, tmp_path: Path) -> None:
    with Browser(tmp_path / "profile") as browser:
        browser.open(address)
        browser.await_true("document.querySelectorAll('canvas').length === 3")

        def text(place: str) -> str:
            return browser.evaluate(f"document.querySelector({place!r}).innerText")

        assert text("#simulated") == "SIMULATED"
        assert text("#status") == "RECORDING"
        assert text("#connection") == "connected"
        assert re.match(r"measured \d+\.\d s ago|STALE: no new data for \d+", text("#age"))
        assert browser.evaluate("document.querySelectorAll('.value .number').length") == 4
        assert text("#recording-time") == "1.5 s of 3.0 s"
        # a text of the recording is text
        assert text("#alarms") == f"At 0.01 s: {HOSTILE}"
        assert browser.evaluate("document.querySelectorAll('img').length") == 0
        assert browser.evaluate("document.title") == "(!) run.h5 - dearig watch"
        # a telephone shows the page without scrolling sideways
        assert browser.evaluate("document.documentElement.scrollWidth") <= 390
        browser.evaluate("document.querySelector('#span-whole').click()")
        browser.await_true("plots[0].chart.scales.x.max === 3")
        assert browser.errors == []
