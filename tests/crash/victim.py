"""A recording to be killed or replayed: ``python -m tests.crash.victim FILE BLOCKS SIZE``.

Sample n of channel c holds the count (n * 7 + c) mod 30000. What is safe stands, as the number of
samples flushed, in FILE.said: at once on a line of its own, then "closing", then "closed". With
--overwrite FILE is there already. With --real the clock is the computer's and the run as fast as
can be.
"""

from __future__ import annotations

import argparse
import os
import time
from pathlib import Path

from dearig.drivers.rig import Block, Event
from tests.tools.recording_victim import pattern
from tests.tools.recordings import Clock, writer


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("path", type=Path)
    parser.add_argument("blocks", type=int)
    parser.add_argument("size", type=int)
    parser.add_argument("--overwrite", action="store_true")
    parser.add_argument("--real", action="store_true")
    asked = parser.parse_args()
    said_to = os.open(f"{asked.path}.said", os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o600)

    def say(what: object) -> None:
        os.write(said_to, f"{what}\n".encode())

    clock = Clock()
    ring = pattern(0, 30000 + asked.size)
    recorder = writer(
        asked.path,
        samples_expected=asked.blocks * asked.size,
        now=time.time if asked.real else clock,
        overwrite=asked.overwrite,
    )
    said = 0
    for i in range(asked.blocks):
        clock.moment += 0.0625
        start = i * asked.size
        events = (Event(start, "info", f"block {i}"),) if i % 8 == 0 else ()
        # the pattern repeats after 30000 samples
        place = start % 30000
        recorder.append(Block(start, ring[:, place : place + asked.size], events))
        if recorder.samples_flushed > said:
            said = recorder.samples_flushed
            say(said)
    say("closing")
    recorder.close()
    say("closed")


if __name__ == "__main__":
    main()
