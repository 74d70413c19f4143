"""A model as a page of equations with numbers, in LaTeX."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

from dearig.config.modelfile import ModelFile
from dearig.model.effects import EFFECTS
from dearig.model.simulation.actuator import Actuator
from dearig.model.springs import LIMIT, SPRING_LAWS
from dearig.report.model_export.caveats import caveats
from dearig.report.text.laws import other_symbols, parameter_meanings
from dearig.report.text.numbers import interval, interval_ends, quoted, significant

__all__ = ["latex_page"]

_FIXED = "fixed"  # in place of the interval of a parameter that was stated
_HEAD = r"""\documentclass[11pt]{article}
\usepackage[T1]{fontenc}
\usepackage[utf8]{inputenc}
\usepackage{amsmath}
\usepackage[a4paper, margin=25mm]{geometry}
\setlength{\parindent}{0pt}
\begin{document}
"""
_MOTION = r"""\section*{Motion}
\begin{equation*}
\frac{\rho L_1^2}{3} \ddot{\lambda} = \frac{F}{L_2 Z} + \varepsilon \left(\frac{V}{Z}\right)^2 a(\lambda) - \frac{1}{\lambda} \sum_{i} \mu_i\,p_i(\lambda/\xi_i), \quad \xi_0 = 1, \quad \dot{\xi}_i = \frac{1}{T_i} p_i(\lambda/\xi_i)
\end{equation*}
where $\lambda$ is the stretch, $\xi_i$ the inner stretch of branch $i$ and $\mu_i p_i$ the true stress of its spring.
"""
_FILM = r"""\section*{Stress}
\begin{equation*}
\sigma = \frac{1}{\lambda} \sum_{i} \mu_i\,p_i(\lambda/\xi_i), \quad \xi_0 = 1, \quad \dot{\xi}_i = \frac{1}{T_i} p_i(\lambda/\xi_i)
\end{equation*}
where $\sigma$ is the nominal stress, $\lambda$ the stretch, $\xi_i$ the inner stretch of branch $i$ and $\mu_i p_i$ the true stress of its spring.
"""
#: I1 - 3 of a spring at its own stretch e, and a of the electric term.
_KINEMATICS = {
    "constrained-width": (r"e^2 + e^{-2} - 2", r"\lambda"),
    "uniaxial": (r"e^2 + 2 e^{-1} - 3", r"\frac{1}{2}"),
    "equibiaxial": (r"2 e^2 + e^{-4} - 3", r"\lambda^3"),
}
_ENERGIES = {
    "gent": r"-\frac{\mu J}{2} \ln\left(1 - \frac{I_1 - 3}{J}\right)",
    "neo-hookean": r"\frac{\mu}{2} (I_1 - 3)",
}


def latex_page(given: ModelFile, version: str) -> str:
    """Return ``given`` as a LaTeX document: equations, numbers with intervals, effects."""
    return "\n".join(_lines(given, version)) + "\n"


def _lines(given: ModelFile, version: str) -> Iterator[str]:
    model = given.model
    found = _estimates(given.history)
    yield f"% written by dearig {version}"
    yield _HEAD.rstrip()
    yield rf"\section*{{Model {_escaped(given.name)}}}"
    film = model.film if isinstance(model, Actuator) else None
    kinematics = film.kinematics if film is not None else model.kinematics  # type: ignore[union-attr]
    yield (_MOTION if film is not None else _FILM).rstrip()
    strain, pull = _KINEMATICS[kinematics]
    yield rf"The film is held {_escaped(kinematics)}: $I_1 - 3 = {strain}$ of a spring at its own stretch $e$"
    yield rf"and $a = {pull}$." if film is not None else "."
    for kind in sorted({s.kind for s in model.network.springs}):
        law = SPRING_LAWS[kind]
        energy = f" $W = {_ENERGIES[kind]}$." if kind in _ENERGIES else ""
        yield rf"{_escaped(law.title)} springs ({_escaped(law.source)}).{energy}"
    yield r"\section*{Numbers}"
    yield r"\begin{tabular}{llll}"
    yield r"symbol & value & unit & 95\,\% interval \\ \hline"
    if isinstance(model, Actuator):
        for symbol, value, unit in (
            ("L_1", model.film.length, "m"),
            ("L_2", model.film.width, "m"),
            ("Z", model.film.thickness, "m"),
            (r"\rho", model.film.density, r"kg/m$^3$"),
            (r"\varepsilon/\varepsilon_0", model.film.permittivity, ""),
            ("F", model.load.weight, "N"),
        ):
            yield _row(symbol, value, unit, None)
    for i, spring in enumerate(model.network.springs):
        yield _row(rf"\mu_{{{i}}}", spring.modulus, "Pa", found.get(f"mu_{i}"))
        law = SPRING_LAWS[spring.kind]
        shape = [spring.limit, *spring.shape] if law.has_limit else list(spring.shape)
        for p, value in zip(law.parameters, shape, strict=True):
            name = f"{p.symbol}_{i}"
            symbol = p.symbol if p.name == LIMIT else rf"\mathrm{{{p.symbol}}}"
            yield _row(f"{symbol}_{{{i}}}", value, "", found.get(name))
        if i:
            yield _row(
                f"T_{{{i}}}",
                model.network.branches[i - 1].relaxation_time,
                "s",
                found.get(f"T_{i}"),
            )
    yield r"\end{tabular}"
    for name, given_values in model.effects:
        yield from _effect_lines(name, dict(given_values), found)
    if not found:
        yield "\nThe model file has no intervals."
    yield from (f"\n{_escaped(sentence)}" for sentence in caveats(given))
    yield r"\end{document}"


def _effect_lines(
    name: str, values: Mapping[str, float], found: Mapping[str, tuple[Any, Any]]
) -> Iterator[str]:
    effect = EFFECTS[name]
    yield rf"\section*{{{_escaped(name[:1].upper() + name[1:])}}}"
    yield f"{_escaped(effect.summary[:1].upper() + effect.summary[1:])}."
    if effect.law is None:
        yield "Its package gives no equation."
    else:
        for equation in effect.law.equations:
            yield rf"\begin{{equation*}} {equation} \end{{equation*}}"
    yield r"\begin{tabular}{lllll}"
    yield r"symbol & parameter & value & unit & 95\,\% interval \\ \hline"
    for symbol, label, meaning, unit in parameter_meanings(effect):
        key = label.replace(" ", "_")
        value = next(v for n, v in values.items() if n.replace(" ", "_") == key)
        row = _row(
            symbol or r"\cdot", value, _escaped(unit), found.get(f"{name}: {key}", found.get(key))
        )
        first, _, rest = row.partition(" & ")
        yield f"{first} & {_escaped(f'{label} {meaning}')} & {rest}"
    yield r"\end{tabular}"
    others = "; ".join(rf"${s}$: {_escaped(about)}" for s, about in other_symbols(effect))
    if others:
        yield f"\n{others}."
    if effect.law is not None:
        yield f"\nSource: {_escaped(effect.law.source)}."


def _estimates(history: Mapping[str, Any]) -> dict[str, tuple[Any, Any]]:
    """Intervals (low, high) by parameter, as far as the history has them; None is an open end.

    Of a parameter that was stated, not fitted, both are ``_FIXED``.
    """
    tables = [*history.get("estimate", [])]
    for step in history.get("step", []):
        if isinstance(step, Mapping):
            tables += [
                {**e, "name": f"{step.get('effect')}: {e.get('name')}"}
                for e in step.get("estimate", step.get("parameter", []))
                if isinstance(e, Mapping)
            ]
    return {
        str(t["name"]): (_FIXED, _FIXED) if _is_fixed(t) else (t.get("low95"), t.get("high95"))
        for t in tables
        if isinstance(t, Mapping)
        and "name" in t
        and ("low95" in t or "high95" in t or _is_fixed(t))
    }


def _is_fixed(table: Mapping[str, Any]) -> bool:
    stated = table.get("stated")
    return isinstance(stated, Mapping) and "fixed" in stated


def _row(symbol: str, value: float, unit: str, ends: tuple[Any, Any] | None) -> str:
    if ends is None:
        return rf"${symbol}$ & {_math(significant(value, 6))} & {unit} & \\"
    if ends[0] == _FIXED:
        return rf"${symbol}$ & {_math(significant(value, 6))} & {unit} & {_FIXED} \\"
    # an end that the data leave open is 0 or infinite, and the history has neither
    low = 0.0 if ends[0] is None else float(ends[0])
    high = math.inf if ends[1] is None else float(ends[1])
    shown = _math(quoted(value, low, high))
    if None in ends:
        word, _, number = interval(low, high).partition(" ")
        within = f"{word} {_math(number)}" if number else word
    else:
        within = f"[{', '.join(map(_math, interval_ends(low, high)))}]"
    return rf"${symbol}$ & {shown} & {unit} & {within} \\"


def _math(number: str) -> str:
    """A number of a report as LaTeX: powers of ten raised, a minus sign that is one."""
    raised = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻", "0123456789-")
    plain = number.replace("\N{INFINITY}", r"\infty")
    head, mark, power = plain.partition("\N{MULTIPLICATION SIGN} 10")
    if mark:
        plain = rf"{head.strip()} \times 10^{{{power.translate(raised)}}}"
    return f"${plain}$"


def _escaped(text: str) -> str:
    marks = {"\\": r"\textbackslash{}", "^": r"\^{}", "~": r"\~{}"}
    return "".join(marks.get(c, f"\\{c}" if c in "&%$#_{}" else c) for c in text)
