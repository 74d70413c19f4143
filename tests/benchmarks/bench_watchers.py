"""A campaign whose watchers are killed at random moments: what it loses, and what it costs.

``python -m tests.benchmarks.bench_watchers --runs 100``. The same campaign is played without
watchers and with them. Watchers are pages with two readers each, one of which never reads, and
terminals. Every recording must have the same samples.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import random
import socket
import subprocess
import sys
import tempfile
import threading
import time
import urllib.request
from pathlib import Path

import h5py
import numpy as np

from tests.tools.killed_campaign import check_campaign, command, made_plan

WATCH = [sys.executable, "-m", "dearig", "watch"]


class Watchers:
    """Pages and terminals that look on at ``folder``, each killed after at most ``life`` s."""

    def __init__(self, folder: Path, seed: int, life: float) -> None:
        self._folder, self._life = folder, life
        self._random = random.Random(seed)  # noqa: S311
        self._over = threading.Event()
        self.kills = self.states = self.pages = 0
        self._threads = [
            threading.Thread(target=self._kill_again, args=(kind,))
            for kind in (self._page, self._terminal)
        ]

    def __enter__(self) -> Watchers:
        for thread in self._threads:
            thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
        for thread in self._threads:
            thread.join()

    def _kill_again(self, kind) -> None:
        while not self._over.is_set():
            kind()

    def _page(self) -> None:
        process = subprocess.Popen(
            [*WATCH, str(self._folder), "--port", "0"], stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL, text=True, env=os.environ | {"COLUMNS": "200"},
        )  # fmt: skip
        assert process.stdout is not None
        line = process.stdout.readline()
        address = next((word for word in line.split() if word.startswith("http")), "")
        if address:
            self.pages += 1
            reader = threading.Thread(target=self._read, args=(address,))
            reader.start()
            host, _, port = address.removeprefix("http://").rstrip("/").partition(":")
            with contextlib.suppress(OSError), socket.create_connection((host, int(port))) as deaf:
                deaf.sendall(f"GET /live HTTP/1.1\r\nHost: {host}:{port}\r\n\r\n".encode())
                self._wait()
        process.kill()
        process.wait()
        process.stdout.close()
        self.kills += 1
        if address:
            reader.join()

    def _read(self, address: str) -> None:
        with contextlib.suppress(OSError), urllib.request.urlopen(f"{address}live") as stream:  # noqa: S310
            for line in stream:
                self.states += b'"state"' in line

    def _terminal(self) -> None:
        import pty

        ours, its = pty.openpty()
        process = subprocess.Popen(
            [*WATCH, str(self._folder)], stdin=its, stdout=its, stderr=its, close_fds=True
        )
        os.close(its)
        self._wait()
        process.kill()
        process.wait()
        os.close(ours)
        self.kills += 1

    def _wait(self) -> None:
        self._over.wait(self._random.uniform(0.2, self._life))


def play(plan: Path) -> float:
    """Play the campaign in a process of its own; return the time in s that it takes."""
    began = time.monotonic()
    subprocess.run(command(plan), check=True, capture_output=True, cwd=plan.parent)
    return time.monotonic() - began


def samples(plan: Path) -> dict[str, list[np.ndarray]]:
    """Return the counts of all channels of each recording."""
    found = {}
    for path in sorted((plan.parent / "out").glob("*.h5")):
        with h5py.File(path) as file:
            data = file["entry/data"]
            found[path.name] = [data[n][()] for n in sorted(data) if n.endswith("_counts")]
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--life", type=float, default=4.0, help="longest life of a watcher in s")
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as one, tempfile.TemporaryDirectory() as two:
        alone, watched = (made_plan(Path(folder), asked.runs) for folder in (one, two))
        out = watched.parent / "out"
        out.mkdir()
        took = play(alone)
        with Watchers(out, asked.seed, asked.life) as watchers:
            took_watched = play(watched)
        events = check_campaign(watched, asked.runs)
        first, second = samples(alone), samples(watched)
        assert first.keys() == second.keys()
        for name, channels in first.items():
            for a, b in zip(channels, second[name], strict=True):
                np.testing.assert_array_equal(a, b)
        print(
            f"{asked.runs} runs, {watchers.kills} watchers killed (seed {asked.seed}; "
            f"{watchers.pages} pages that sent {watchers.states} states): none lost, repeated or "
            f"changed; {events['ended']} ends in the journal; {took:.0f} s alone, "
            f"{took_watched:.0f} s watched"
        )


if __name__ == "__main__":
    main()
