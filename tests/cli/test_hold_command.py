"""The command that holds a displacement, from end to end."""

from __future__ import annotations

from pathlib import Path

import pytest

from dearig.recording import open_recording
from tests.tools.command import SLOW_RIG, dearig, done, names, refused, thesis_model, write


@pytest.fixture
def options(tmp_path: Path) -> list[str | Path]:
    """A model, a rig and a length."""
    rig = write(tmp_path / "rig.toml", SLOW_RIG)
    return ["--model", thesis_model(tmp_path / "model.toml"), "--rig-file", rig, "--for", "12s"]


def test_it_holds_says_how_well_and_records(options, tmp_path: Path) -> None:
    out = tmp_path / "held.h5"
    answer = done("hold", "0.3", *options, "--out", out, "--json", "-")
    assert answer.json["format"] == "dearig-hold/1"
    assert answer.json["settled_rms_um"] < 2.0 * answer.json["noise_floor_um"]
    assert answer.json["recording"] == str(out)
    assert "0.3000 mm were held for 12.0 s" in answer.err
    assert "feedback" in open_recording(out).provenance


def test_a_check_plays_nothing(options, tmp_path: Path) -> None:
    before = names(tmp_path)
    answer = done("hold", "0.3", *options, "--check", "--json", "-")
    assert answer.json["delay_s"] == pytest.approx(0.6)
    assert answer.json["voltage_kV"] < answer.json["highest_kV"]
    assert names(tmp_path) == before
    # on a card it says which limits apply, and that the model is of another film
    card = write(tmp_path / "card.toml", "[film]\nlength_mm = 60.0\n" + SLOW_RIG)
    answer = done(
        "hold", "0.2", *options[:2], "--rig-file", card, *options[4:], "--rig", "daqmx:Dev1",
        "--check",
    )  # fmt: skip
    assert "scaling and limits are those of rig file" in answer.out
    assert "length: 0.075 in the model, 0.06 in the rig file" in answer.out


def test_a_run_that_an_interlock_ends_has_its_exit_code(options, tmp_path: Path) -> None:
    out = tmp_path / "held.h5"
    answer = dearig("hold", "0.3", *options, "--out", out, "--fault", "sensor-stuck@6.0")
    assert answer.code == 3
    assert "no usable reading for 2 s" in answer.err
    command = open_recording(out).voltage_command
    assert command is not None
    assert command[-1] == pytest.approx(0.0, abs=1.0)


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        (("0.3", "--for", "soon"), "'soon' is not a time"),
        (("0.3", "--for", "-3s"), "is not a time"),
        (("0.3", "--for", "1h"), "600 s is allowed"),
        (("9", "--for", "1min"), "9 mm cannot be held"),
        (("0.3", "--ahead-s", "nan"), "ahead = nan s must be from"),
        (("0.3", "--fault", "flood@3"), "flood"),
    ],
)
def test_wrong_input_is_refused_with_a_sentence(options, asked, said, tmp_path: Path) -> None:
    refused(dearig("hold", *options, *asked, "--out", tmp_path / "held.h5"), said)


def test_a_run_needs_an_output(options) -> None:
    refused(dearig("hold", "0.3", *options), "--out FILE.h5 is missing")
