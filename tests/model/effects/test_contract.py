"""The contract of effects: every effect passes it, and each kind of mistake is told."""

import re
from pathlib import Path

import pytest

from dearig.model import effects
from dearig.model.effects import EFFECTS
from dearig.model.effects_contract import check_effect
from dearig.model.errors import ModelError
from tests.deep import mostly_deep, one_of_each
from tests.tools.effect_plugin import FEW, add_distribution, run_with

HEAD = '''"""A made effect."""

import math

import numpy as np

from dearig.model.effects import Effect, Parameter
from dearig.model.compiled.jit import jit

EFFECT = Effect(
    name="{name}", family="unknown", acts_on="{acts_on}", summary="made for a test",
    parameters=(Parameter("size", "", ({low}, 1e6), "of it", {typical}, 0.0),),
    memory={memory}, drift_basis={basis},
)
'''
BODIES = {
    "upper bound of the drag": """
@jit
def stress(c, k, m, j, lam, rate, lam0, since, t):
    return c[k] * rate

@jit
def stiffness(c, k, m, j, lam, rate):
    return 0.0, 3.0 * c[k]
""",
    "forgotten slope": """
@jit
def stress(c, k, m, j, lam, rate, lam0, since, t):
    return c[k] * (lam - c[9])

@jit
def stiffness(c, k, m, j, lam, rate):
    return 0.0, 0.0
""",
    "numeric stiffness": """
@jit
def stress(c, k, m, j, lam, rate, lam0, since, t):
    return c[k] * (lam - c[9]) * (1.0 + 0.3 * rate)
""",
    "no stiffness at all": """
stiffness = None

@jit
def stress(c, k, m, j, lam, rate, lam0, since, t):
    return c[k] * rate
""",
    "memory too small": """
@jit
def soften(c, k, m, j, lam, since, t, warmth):
    return 1.0 - 1e-3 * c[k] * m[j + 1]

@jit
def commit(c, k, m, j, lam, rate, lam0, h, t):
    m[j + 1] += h
    return 0
""",
    "stress with a state of its own": """
@jit
def stress(c, k, m, j, lam, rate, lam0, since, t):
    m[j] += 0.1 * (lam - lam0)
    return c[k] * m[j]
""",
    "not nothing when neutral": """
@jit
def soften(c, k, m, j, lam, since, t, warmth):
    return 1.01 + 1e-4 * c[k]
""",
    "infinite at a bound": """
@jit
def soften(c, k, m, j, lam, since, t, warmth):
    return 1.0 + 1e-3 / (1e6 - c[k])
""",
    "state that is not handed on": """
@jit
def stress(c, k, m, j, lam, rate, lam0, since, t):
    return c[k] * (m[j] + lam - lam0)

@jit
def commit(c, k, m, j, lam, rate, lam0, h, t):
    m[j] += 0.5 * (lam - lam0)
    return 0
""",
    "supply that moves on": """
@jit
def supply(c, k, m, j, t, start, end, h, lam, rate):
    before = m[j]
    m[j] += 0.1 * (end - m[j])
    return before, m[j]
""",
    "hysteresis that is not declared": """
@jit
def stress(c, k, m, j, lam, rate, lam0, since, t):
    return c[k] * min(max(m[j] + lam - lam0, -2e-4), 2e-4)

@jit
def commit(c, k, m, j, lam, rate, lam0, h, t):
    m[j] = min(max(m[j] + lam - lam0, -2e-4), 2e-4)
    return 0
""",
    "another drift": """
def basis(time):
    return time[:, None] ** 2

@jit
def sense(c, k, m, j, t, dt, x, u):
    return x + c[k] * t
""",
}
SETTINGS = {
    "memory too small": {"memory": 1, "typical": 1.0},
    "stress with a state of its own": {"memory": 1},
    "not nothing when neutral": {"typical": 1.0},
    "infinite at a bound": {"typical": 1.0},
    "state that is not handed on": {"memory": 1},
    "supply that moves on": {"memory": 1},
    "hysteresis that is not declared": {"memory": 1, "typical": 5e5},
    "another drift": {"acts_on": "sensor", "basis": "lambda time: basis(time)", "typical": 1e-6},
}
EXPECTED = {
    "upper bound of the drag": r"d stress/d rate = 150 Pa s .* that of its stress is 50 Pa s",
    "forgotten slope": r"d stress/d lam = 0 Pa .* less than the 50 Pa of its stress",
    "numeric stiffness": "",
    "no stiffness at all": r"d stress/d rate = 0 Pa s .* that of its stress is 50 Pa s",
    "memory too small": r"its hook soften returns .* with a number of another effect",
    "stress with a state of its own": r"its hook stress changes the state",
    "not nothing when neutral": r"m of it are left near its neutral values",
    "infinite at a bound": r"its hook soften returns \[inf\] at size = 1e\+06",
    "state that is not handed on": r"its stress jumps between steps .* what commit hands on",
    "supply that moves on": r"its hook supply changes the state where h is 0",
    "hysteresis that is not declared": r"without is_hysteretic, quick steps change",
    "another drift": r"its drift_basis differs from what sense adds",
}
PROGRAM = (
    FEW
    + """
from dearig.model.effects import EFFECTS, ORIGINS, PROBLEMS
from dearig.model.effects_contract import faults_of_effect
assert not PROBLEMS, PROBLEMS
for name, origin in ORIGINS.items():
    if origin != "dearig":
        print(f"{name}: {'; '.join(faults_of_effect(name))}")
"""
)


# hooks are compiled one by one: the suite has an effect of each family
@pytest.mark.parametrize("name", one_of_each(EFFECTS, lambda name: EFFECTS[name].family))
def test_every_effect_keeps_the_contract(name):
    check_effect(name)


def test_an_effect_that_nobody_knows():
    with pytest.raises(ModelError, match="'magic' is not one of"):
        check_effect("magic")


def worked_example():
    """The effect that the README walks through."""
    text = (Path(effects.__path__[0]) / "README.md").read_text(encoding="utf-8")
    (source,) = re.findall(r"```python\n(\"\"\".*?)```", text, flags=re.DOTALL)
    return source


@pytest.mark.timeout(900)  # compiled, the kernels are compiled with the made effects
@pytest.mark.parametrize("compiled", mostly_deep([False, True], [False]))
def test_the_contract_tells_what_is_wrong_with_each_made_effect(compiled, tmp_path):
    """One test, since two processes that share the tests would each compile the kernels."""
    modules = {}
    for i, (name, body) in enumerate(BODIES.items()):
        settings = {"acts_on": "load", "low": 0.0, "typical": 50.0, "memory": 0, "basis": None}
        head = HEAD.format(name=name, **settings | SETTINGS.get(name, {}))
        modules[f"made_effect_{i}"] = head + body
    modules["fading_drag"] = worked_example()
    add_distribution(tmp_path, "made-effects", modules)
    lines = run_with(tmp_path, PROGRAM, compiled).splitlines()
    told = dict(line.split(": ", 1) for line in lines)
    # the worked example of the README keeps the contract
    expected = EXPECTED | {"fading drag": ""}
    assert told.keys() == expected.keys()
    otherwise = {
        name: (words, told[name])
        for name, words in expected.items()
        if not re.search(words, told[name]) or bool(words) != bool(told[name])
    }
    assert otherwise == {}
