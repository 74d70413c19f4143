"""Formulas: LaTeX as MathML for a page, and as a line of text for a terminal.

The subset of LaTeX that this project writes: fractions, roots, sums, integrals, sub- and
superscripts, Greek letters, names of functions, accents, and cases.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import cache

__all__ = ["ASCII", "as_text", "mathml", "symbols_of"]

_GREEK = {
    "alpha": "α", "beta": "β", "gamma": "γ", "delta": "δ", "epsilon": "ε", "varepsilon": "ε",
    "zeta": "ζ", "eta": "η", "theta": "θ", "kappa": "κ", "lambda": "λ", "mu": "μ", "nu": "ν",
    "xi": "ξ", "pi": "π", "rho": "ρ", "sigma": "σ", "tau": "τ", "phi": "φ", "omega": "ω",
    "Gamma": "Γ", "Delta": "Δ", "Omega": "Ω", "Psi": "Ψ",
}  # fmt: skip
_SIGNS = {
    "cdot": " · ", "le": " ≤ ", "ge": " ≥ ", "ne": " ≠ ", "sum": "Σ", "int": "∫", "partial": "∂",
    "infty": "∞", "quad": "  ", ",": " ", "left": "", "right": "", "to": " → ", "pm": "±",
    "times": " × ", "approx": " ≈ ", "|": "|", "{": "{", "}": "}", "%": "%", ";": " ", "!": "",
}  # fmt: skip
_FUNCTIONS = ("sin", "cos", "tan", "tanh", "sinh", "cosh", "exp", "ln", "max", "min", "log", "det")
_ACCENTS = {"dot": "\u0307", "ddot": "\u0308", "bar": "\u0304", "hat": "\u0302"}
_PLAIN_NAMES = ("mathrm", "operatorname", "text")

#: Signs of ``as_text`` in ASCII: Greek letters by name, a derivative by time as an apostrophe.
ASCII = {
    **{letter: name for name, letter in _GREEK.items()},
    **dict(zip("≤≥≠Σ∫∂·", ("<=", ">=", "!=", "sum", "integral", "d", "*"), strict=True)),
    "\u0307": "'", "\u0308": "''", "\u0304": "_mean", "\u0302": "_hat",
}  # fmt: skip

#: Tokens after which, or before the end, a fraction stands alone.
_ENDS = frozenset(
    {"}", "+", "-", "=", ",", ")", "|", "&", "<", ">", r"\right", r"\\", r"\quad", r"\le", r"\ge"}
)

_TOKEN = re.compile(r"\\[A-Za-z]+|\\.|[A-Za-z]|\d+(?:\.\d+)?|\s+|.", re.DOTALL)


@cache
def mathml(latex: str, display: bool = True) -> str:
    """Return the formula as a MathML element.

    Parameters
    ----------
    latex : str
        The formula without delimiters.
    display : bool
        On a line of its own; otherwise within a line of text.
    """
    from latex2mathml.converter import convert

    made = str(convert(latex, display="block" if display else "inline"))
    # in HTML the element needs no name space, and a page without addresses can be checked
    return re.sub(r' xmlns="[^"]*"', "", made, count=1)


def as_text(latex: str) -> str:
    """Return the formula as one line of text, with Greek letters and fractions as ``a/b``.

    Parameters
    ----------
    latex : str
        The formula without delimiters.
    """
    tokens = _Tokens(_TOKEN.findall(latex))
    return re.sub(r" {3,}", "  ", _row(tokens, "")).strip()


def symbols_of(latex: str) -> tuple[str, ...]:
    """Return the symbols of a formula in LaTeX, in the order in which they occur.

    A symbol is a letter with its subscript; an accent (a time derivative) is not part of it. Units
    and names of functions, which are upright, are left out, and so are the counters of sums.
    """
    upright = re.sub(r"\\(?:mathrm|operatorname|text|begin|end)\{[^}]*\}", " ", latex)
    counters = set(re.findall(r"\\sum_\{(\w)=", upright))
    upright = re.sub(r"\\sum_\{[^}]*\}\^\{[^}]*\}", " ", upright)
    found = re.findall(
        r"(\\[A-Za-z]+|[A-Za-z])(?:\})?(_(?:\{[^}]*\}|\w))?", re.sub(r"\\[,;!]", " ", upright)
    )
    names = [
        f"{base}{below}"
        for base, below in found
        if not base.startswith("\\") or (base[1:] in _GREEK and base != r"\pi")
    ]
    return tuple(dict.fromkeys(n for n in names if n not in counters))


class _Tokens:
    """Tokens that are read one after the other."""

    def __init__(self, tokens: list[str]) -> None:
        self._tokens = tokens
        self._at = 0

    def __iter__(self) -> Iterator[str]:
        while self._at < len(self._tokens):
            self._at += 1
            yield self._tokens[self._at - 1]

    def peek(self) -> str:
        """Return the next token; empty at the end."""
        return self._tokens[self._at] if self._at < len(self._tokens) else ""

    @property
    def has_factor(self) -> bool:
        """Whether what follows multiplies: then a fraction before it needs parentheses."""
        rest = (t for t in self._tokens[self._at :] if not t.isspace())
        following = next(rest, "}")
        if following == r"\left":
            following = next(rest, "")
        return following not in _ENDS

    def argument(self) -> str:
        """Return the text of the next group or token."""
        for part in self:
            if part.isspace():
                continue
            return _row(self, "}") if part == "{" else _one(part, self)
        return ""


def _row(tokens: _Tokens, end: str) -> str:
    """Return the text up to ``end`` (a closing brace), or of all tokens."""
    found = ""
    for part in tokens:
        if part == end:
            break
        if part in ("_", "^"):
            found = found.rstrip() + _script(part, tokens.argument())
        elif part.isspace():
            found += " " if found and not found.endswith(" ") else ""
        else:
            found += _one(part, tokens)
    return re.sub(r" {2}(?! )", " ", found)


def _script(mark: str, text: str) -> str:
    text = text.strip()
    if text == "'":
        return "'"
    return f"{mark}{text}" if len(text) == 1 or re.fullmatch(r"\w+", text) else f"{mark}({text})"


def _one(part: str, tokens: _Tokens) -> str:
    """Return the text of one part with its arguments."""
    if part == "{":
        return _row(tokens, "}")
    if part == "&":
        return "  if "
    if not part.startswith("\\"):
        return part
    name = part[1:]
    if name == "frac":
        whole = f"{_factor(tokens.argument())}/{_factor(tokens.argument(), divisor=True)}"
        return f"({whole})" if tokens.has_factor else whole
    if name == "sqrt":
        return f"sqrt({tokens.argument()})"
    if name in _ACCENTS:
        body = tokens.argument()
        return body[:1] + _ACCENTS[name] + body[1:]
    if name in _PLAIN_NAMES:
        body = tokens.argument()
        return (
            f"{body} " if name == "operatorname" and tokens.peek() not in ("(", r"\left") else body
        )
    if name in ("begin", "end"):
        tokens.argument()
        return "{ " if name == "begin" else " }"
    if name == "\\":
        return "; "
    if name in _FUNCTIONS:
        following = tokens.peek()
        return name if following in ("(", r"\left", "_", "^") else f"{name} "
    return _GREEK.get(name) or _SIGNS.get(name, name)


def _factor(text: str, divisor: bool = False) -> str:
    """Return ``text``, in parentheses where it would be misread above or below a stroke."""
    text = text.strip()
    needs = re.search(r"[ +\-/]" if divisor else r"[+\-]|[ /]", text)
    return f"({text})" if needs else text
