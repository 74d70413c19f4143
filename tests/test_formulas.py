"""Formulas as MathML and as text."""

from __future__ import annotations

import unicodedata

import pytest

from dearig.formulas import as_text, mathml, symbols_of
from dearig.report.text.numbers import to_ascii
from tests.report.pages.test_page import Page

TEXTS = {
    r"\tau \dot{V} = U - V": "τ V̇ = U - V",
    r"R \exp(g \delta)": "R exp(g δ)",
    r"\frac{F}{p} (z + \tau \dot{z})": "(F/p) (z + τ ż)",
    r"z = \frac{a + b}{c d}": "z = (a + b)/(c d)",
    r"\left(1 + |\delta / r|^n\right)^{1/n}": "(1 + |δ / r|^n)^(1/n)",
    r"\sum_{i=1}^{6} a_i B_i(x)": "Σ_(i=1)^6 a_i B_i(x)",
    r"\operatorname{sign}(z) \max(|z| - r, 0)": "sign(z) max(|z| - r, 0)",
    r"\begin{cases} 0 & x \le a \\ 1 & x > a \end{cases}": "{ 0  if x ≤ a ; 1  if x > a }",
    r"E_0 = 8\,\mathrm{MV/m}": "E_0 = 8 MV/m",
}


@pytest.mark.parametrize("latex", TEXTS)
def test_a_formula_is_text_that_is_read_one_way(latex):
    assert as_text(latex) == unicodedata.normalize("NFD", TEXTS[latex])


def test_a_terminal_without_greek_letters_shows_their_names():
    assert to_ascii(as_text(r"\tau \dot{\lambda} \le \sigma")) == "tau lambda' <= sigma"


def test_a_formula_is_well_formed_mathml():
    page = Page(mathml(r"\frac{\lambda V}{8\,\mathrm{kV}} < 1"))
    assert page.seen[0] == "math"
    assert {"mfrac", "mi", "mn", "mo"} <= set(page.seen)
    assert 'display="block"' in mathml("g")
    assert 'display="inline"' in mathml("g", display=False)


def test_symbols_are_letters_with_their_subscripts():
    assert symbols_of(r"\sigma_0 + \sum_{i=1}^{6} Y_i \frac{z_i}{s_i} \exp(-t/8\,\mathrm{kV})") == (
        r"\sigma_0", "Y_i", "z_i", "s_i", "t",
    )  # fmt: skip
