"""Every reader of files: good files to begin with, and what is done with a file."""

from __future__ import annotations

import io
import json
import random
import tempfile
import zipfile
import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np
from nptdms import ChannelObject, TdmsWriter
from openpyxl import Workbook
from scipy.io import savemat

from dearig.batch.queue import CampaignOutcome, Queue
from dearig.config.campaignfile import EXAMPLE as CAMPAIGN
from dearig.config.campaignfile import load_campaign
from dearig.config.modelfile import load_model
from dearig.config.presets import PRESETS
from dearig.config.rigfile import load_rig_file, write_default
from dearig.config.sequencefile import load_sequence
from dearig.config.targetfile import EXAMPLE, load_target
from dearig.drivers.rig import Block
from dearig.recording import (
    RunMetadata,
    export_recording,
    open_recording,
    recover,
    save_recording,
)
from dearig.recording.content.journal import HEAD, MAGIC, PAGE, PIECE
from dearig.recording.importers.columns.choose import choose
from dearig.recording.importers.columns.specimen import Specimen
from dearig.recording.importers.columns.values import values_of
from dearig.recording.importers.registry import source_at
from dearig.report.pages.campaign import campaign_json, campaign_summary, campaign_table
from tests.fuzz.mutate import mutated_bytes, mutated_hdf5, mutated_text
from tests.tools.command import LOBE, film_model, thesis_model
from tests.tools.recordings import Clock, run_counts, write_run, writer

__all__ = ["TARGETS", "Target"]

Mutate = Callable[[random.Random, Sequence[bytes]], bytes]


@dataclass(frozen=True)
class Target:
    """One reader: the ending of its files, good ones, how they are damaged, and the reading.

    ``share`` of all inputs are for it.
    """

    suffix: str
    seeds: Callable[[Path], list[bytes]]
    mutate: Mutate
    read: Callable[[Path], object]
    share: float


def read_recording(path: Path) -> None:
    recording = open_recording(path)
    for name in recording.values:
        recording.overview(name, 10)
        recording.window(name, 3, 9)


def read_table(path: Path) -> None:
    chosen = choose(source_at(path), {}, {}, timed=False)
    values_of(chosen, Specimen(80.0, 22.0), None, skip_bad_rows=False)


def recordings(folder: Path) -> list[bytes]:
    run, killed = folder / "run.h5", folder / "killed.h5"
    write_run(run, run_counts(200, quiet=100), block=100)
    recorder = writer(folder / "other.h5")
    recorder.append(Block(0, run_counts(150, quiet=50)))
    recorder._flush_all(1.8e9)
    killed.write_bytes((folder / "other.h5").read_bytes())
    recorder.close()
    time = np.linspace(0.0, 1.0, 50)
    film = save_recording(
        folder / "film.h5", "film", {"time": time, "stretch": 1 + time, "nominal_stress": time},
        RunMetadata(title="film"), now=Clock(),
    )  # fmt: skip
    return [path.read_bytes() for path in (run, killed, film)]


def exported(to: str) -> Callable[[Path], list[bytes]]:
    def made(folder: Path) -> list[bytes]:
        run = folder / "run.h5"
        write_run(run, run_counts(60, quiet=30), block=30)
        seeds = [export_recording(run, to, folder / f"run.{to}").read_bytes()]
        n = np.arange(20.0)
        if to == "csv":
            seeds += [
                b"time_s,stretch,nominal_stress_kPa\n0,1,0\n1,1.1,10\n3,1.2,20\n",
                b"# comment\ntime_s;voltage_kV;displacement_um\n0,0;0;0\n0,5;1;2\n1,0;2;3\n",
                b"time_s\tforce_N\tdisplacement_mm\n0\t1\t2\n1\t2\t3\n",
            ]
        if to == "mat":
            path = folder / "plain.mat"
            content = {"time_s": n, "rig": {"voltage_kV": n, "c": [1, "a"]}, "displacement_m": n}
            savemat(path, content)
            seeds.append(path.read_bytes())
        return seeds

    return made


