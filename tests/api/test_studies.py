"""Studies of many recordings and their trends, as a notebook uses them."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest

import dearig
from tests.tools import command


@pytest.fixture(scope="module")
def table(run, fit) -> dearig.StudyResult:
    return dearig.study(run, "validate", model=fit, workers=1)


def _rows(runs: int = 24) -> list[dict[str, object]]:
    """Return a made table: a modulus falls by 2 % per degree, in both of two films alike."""
    rng = np.random.default_rng(5)
    warm = rng.uniform(20.0, 30.0, runs)
    values = 50.0 * np.exp(-0.02 * (warm - 25.0) + 1e-4 * rng.standard_normal(runs))
    return [
        {
            "recording": f"r{i:02d}", "state": "ok", "film": f"F{i % 2}",
            "started": f"2026-01-01T{i:02d}:00:00+00:00",
            "temperature_degC": float(t), "mu_0_kPa": float(v),
            "mu_0_kPa_low95": float(0.999 * v), "mu_0_kPa_high95": float(1.001 * v),
        }
        for i, (t, v) in enumerate(zip(warm, values, strict=True))
    ]  # fmt: skip


def test_a_study_has_the_row_that_the_command_writes(run, fit, table, tmp_path: Path) -> None:
    model = fit.save(tmp_path / "model.toml")
    answer = command.dearig(
        "study", run.path, "--do", "validate", "--model", model, "--workers", "1",
        "--out", tmp_path / "out",
    )  # fmt: skip
    assert answer.code == 0
    with (tmp_path / "out" / "study.csv").open(encoding="utf-8") as file:
        (theirs,) = csv.DictReader(file)
    (mine,) = table.rows
    assert mine["film"] == theirs["film"] == "F7"
    assert mine["rms_um"] == float(theirs["rms_um"])
    assert table.failed == ()


def test_a_study_shows_saves_and_plots_itself(table, tmp_path: Path) -> None:
    assert "1 recording." in repr(table)
    assert "F7" in table._repr_html_()
    assert table.to_pandas().loc[table.rows[0]["recording"], "film"] == "F7"
    assert table.plot("rms_um").axes[0].get_ylabel()
    numbers = json.loads(table.save(tmp_path / "t.json").read_text(encoding="utf-8"))
    assert numbers["format"] == "dearig-study-table/1"
    assert "rms_um" in table.save(tmp_path / "t.csv").read_text(encoding="utf-8")
    assert "<html" in table.to_html(tmp_path / "t.html").read_text(encoding="utf-8")
    with pytest.raises(dearig.InputError, match=r"end the name in \.csv"):
        table.save(tmp_path / "t.txt")
    with pytest.raises(dearig.InputError, match=r"'mu_9' is not a number of this study; .*rms_um"):
        table.plot("mu_9")


def test_a_study_without_a_folder_leaves_nothing_behind(table, tmp_path: Path) -> None:
    assert not table.table.table.parent.exists()
    numbers = json.loads(table.save(tmp_path / "t.json").read_text(encoding="utf-8"))
    assert (numbers["table"], numbers["parquet"]) == (None, None)


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"do": "fit"}, "fit is not one of identify, diagnose, validate"),
        ({"do": "validate"}, "a validation needs a model"),
        ({"do": "identify", "model": "model.toml"}, "a model file is for validate"),
        ({"do": "diagnose", "own": ["mu_0"]}, "are for identify"),
        ({"do": "identify", "on": "moon"}, "'moon' is not a place to compute at"),
    ],
)
def test_what_does_not_go_together_is_refused(run, wrong, said: str) -> None:
    with pytest.raises(dearig.InputError, match=said):
        dearig.study(run, **wrong)


def test_the_trend_of_a_made_table_is_the_true_one(tmp_path: Path) -> None:
    found = dearig.trends(_rows(), against=["temperature_degC"])
    (effect,) = found.effects
    assert effect["low95"] < 100.0 * (np.exp(-0.02) - 1.0) < effect["high95"]
    assert effect["verdict"] == "common"
    assert found.changes == []
    assert found.to_pandas().loc[0, "number"] == "mu_0_kPa"
    for what in ("columns", "films"):
        assert found.plot("mu_0_kPa", what).axes
    assert "effects" in json.loads(found.save(tmp_path / "a.json").read_text())["numbers"][0]
    assert "slope" in found.save(tmp_path / "a.csv").read_text(encoding="utf-8")
    assert "<html" in found.to_html(tmp_path / "a.html").read_text(encoding="utf-8")
    assert "<svg" in found._repr_html_()
    assert "2 films" in repr(found)
    with pytest.raises(dearig.InputError, match="'mu_9' has no trend; what has one is mu_0_kPa"):
        found.plot("mu_9")


def test_a_table_on_disk_gives_the_same_trend(tmp_path: Path) -> None:
    rows = _rows()
    with (tmp_path / "study.csv").open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)
    ours = dearig.trends(rows, against=["temperature_degC"]).effects
    for source in (tmp_path, tmp_path / "study.csv"):
        theirs = dearig.trends(source, against=["temperature_degC"]).effects
        assert theirs[0]["slope"] == pytest.approx(ours[0]["slope"])
    with pytest.raises(dearig.InputError, match="has no column 'mu_9'"):
        dearig.trends(rows, numbers=["mu_9"])
