"""A recording under load, to be killed: ``python -m tests.tools.recording_victim FILE BLOCKS``.

Sample n of channel c holds the count (n * 7 + c) mod 30000. Says on a line of its own how many
samples are flushed, whenever there are more; "closing" before it closes.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from dearig.drivers.rig import Block, Event
from tests.tools.recordings import Clock, writer

BLOCK = 250


def pattern(start: int, samples: int) -> np.ndarray:
    n = np.arange(start, start + samples, dtype=np.int64)
    return np.array([(n * 7 + c) % 30000 for c in range(4)]).astype(np.int16)


def main(path: Path, blocks: int) -> None:
    clock = Clock()
    recorder = writer(path, now=clock)
    said = 0
    for i in range(blocks):
        clock.moment += 0.0625
        events = (Event(i * BLOCK, "info", f"block {i}"),) if i % 8 == 0 else ()
        recorder.append(Block(i * BLOCK, pattern(i * BLOCK, BLOCK), events))
        if recorder.samples_flushed > said:
            said = recorder.samples_flushed
            print(said, flush=True)
    print("closing", flush=True)
    recorder.close()


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]))
