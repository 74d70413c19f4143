"""What a diagnosis is worth, given what the rig hid."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import permutations
from typing import Any

from tests.blind.seeds import kind_of

__all__ = ["FAILED", "GROUP", "RIGHT", "WITHIN", "WRONG", "Score", "score"]

RIGHT, GROUP, WRONG, FAILED = "right", "group", "wrong", "failed"

#: A validation RMS counts as noise up to this many times the rig's noise.
WITHIN = 1.15
_SAME_UM = 1e-3  # two errors nearer than this are the same


@dataclass(frozen=True)
class Score:
    """One case. Errors are validation RMS in um, NaN where the command failed.

    ``named`` are the families of the steps in their order, ``groups`` those that each step says it
    could as well be. ``outcome`` is ``right`` (the first step names what is hidden; nothing is
    named where nothing is; what is in no family is not passed off as one), ``group`` (the first
    step says that it cannot tell it from what is hidden), ``wrong``, or ``failed``. ``both`` is
    None but for two effects. ``needless`` are families named that are not hidden. ``floor`` is the
    rig's noise, ``own`` what the validation recordings have each of their own: the way a bench has
    wandered, which the hidden truth itself could not predict. ``probability`` is what the
    diagnosis gives to what is true, ``brier`` the Brier score; ``processor`` are seconds of
    processors that the command took; all NaN where they are not known. ``leading`` is the family
    of the highest probability, ``leading_probability``.
    """

    seed: int
    mode: str
    kind: str
    families: tuple[str, ...]
    description: str
    hidden_um: float
    named: tuple[str, ...]
    groups: tuple[tuple[str, ...], ...]
    unnamed: str
    verdict: str
    outcome: str
    both: bool | None
    needless: tuple[str, ...]
    floor: float
    own: float
    floor_read: float
    before: float
    after: float
    seconds: float
    error: str
    probability: float = math.nan
    brier: float = math.nan
    processor: float = math.nan
    leading: str = ""
    leading_probability: float = math.nan

    @property
    def leads_right(self) -> bool:
        """Whether the family that the diagnosis gives the highest probability is hidden."""
        return self.leading in _truth(self.families)

    @property
    def least(self) -> float:
        """RMS in um that the hidden truth itself would leave: noise, and what is of one run."""
        return math.hypot(self.floor, self.own)

    @property
    def over_least(self) -> float:
        """Validation RMS after over that."""
        return self.after / self.least

    @property
    def is_noise(self) -> bool:
        """Whether validation is down to what the hidden truth itself would leave."""
        return self.over_least <= WITHIN

    @property
    def worse(self) -> bool:
        """Whether validation is worse than with the baseline."""
        return self.after > self.before + _SAME_UM

    @property
    def found(self) -> bool:
        """Whether the hidden family, or a group that holds it, is the first named."""
        return self.outcome in (RIGHT, GROUP)


def score(result: Mapping[str, Any]) -> Score:
    """The score of a kept ``result``."""
    truth, answer = result["truth"], result["diagnosis"]
    families, said = tuple(truth["families"]), _said(answer)
    kind = kind_of(families)
    nan = float("nan")
    named: tuple[str, ...] = ()
    groups: tuple[tuple[str, ...], ...] = ()
    unnamed, verdict, outcome, both = "", "", FAILED, None
    before = after = floor_read = nan
    if answer is not None:
        steps = answer["steps"]
        named = tuple(step["family"] for step in steps)
        groups = tuple(tuple(step["indistinguishable_from"]) for step in steps)
        unnamed = answer["unnamed"]["expression"] or "?" if answer["unnamed"] else ""
        verdict = answer["verdict"]
        floor_read = answer["noise_floor_um"]
        before, after = _validation(answer["baseline"]), _validation(answer["final"])
        if kind == "clean":
            clean = verdict == "nothing_missing" and not steps and not unnamed
            outcome = RIGHT if clean else WRONG
        elif kind == "unknown":
            noise = after <= WITHIN * math.hypot(result["floor_um"], result["own_um"])
            outcome = RIGHT if "unknown" in named or unnamed or noise else WRONG
        else:
            outcome = _first_step(families, named, groups)
        if kind == "pair":
            both = _both(families, named, groups)
    return Score(
        seed=result["seed"],
        mode=result["mode"],
        kind=kind,
        families=families,
        description=truth["description"],
        hidden_um=truth["hidden_um"],
        named=named,
        groups=groups,
        unnamed=unnamed,
        verdict=verdict,
        outcome=outcome,
        both=both,
        needless=_needless(families, named, groups),
        floor=result["floor_um"],
        own=result["own_um"],
        floor_read=floor_read,
        before=before,
        after=after,
        seconds=result["wall_s"],
        error=result["error"],
        probability=_probability(families, answer),
        brier=_brier(families, answer),
        processor=result.get("processor_s", math.nan),
        leading=max(said, key=said.__getitem__, default=""),
        leading_probability=max(said.values(), default=math.nan),
    )


def _truth(families: tuple[str, ...]) -> set[str]:
    return set(families) or {"none"}


def _probability(families: tuple[str, ...], answer: Mapping[str, Any] | None) -> float:
    """Probability that the diagnosis gives to what is true; NaN where it gives none."""
    said = _said(answer)
    return sum(said.get(f, 0.0) for f in _truth(families)) if said else math.nan


def _brier(families: tuple[str, ...], answer: Mapping[str, Any] | None) -> float:
    """Brier score of the probabilities: 0 is certain and right, 2 certain and wrong."""
    said, truth = _said(answer), _truth(families)
    wanted = dict.fromkeys(truth, 1.0 / len(truth))
    every = {*said, *truth}
    errors = ((said.get(f, 0.0) - wanted.get(f, 0.0)) ** 2 for f in every)
    return sum(errors) if said else math.nan


def _said(answer: Mapping[str, Any] | None) -> dict[str, float]:
    listed = [] if answer is None else answer.get("families", [])
    return {item["family"]: item["probability"] for item in listed}


def _validation(stand: Mapping[str, Any]) -> float:
    """Validation RMS in um; infinite where the model cannot follow the recordings."""
    found = stand["validation"]
    rms = None if found is None else found["rms_um"]
    return float("inf") if rms is None else float(rms)


def _first_step(
    families: tuple[str, ...], named: tuple[str, ...], groups: tuple[tuple[str, ...], ...]
) -> str:
    if not named:
        return WRONG
    if named[0] in families:
        return RIGHT
    return GROUP if set(groups[0]) & set(families) else WRONG


def _both(
    families: tuple[str, ...], named: tuple[str, ...], groups: tuple[tuple[str, ...], ...]
) -> bool:
    """Whether each of two families is in a step of its own, by name or in its group."""
    meant = [{name, *group} for name, group in zip(named, groups, strict=True)]
    return any(
        all(family in step for family, step in zip(families, steps, strict=True))
        for steps in permutations(meant, len(families))
    )


def _needless(
    families: tuple[str, ...], named: tuple[str, ...], groups: tuple[tuple[str, ...], ...]
) -> tuple[str, ...]:
    return tuple(
        name
        for name, group in zip(named, groups, strict=True)
        if not {name, *group} & set(families)
    )
