"""The laws that ``dearig effects`` prints."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from dearig.model.effects import EFFECTS
from dearig.report.text.laws import place_text
from tests.tools.command import dearig, done, refused


def test_the_list_has_every_effect_with_family_and_sentence(tmp_path: Path) -> None:
    answer = done("effects", "--json", tmp_path / "effects.json")
    for effect in EFFECTS.values():
        line = f"{effect.name} (acts {place_text(effect.acts_on)}): {effect.summary}"
        assert line in answer.out
    told = json.loads((tmp_path / "effects.json").read_text(encoding="utf-8"))
    assert told["format"] == "dearig-effects/1"
    assert {e["name"] for e in told["effects"]} == set(EFFECTS)


def test_one_effect_is_told_with_equation_parameters_and_source() -> None:
    answer = done("effects", "Strained-Electrode")
    assert "(d(C V))/dt = (U - V)/(R_0 exp(g δ))" in answer.out
    assert "g: gauge, relative change of the resistance per change of stretch" in answer.out
    assert "R_0: resistance, between the amplifier and the film at rest, in ohm" in answer.out
    assert "Source: " in answer.out
    bounds = next(line for line in answer.out.splitlines() if line.startswith("gauge"))
    assert bounds.split() == ["gauge", "g", "-300", "300"]


def test_no_symbol_is_explained_that_no_equation_has() -> None:
    answer = done("effects", "distributed hysteresis")
    assert "z_i: strain of element i" in answer.out
    assert "thickness of the film as it is" not in answer.out


def test_one_effect_as_json_has_latex_and_si_units() -> None:
    answer = dearig("effects", "leakage", "--json", "-")
    (effect,) = json.loads(answer.out)["effects"]
    assert effect["equations"][1] == r"g(e) = \exp\left(b (e^n - 1)\right)"
    assert [p["symbol"] for p in effect["parameters"]] == ["s", "b", "n"]
    assert effect["parameters"][0]["bounds"] == [0.0, 0.5]
    assert {"symbol": "V", "meaning": "voltage at the film"} in effect["where"]


@pytest.mark.parametrize(
    ("name", "near"), [("dry fricton", "dry friction"), ("friction", "easing friction")]
)
def test_a_name_that_is_no_effect_is_answered_with_names_that_are_near(name, near) -> None:
    refused(dearig("effects", name), f"no effect is called {name!r}", near)
