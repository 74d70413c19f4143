"""One blind case: record it on the simulated rig, diagnose it by the public command, keep the JSON.

Nothing but the seed goes to the rig, nothing but recordings to the diagnosis, and nothing but its
JSON is read. What the rig hides is looked up afterwards, for the score.
"""

from __future__ import annotations

import hashlib
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from dearig.acquisition.run import RunOptions, record
from dearig.analysis.readings.record import Readings
from dearig.config.rigfile import load_rig_file
from dearig.config.sequencefile import load_sequence
from dearig.config.toml_input import read_text
from dearig.errors import DearigError
from dearig.model.readings.records import ActuatorRecord, counted
from dearig.recording import open_recording
from dearig.sim_backend.laser_noise import WHITE
from dearig.sim_backend.streams import Streams
from dearig.sim_backend.truth.cases import TruthCase, address_of
from tests.blind.seeds import clean_seeds, drawn

__all__ = [
    "MODES",
    "VALIDATION",
    "Bench",
    "Case",
    "case_of",
    "diagnose",
    "records_of",
    "sources_digest",
]

HERE = Path(__file__).parent
ROOT = HERE.parents[1]

#: Training sequences of each mode.
MODES = {"thesis": ("thesis",), "rich": ("thesis", "rich")}
#: Other amplitudes, other frequencies, and steps.
VALIDATION = ("validation-a-0.6", "validation-b-7.0", str(HERE / "ramped-steps.toml"))


_TIMEOUT = 900.0  # s: far beyond what any case may take; a hang must not end the row
_INTERRUPTED = 130


