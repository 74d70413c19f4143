"""Chromium without a screen, driven by its DevTools protocol over two pipes."""

from __future__ import annotations

import base64
import itertools
import json
import os
import shutil
import subprocess
import time
from pathlib import Path
from typing import Any

CHROMIUM = next(
    filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), ""
)


class Browser:
    """One page of ``width`` times ``height``; ``errors`` are what was blocked or has failed in it.

    A context manager. ``profile`` is a folder for the browser's own files.
    """

    def __init__(self, profile: Path, width: int = 390, height: int = 844, dark: bool = False):
        self.errors: list[str] = []
        self._numbers = itertools.count(1)
        self._rest = b""
        read_by_it, self._to = os.pipe()
        self._from, written_by_it = os.pipe()

        def hand_over() -> None:
            # the protocol's pipes are 3 and 4; what is moved there is out of the way first
            one, two = os.dup(read_by_it), os.dup(written_by_it)
            os.dup2(one, 3)
            os.dup2(two, 4)

        self._process = subprocess.Popen(
            [
                CHROMIUM, "--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars",
                "--remote-debugging-pipe", "--no-first-run", f"--user-data-dir={profile}",
            ],
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, preexec_fn=hand_over,
            close_fds=False,
        )  # fmt: skip
        os.close(read_by_it)
        os.close(written_by_it)
        target = self._call("Target.createTarget", url="about:blank")["targetId"]
        self._session = self._call("Target.attachToTarget", targetId=target, flatten=True)[
            "sessionId"
        ]
        for domain in ("Page", "Runtime", "Log"):
            self.call(f"{domain}.enable")
        self.resize(width, height)
        if dark:
            features = [{"name": "prefers-color-scheme", "value": "dark"}]
            self.call("Emulation.setEmulatedMedia", features=features)

    def resize(self, width: int, height: int) -> None:
        self.call(
            "Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1,
            mobile=False,
        )  # fmt: skip

    def open(self, address: str) -> None:
        self.call("Page.navigate", url=address)

    def evaluate(self, script: str) -> Any:
        """Return the value of ``script`` in the page."""
        found = self.call("Runtime.evaluate", expression=script, returnByValue=True)
        assert "exceptionDetails" not in found, found
        return found["result"].get("value")

    def await_true(self, script: str, most: float = 60.0) -> None:
        """Return when ``script`` is true. Raises ``AssertionError`` after ``most`` s."""
        # each look is answered by the browser, which draws in between
        wait = (
            "new Promise(done => requestAnimationFrame(() => requestAnimationFrame("
            f"() => done(Boolean({script})))))"
        )
        end = time.monotonic() + most
        while not self.call(
            "Runtime.evaluate", expression=wait, awaitPromise=True, returnByValue=True
        )["result"].get("value"):
            assert time.monotonic() < end, f"never true: {script}"

    def picture(self, path: Path, whole: bool = True) -> None:
        """Write the page as PNG to ``path``."""
        found = self.call("Page.captureScreenshot", captureBeyondViewport=whole)
        path.write_bytes(base64.b64decode(found["data"]))

    def call(self, method: str, **given: Any) -> dict[str, Any]:
        return self._call(method, self._session, **given)

    def _call(self, method: str, session: str = "", **given: Any) -> dict[str, Any]:
        number = next(self._numbers)
        message = {"id": number, "method": method, "params": given}
        if session:
            message["sessionId"] = session
        os.write(self._to, json.dumps(message).encode() + b"\0")
        while True:
            answer = self._next()
            if answer.get("id") == number:
                assert "error" not in answer, answer
                return answer["result"]
            self._note(answer)

    def _next(self) -> dict[str, Any]:
        while b"\0" not in self._rest:
            part = os.read(self._from, 2**16)
            assert part, "the browser has ended"
            self._rest += part
        message, _, self._rest = self._rest.partition(b"\0")
        return json.loads(message)

    def _note(self, message: dict[str, Any]) -> None:
        given = message.get("params", {})
        match message.get("method"):
            case "Runtime.exceptionThrown":
                self.errors.append(str(given["exceptionDetails"]))
            case "Log.entryAdded" if given["entry"]["level"] == "error":
                self.errors.append(str(given["entry"]))
            case "Runtime.consoleAPICalled" if given["type"] == "error":
                self.errors.append(str(given["args"]))

    def __enter__(self) -> Browser:
        return self

    def __exit__(self, *_: object) -> None:
        self._call("Browser.close")
        self._process.wait(30)
        os.close(self._to)
        os.close(self._from)
