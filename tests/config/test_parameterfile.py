"""Parameter files: what is stated, with its units, and sentences for what cannot be meant."""

from __future__ import annotations

from pathlib import Path

import pytest

from dearig.config.parameterfile import constraints_of, load_parameter_file, stated_of
from dearig.errors import InputError
from dearig.model.film.material import THESIS_FILM, Load
from dearig.model.fitting import Constraint
from dearig.model.simulation.actuator import Actuator
from dearig.units import parameter_key
from tests.tools.engine import ONE, PLAIN

TEXT = """
[mu_0_kPa]
mean = 46
sd = 0.5

[T_1_s]
low = 0.1

[linear_drag.drag_Pa_s]
fixed = 5.0

["dry_friction.friction_kPa"]
high = 2.0
"""


def test_file_is_read_in_si_units(tmp_path: Path) -> None:
    path = tmp_path / "known.toml"
    path.write_text(TEXT, encoding="utf-8")
    assert constraints_of(load_parameter_file(path), [PLAIN], with_effects=True) == (
        Constraint("mu_0", mean=46e3, sd=500.0),
        Constraint("T_1", low=0.1),
        Constraint("linear drag: drag", fixed=5.0),
        Constraint("dry friction: friction", high=2e3),
    )


def test_nothing_stated_is_no_constraint() -> None:
    assert constraints_of(None, [PLAIN]) == ()
    assert constraints_of({}, [PLAIN]) == ()


def test_names_are_those_of_any_candidate() -> None:
    stated = {"T_1_s": {"low": 0.1}}
    none = Actuator(THESIS_FILM, PLAIN.load, type(ONE)(ONE.equilibrium, ()))
    assert constraints_of(stated, [none, PLAIN]) == (Constraint("T_1", low=0.1),)
    with pytest.raises(InputError, match="which has mu_0_kPa"):
        constraints_of(stated, [none])


def test_keys_end_in_the_unit_that_is_shown() -> None:
    assert parameter_key("mu_0", "Pa") == "mu_0_kPa"
    assert parameter_key("J_0", "") == "J_0"
    assert parameter_key("linear drag: drag", "Pa s") == "linear_drag.drag_Pa_s"


@pytest.mark.parametrize(
    ("stated", "sentence"),
    [
        ({"mu_0": {"fixed": 46}}, "mu_0 is not a parameter .* ends in its unit, mu_0_kPa"),
        ({"mu_0_MPa": {"fixed": 46}}, r"did you mean mu_0_kPa\?"),
        ({"mu_7_kPa": {"fixed": 46}}, "which has mu_0_kPa, mu_1_kPa, J_0, J_1, T_1_s"),
        ({"mu_0_kPa": {"fixed": -3}}, "fixed = -3 is outside .* 1e-05 to 8000 kPa"),
        ({"T_1_s": {"high": 1e9}}, "high = 1e.09 is outside"),
        ({"mu_0_kPa": {"low": 50, "high": 40}}, "mu_0_kPa: low = 50, high = 40: its lower bound"),
        ({"mu_0_kPa": {"fixed": 46, "low": 1}}, "fixed = 46, low = 1: it is fixed"),
        ({"mu_0_kPa": {"mean": 46}}, "a mean and a standard deviation"),
        ({"mu_0_kPa": {"mean": 46, "sd": -1}}, "not above 0"),
        ({"mu_0_kPa": {}}, "nothing is stated"),
        ({"linear_drag.drag_Pa_s": {"high": 5}}, "not a parameter of this fit"),
    ],
)
def test_what_cannot_be_meant_is_told_in_a_sentence(
    stated: dict[str, dict[str, float]], sentence: str
) -> None:
    with pytest.raises(InputError, match=sentence) as told:
        constraints_of(stated, [PLAIN])
    assert "parameters" in told.value.options


def test_measured_rest_length_leaves_nothing_to_state_of_mu_0() -> None:
    known = Actuator(THESIS_FILM, Load(0.2, rest_length=0.082), ONE)
    with pytest.raises(InputError, match="mu_0 follows from the measured rest length"):
        constraints_of({"mu_0_kPa": {"fixed": 46}}, [known], with_effects=True)


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"mu_0_kPa": 46}, r"mu_0_kPa = 46 is not a table: write \[mu_0_kPa\]"),
        ({"mu_0_kPa": {"sigma": 1}}, "mu_0_kPa.sigma is not a key; mu_0_kPa takes fixed, low"),
        ({"mu_0_kPa": {"fixed": "46"}}, 'mu_0_kPa.fixed = "46" is not a number'),
        ({"mu_0_kPa": {"fixed": True}}, "not a number"),
        ({"mu_0_kPa": {"fixed": float("nan")}}, "not a number"),
        ({"mu_0_kPa": {"fixed": [1]}}, "not a number"),
    ],
)
def test_tables_hold_numbers(given: dict[str, object], sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        stated_of(given)


def test_errors_of_a_file_name_it(tmp_path: Path) -> None:
    path = tmp_path / "known.toml"
    path.write_text("mu_0_kPa = 3\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"parameter file .*known.toml: mu_0_kPa = 3"):
        load_parameter_file(path)
