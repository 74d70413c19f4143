"""Laws of effects in reports: equations and symbols as MathML."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from dearig.formulas import mathml
from dearig.report.text.laws import other_symbols, parameter_meanings

if TYPE_CHECKING:  # jinja2 is loaded by the command that writes a report
    from markupsafe import Markup

    from dearig.model.effects import Effect

__all__ = ["LawView", "law_view"]


@dataclass(frozen=True)
class LawView:
    """Equations as MathML, every symbol as MathML with its meaning, and the source."""

    equations: tuple[Markup, ...]
    symbols: tuple[tuple[Markup, str], ...]
    source: str


def law_view(effect: Effect) -> LawView | None:
    """Return the law of ``effect`` for a page; None where its distribution gives none."""
    from markupsafe import Markup

    if effect.law is None:
        return None

    def inline(latex: str) -> Markup:
        return Markup(mathml(latex, display=False))  # noqa: S704  (made from a formula, not text)

    symbols = [
        (inline(symbol), f"{name}, {meaning}{f', in {unit}' if unit else ''}")
        for symbol, name, meaning, unit in parameter_meanings(effect)
    ]
    symbols += [(inline(symbol), meaning) for symbol, meaning in other_symbols(effect)]
    equations = tuple(Markup(mathml(e)) for e in effect.law.equations)  # noqa: S704
    return LawView(equations, tuple(symbols), effect.law.source)
