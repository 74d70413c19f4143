"""Thirty reports of simulated rigs, of varied kinds, each read for contradictions by a script.

    python -m tests.blind.reports --out DIR               makes what is missing in DIR, and reads it
    python -m tests.blind.reports --out DIR --only read   reads what is there
    python -m tests.blind.reports --out DIR --first 5000  rigs of other seeds

Each report is made by the public commands, in processes of their own: the recordings, the
terminal's text, the JSON, the page and the model. ``contradictions`` says what is looked for.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
from dataclasses import dataclass
from itertools import count
from pathlib import Path

from dearig.sim_backend.truth.cases import address_of
from tests.blind.contradictions import contradictions_in
from tests.blind.play import HERE, VALIDATION
from tests.blind.seeds import drawn, kind_of

_SHORT = """\
name = "short"
[[segment]]
kind = "half_sine"
amplitude_kV = 7.0
frequency_Hz = 0.5
repeats = 2
"""
_FIRST = 400000  # no other row of seeds begins here


@dataclass(frozen=True)
class Kind:
    """A kind of report: what its rig hides, and the commands' arguments.

    ``hides`` is a kind of case; ``nth`` the how manieth from the first seed on. Without
    ``channels`` the recordings are a table of time, voltage and displacement, imported.
    """

    name: str
    hides: str
    nth: int = 0
    generator: str = "first"
    noise: str = "white"
    train: tuple[str, ...] = ("thesis",)
    validation: tuple[str, ...] = VALIDATION
    arguments: tuple[str, ...] = ()
    channels: bool = True
    command: str = "diagnose"

    def seed(self, first: int) -> int:
        """Return the seed of its rig, from ``first`` on."""
        hits = (s for s in count(first) if kind_of(drawn(s, self.generator).families) == self.hides)
        return [next(hits) for _ in range(self.nth + 1)][-1]


_SHORT_RUN = ("short.toml",)
KINDS = (
    Kind("clean", "clean"),
    Kind("clean-alone", "clean", 1, validation=()),
    Kind("clean-coarse", "clean", 2, noise="coarse"),
    Kind("clean-short", "clean", 3, train=_SHORT_RUN, validation=("validation-a-0.6",)),
    *(Kind(f"one-{i}", "covered", i) for i in range(7)),
    *(Kind(f"pair-{i}", "pair", i) for i in range(4)),
    *(Kind(f"unknown-{i}", "unknown", i) for i in range(2)),
    *(Kind(f"other-{i}", "covered", i, "second") for i in range(4)),
    Kind("other-pair", "pair", 0, "second"),
    Kind("other-rich", "covered", 5, "second", train=("thesis", "rich")),
    Kind("alone", "covered", 8, validation=()),
    Kind("short", "covered", 9, train=_SHORT_RUN, validation=("validation-b-7.0",)),
    Kind("prior", "covered", 10, arguments=("--fix", "mu_3_kPa=20", "--prior", "mu_0_kPa=46+-2")),
    Kind("no-channels", "covered", 11, channels=False),
    Kind("identify-clean", "clean", 4, command="identify"),
    Kind("identify-hidden", "covered", 12, command="identify"),
    Kind("identify-short", "clean", 5, train=_SHORT_RUN, command="identify", validation=()),
    Kind(
        "identify-prior", "pair", 5, command="identify",
        arguments=("--bound", "T_1_s=0.1..0.5", "--prior", "mu_0_kPa=46+-2"),
    ),
)  # fmt: skip


def main() -> None:
    """Make the reports, and print what contradicts itself in each."""
    parser = argparse.ArgumentParser(
        prog="python -m tests.blind.reports",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--out", type=Path, required=True, help="folder of the reports")
    parser.add_argument("--first", type=int, default=_FIRST, help=f"first seed [{_FIRST}]")
    parser.add_argument("--only", choices=("make", "read"), help="make, or read what is there")
    parser.add_argument("--kinds", default="", help="these kinds, such as clean,pair-0 [all]")
    given = parser.parse_args()
    wanted = [k for k in KINDS if not given.kinds or k.name in given.kinds.split(",")]
    found = 0
    for kind in wanted:
        folder = given.out / kind.name
        if given.only != "read" and not (folder / "said.txt").exists():
            make(kind, given.first, folder)
        if given.only == "make" or not (folder / "said.txt").exists():
            continue
        for text in contradictions_in(folder):
            found += 1
            print(f"{kind.name}: {text}", flush=True)
    print(f"{found} contradictions")


def make(kind: Kind, first: int, folder: Path) -> None:
    """Record the rig of ``kind`` and make its report in ``folder``."""
    folder.mkdir(parents=True, exist_ok=True)
    rig_file = folder / "rig.toml"
    rig_file.write_text(
        (HERE / "rig.toml").read_text(encoding="utf-8") + "\n[card]\nsample_rate_Hz = 200.0\n"
    )
    (folder / "short.toml").write_text(_SHORT, encoding="utf-8")
    seed = kind.seed(first)
    address = address_of(seed, kind.generator, kind.noise)
    case = drawn(seed, kind.generator, kind.noise)
    (folder / "hidden.txt").write_text(
        f"{address}: {case.description or 'nothing'}\n", encoding="utf-8"
    )
    paths = []
    for i, name in enumerate((*kind.train, *kind.validation)):
        sequence = str(folder / name) if name in _SHORT_RUN else name
        path = folder / f"{Path(name).name.removesuffix('.toml')}.h5"
        _run(folder, "record", sequence, "--rig", address, "--rig-file", str(rig_file),
             "--seed", str(i), "--out", str(path))  # fmt: skip
        paths.append(path if kind.channels else _stripped(path, folder))
    train, validation = paths[: len(kind.train)], paths[len(kind.train) :]
    arguments = [*map(str, train), *kind.arguments, "--rig-file", str(rig_file)]
    for path in validation:
        arguments += ["--validate", str(path)]
    model = "--out" if kind.command == "identify" else "--model-out"
    outputs = {"--json": "said.json", "--report": "said.html", model: "model.toml"}
    for option, name in outputs.items():
        arguments += [option, str(folder / name)]
    said = _run(folder, kind.command, *arguments)
    (folder / "said.txt").write_text(said, encoding="utf-8")


def _stripped(path: Path, folder: Path) -> Path:
    """Return the recording at ``path`` without its electrical channels, imported from a table."""
    import pandas

    table = path.with_suffix(".csv")
    _run(folder, "export", str(path), "--to", "csv", "--out", str(table))
    columns = pandas.read_csv(table, comment="#")
    bare = path.with_name(f"{path.stem}-bare.csv")
    columns[["time_s", "voltage_V", "displacement_m"]].to_csv(bare, index=False)
    out = bare.with_suffix(".h5")
    _run(folder, "import", str(bare), "--out", str(out))
    return out


def _run(folder: Path, *arguments: str) -> str:
    """Run ``dearig``; return what it prints. Raise RuntimeError where it fails."""
    ended = subprocess.run(
        [sys.executable, "-m", "dearig", *arguments],
        capture_output=True, text=True, check=False, env={**os.environ, "COLUMNS": "120"},
    )  # fmt: skip
    if ended.returncode != 0:
        raise RuntimeError(f"{folder.name}: {' '.join(arguments)}: {ended.stderr[-800:]}")
    return ended.stdout + ended.stderr


if __name__ == "__main__":
    main()
