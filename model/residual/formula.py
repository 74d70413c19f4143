"""Describe a residual that no effect explains by a short formula.

Sparse regression (orthogonal matching pursuit) of the missing stress on a small dictionary of terms
in stretch, rate, voltage, time and delayed copies. The formula is fitted on one part of the time
and counts only if it explains the other part too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dearig.model.residual.missing_stress import MissingStress
from dearig.model.residual.signature import Signature

__all__ = ["Unnamed", "describe_unnamed", "looks"]

_TERMS_MAX = 3
_TERM_SHARE_MIN = 0.05  # of the variance in the part left out: what each term must explain
_FORMULA_SHARE_MIN = 0.3  # of it: what a formula must explain
_BLOCKS = 8  # of time, every other one left out
_DELAYS = (0.05, 0.2, 1.0)  # s


@dataclass(frozen=True)
class Unnamed:
    """A residual that no effect explains: where it acts, a formula if found, and a description."""

    acts_on: str
    expression: str
    signature: str


def describe_unnamed(
    missing: Sequence[MissingStress], after: Sequence[Signature]
) -> Unnamed | None:
    """Return a description of the residual that no family explains; None without records."""
    if not missing:
        return None
    largest = max(missing, key=lambda m: float(np.var(m.stress)))
    terms, share = _pursuit(largest)
    if share < _FORMULA_SHARE_MIN:
        return Unnamed(_where(after), "", f"no short formula explains it. {looks(after)}")
    formula = " ".join(f"{c:+.3g} {name}" for name, c in terms)
    return Unnamed(
        _where(after),
        f"p/Pa = {formula}",
        f"the formula explains {100 * share:.0f} % of the missing stress in the parts of the time "
        f"that it was not fitted to. {looks(after)}",
    )


def looks(after: Sequence[Signature]) -> str:
    """Return what is remarkable in the residual of each record, in words."""
    return "; ".join(f"{s.record}: {', '.join(s.words)}" for s in after)


def _where(after: Sequence[Signature]) -> str:
    """Return the place in the signal path of the quantity that explains most of the residual."""
    shares: dict[str, float] = {}
    for s in after:
        for d in s.dependences:
            shares[d.quantity] = shares.get(d.quantity, 0.0) + d.explained * s.rms**2
    if not shares:
        return "film stress"
    first = max(shares, key=lambda q: shares[q])
    return {
        "voltage squared": "dielectric",
        "displacement": "film stress",
        "stretch": "film stress",
        "stress": "film stress",
        "rate": "load",
        "rate of stretch": "film stress",
        "time": "environment",
    }[first]


def _dictionary(m: MissingStress) -> dict[str, np.ndarray]:
    """Candidate terms (N,) by name, each in its own unit."""
    strain = m.stretch - m.stretch[0]
    scale = float(np.max(np.abs(m.rate))) or 1.0
    kilovolts = m.voltage * 1e-3
    step = float(np.median(np.diff(m.time)))
    terms = {
        "e": strain,
        "e^2": strain**2,
        "e^3": strain**3,
        "e'": m.rate,
        "e'|e'|": m.rate * np.abs(m.rate),
        "sign(e')": np.tanh(m.rate / (0.02 * scale)),
        "e e'": strain * m.rate,
        "V": kilovolts,
        "V^2": kilovolts**2,
        "V^4": kilovolts**4,
        "e V^2": strain * kilovolts**2,
        "t": m.time - m.time[0],
        "e t": strain * (m.time - m.time[0]),
    }
    for delay in _DELAYS:
        shift = max(round(delay / step), 1)
        if shift < strain.size // 4:
            late = np.concatenate([np.full(shift, strain[0]), strain[:-shift]])
            terms[f"e(t - {delay:g} s)"] = late
            late = np.concatenate([np.zeros(shift), kilovolts[:-shift] ** 2])
            terms[f"V^2(t - {delay:g} s)"] = late
    largest = float(np.max(strain))
    for part in (0.5, 0.7, 0.85):
        at = part * largest
        terms[f"max(e - {at:.3g}, 0)"] = np.maximum(strain - at, 0.0)
    return {n: t for n, t in terms.items() if float(np.std(t)) > 0.0}


def _pursuit(m: MissingStress) -> tuple[list[tuple[str, float]], float]:
    """Return terms with coefficients, and the share of variance explained in the part left out."""
    terms = _dictionary(m)
    block = (np.arange(m.time.size) * _BLOCKS // m.time.size) % 2
    fit, check = block == 0, block == 1
    target = m.stress - m.stress[fit].mean()
    names: list[str] = []
    best_share, best_size = 0.0, np.empty(0)
    total = float(np.sum((target[check] - target[check].mean()) ** 2)) or 1.0
    while len(names) < _TERMS_MAX:
        trials = []
        for name in terms:
            if name in names:
                continue
            columns = np.column_stack([*(terms[n] for n in (*names, name)), np.ones(target.size)])
            size, *_ = np.linalg.lstsq(columns[fit], target[fit], rcond=1e-10)
            inside = float(np.sum((target[fit] - columns[fit] @ size) ** 2))
            outside = target[check] - columns[check] @ size
            trials.append((inside, 1.0 - float(outside @ outside) / total, name, size))
        if not trials:
            break
        _, share, name, size = min(trials, key=lambda t: t[0])
        if share < best_share + _TERM_SHARE_MIN:
            break
        names.append(name)
        best_share, best_size = share, size
    return list(zip(names, best_size[:-1].tolist(), strict=True)), best_share