def tdms_files(folder: Path) -> list[bytes]:
    n = np.arange(20.0)
    first, second = folder / "a.tdms", folder / "b.tdms"
    with TdmsWriter(str(first)) as file:
        for name in ("time_s", "voltage_V", "displacement_mm"):
            file.write_segment([ChannelObject("g", name, n)])
    timing = {"wf_increment": 0.1, "wf_start_offset": 0.0}
    with TdmsWriter(str(second)) as file:
        file.write_segment(
            [ChannelObject("g", c, n.astype(t), timing)
             for c, t in (("voltage_kV", "f4"), ("displacement_um", "i2"))]
        )  # fmt: skip
    return [first.read_bytes(), second.read_bytes()]


def workbooks(folder: Path) -> list[bytes]:
    book = Workbook()
    for row in (("Zeit", "Spannung", "Weg"), ("s", "kV", "mm"), *([i, i, i] for i in range(20))):
        book.active.append(row)
    book.save(folder / "a.xlsx")
    return [(folder / "a.xlsx").read_bytes()]


def mutated_workbook(rng: random.Random, seeds: Sequence[bytes]) -> bytes:
    """Return a workbook with another text in one of its parts."""
    with zipfile.ZipFile(io.BytesIO(rng.choice(seeds))) as archive:
        parts = {name: archive.read(name) for name in archive.namelist()}
    name = rng.choice([n for n in parts if n.startswith("xl/") and "theme" not in n])
    parts[name] = mutated_text(rng, [parts[name]])
    made = io.BytesIO()
    with zipfile.ZipFile(made, "w") as archive:
        for part, content in parts.items():
            archive.writestr(part, content)
    return made.getvalue()


def json_files(folder: Path) -> list[bytes]:
    names, n = ("time_s", "voltage_V", "displacement_mm"), list(range(20))
    rows = [dict.fromkeys(names, i) for i in n]
    contents = (
        {"run": dict.fromkeys(names, n), "fs": 100}, rows,
        {"columns": names, "data": [[1, 2, 3]] * 9},
        [{"name": name, "unit": "s", "data": n} for name in names],
    )  # fmt: skip
    return [
        *(json.dumps(c).encode() for c in contents),
        b"\n".join(json.dumps(r).encode() for r in rows),
    ]


def other_hdf5(folder: Path) -> list[bytes]:
    with h5py.File(folder / "a.h5", "w") as file:
        file.attrs["default"] = "scan"
        for name in ("time_s", "voltage_V", "displacement_mm"):
            file[f"scan/{name}"] = np.arange(20.0)
            file[f"scan/{name}"].attrs["units"] = name.rpartition("_")[2]
        file["log"] = np.ones((20, 3))
        file["table"] = np.ones(20, dtype=[("time_s", "f8"), ("x", "f4", (2,))])
    return [(folder / "a.h5").read_bytes()]


def sequences(folder: Path) -> list[bytes]:
    return [LOBE.encode(), *(text.encode() for text in PRESETS.values())]


def paths(folder: Path) -> list[bytes]:
    return [EXAMPLE.encode(), LOBE.replace("kV", "mm").encode()]


def plans(folder: Path) -> list[bytes]:
    listed = '[[run]]\nsequence = "rich"\nrepeat = 2\n[run.set]\ntail_s = 2.0\n'
    return [CAMPAIGN.encode(), f'name = "a"\nsequence = "thesis"\n{listed}'.encode()]


def read_plan(path: Path) -> None:
    plan = load_campaign(path)
    plan.load(plan.runs[-1])


