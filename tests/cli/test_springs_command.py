"""The choice of a strain energy by ``dearig identify``, as a user runs it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import get_args

import numpy as np
import pytest

from dearig.cli.options import SpringChoice, SpringKind
from dearig.config.modelfile import load_model, save_model
from dearig.model.film.material import Network, Spring
from dearig.model.simulation.strip import Strip
from dearig.model.springs import SPRINGS
from tests.tools.command import dearig, done, refused

OGDEN = Strip(Network(Spring(40e3, kind="ogden", shape=(1.2,))))


@pytest.fixture(scope="module")
def pulls(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with two pulls of a film of one Ogden spring, ``train.h5`` and ``other.h5``."""
    folder = tmp_path_factory.mktemp("pulls")
    for name, end, seed in (("train", 5.0, 1), ("other", 6.0, 2)):
        time = np.linspace(0.0, 10.0, 80)
        stretch = np.linspace(1.0, end, 80)
        stress = OGDEN.simulate(time, stretch).stress * 1e-3
        stress = stress + np.random.default_rng(seed).normal(0.0, 0.05, 80)
        np.savetxt(
            folder / f"{name}.csv", np.column_stack([time, stretch, stress]), delimiter=",",
            comments="", header="time_s,stretch,nominal_stress_kPa",
        )  # fmt: skip
        done("import", folder / f"{name}.csv", "--out", folder / f"{name}.h5")
    return folder


def test_options_name_every_energy() -> None:
    assert sorted(get_args(SpringKind)) == sorted(SPRINGS)
    assert get_args(SpringChoice) == (*get_args(SpringKind), "choose")


@pytest.mark.deep
def test_the_energy_that_made_the_data_is_kept(pulls: Path, tmp_path: Path) -> None:
    model, report, out = (tmp_path / name for name in ("m.toml", "report.html", "out.json"))
    answer = done(
        "identify", pulls / "train.h5", "--validate", pulls / "other.h5", "--out", model,
        "--spring", "choose", "--branches", "0", "--no-intervals", "--report", report,
        "--json", out,
    )  # fmt: skip
    assert "Strain energies" in answer.out
    assert "give Ogden the probability" in answer.out.replace("\n", " ")
    kept = load_model(model).model.network
    assert kept.equilibrium.kind == "ogden"
    assert kept.equilibrium.shape[0] == pytest.approx(1.2, abs=0.02)
    assert kept.branches == ()
    assert "Strain energies" in report.read_text(encoding="utf-8")
    found = dearig("validate", model, pulls / "other.h5", "--json", "-").json
    assert found["recordings"][0]["rms_kPa"] < 0.1
    springs = json.loads(out.read_text(encoding="utf-8"))["springs"]
    assert [s["chosen"] for s in springs] == [True] + [False] * (len(springs) - 1)
    assert sum(s["probability"] for s in springs) == pytest.approx(1.0)
    assert [s["criterion"] for s in springs] == sorted(s["criterion"] for s in springs)
    worst = next(s for s in springs if s["spring"] == "neo-hookean")
    for error in ("train_rms_kPa", "left_out_rms_kPa", "validation_rms_kPa"):
        assert worst[error] > 10.0 * springs[0][error]


def test_effects_of_a_model_are_fitted_too(pulls: Path, tmp_path: Path) -> None:
    slack = Strip(OGDEN.network, effects=(("slack", (("looseness", 0.5),)),))
    save_model(tmp_path / "slack.toml", "slack", slack, {})
    found = done(
        "identify", pulls / "train.h5", "--out", tmp_path / "m.toml", "--branches", "0",
        "--spring", "ogden", "--effects-of", tmp_path / "slack.toml", "--no-intervals", "--json",
        "-",
    ).json  # fmt: skip
    assert [p["name"] for p in found["parameters"]] == ["mu_0", "alpha_0", "slack: looseness"]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--branches", "9"), ["from 1 to 8 branches, a film also 0"]),
        (("--spring", "hooke"), ["hooke", "ogden"]),
        (("--effects-of", "no.toml"), ["no.toml"]),
    ],
)
def test_wrong_options_are_refused(
    pulls: Path, tmp_path: Path, options: tuple[str, ...], words: list[str]
) -> None:
    refused(dearig("identify", pulls / "train.h5", "--out", tmp_path / "m.toml", *options), *words)
    assert not (tmp_path / "m.toml").exists()
