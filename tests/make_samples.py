"""The sample recordings under ``recordings/``: ``python -m tests.make_samples``.

The thesis's excitation on two simulated rigs, sampled slowly so that the files stay small: one is
the thesis's model, the other hides an effect.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path
from unittest.mock import patch

from dearig.recording.verify import verify
from tests.tools.command import done

FOLDER = Path(__file__).parents[1] / "recordings"
RIG = "[card]\nsample_rate_Hz = 200.0\n"
#: Name, rig and seed of each.
SAMPLES = (
    ("sample-plain.h5", "sim", "1"),
    ("sample-hidden-effect.h5", "sim:7", "2"),
)
#: Bytes that each may have, so that a checkout stays small.
LARGEST = 300_000


def make(folder: Path) -> list[Path]:
    """Record the samples to ``folder``, replacing what is there; returns where they are."""
    made = []
    with tempfile.TemporaryDirectory() as scratch, patch("platform.node", return_value="sample"):
        rig_file = Path(scratch) / "rig.toml"
        rig_file.write_text(RIG, encoding="utf-8")
        for name, rig, seed in SAMPLES:
            path = folder / name
            done(
                "record", "thesis", "--rig", rig, "--rig-file", rig_file, "--seed", seed,
                "--out", path, "--film", "none: simulated", "--notes",
                f"a sample: dearig record thesis --rig {rig} --seed {seed}, at 200 Hz", "--force",
            )  # fmt: skip
            made.append(path)
    return made


def main() -> None:
    for path in make(FOLDER):
        size, found = path.stat().st_size, verify(path)
        print(f"{path}: {size} bytes, {'sound' if found.sound else found.faults}")
        if size > LARGEST or not found.sound:
            sys.exit(1)


if __name__ == "__main__":
    main()
