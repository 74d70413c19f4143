"""A displacement that is followed, as a notebook asks for it."""

from __future__ import annotations

import json

import numpy as np
import pytest

import dearig
from tests.tools.command import film_model, thesis_model

from .conftest import SLOW_RIG

TIME = np.array([0.0, 1.0, 1.5, 4.0, 8.0])
PATH = np.array([0.0, 0.3, 0.3, 0.04, 0.0]) * 1e-3


@pytest.fixture(scope="module")
def model(tmp_path_factory):
    return thesis_model(tmp_path_factory.mktemp("model") / "model.toml")


@pytest.fixture(scope="module")
def result(model, tmp_path_factory):
    out = tmp_path_factory.mktemp("tracked") / "out"
    return dearig.track((TIME, PATH), model, out=out, rig_file=SLOW_RIG, iterations=1, nearest=True)


def test_arrays_become_a_voltage(model, tmp_path):
    found = dearig.invert(dearig.Model.open(model), (TIME, PATH), rig_file=SLOW_RIG)
    held = (found.time > 3.3) & (found.time < 3.4)  # after the lead-in of 2 s
    np.testing.assert_allclose(found.response[held], 0.3e-3, atol=1e-6)
    assert found.voltage[0] == found.voltage[-1] == 0.0
    assert "kV" in repr(found)
    assert "<svg" in found._repr_html_()
    table = found.save(tmp_path / "voltage.csv")
    assert table.read_text(encoding="utf-8").startswith("time_s,voltage_V\n")
    with pytest.raises(dearig.InputError, match=r"end the name in \.csv"):
        found.save(tmp_path / "voltage.txt")


def test_what_cannot_be_reached_is_in_the_result(model):
    found = dearig.invert(model, (TIME, 3.0 * PATH), rig_file={"limits": {"voltage_max_kV": 3.0}})
    assert not found.feasible
    assert "voltage" in {part.cause for part in found.unreachable}
    assert "not reachable" in found._repr_html_()


def test_runs_have_errors_recordings_and_a_report(result, tmp_path):
    assert [run.kind for run in result.runs] == ["model", "learned"]
    assert result.best.signal.size == result.runs[0].time.size
    numbers = json.loads(result.save(tmp_path / "track.json").read_text(encoding="utf-8"))
    assert numbers["format"] == "dearig-track/1"
    assert "<html" in result.to_html(tmp_path / "track.html").read_text(encoding="utf-8")
    assert "um RMS" in repr(result).replace("µ", "u")
    assert "<svg" in result._repr_html_()
    assert result.plot("errors") is not None
    with pytest.raises(dearig.InputError, match="what can is runs, errors"):
        result.plot("everything")


@pytest.mark.parametrize(
    ("time", "path", "words"),
    [
        ([0.0, 1.0], [0.0, 1e-4], "ends at 0.1 mm but the run ends at 0 mm"),
        ([0.0, 1.0, 0.5], [0.0, 1e-4, 0.0], "time does not increase"),
        ([0.0, 1.0], [0.0, np.nan], "is not a finite number"),
    ],
)
def test_arrays_that_are_no_path_are_refused(model, time, path, words):
    with pytest.raises(dearig.InputError, match=words):
        dearig.invert(model, (np.array(time), np.array(path)))


def test_a_bare_film_is_refused(tmp_path):
    with pytest.raises(dearig.InputError, match="a voltage does not move"):
        dearig.invert(film_model(tmp_path / "film.toml"), (TIME, PATH))
