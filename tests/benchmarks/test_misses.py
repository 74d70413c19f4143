"""Causes of misses: the arithmetic, on rows written by hand."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from dearig.model.film.material import THESIS_FILM, THESIS_LOAD
from dearig.sim_backend.truth.cases import draw
from dearig.sim_backend.truth.effects import sudden
from tests.benchmarks.bench_misses import cause_of, happened_once, said_of, table
from tests.blind.score import score
from tests.blind.test_score import result, step


def row(after: float, alone: float, together: float, train: float = 1.0) -> dict[str, Any]:
    return {
        "seed": 3, "mode": "thesis", "generator": "first", "noise": "white", "missed": True,
        "description": "a drag", "named": ["drag"], "said": "named right", "once": False,
        "after": after,
        "alone": {"laws": ["linear drag"], "validation": alone, "train": train},
        "together": {"laws": ["general drag"], "validation": together, "train": 1.0},
    }  # fmt: skip


@pytest.mark.parametrize(
    ("given", "cause"),
    [
        (row(5.0, 1.1, 1.0), "search"),
        (row(5.0, 4.0, 1.1), "excitation"),
        (row(5.0, 4.0, 1.3), "form, not shown"),
        (row(5.0, 4.0, 1.3, train=1.3), "form"),
        ({**row(5.0, 4.0, 1.3), "once": True}, "once"),
        # named wrongly, and predicted all the same
        (row(1.1, 4.0, 1.3), "within 15 %"),
    ],
)
def test_each_miss_has_one_cause(given: dict[str, Any], cause: str) -> None:
    assert cause_of(given) == cause
    page = table([given, {**row(1.0, 1.0, 1.0), "missed": False}])
    assert "Generator first: 1 of 2 rigs are missed" in page
    cells = page.split("| named right |")[1].splitlines()[0].split("|")
    names = page.splitlines()[3].split("|")[2:-1]
    assert [n.strip() for n, c in zip(names, cells, strict=False) if c.strip() == "1"] == [cause]


def test_what_a_diagnosis_says_of_what_is_hidden() -> None:
    said = [
        said_of(score(result(("drag",), *steps)))
        for steps in ([step("drag")], [step("creep", "drag")], [step("creep")], [])
    ]
    assert said == ["named right", "named right", "named wrongly", "nothing named"]
    assert said_of(score(result(("creep", "drag"), step("drag")))) == "one of two missed"
    both = score(result(("creep", "drag"), step("drag"), step("creep")))
    assert said_of(both) == "named right"


def test_a_slip_happens_once() -> None:
    case = draw(5, THESIS_FILM, THESIS_LOAD, "drag")
    assert not happened_once(case)
    for make in (sudden.load_slips, sudden.mount_slips, sudden.electrode_tears):
        slip = make(np.random.default_rng(1), THESIS_LOAD)
        assert happened_once(replace(case, effects=(*case.effects, slip)))
