"""Model files: what is saved is what is simulated again, and where it comes from."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from pathlib import Path
from typing import get_args

import numpy as np
import pytest

from dearig.config.modelfile import _File, load_model, model_toml, save_model
from dearig.errors import InputError
from dearig.model.film.material import (
    TABLE_3,
    THESIS_FILM,
    THESIS_LOAD,
    Branch,
    Film,
    Load,
    Network,
    Spring,
)
from dearig.model.simulation.actuator import Actuator
from dearig.model.simulation.strip import Strip
from dearig.model.springs import SPRINGS

STRANGE_FILM = Film(0.05, 0.04, 0.0005, 3.1, 970.0, "uniaxial")
MODELS = {
    "thesis": Actuator(THESIS_FILM, THESIS_LOAD, TABLE_3),
    "measured rest": Actuator(STRANGE_FILM, Load(0.1, 0.0555), TABLE_3),
    "no limits": Actuator(THESIS_FILM, THESIS_LOAD, Network(Spring(5e4))),
    "springs of three kinds": Strip(
        Network(
            Spring(1e4, 50.0, "arruda-boyce"),
            (Branch(Spring(2e4, math.inf), 0.5), Branch(Spring(3e4, 99.0, "gent"), 7.0)),
        ),
        "equibiaxial",
    ),
    "springs of newer laws": Strip(
        Network(
            Spring(1e4, 50.0, "extended-tube", (0.2, 0.5)),
            (
                Branch(Spring(2e4, kind="ogden", shape=(-1.5,)), 0.5),
                Branch(Spring(2e4, kind="ogden-two-terms", shape=(1.0, 4.0, 0.1)), 0.5),
                Branch(Spring(2e4, kind="yeoh", shape=(-0.1, 0.01)), 0.5),
                Branch(Spring(2e4, kind="mooney-rivlin", shape=(0.3,)), 0.5),
            ),
        ),
    ),
    "effects": Actuator(
        THESIS_FILM,
        THESIS_LOAD,
        TABLE_3,
        (
            ("sensor lag", (("time_constant", 4.5e-3),)),
            ("linear drag", (("drag", 1.25),)),
        ),
    ),
    "a film's effect": Strip(
        TABLE_3, "uniaxial", (("Mullins softening", (("softening", 0.25), ("width", 0.5))),)
    ),
}


@pytest.mark.parametrize("name", MODELS)
def test_a_model_comes_back_to_the_last_bit(tmp_path: Path, name: str) -> None:
    model = MODELS[name]
    save_model(tmp_path / "m.toml", name, model, {"seconds": 1.5})
    loaded = load_model(tmp_path / "m.toml")
    assert loaded.model == model
    assert loaded.name == name
    assert loaded.kind == ("actuator" if isinstance(model, Actuator) else "film")
    assert loaded.history == {"seconds": 1.5}


@pytest.mark.parametrize(
    ("name", "values", "new"),
    [
        ("dry friction", {"friction": 50.0, "presliding": 1e-4, "damping": 1e-6}, "damping"),
        (
            "broad dielectric relaxation",
            {
                "strength": 0.1,
                "relaxation_time": 0.2,
                "alpha": 0.4,
                "half_width": 4.0,
                "settled": 1.0,
            },
            "half_width",
        ),
        (
            "dielectric relaxation in stages",
            {
                "strength": 0.1,
                "sooner": 0.1,
                "later": 0.1,
                "relaxation_time": 0.2,
                "ratio": 7.0,
                "sooner_ratio": 7.0,
                "settled": 1.0,
            },
            "sooner_ratio",
        ),
        (
            "elastoplastic friction",
            {
                "friction": 50.0,
                "presliding": 1e-4,
                "damping": 1e-3,
                "excess": 0.2,
                "easing": 1e-2,
                "elastic": 0.5,
                "easing_exponent": 2.0,
            },
            "easing_exponent",
        ),
    ],
)
def test_an_older_file_lacks_numbers_of_newer_laws(
    tmp_path: Path, name: str, values: dict[str, float], new: str
) -> None:
    model = replace(MODELS["thesis"], effects=((name, tuple(values.items())),))
    path = tmp_path / "m.toml"
    save_model(path, "old", model, {})
    now = path.read_text(encoding="utf-8")
    then = re.sub(rf",? *{new} = [^,}}\n]*", "", now)
    assert then != now
    path.write_text(then, encoding="utf-8")
    assert load_model(path).model == model


def test_history_takes_what_toml_does_not_have(tmp_path: Path) -> None:
    history = {
        "low": None,
        "count": np.int64(3),
        "values": [np.float64(1.5), None],
        "train": [{"name": "a\udcff", "sha256": "12ab"}],
    }
    save_model(tmp_path / "m.toml", "x", MODELS["thesis"], history)
    loaded = load_model(tmp_path / "m.toml")
    train = [{"name": "a?", "sha256": "12ab"}]
    assert loaded.history == {"count": 3, "values": [1.5], "train": train}
    assert loaded.fitted == {"12ab"}


def test_a_model_is_not_overwritten(tmp_path: Path) -> None:
    path = tmp_path / "m.toml"
    save_model(path, "one", MODELS["thesis"], {})
    with pytest.raises(InputError, match="exists already"):
        save_model(path, "two", MODELS["thesis"], {})
    assert load_model(path).name == "one"
    save_model(path, "two", MODELS["thesis"], {}, overwrite=True)
    assert load_model(path).name == "two"
    assert [p.name for p in tmp_path.iterdir()] == ["m.toml"]


@pytest.mark.parametrize(
    ("spring", "words"),
    [
        ('"ogden"', "spring (ogden): exponent is missing"),
        ('"ogden"\nexponent = 40.0', "exponent = 40.0 must be from -20 to 20"),
        ('"gent"\nshare = 0.1', "spring (gent): share is not its key: it takes limit"),
        ('"neo-hookean"\ncubic = 0.1', "cubic is not its key: it takes nothing"),
        ('"ogdn"', '"ogden"'),
    ],
)
def test_a_spring_has_the_numbers_of_its_law(tmp_path: Path, spring: str, words: str) -> None:
    path = tmp_path / "m.toml"
    path.write_text(
        'format = "dearig-model/1"\nname = "m"\nkinematics = "uniaxial"\n'
        f"[equilibrium]\nmodulus_Pa = 1e4\nspring = {spring}\n",
        encoding="utf-8",
    )
    with pytest.raises(InputError, match=re.escape(words)):
        load_model(path)


def test_a_file_takes_every_law() -> None:
    taken = _File.model_fields["equilibrium"].annotation.model_fields["spring"].annotation
    assert get_args(taken) == SPRINGS


@pytest.mark.parametrize("name", ["wandering drift", "restless drift"])
def test_a_drift_of_an_earlier_version_says_what_to_write(tmp_path: Path, name: str) -> None:
    path = tmp_path / "m.toml"
    text = model_toml("m", Strip(TABLE_3, "uniaxial"), {})
    path.write_text(f'{text}\n[[effect]]\nname = "{name}"\nvalues = {{linear = 1e-6}}\n', "utf-8")
    with pytest.raises(InputError, match="write 'fitful drift', with the same amplitudes and 0"):
        load_model(path)