def sources_digest() -> str:
    """What results depend on: the sources of the model, the hidden effects and this test's rig."""
    digest = hashlib.sha256()
    paths = [
        *(p for folder in ("model", "sim_backend") for p in (ROOT / folder).rglob("*.py")),
        *HERE.glob("*.toml"),
        ROOT / "app" / "config" / "presets.py",
    ]
    for path in sorted(paths):
        digest.update(path.relative_to(ROOT).as_posix().encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


@dataclass(frozen=True)
class Case:
    """One seed in one mode, its effect drawn by a generator, its laser with a kind of noise."""

    seed: int
    mode: str
    generator: str = "first"
    noise: str = WHITE

    @property
    def truth(self) -> TruthCase:
        """What its rig hides."""
        return drawn(self.seed, self.generator, self.noise)

    @property
    def address(self) -> str:
        """Address of its rig."""
        return address_of(self.seed, self.generator, self.noise)


def case_of(result: Mapping[str, Any]) -> Case:
    """The case of a kept ``result``."""
    return Case(
        result["seed"], result["mode"], result.get("hand", "first"), result.get("noise", WHITE)
    )


class Bench:
    """A folder of results at one sample rate, with the rig file that made them.

    Parameters of a ``bare`` one have no intervals; its results are apart, as their times are.
    """

    def __init__(self, folder: Path, rate: float, bare: bool = False) -> None:
        self.bare = bare
        self.folder = folder / (f"{rate:g}Hz-bare" if bare else f"{rate:g}Hz")
        self.folder.mkdir(parents=True, exist_ok=True)
        self.rig_path = self.folder / "rig.toml"
        text = read_text(HERE / "rig.toml", "rig file")
        self.rig_path.write_text(
            f"{text}\n[card]\nsample_rate_Hz = {rate:.1f}\n", encoding="utf-8", newline="\n"
        )
        self._rig = load_rig_file(self.rig_path)
        self._floors: dict[str, float] = {}

    def floor_um(self, noise: str = WHITE) -> float:
        """RMS in um of what the rig's laser and card add, read from a film that hangs still."""
        if noise not in self._floors:
            still = clean_seeds(1)[0]
            with tempfile.TemporaryDirectory() as folder:
                path = Path(folder) / "quiet.h5"
                quiet = str(HERE / "quiet.toml")
                self._record(quiet, address_of(still, noise=noise), path, seed=0)
                reading = open_recording(path).signal
            self._floors[noise] = float(np.std(reading)) * 1e6
        return self._floors[noise]

    def own_um(self, case: Case) -> float:
        """RMS in um of what the validation recordings of ``case`` have each of their own."""
        rate, truth = float(self._rig.card.sample_rate_Hz), case.truth
        parts = []
        for i, name in enumerate(VALIDATION, start=len(MODES[case.mode])):
            time, voltage = load_sequence(name).sample(rate)
            # the film's own chance in the first run of the rig that ``record`` opens
            chance = Streams((i, case.seed)).before_run("film", 0)
            lead_in = int(np.argmax(voltage != 0.0))
            parts.append(counted(truth.of_one_run(time, voltage, chance), lead_in))
        return float(np.sqrt(np.mean(np.concatenate(parts) ** 2))) * 1e6

    def record(self, case: Case, folder: Path) -> tuple[list[Path], list[Path]]:
        """Training and validation recordings of ``case`` in ``folder``, each with its own noise."""
        names = [*MODES[case.mode], *VALIDATION]
        paths = [folder / f"{Path(name).name.removesuffix('.toml')}.h5" for name in names]
        for i, (name, path) in enumerate(zip(names, paths, strict=True)):
            self._record(name, case.address, path, seed=i)
        split = len(MODES[case.mode])
        return paths[:split], paths[split:]

    def play(self, case: Case) -> dict[str, Any]:
        """Record and diagnose ``case``; the result as it is kept."""
        sources = sources_digest()
        with tempfile.TemporaryDirectory(prefix="dearig-blind-") as name:
            folder = Path(name)
            try:
                train, validation = self.record(case, folder)
            except DearigError as fault:
                return self._kept(case, sources, None, f"not recorded: {fault}", 0.0)
            before = _processor_seconds()
            answer, error, seconds = diagnose(train, validation, folder / "out.json", self.bare)
        # of all cases that run at a time: true of one job only
        processor = _processor_seconds() - before
        return self._kept(case, sources, answer, error, seconds, processor)

    def _kept(
        self,
        case: Case,
        sources: str,
        answer: dict[str, Any] | None,
        error: str,
        seconds: float,
        processor: float = 0.0,
    ) -> dict[str, Any]:
        truth = case.truth
        time, voltage = load_sequence("thesis").sample(float(self._rig.card.sample_rate_Hz))
        result = {
            "seed": case.seed,
            "mode": case.mode,
            "hand": case.generator,
            "noise": case.noise,
            "sources": sources,
            "floor_um": self.floor_um(case.noise),
            "own_um": self.own_um(case),
            "truth": {
                "families": list(truth.families),
                "description": truth.description,
                "shown_by_monitor": [effect.seen for effect in truth.effects],
                "hidden_um": truth.size(time, voltage) * 1e6,
            },
            "wall_s": seconds,
            "processor_s": processor,
            "error": error,
            "diagnosis": answer,
        }
        self._path(case).write_text(json.dumps(result, indent=1), encoding="utf-8")
        return result

    def kept(self, case: Case, any_sources: bool) -> dict[str, Any] | None:
        """The result of ``case``, unless there is none or it is of other sources."""
        path = self._path(case)
        if not path.exists():
            return None
        result: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        return result if any_sources or self.is_fresh(result) else None

    def is_fresh(self, result: Mapping[str, Any]) -> bool:
        """Whether ``result`` is of the sources as they are now."""
        return bool(result["sources"] == sources_digest())

    def all_kept(self) -> list[dict[str, Any]]:
        """Every result in the folder, of whatever sources, by seed and mode."""
        found = [json.loads(p.read_text(encoding="utf-8")) for p in self.folder.glob("*-*.json")]
        return sorted(found, key=lambda r: (r["seed"], list(MODES).index(r["mode"])))

    def again(self) -> str:
        """How to play a case by hand, in words."""
        return (
            f"To look at one: dearig record SEQUENCE --rig sim:SEED --seed N --rig-file "
            f"{self.rig_path} --out FILE.h5 with N = 0, 1, .. for the training sequences and then "
            f"{', '.join(Path(name).name for name in VALIDATION)}; and dearig diagnose."
        )

    def _path(self, case: Case) -> Path:
        name = case.address.removeprefix("sim:").replace(":", "-")
        return self.folder / f"{case.mode}-{name}.json"

    def _record(self, sequence: str, rig: str, out: Path, seed: int) -> None:
        text = read_text(self.rig_path, "rig file")
        record(load_sequence(sequence), rig, self._rig, out, RunOptions(text, seed=seed))


def records_of(paths: Sequence[Path]) -> list[ActuatorRecord]:
    """Records of actuators at ``paths``, as a fit takes them."""
    records = [Readings(open_recording(path)).record for path in paths]
    return [r for r in records if isinstance(r, ActuatorRecord)]


def _processor_seconds() -> float:
    """Seconds of processors that ended child processes have taken; 0 on Windows."""
    times = os.times()
    return times.children_user + times.children_system


def diagnose(
    train: Sequence[Path],
    validation: Sequence[Path],
    out: Path,
    bare: bool = False,
    model: Path | None = None,
) -> tuple[dict[str, Any] | None, str, float]:
    """Run ``dearig diagnose``: its JSON, or None and what went wrong, and the seconds it took.

    With ``bare`` the intervals of parameters are left out. The model is written to ``model``.
    """
    program = ["tests.blind.bare"] if bare else ["dearig", "diagnose"]
    command = [sys.executable, "-m", *program, *map(str, train)]
    for path in validation:
        command += ["--validate", str(path)]
    command += ["--json", str(out)]
    if model is not None:
        command += ["--model-out", str(model)]
    started = time.perf_counter()
    try:
        ended = subprocess.run(
            command, cwd=ROOT, capture_output=True, text=True, timeout=_TIMEOUT, check=False
        )
    except subprocess.TimeoutExpired:
        return None, f"no answer within {_TIMEOUT:g} s", time.perf_counter() - started
    seconds = time.perf_counter() - started
    if ended.returncode == _INTERRUPTED:
        raise KeyboardInterrupt  # no result: ctrl-C goes to every process of the terminal
    if ended.returncode != 0 or not out.exists():
        said = ended.stderr.strip().splitlines() or ["nothing was said"]
        return None, f"exit code {ended.returncode}: {said[-1]}", seconds
    return json.loads(out.read_text(encoding="utf-8")), "", seconds
