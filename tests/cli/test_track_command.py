"""The command that makes the film follow a displacement, from end to end."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.tools.command import (
    SLOW_RIG,
    dearig,
    done,
    film_model,
    names,
    refused,
    strict_json,
    thesis_model,
    write,
)
from tests.tools.targets import UP_AND_DOWN


@pytest.fixture
def files(tmp_path: Path) -> list[str | Path]:
    """A target, with the options for a model and a rig."""
    rig = write(tmp_path / "rig.toml", SLOW_RIG)
    model = thesis_model(tmp_path / "model.toml")
    target = write(tmp_path / "target.toml", UP_AND_DOWN)
    return [target, "--model", model, "--rig-file", rig]


def test_it_follows_learns_and_reports(files, tmp_path: Path) -> None:
    out = tmp_path / "out"
    answer = done(
        "track", *files, "--rig", "sim:8", "--out", out, "--iterations", "1", "--compare",
        files[2], "--json", "-",
    )  # fmt: skip
    found = answer.json
    assert found["format"] == "dearig-track/1"
    assert [run["kind"] for run in found["runs"]] == ["linear", "thesis", "model", "learned"]
    assert found["runs"][3]["rms_um"] < 0.5 * found["runs"][2]["rms_um"]
    assert found["status"] == "complete"
    assert {"report.html", "model.h5", "learned-1.toml", "learned-1.csv"} <= names(out)
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "Margins to the limits" in page
    assert "learned, iteration 1" in answer.err
    played_again = done(
        "record", out / "learned-1.toml", "--rig-file", files[4], "--out", tmp_path / "again.h5"
    )
    assert "finished" in played_again.out


def test_it_says_what_can_be_reached_and_touches_nothing(files, tmp_path: Path) -> None:
    before = names(tmp_path)
    answer = done("track", *files, "--check", "--json", "-")
    assert "the film can follow it, with up to" in answer.err
    assert answer.json["feasible"] is True
    assert answer.json["runs"] == []
    target = write(
        tmp_path / "fast.toml", UP_AND_DOWN.replace("duration_s = 5.0", "duration_s = 0.2")
    )
    refused(dearig("track", target, *files[1:], "--check"), "no voltage pushes it", "--nearest")
    refused(dearig("track", *files, "--within-um", "0.5", "--check"), "cannot be reached")
    assert names(tmp_path) - before == {"fast.toml"}


def test_an_early_end_keeps_what_was_done(files, tmp_path: Path) -> None:
    out, json = tmp_path / "out", tmp_path / "track.json"
    answer = dearig("track", *files, "--out", out, "--fault", "arc@1.2", "--json", json)
    assert answer.code == 3
    found = strict_json(json.read_text(encoding="utf-8"))
    assert found["status"] == "stopped"
    assert found["runs"] == []
    assert {"report.html", "model.h5"} <= names(out)


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"to_mm = 0.3": "to_kV = 3.0"}, "write to_mm"),
        ({"kind": "sort"}, "kind is missing"),
        ({"to_mm = 0.0": "to_mm = 0.1"}, "the run ends at 0 mm"),
    ],
)
def test_a_wrong_target_is_one_sentence(files, tmp_path: Path, changed, words) -> None:
    text = UP_AND_DOWN
    for old, new in changed.items():
        text = text.replace(old, new)
    target = write(tmp_path / "wrong.toml", text)
    refused(dearig("track", target, *files[1:], "--out", tmp_path / "out"), words)


def test_wrong_input_is_one_sentence(files, tmp_path: Path) -> None:
    out = ["--out", tmp_path / "out"]
    target, _, _, *rig = files
    refused(dearig("track", *files), "--out DIR is missing")
    refused(dearig("track", tmp_path / "none.toml", *files[1:], *out), "none.toml")
    film = film_model(tmp_path / "film.toml")
    refused(dearig("track", target, "--model", film, *rig, *out), "bare film")
    refused(dearig("track", *files, *out, "--rig", "simm"), "is not known")
    refused(dearig("track", *files, *out, "--fault", "flood@1", "--force"), "flood")


def test_the_example_of_a_target_can_be_followed(files, tmp_path: Path) -> None:
    example = tmp_path / "example.toml"
    assert "dearig track" in done("target-file", example).out
    assert "the film can follow it" in done("track", example, *files[1:], "--check").out
    refused(dearig("target-file", example), "exists")
