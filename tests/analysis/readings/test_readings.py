"""Readings: every file is opened once, and every recording inspected once."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dearig.analysis import diagnose as diagnosis
from dearig.analysis.readings import record
from dearig.analysis.readings.opening import open_all
from dearig.analysis.readings.record import Readings, read_all
from dearig.analysis.simulate import simulate_model
from dearig.analysis.study import StudyRequest, study
from dearig.analysis.summary import assess
from dearig.analysis.validate import validate_model
from dearig.config.modelfile import load_model, save_model
from dearig.errors import InputError
from dearig.model.film.material import TABLE_3, THESIS_FILM, THESIS_LOAD
from dearig.model.simulation.actuator import Actuator, Drive
from dearig.recording.content.metadata import RunMetadata
from dearig.recording.reading import reader
from dearig.recording.writing.save import save_recording
from tests.tools.command import done
from tests.tools.diagnosis import finding

MODEL = Actuator(THESIS_FILM, THESIS_LOAD, TABLE_3)
NAMES = ("a.h5", "b.h5", "c.h5")


def run(path: Path, seed: int) -> Path:
    """Record lobes of the thesis's film, with an outlier, after a quiet second."""
    time = np.arange(800) / 100.0
    volts = np.where(time < 1.0, 0.0, 6e3 * np.abs(np.sin(0.5 * np.pi * (time - 1.0))))
    moved = MODEL.simulate(Drive(time, volts)).displacement
    values = {
        "time": time,
        "voltage_command": volts,
        "voltage_monitor": volts + np.random.default_rng(seed + 10).normal(0.0, 1.0, 800),
        "displacement": moved + np.random.default_rng(seed).normal(0.0, 1e-6, 800),
    }
    values["displacement"][300] = 30e-3
    about = RunMetadata(title=path.stem, film=THESIS_FILM, load=THESIS_LOAD)
    return save_recording(path, "actuator", values, about)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("readings")
    for seed, name in enumerate(NAMES):
        run(folder / name, seed)
    save_model(folder / "model.toml", "Table 3", MODEL, {})
    return folder


@pytest.fixture
def opens(monkeypatch: pytest.MonkeyPatch) -> Counter[str]:
    """How often each recording was opened, by its name."""
    found: Counter[str] = Counter()
    read_from = reader.read_from

    def counted(path: Path, look: object) -> object:
        found[path.name] += 1
        return read_from(path, look)

    monkeypatch.setattr(reader, "read_from", counted)
    return found


@pytest.fixture
def inspected(monkeypatch: pytest.MonkeyPatch) -> Counter[str]:
    """How often each recording was inspected, by its name."""
    found: Counter[str] = Counter()
    inspect = record.inspect

    def counted(recording: object, moved: object) -> object:
        found[recording.path.name] += 1
        return inspect(recording, moved)

    monkeypatch.setattr(record, "inspect", counted)
    return found


@pytest.fixture
def searched(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """A search that ends immediately, with what it says about a voltage that is held."""
    found = replace(finding(), held=True)
    monkeypatch.setattr(diagnosis, "diagnose", lambda *_, **__: found)
    return


ONCE = dict.fromkeys(NAMES, 1)


def test_identify_opens_and_inspects_each_file_once(folder, opens, inspected, tmp_path):
    done(
        "identify", folder / "a.h5", folder / "b.h5", "--validate", folder / "c.h5",
        "--branches", "1", "--no-intervals", "--out", tmp_path / "m.toml",
    )  # fmt: skip
    assert opens == ONCE
    assert inspected == ONCE


def test_validate_opens_and_inspects_each_file_once(folder, opens, inspected):
    done("validate", folder / "model.toml", *(folder / name for name in NAMES))
    assert opens == ONCE
    assert inspected == ONCE


@pytest.mark.usefixtures("searched")
def test_diagnose_opens_and_inspects_each_file_once(folder, opens, inspected):
    done(
        "diagnose", folder / "a.h5", folder / "b.h5", "--validate", folder / "c.h5"
    )  # fmt: skip
    assert opens == ONCE
    assert inspected == ONCE


def test_a_study_opens_and_inspects_each_file_once(folder, opens, inspected, tmp_path):
    task = StudyRequest(False, (folder / "a.h5",), (folder / "b.h5",), branches=1)
    study(task, tmp_path, lambda *_: None)
    assert opens == inspected == {"a.h5": 1, "b.h5": 1}


def test_an_assessment_opens_its_file_once(folder, opens, inspected):
    assert assess(folder / "a.h5", None).errors is not None
    assert opens == inspected == {"a.h5": 1}


def test_what_was_found_of_one_recording_is_kept(folder):
    readings = Readings(*open_all([folder / "a.h5"]))
    assert readings.quality is readings.quality
    assert readings.record is readings.record
    assert not readings.quality.valid[300]


def test_holding_the_voltage_changes_the_drive_alone(folder):
    readings = Readings(*open_all([folder / "a.h5"]))
    linear = readings.record
    held = readings.held()
    assert held.quality is readings.quality
    assert held.noise is readings.noise
    assert (linear.drive.hold, held.record.drive.hold) == (False, True)
    assert held.recording.sha256 == readings.recording.sha256


@pytest.mark.deep
@pytest.mark.usefixtures("searched")
def test_a_model_carries_that_its_voltage_was_taken_as_held(folder, tmp_path):
    out = tmp_path / "held.toml"
    done("diagnose", folder / "a.h5", "--validate", folder / "c.h5", "--model-out", out)
    given = load_model(out)
    assert given.assumes_held_voltage
    held = validate_model(given, [folder / "c.h5"]).comparisons[0]
    linear = validate_model(replace(given, history={}), [folder / "c.h5"]).comparisons[0]
    drive = Readings(*open_all([folder / "c.h5"])).held().voltage
    expected = given.model.simulate(drive).displacement
    assert np.ptp(held.model - expected) == pytest.approx(0.0, abs=1e-12)
    assert np.ptp(linear.model - expected) > 1e-7
    # and so does what it predicts
    assert simulate_model(given, folder / "c.h5").hold
    assert not simulate_model(replace(given, history={}), folder / "c.h5").hold


def test_each_drive_is_inspected_for_itself(folder):
    (recording,) = open_all([folder / "a.h5"])
    command, monitor = Readings(recording), Readings(recording, "monitor")
    assert command.moved_by is recording.voltage_command
    assert monitor.moved_by is recording.voltage_monitor
    assert np.ptp(command.voltage.voltage[:90]) == 0.0
    assert np.ptp(monitor.voltage.voltage[:90]) > 0.0


def test_readings_that_were_made_are_used_again(folder):
    first, _ = read_all([folder / "a.h5"])
    both, said = read_all([*first, folder / "b.h5"])
    assert both[0] is first[0]
    assert both[1].name == "b"
    assert said == []
    with pytest.raises(InputError, match="is given twice"):
        read_all([*first, folder / "a.h5"])


def test_a_model_in_memory_validates_what_is_open(folder, opens):
    recordings = open_all([folder / name for name in NAMES])
    validate_model(folder / "model.toml", recordings)
    assert opens == ONCE
