"""Equations of the effects: each effect has them, and every symbol in them is defined."""

from __future__ import annotations

import re
from dataclasses import replace

import pytest

from dearig.formulas import as_text, mathml, symbols_of
from dearig.model.effects import EFFECTS, ORIGINS
from dearig.model.effects.description import COMMON_SYMBOLS, Law, faults_of
from dearig.model.effects.registry import OURS

NAMES = [name for name in EFFECTS if ORIGINS[name] == OURS]
DRAG = EFFECTS["linear drag"]


def indexed(symbol: str) -> set[str]:
    """The symbol itself, and that of the family that it is a member of: a_1 is one of a_i."""
    base, _, below = symbol.partition("_")
    member = re.fullmatch(r"\{?\d+\}?", below)
    return {symbol, *(f"{base}_{i}" for i in "ijn" if member)}


@pytest.mark.parametrize("name", NAMES)
def test_every_symbol_of_a_law_is_defined_and_every_parameter_is_in_it(name):
    effect = EFFECTS[name]
    assert faults_of(effect, with_law=True) == []
    law = effect.law
    used = {s for equation in law.equations for s in symbols_of(equation)}
    arguments = {a for e in law.equations for a in re.findall(r"^[A-Z]\((\w)\) =", e)}
    indices = {s.partition("_")[2] for s in used} | set(
        re.findall(r"\\sum_\{(\w)=", " ".join(law.equations))
    )
    known = {*law.symbols, *(s for s, _ in law.where), *(s for s, _ in COMMON_SYMBOLS)}
    families = {base for symbol in law.symbols for base in indexed(symbol)}
    undefined = {s for s in used if not indexed(s) & (known | families)}
    assert undefined <= arguments | indices
    words = " ".join(about for _, about in law.where)
    for symbol in law.symbols:
        assert indexed(symbol) & used or symbol in words, f"{symbol} is in no equation"
    for symbol, _ in law.where:
        assert symbol in used, f"{symbol} is explained and not used"


@pytest.mark.parametrize("name", NAMES)
def test_every_equation_can_be_set_and_printed(name):
    for formula in (*EFFECTS[name].law.equations, *EFFECTS[name].law.symbols):
        assert mathml(formula).startswith("<math")
        text = as_text(formula)
        assert "\\" not in text
        assert text.count("(") == text.count(")")


def test_an_effect_of_this_project_without_a_law_is_refused_and_a_guests_is_not():
    guest = replace(DRAG, law=None)
    assert faults_of(guest) == []
    assert faults_of(guest, with_law=True) == [
        "it has no law: its equations, the symbols of its parameters, their source"
    ]


@pytest.mark.parametrize(
    ("law", "fault"),
    [
        (Law((), ("d",), "Stokes"), "its law has no equation"),
        (Law(("d",), ("d",), ""), "its law has no source"),
        (Law(("d",), ("d", "e"), "Stokes"), "its law has 2 symbols for 1 parameters"),
    ],
)
def test_a_law_that_does_not_fit_its_effect_is_refused(law, fault):
    assert any(told.startswith(fault) for told in faults_of(replace(DRAG, law=law)))
