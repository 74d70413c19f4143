"""What a prediction says of the static pull-in: no more than the fit of its model knows."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from dearig.analysis.simulate import SimulatedRecord
from dearig.config.modelfile import ModelFile, load_model, save_model
from dearig.model.film.material import THESIS_FILM, THESIS_LOAD, Network, Spring
from dearig.model.simulation.actuator import Actuator
from dearig.report.text.sentences import pull_in_text

STIFFENING = {"method": "hybrid", "estimate": [{"name": "J_0", "determined": True}]}
OPEN = {"method": "hybrid", "estimate": [{"name": "J_0", "determined": False}]}
NO_INTERVALS = {"method": "diagnosis", "estimate": []}


@pytest.mark.parametrize(
    ("history", "pull_in", "told"),
    [
        ({}, 5.2e3, "5.20 kV"),  # a model that a person wrote is what it says
        (STIFFENING, 5.2e3, "5.20 kV"),
        (STIFFENING, None, "none: the springs stiffen first"),
        (OPEN, None, "not known: the data do not determine J₀"),
        (OPEN, 5.2e3, "5.20 kV with the model's limits, but the data do not determine J₀"),
        (NO_INTERVALS, 5.2e3, "5.20 kV with the model's limits, but no intervals of J₀ were"),
        (NO_INTERVALS, None, "not known: no intervals of J₀ were computed"),
    ],
)
def test_the_static_pull_in_is_known_as_well_as_the_limits(
    history: dict[str, Any], pull_in: float | None, told: str, tmp_path: Any
) -> None:
    model = Actuator(THESIS_FILM, THESIS_LOAD, Network(Spring(45e3, 20.0)))
    save_model(tmp_path / "m.toml", "m", model, history)
    given = load_model(tmp_path / "m.toml")
    made = SimulatedRecord("p", "actuator", given, {"time": np.zeros(1)}, pull_in=pull_in)
    assert pull_in_text(made).startswith(told)
    bare = replace(made, model=ModelFile("m", model))
    assert bare.open_limits == ()
