"""The score as tables in Markdown, and the cases that went wrong, one line each."""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Iterable, Sequence

from dearig.sim_backend.truth.cases import FORMS, UNKNOWN
from tests.blind.score import FAILED, GROUP, RIGHT, WRONG, Score

__all__ = ["line", "report"]

#: Seconds a case may take.
QUICK = 60.0
#: Share to be named, by mode; of the rest, whatever the mode.
NAMED = {"thesis": 0.90, "rich": 0.95}
EXPLAINED, DESCRIBED, FALSE_ALARMS, SURE = 0.85, 0.80, 0.02, 0.90

_TITLES = {"thesis": "the thesis's record alone", "rich": "the thesis's record and the rich one"}
_HEAD = (
    "| hidden | n | right | group | wrong | RMS before -> after, noise = 1 | within 15 % | worst "
    "| s, median / max |\n|---|---|---|---|---|---|---|---|---|\n"
)
_TARGETS = "| over all | reached | wanted | |\n|---|---|---|---|\n"
_SURE = 0.9  # a probability from which on a diagnosis is sure


def report(scores: Sequence[Score]) -> str:
    """All tables of ``scores``, a mode each, and the list of what went wrong."""
    parts = []
    for mode, title in _TITLES.items():
        of_mode = [s for s in scores if s.mode == mode]
        if of_mode:
            parts.append(f"Training on {title}, {len(of_mode)} cases:\n\n{_families(of_mode)}")
            parts.append(_totals(mode, of_mode))
    wrong = [s for s in scores if s.outcome in (WRONG, FAILED) or s.worse]
    if wrong:
        parts.append("Wrong, failed, or worse than before:\n")
        parts[-1] += "".join(f"\n- {line(s)}; hidden: {s.description or 'nothing'}" for s in wrong)
    return "\n\n".join(parts) if parts else "No results."


def line(s: Score) -> str:
    """One case in one line."""
    hidden = " + ".join(s.families) or "nothing"
    head = f"{s.outcome}: seed {s.seed}, {s.mode}: {hidden} ({_number(s.hidden_um)} um)"
    if s.error:
        return f"{head}, {s.error}"
    steps = [
        f"{name} (or {', '.join(group)})" if group else name
        for name, group in zip(s.named, s.groups, strict=True)
    ]
    if s.unnamed:
        steps.append(f"unnamed [{s.unnamed}]")
    named = ", then ".join(steps) or "nothing"
    worse = ", WORSE" if s.worse else ""
    return (
        f"{head}, named {named}, {s.before:.2f} -> {s.after:.2f} um{worse}, "
        f"{s.verdict}, {s.seconds:.0f} s"
    )


def _families(scores: Sequence[Score]) -> str:
    rows: list[tuple[str, list[Score]]] = [
        (family, [s for s in scores if s.families == (family,)])
        for family in FORMS
        if family != UNKNOWN
    ]
    for label, kind in (("two effects", "pair"), ("in no family", UNKNOWN), ("nothing", "clean")):
        rows.append((label, [s for s in scores if s.kind == kind]))
    return _HEAD + "\n".join(_row(label, of) for label, of in rows if of)


def _row(label: str, scores: Sequence[Score]) -> str:
    def times(outcome: str) -> int:
        return sum(s.outcome == outcome for s in scores)

    told = [s for s in scores if s.outcome != FAILED]
    failed = len(scores) - len(told)
    wrong = f"{times(WRONG)}" + (f" + {failed} failed" if failed else "")
    spent = [s.seconds for s in scores]
    errors = "-> | | "
    if told:
        before = statistics.median(s.before / s.least for s in told)
        after = statistics.median(s.over_least for s in told)
        worst = max(s.over_least for s in told)
        within = sum(s.is_noise for s in told)
        errors = f"{before:.3g} -> {after:.3g} | {within} of {len(scores)} | {worst:.3g}"
    return (
        f"| {label} | {len(scores)} | {times(RIGHT)} | {times(GROUP)} | {wrong} | {errors} "
        f"| {statistics.median(spent):.0f} / {max(spent):.0f} |"
    )