def journals(folder: Path) -> list[bytes]:
    at = {"at": "2026-11-27T10:00:00.000+00:00"}
    run = {"name": "a", "sequence_sha256": "0", "duration_s": 1.5, "settings": {}, "warm_up": False}
    entries = [
        {"event": "planned", "format": "dearig-campaign-journal/1", "name": "n", "rig": "sim",
         "plan_sha256": "1", "rig_file_sha256": "2", "rest_s": 0.5, "repeat_lost": 1,
         "runs": [run, run | {"name": "b"}]},
        {"event": "armed", "by": "Ada", "rig": "sim", "runs": 2, "until": 1.8e9},
        {"event": "request", "number": 1, "what": "first", "run": "b", "by": ""},
        {"event": "started", "run": "b", "attempt": 1, "recording": "b.h5"},
        {"event": "recorded", "run": "b", "recording": "b.h5", "output": "confirmed"},
        {"event": "ended", "run": "b", "state": "done", "reason": "", "recording": "b.h5",
         "numbers": {"mu_0_kPa": 45.0}, "model": "models/b.toml"},
        {"event": "halted", "reason": "arc"},
        {"event": "session-ended", "status": "halted", "reason": "arc"},
    ]  # fmt: skip
    return [b"".join(json.dumps(at | entry).encode() + b"\n" for entry in entries)]


def read_journal(path: Path) -> None:
    queue = Queue.of(path)
    if queue.runs:
        outcome = CampaignOutcome(queue.name, path.parent, queue, queue.status, queue.reason)
        json.dumps(campaign_json(outcome), allow_nan=False)
        campaign_table(outcome)
        campaign_summary(outcome)


def sidecars(folder: Path) -> list[bytes]:
    """Journals of the first recording, with one page and with two."""
    content = recordings(folder)[0]
    size, found = len(content), []
    for count in (1, 2):
        parts = [HEAD.pack(MAGIC, size, size, count)]
        for at in range(0, count * PAGE, PAGE):
            old = content[at : at + PAGE]
            parts += [PIECE.pack(at, len(old)), old, old]
        whole = b"".join(parts)
        found.append(whole + zlib.crc32(whole).to_bytes(4, "little"))
    return found


def read_beside(path: Path) -> None:
    """Read and recover the recording that the journal at ``path`` is beside."""
    recording = path.with_suffix("")
    if not recording.exists():
        recording.write_bytes(seeds_of("recordings")[0])
    open_recording(recording)
    recover(recording)


def rig_files(folder: Path) -> list[bytes]:
    write_default(folder / "rig.toml")
    return [(folder / "rig.toml").read_bytes(), b"[card]\nsample_rate_Hz = 200.0\n"]


def models(folder: Path) -> list[bytes]:
    return [
        thesis_model(folder / "thesis.toml").read_bytes(),
        film_model(folder / "film.toml").read_bytes(),
    ]


TARGETS: dict[str, Target] = {
    "sequences": Target(".toml", sequences, mutated_text, load_sequence, 0.2),
    "paths": Target(".toml", paths, mutated_text, load_target, 0.01),
    "plans": Target(".toml", plans, mutated_text, read_plan, 0.05),
    "journals": Target(".jsonl", journals, mutated_text, read_journal, 0.05),
    "sidecars": Target(".h5.journal", sidecars, mutated_bytes, read_beside, 0.05),
    "rig files": Target(".toml", rig_files, mutated_text, load_rig_file, 0.12),
    "model files": Target(".toml", models, mutated_text, load_model, 0.2),
    "CSV": Target(".csv", exported("csv"), mutated_text, read_table, 0.2),
    "MAT": Target(".mat", exported("mat"), mutated_bytes, read_table, 0.2),
    "Parquet": Target(".parquet", exported("parquet"), mutated_bytes, read_table, 0.03),
    "TDMS": Target(".tdms", tdms_files, mutated_bytes, read_table, 0.03),
    "workbooks": Target(".xlsx", workbooks, mutated_workbook, read_table, 0.02),
    "JSON": Target(".json", json_files, mutated_text, read_table, 0.1),
    "HDF5 of others": Target(".hdf5", other_hdf5, mutated_hdf5, read_table, 0.02),
    "recordings": Target(".h5", recordings, mutated_hdf5, read_recording, 0.01),
}


def seeds_of(name: str) -> list[bytes]:
    """Good files of a target."""
    with tempfile.TemporaryDirectory() as made:
        return TARGETS[name].seeds(Path(made))
