"""Studies of many recordings: the same table wherever it is computed, and what it costs to fail."""

from __future__ import annotations

import csv
import json
import os
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import psutil
import pytest

from dearig.batch.engines import ClusterLost, DaskEngine, LocalEngine, engine_at
from dearig.batch.extremes import write_extremes
from dearig.batch.fits import StudyOptions, about, fit_task, key_of
from dearig.batch.studies import study_recordings, subjects_of, with_model
from dearig.errors import InputError
from dearig.model.verdict import REJECTED_BELOW
from dearig.recording import RunMetadata
from dearig.recording.reading.reader import open_recording
from dearig.recording.writing.save import save_recording
from tests.tools.command import dearig, done, names, refused, thesis_model
from tests.tools.played import Bench
from tests.tools.recordings import run_counts, write_run
from tests.tools.study_work import LightTask, work

ROOT = Path(__file__).resolve().parents[2]
FIRST, SECOND = "day 1/a.h5", "b.h5"


@pytest.fixture(scope="module")
def shelf(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with two recordings, one that is broken, and a model."""
    folder = tmp_path_factory.mktemp("shelf")
    (folder / "recordings" / "day 1").mkdir(parents=True)
    for i, name in enumerate((FIRST, SECOND)):
        write_run(folder / "recordings" / name, run_counts(400, quiet=100, seed=i), block=200)
    whole = (folder / "recordings" / SECOND).read_bytes()
    (folder / "recordings" / "broken.h5").write_bytes(whole[: len(whole) // 2])
    thesis_model(folder / "model.toml")
    return folder


@pytest.fixture
def options(shelf: Path) -> StudyOptions:
    return with_model(StudyOptions("validate"), shelf / "model.toml")


def rows(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def test_a_broken_recording_costs_its_row_and_nothing_is_computed_twice(
    shelf: Path, options: StudyOptions, tmp_path: Path
) -> None:
    computed = []

    def counted(task):
        computed.append(task.name)
        return fit_task(task)

    def table(options: StudyOptions = options):
        subjects = subjects_of([shelf / "recordings"], tmp_path)
        return study_recordings(subjects, options, tmp_path, LocalEngine(1, counted))

    (shelf / "recordings" / "moved.h5").symlink_to(shelf / "away.h5")
    with_lost = table()
    (shelf / "recordings" / "moved.h5").unlink()
    (lost,) = (row for row in with_lost.rows if row["recording"] == "moved.h5")
    assert (lost["state"], lost["reason"]) == ("failed", "moved.h5 is not there")
    computed.clear()
    shutil.rmtree(tmp_path / "cache")
    first = table()
    assert [(row["recording"], row["state"]) for row in first.rows] == [
        ("broken.h5", "failed"), (SECOND, "ok"), (FIRST, "ok")
    ]  # fmt: skip
    assert "broken.h5" in first.failed[0]["reason"]
    assert str(shelf) not in first.failed[0]["reason"]
    written = first.table.read_bytes()
    again = table()
    assert (again.cached, again.table.read_bytes()) == (2, written)
    assert sorted(computed) == sorted(["broken.h5", "broken.h5", FIRST, SECOND])
    # a number in the table is the number to its last digit
    found = {row["recording"]: row for row in rows(again.table)}
    assert found["broken.h5"]["rejected"] == ""
    for name in (FIRST, SECOND):
        likely = float(found[name]["misfit_p"])
        assert found[name]["rejected"] == str(likely < REJECTED_BELOW)
    assert [float(found[r["recording"]]["rms_um"]) for r in first.rows[1:]] == [
        r["rms_um"] for r in first.rows[1:]
    ]
    pandas = pytest.importorskip("pandas")
    pytest.importorskip("pyarrow")
    frame = pandas.read_parquet(again.parquet)
    assert list(frame["rms_um"].dropna()) == [row["rms_um"] for row in again.rows[1:]]
    assert set(frame["recording"]) == {"broken.h5", FIRST, SECOND}
    # other options are other rows
    assert table(replace(options, drive="monitor")).cached == 0


def test_cycles_of_a_study_are_those_of_a_lifetime_test(tmp_path: Path) -> None:
    """Also about a bias, where the voltage never falls below half of its peak."""
    voltage = np.r_[np.zeros(30), 4e3 - 1e3 * np.cos(2.0 * np.pi * np.arange(301) / 20), 0.0]
    values = {"time": np.arange(voltage.size) / 100.0, "voltage_command": voltage,
              "displacement": voltage * 1e-7}  # fmt: skip
    path = save_recording(tmp_path / "run.h5", "actuator", values, RunMetadata())
    assert about(open_recording(path))["cycles"] == 15
    assert write_extremes(path, tmp_path / "run.csv") == 15


def test_the_key_of_a_row_is_of_content_options_and_name(
    shelf: Path, options: StudyOptions, tmp_path: Path
) -> None:
    path = tmp_path / "b.h5"
    shutil.copy(shelf / "recordings" / SECOND, path)
    key = key_of(path, "b.h5", options)
    assert key == key_of(shelf / "recordings" / SECOND, "b.h5", options)
    raw = bytearray(path.read_bytes())
    raw[-1] ^= 1
    path.write_bytes(raw)
    others = {
        key_of(path, "b.h5", options),
        key_of(shelf / "recordings" / SECOND, "c.h5", options),
        key_of(shelf / "recordings" / SECOND, "b.h5", replace(options, branches=2)),
    }
    assert len(others | {key}) == 4


def test_a_worker_that_dies_costs_the_row_of_its_recording(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)  # workers import nothing from the working folder
    tasks = [LightTask(name) for name in ("a", "poison")]
    found = {task.name: row for task, row in LocalEngine(2, work).run(tasks)}
    assert {name: row["state"] for name, row in found.items()} == {
        "a": "ok", "poison": "failed"
    }  # fmt: skip
    assert "ended without a word" in found["poison"]["reason"]


def test_workers_end_with_the_process_that_began_them_also_when_it_is_killed(
    tmp_path: Path,
) -> None:
    began = subprocess.Popen(
        [sys.executable, "-m", "tests.tools.study_work"],
        cwd=tmp_path, env={**os.environ, "PYTHONPATH": str(ROOT)},
        stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    assert began.stdout is not None
    with began.stdout:
        workers = [psutil.Process(int(began.stdout.readline())) for _ in range(2)]
        began.kill()
        began.wait()
    _, alive = psutil.wait_procs(workers, timeout=60)
    assert not alive


def test_a_lost_cluster_leaves_the_rest_to_this_computer(
    shelf: Path, options: StudyOptions, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Lost:
        def run(self, tasks):
            yield tasks[0], fit_task(tasks[0])
            raise ClusterLost("the scheduler does not answer")

    monkeypatch.setattr("dearig.batch.studies.LocalEngine", lambda work: LocalEngine(1, work))
    subjects = subjects_of([shelf / "recordings"], tmp_path)
    table = study_recordings(subjects, options, tmp_path / "lost", Lost())
    whole = study_recordings(subjects, options, tmp_path / "whole", LocalEngine(1))
    assert "the scheduler does not answer" in table.moved
    assert table.table.read_bytes() == whole.table.read_bytes()


@pytest.mark.deep
@pytest.mark.filterwarnings("ignore")
def test_dask_gives_the_same_table(shelf: Path, options: StudyOptions, tmp_path: Path) -> None:
    distributed = pytest.importorskip("distributed", reason='takes the extra "cluster"')
    subjects = subjects_of([shelf / "recordings"], tmp_path)
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=2, processes=False, dashboard_address=None
    ) as cluster:
        engine = engine_at(f"dask:{cluster.scheduler_address}")
        assert isinstance(engine, DaskEngine)
        table = study_recordings(subjects, options, tmp_path / "dask", engine)
    here = study_recordings(subjects, options, tmp_path / "here", LocalEngine(1))
    assert table.table.read_bytes() == here.table.read_bytes()


def test_a_campaign_s_settings_are_columns_and_its_warm_up_is_left_out(bench: Bench) -> None:
    bench.play(
        'name = "three"\nsequence = "lobe.toml"\n[warm_up]\nruns = 1\n'
        '[grid]\n"segment.0.amplitude_kV" = [1.0, 2.0]\n'
    )
    found = subjects_of([bench.out], bench.folder / "study")
    assert [(s.name, dict(s.labels)) for s in found] == [
        (f"three-000{i}.h5", {"run": f"three-000{i}", "set segment.0.amplitude_kV": float(i)})
        for i in (1, 2)
    ]


def test_a_list_names_recordings_beside_it(shelf: Path, tmp_path: Path) -> None:
    chosen = shelf / "chosen.txt"
    chosen.write_text(f'# two of them\nrecordings/{SECOND}\n\n"recordings/{FIRST}"\n', "utf-8")
    assert [s.path for s in subjects_of([chosen], tmp_path)] == [
        shelf / "recordings" / SECOND, shelf / "recordings" / FIRST
    ]  # fmt: skip
    with pytest.raises(InputError, match="is given twice"):
        subjects_of([chosen, chosen], tmp_path)
    chosen.write_text(f"recordings/{FIRST}\n{shelf / 'recordings' / FIRST}\n", "utf-8")
    with pytest.raises(InputError, match="are one file"):
        subjects_of([chosen], tmp_path)


def test_an_interrupted_study_says_what_is_kept(
    shelf: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("dearig.batch.studies._compute", interrupted)
    out = tmp_path / "study"
    answer = dearig("study", shelf / "recordings", "--do", "identify", "--out", out)
    assert answer.code == 130
    assert f"are kept in {out}; the same command goes on from there" in answer.err


def test_the_command_from_recordings_to_its_table(shelf: Path, tmp_path: Path) -> None:
    out = tmp_path / "study"
    arguments = ["study", shelf / "recordings", "--do", "validate", "--out", out]
    refused(dearig(*arguments), "a validation needs a model file (--model")
    model = ["--model", shelf / "model.toml"]
    refused(dearig("study", tmp_path, "--do", "identify"), "there is no recording")
    refused(dearig("study", tmp_path / "no", "--do", "identify"), "is not there")
    refused(dearig(*arguments, *model, "--on", "dusk:x"), "write local, or dask:ADDRESS")
    assert names(tmp_path) == set()
    found = done(*arguments, *model, "--workers", "1", "--json", "-")
    assert found.json["format"] == "dearig-study-table/1"
    assert (found.json["recordings"], found.json["ok"], found.json["failed"]) == (3, 2, 1)
    assert {"study.csv", "cache"} <= names(out)
    assert json.loads(next((out / "cache").iterdir()).read_text("utf-8"))["row"]["state"] == "ok"


def test_a_study_without_any_result_is_no_success(tmp_path: Path) -> None:
    (tmp_path / "recordings").mkdir()
    for name in ("a.h5", "b.h5"):
        (tmp_path / "recordings" / name).write_bytes(b"\x89HDF\r\n\x1a\n" + bytes(100))
    out = tmp_path / "study"
    answer = dearig(
        "study", tmp_path / "recordings", "--do", "identify", "--out", out, "--workers", "1"
    )
    assert answer.code == 2
    assert "none of the 2 recordings has a result" in answer.err
    assert (out / "study.csv").exists()