def _totals(mode: str, scores: Sequence[Score]) -> str:
    covered = [s for s in scores if s.kind in ("covered", "pair")]
    pairs = [s for s in scores if s.kind == "pair"]
    unknown = [s for s in scores if s.kind == UNKNOWN]
    clean = [s for s in scores if s.kind == "clean"]
    told = [s for s in scores if s.outcome != FAILED]
    closed = [s for s in told if s.verdict in ("explained", "nothing_missing")]
    open_ = [s for s in told if s not in closed]
    sure = [s for s in scores if s.leading_probability >= _SURE]
    rows = [
        _share("named right or in the group", covered, lambda s: s.found, NAMED[mode]),
        _share("within 15 % of the noise", covered, lambda s: s.is_noise, EXPLAINED),
        _share(
            "... of what hides no drift that changes from run to run",
            [s for s in covered if not s.own],
            lambda s: s.is_noise,
            None,
        ),
        _share("both of two effects named", pairs, lambda s: bool(s.both), None),
        _share("of no family, and said so", unknown, lambda s: s.outcome == RIGHT, DESCRIBED),
        _most("false alarms", clean, lambda s: s.outcome != RIGHT, FALSE_ALARMS),
        _most("worse than before", scores, lambda s: s.worse, 0.0),
        _most("something needless named", covered, lambda s: bool(s.needless), None),
        _share(f"said with {_SURE:g} or more, and true", sure, lambda s: s.leads_right, SURE),
        _share("explained or nothing_missing, and within 15 %", closed, lambda s: s.is_noise, None),
        _share("any other verdict, and within 15 %", open_, lambda s: s.is_noise, None),
        _most(f"longer than {QUICK:.0f} s", scores, lambda s: s.seconds > QUICK, 0.0),
        _most(
            f"longer than {QUICK:.0f} s of processors", scores, lambda s: s.processor > QUICK, None
        ),
    ]
    floors = [s.floor_read / s.floor for s in scores if s.outcome != FAILED]
    said = ""
    if floors:
        said = (
            f"\n\nThe rig's noise is {scores[0].floor:.3f} um; the diagnoses read "
            f"{min(floors):.2f} to {max(floors):.2f} times that. A drift that "
            "changes from run to run counts as noise: not even the hidden truth predicts it."
        )
    return _TARGETS + "\n".join(row for row in rows if row) + said + _sureness(scores)


def _sureness(scores: Sequence[Score]) -> str:
    """The calibration of probabilities, and the processor time; "" where neither is known."""
    sure = [s for s in scores if math.isfinite(s.probability)]
    spent = [s.processor for s in scores if s.processor > 0.0]
    said = ""
    if sure:
        right = [s for s in sure if s.probability >= _SURE]
        wrong = [s for s in sure if s.probability <= 1.0 - _SURE]
        mean, brier = _mean(s.probability for s in sure), _mean(s.brier for s in sure)
        said = (
            f"\n\nThe probability given to what is true is {mean:.2f} in the mean, the Brier score "
            f"{brier:.2f} ({len(sure)} cases): {len(right)} times at least {_SURE:g}, "
            f"{len(wrong)} times at most {1.0 - _SURE:.2g}."
        )
    if spent:
        said += f"\n\nSeconds of processors: median {statistics.median(spent):.1f}, "
        said += f"largest {max(spent):.0f}."
    return said


def _mean(values: Iterable[float]) -> float:
    return statistics.fmean(values)


def _share(
    label: str, of: Sequence[Score], holds: Callable[[Score], bool], wanted: float | None
) -> str:
    if not of:
        return ""
    hits = sum(map(holds, of))
    target = "" if wanted is None else f">= {wanted:.0%}"
    verdict = "" if wanted is None else _verdict(hits >= wanted * len(of))
    return f"| {label} | {hits} of {len(of)} ({hits / len(of):.0%}) | {target} | {verdict} |"


def _most(
    label: str, of: Iterable[Score], holds: Callable[[Score], bool], allowed: float | None
) -> str:
    scores = list(of)
    if not scores:
        return ""
    hits = sum(map(holds, scores))
    most = None if allowed is None else math.floor(allowed * len(scores) + 1e-9)
    target = "" if most is None else f"<= {most}"
    verdict = "" if most is None else _verdict(hits <= most)
    return f"| {label} | {hits} of {len(scores)} | {target} | {verdict} |"


def _verdict(kept: bool) -> str:
    return "yes" if kept else "**no**"


def _number(value: float) -> str:
    return f"{value:.3g}" if math.isfinite(value) else "?"
