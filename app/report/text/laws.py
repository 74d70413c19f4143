"""Laws of effects for a reader: equations, symbols, parameters and sources."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from dearig.errors import InputError
from dearig.formulas import as_text
from dearig.model.effects.description import COMMON_SYMBOLS
from dearig.report.text.numbers import significant
from dearig.report.text.tables import Row, Table

if TYPE_CHECKING:
    # the effects are searched, and the compiler loaded, where one is asked for
    from dearig.model.effects import Effect

__all__ = [
    "bounds_table",
    "effect_named",
    "law_json",
    "law_lines",
    "other_symbols",
    "parameter_meanings",
    "place_text",
]


def place_text(acts_on: str) -> str:
    """Return where an effect acts as "on the film stress" or "through the environment"."""
    return f"{'through' if acts_on == 'environment' else 'on'} the {acts_on}"


def effect_named(name: str) -> Effect:
    """Return the effect that a person means by ``name``; case and underscores do not matter.

    Raises
    ------
    InputError
        If no effect has this name. The message has names that are like it.
    """
    import difflib

    from dearig.model.effects import EFFECTS

    wanted = name.replace("_", " ").replace("-", " ").strip().lower()
    known = {n.replace("-", " ").lower(): n for n in EFFECTS}
    if wanted in known:
        return EFFECTS[known[wanted]]
    near = [known[n] for n in difflib.get_close_matches(wanted, known, n=3)]
    near += [n for n, effect in EFFECTS.items() if effect.family == wanted.replace(" ", "_")]
    raise InputError(
        f"no effect is called {name!r}"
        + (f"; near to it: {', '.join(dict.fromkeys(near))}" if near else "")
        + "; without a name, all are listed"
    )


def other_symbols(effect: Effect) -> tuple[tuple[str, str], ...]:
    """Return symbols of the effect's law that are not its parameters', each with its meaning."""
    law = effect.law
    if law is None:
        return ()
    own = {symbol for symbol, _ in law.where} | set(law.symbols)
    text = " ".join(law.equations)
    shared = [(s, about) for s, about in COMMON_SYMBOLS if s not in own and _occurs(s, text)]
    return (*law.where, *shared)


def _origin(effect: Effect) -> str:
    """Return the distribution that an effect is from."""
    from dearig.model.effects import ORIGINS

    return ORIGINS[effect.name]


def _occurs(symbol: str, text: str) -> bool:
    """Whether ``symbol`` stands in ``text`` as itself, not as the beginning of another one."""
    upright = re.sub(r"\\(?:mathrm|operatorname)\{[^}]*\}", " ", text)
    if symbol.startswith(r"\dot"):
        return symbol in upright
    return re.search(rf"(?<![A-Za-z\\_]){re.escape(symbol)}(?![A-Za-z_]|\}}_)", upright) is not None


def parameter_meanings(effect: Effect) -> tuple[tuple[str, str, str, str], ...]:
    """Return of each parameter its symbol (or ""), its name in words, its meaning and its unit."""
    symbols = effect.law.symbols if effect.law else ("",) * len(effect.parameters)
    return tuple(
        (symbol, p.name.replace("_", " "), p.meaning, p.unit)
        for symbol, p in zip(symbols, effect.parameters, strict=True)
    )


def law_lines(effect: Effect) -> Iterator[str]:
    """Yield the equations of an effect, the meaning of its symbols and its source, as lines."""
    law = effect.law
    if law is None:
        yield f"{_origin(effect)} gives no equation of {effect.name}."
        return
    yield f"Equations of {effect.name}:"
    for equation in law.equations:
        yield f"    {as_text(equation)}"
    for symbol, name, meaning, unit in parameter_meanings(effect):
        yield f"{as_text(symbol)}: {name}, {meaning}{f', in {unit}' if unit else ''}"
    for symbol, meaning in other_symbols(effect):
        yield f"{as_text(symbol)}: {meaning}"
    yield f"Source: {law.source}."


def bounds_table(effect: Effect) -> Table:
    """Return the parameters of an effect with symbol, unit and bounds, in SI units."""
    rows = [
        Row((name, as_text(symbol), unit, significant(p.bounds[0]), significant(p.bounds[1])))
        for (symbol, name, _, unit), p in zip(
            parameter_meanings(effect), effect.parameters, strict=True
        )
    ]
    head = (("Parameter", ""), ("Symbol", ""), ("Unit", ""), ("From", ""), ("To", ""))
    return Table("Bounds", head, tuple(rows))


def law_json(effect: Effect) -> dict[str, Any]:
    """Return an effect's law as a JSON value, in SI units; equations and symbols in LaTeX."""
    law = effect.law
    return {
        "name": effect.name,
        "family": effect.family,
        "acts_on": effect.acts_on,
        "summary": effect.summary,
        "origin": _origin(effect),
        "equations": list(law.equations) if law else [],
        "source": law.source if law else "",
        "parameters": [
            {
                "name": p.name,
                "symbol": symbol,
                "meaning": p.meaning,
                "unit": p.unit,
                "bounds": list(p.bounds),
                "neutral": p.neutral,
            }
            for p, (symbol, *_) in zip(effect.parameters, parameter_meanings(effect), strict=True)
        ],
        "where": [{"symbol": s, "meaning": meaning} for s, meaning in other_symbols(effect)],
    }
