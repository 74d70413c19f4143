"""Options of ``dearig identify``: what is known of parameters; and its end by ctrl-C."""

from __future__ import annotations

import json
import signal
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dearig.analysis import identify as identify_module
from dearig.cli.options import stated_by
from dearig.config.modelfile import load_model
from dearig.errors import InputError
from dearig.model.film.material import Branch, Network, Spring
from dearig.model.fitting.estimates import BY_CURVATURE
from dearig.model.simulation.strip import Strip
from tests.tools.command import dearig, done, refused

FILM = Strip(Network(Spring(40e3, 1e4), (Branch(Spring(30e3, 1e4), 2.0),)))


@pytest.fixture(scope="module")
def pull(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A film that is pulled, held and let go."""
    folder = tmp_path_factory.mktemp("pull")
    time = np.linspace(0.0, 20.0, 400)
    stretch = np.interp(time, [0.0, 2.0, 10.0, 11.0, 20.0], [1.0, 1.6, 1.6, 1.1, 1.1])
    stress = FILM.simulate(time, stretch).stress * 1e-3
    stress = stress + np.random.default_rng(1).normal(0.0, 0.05, time.size)
    np.savetxt(
        folder / "pull.csv", np.column_stack([time, stretch, stress]), delimiter=",",
        comments="", header="time_s,stretch,nominal_stress_kPa",
    )  # fmt: skip
    done("import", folder / "pull.csv", "--out", folder / "pull.h5")
    return folder / "pull.h5"


def test_options_state_parameters_and_go_before_the_file(tmp_path: Path) -> None:
    path = tmp_path / "known.toml"
    path.write_text("[mu_0_kPa]\nfixed = 1.0\n[J_0]\nlow = 2.0\n", encoding="utf-8")
    found = stated_by(
        path,
        ["mu_3_kPa= 2e1"],
        ["T_1_s=0.1..1", "T_2_s=..5.", "mu_1_kPa=.5.."],
        ["mu_0_kPa=46+-0.5", "T_1_s=0.5 ± 0.1"],
    )
    assert found == {
        "mu_0_kPa": {"mean": 46.0, "sd": 0.5},
        "J_0": {"low": 2.0},
        "mu_3_kPa": {"fixed": 20.0},
        "T_1_s": {"low": 0.1, "high": 1.0, "mean": 0.5, "sd": 0.1},
        "T_2_s": {"high": 5.0},
        "mu_1_kPa": {"low": 0.5},
    }
    assert stated_by(None, None, None, None) == {}


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ((["mu_0_kPa"], None, None), "--fix 'mu_0_kPa' is not of the form NAME=VALUE"),
        ((["=3"], None, None), "--fix '=3' is not of the form"),
        ((["mu_0_kPa=nan"], None, None), "not of the form"),
        ((None, ["T_1_s=.."], None), "--bound 'T_1_s=..' is not of the form NAME=LOW..HIGH"),
        ((None, ["T_1_s=1-2"], None), "not of the form"),
        ((None, None, ["mu_0_kPa=46"]), "--prior 'mu_0_kPa=46' is not of the form NAME=MEAN"),
        ((["J_0=1", "J_0=2"], None, None), "--fix is given twice for J_0"),
    ],
)
def test_values_of_another_form_are_refused(
    options: tuple[list[str] | None, list[str] | None, list[str] | None], sentence: str
) -> None:
    with pytest.raises(InputError) as told:
        stated_by(None, *options)
    assert sentence in str(told.value)


def test_identify_keeps_to_what_is_stated(pull: Path, tmp_path: Path) -> None:
    report = tmp_path / "report.html"
    answer = done(
        "identify", pull, "--branches", "1", "--out", tmp_path / "m.toml", "--fix", "mu_1_kPa=30",
        "--prior", "mu_0_kPa=41+-0.01", "--bound", "T_1_s=1.5..1.9", "--report", report,
        "--json", tmp_path / "m.json",
    )  # fmt: skip
    found = json.loads((tmp_path / "m.json").read_text(encoding="utf-8"))
    one = {p["name"]: p for p in found["parameters"]}
    assert one["mu_1"]["value"] == 30e3
    assert (one["mu_1"]["fixed"], one["mu_1"]["free"]) == (True, False)
    assert one["mu_1"]["ci95"] == one["mu_1"]["ci95_combined"] == [None, None]
    assert one["mu_0"]["prior"] == {"mean": 41e3, "sd": pytest.approx(10.0)}
    assert one["T_1"]["bounds"] == [1.5, 1.9]
    assert one["T_1"]["at_bound"]
    assert one["J_0"]["bounds"] is one["J_0"]["prior"] is None
    assert found["prior_p"] < 1e-3
    assert "mu_1" not in found["covariance"]["names"]
    text = " ".join(answer.out.split())
    assert "prior 41 ± 0.01 kPa" in text
    assert "T₁: at its stated bound; stated bounds 1.5 to 1.9 s" in text
    assert "Fixed: stated before the fit" in text
    page = report.read_text(encoding="utf-8")
    assert "prior 41 ± 0.01 kPa" in page
    assert "fixed" in page
    kept = load_model(tmp_path / "m.toml")
    assert kept.model.network.branches[0].spring.modulus == 30e3
    stated = {e["name"]: e.get("stated") for e in kept.history["estimate"]}
    assert stated["mu_1"] == {"fixed": 30e3}
    assert stated["J_0"] is None


def test_what_is_stated_of_a_branch_that_was_not_chosen_has_no_part(
    pull: Path, tmp_path: Path
) -> None:
    out = tmp_path / "m.json"
    answer = done(
        "identify", pull, "--branches", "0-1", "--out", tmp_path / "m.toml", "--spring",
        "neo-hookean", "--fix", "T_1_s=1000", "--no-intervals", "--json", out,
    )  # fmt: skip
    chosen = load_model(tmp_path / "m.toml").model.network
    said = "what is stated of T_1 has no part" in " ".join(answer.out.split())
    assert said == (not chosen.branches)
    if chosen.branches:
        assert chosen.times == (1000.0,)


@pytest.mark.parametrize("command", ["identify", "diagnose"])
def test_unknown_names_are_refused_before_the_fit(pull: Path, tmp_path: Path, command: str) -> None:
    out = () if command == "diagnose" else ("--out", tmp_path / "m.toml")
    answer = dearig(command, pull, *out, "--fix", "mu_0=3")
    refused(answer, "mu_0 is not a parameter of this fit", "--fix")
    assert not (tmp_path / "m.toml").exists()


def test_ctrl_c_while_intervals_are_computed_keeps_the_fit(
    pull: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    real = identify_module.add_intervals

    def asked_to_end(*given: Any, **options: Any) -> Any:
        signal.raise_signal(signal.SIGINT)
        return real(*given, **options)

    monkeypatch.setattr(identify_module, "add_intervals", asked_to_end)
    model, report, out = (tmp_path / name for name in ("m.toml", "report.html", "m.json"))
    answer = dearig(
        "identify", pull, "--branches", "1", "--out", model, "--report", report, "--json", out
    )
    assert answer.code == 130
    assert answer.err.endswith("dearig: interrupted: the fit found before that was kept\n")
    found = json.loads(out.read_text(encoding="utf-8"))
    assert found["status"] == "stopped"
    assert "interrupted" in " ".join(answer.out.split())
    one = {p["name"]: p for p in found["parameters"]}
    assert BY_CURVATURE in one["mu_0"]["note"]
    assert one["mu_0"]["ci95"][0] < 40e3 < one["mu_0"]["ci95"][1]
    assert load_model(model).model.network.equilibrium.modulus == one["mu_0"]["value"]
    assert BY_CURVATURE in report.read_text(encoding="utf-8")


def test_ctrl_c_during_the_fit_leaves_nothing(
    pull: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def asked_to_end(*_given: Any, **_options: Any) -> Any:
        signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(identify_module, "identify", asked_to_end)
    answer = dearig("identify", pull, "--out", tmp_path / "m.toml")
    assert (answer.code, answer.err) == (130, "dearig: interrupted\n")
    assert not (tmp_path / "m.toml").exists()
