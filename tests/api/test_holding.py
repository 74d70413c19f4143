"""A displacement that is held, as a notebook asks for it."""

from __future__ import annotations

import json

import numpy as np
import pytest

import dearig
from tests.tools.command import film_model, thesis_model

from .conftest import SLOW_RIG


@pytest.fixture(scope="module")
def model(tmp_path_factory):
    return thesis_model(tmp_path_factory.mktemp("model") / "model.toml")


@pytest.fixture(scope="module")
def result(model, tmp_path_factory):
    out = tmp_path_factory.mktemp("held") / "held.h5"
    return dearig.hold(0.4, model, seconds=15.0, out=out, rig_file=SLOW_RIG)


def test_it_is_held_within_the_noise(result):
    noise = result.outcome.noise
    assert result.outcome.settled_rms == pytest.approx(noise, rel=0.3)
    assert result.rms_um < 2e6 * noise
    displacement = result.recording.displacement
    held = displacement[round(4.0 * 200.0) : round(19.0 * 200.0)]
    assert np.mean(held) == pytest.approx(0.4e-3, abs=0.3e-6)
    assert result.recording.displacement_model is not None


def test_a_result_shows_and_saves_itself(result, tmp_path):
    numbers = json.loads(result.save(tmp_path / "hold.json").read_text(encoding="utf-8"))
    assert numbers["format"] == "dearig-hold/1"
    assert numbers["feedback"]["delay_s"] == pytest.approx(0.6)
    assert len(numbers["minutes"]) == 1
    assert "0.4000 mm were held for 15.0 s" in repr(result)
    assert "<svg" in result._repr_html_()
    assert "<html" in result.to_html(tmp_path / "hold.html").read_text(encoding="utf-8")
    with pytest.raises(dearig.InputError, match=r"end the name in \.json"):
        result.save(tmp_path / "hold.txt")


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"displacement_mm": -0.4}, "must be above 0"),
        ({"displacement_mm": float("nan")}, "must be above 0"),
        ({"displacement_mm": 5.0}, "more than the highest voltage"),
        ({"seconds": 3.0}, "must last from 10 s"),
        ({"options": dearig.HoldOptions(authority=0.7)}, "authority = 70 % must be from 0.1 to"),
        ({"faults": ["flood@3"]}, "flood"),
    ],
)
def test_what_cannot_be_held_is_refused(model, tmp_path, wrong, said):
    asked = {"displacement_mm": 0.4, "seconds": 15.0, "rig_file": SLOW_RIG, **wrong}
    with pytest.raises(dearig.InputError, match=said):
        dearig.hold(model=model, out=tmp_path / "held.h5", **asked)
    assert not list(tmp_path.iterdir())


def test_a_bare_film_cannot_be_held(tmp_path):
    film = film_model(tmp_path / "film.toml")
    with pytest.raises(dearig.InputError, match="bare film"):
        dearig.hold(0.4, film, seconds=15.0, out=tmp_path / "held.h5")
