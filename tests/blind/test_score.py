"""The blind test's own arithmetic, on answers written by hand; and one case from end to end."""

from __future__ import annotations

import inspect
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from dearig.model.fitting.estimates import estimates_with_intervals
from tests.blind import play
from tests.blind.bare import values_alone
from tests.blind.play import Bench, Case, case_of
from tests.blind.score import Score, score
from tests.blind.seeds import CLEAN_FROM, chosen, clean_seeds, drawn, family_seeds, kind_of
from tests.blind.table import line, report

FLOOR = 1.06


def errors(rms_um: float) -> dict[str, float]:
    return {"rms_um": rms_um, "nrmse_pct": 0.1, "max_um": 4.0 * rms_um}


def step(family: str, *others: str) -> dict[str, Any]:
    return {"effect": family, "family": family, "indistinguishable_from": list(others)}


def result(
    hidden: tuple[str, ...],
    *steps: dict[str, Any],
    before: float = 20.0,
    after: float = 1.07,
    unnamed: dict[str, str] | None = None,
    seed: int = 0,
    mode: str = "thesis",
    own: float = 0.0,
) -> dict[str, Any]:
    """A kept result in which ``hidden`` was diagnosed as ``steps``."""
    anything = bool(steps or unnamed)
    return {
        "seed": seed,
        "mode": mode,
        "sources": "as they are",
        "floor_um": FLOOR,
        "own_um": own,
        "truth": {
            "families": list(hidden),
            "description": " and ".join(hidden),
            "hidden_um": 30.0,
        },
        "wall_s": 10.0 + seed,
        "error": "",
        "diagnosis": {
            "noise_floor_um": 1.05,
            "baseline": {"validation": errors(before)},
            "steps": list(steps),
            "final": {"validation": errors(after)},
            "verdict": "explained" if anything else "nothing_missing",
            "unnamed": unnamed,
        },
    }


def failed(hidden: tuple[str, ...]) -> dict[str, Any]:
    return {**result(hidden), "diagnosis": None, "error": "exit code 1: it fell over"}


@pytest.mark.parametrize(
    ("steps", "outcome"),
    [
        ([step("drag")], "right"),
        ([step("drag", "creep"), step("creep")], "right"),
        ([step("creep", "drift", "drag")], "group"),
        ([step("creep", "drift")], "wrong"),
        # only the first step counts: what else had to be put in is not what is missing
        ([step("creep"), step("drag")], "wrong"),
        ([], "wrong"),
    ],
)
def test_the_first_step_must_name_what_is_hidden(steps: list[dict[str, Any]], outcome: str) -> None:
    assert score(result(("drag",), *steps)).outcome == outcome


def test_what_is_named_and_not_hidden_is_needless() -> None:
    s = score(result(("drag",), step("drag"), step("creep", "drag"), step("drift", "thermal")))
    assert s.needless == ("drift",)


@pytest.mark.parametrize(
    ("steps", "outcome", "both"),
    [
        ([step("drag"), step("creep")], "right", True),
        ([step("creep"), step("drag")], "right", True),
        ([step("creep")], "right", False),
        # one step whose group holds the other is one effect, not two
        ([step("creep", "drag")], "right", False),
        ([step("drift", "creep"), step("drag")], "group", True),
        ([step("leakage"), step("drag"), step("creep")], "wrong", True),
        ([step("leakage")], "wrong", False),
        ([], "wrong", False),
    ],
)
def test_two_effects(steps: list[dict[str, Any]], outcome: str, both: bool) -> None:
    s = score(result(("creep", "drag"), *steps))
    assert (s.kind, s.outcome, s.both) == ("pair", outcome, both)


def test_a_clean_film_has_nothing_missing() -> None:
    assert score(result((), after=1.06)).outcome == "right"
    assert score(result((), step("drift"))).outcome == "wrong"
    strange = {"acts_on": "film", "expression": "", "signature": "s"}
    assert score(result((), unnamed=strange)).outcome == "wrong"


def test_what_is_in_no_family_must_be_said_or_explained_all_the_same() -> None:
    formula = {"acts_on": "film", "expression": "0.3 rate", "signature": "s"}
    of = ("unknown",)
    assert score(result(of, step("unknown"), after=9.0)).outcome == "right"
    assert score(result(of, step("drag"), unnamed=formula, after=9.0)).outcome == "right"
    assert score(result(of, step("drag"), after=1.15 * FLOOR)).outcome == "right"
    assert score(result(of, step("drag"), after=1.16 * FLOOR)).outcome == "wrong"


def test_errors_are_held_against_the_rigs_own_noise() -> None:
    s = score(result(("drag",), step("drag"), after=1.15 * FLOOR))
    assert s.is_noise
    assert not s.worse
    assert not score(result(("drag",), step("drag"), after=1.2 * FLOOR)).is_noise
    assert score(result(("drag",), step("drag"), before=1.2, after=1.21)).worse
    assert not score(result(("drag",), before=1.2, after=1.2)).worse


def test_a_model_that_cannot_follow_is_worse_than_any_that_can() -> None:
    lost = result(("drag",), step("drag"), before=2.0)
    lost["diagnosis"]["final"]["validation"] = None
    s = score(lost)
    assert s.worse
    assert not s.is_noise
    assert "2.00 -> inf um, WORSE" in line(s)
    found = result(("drag",), step("drag"))
    found["diagnosis"]["baseline"]["validation"]["rms_um"] = None
    assert not score(found).worse


def test_a_command_that_fails_is_neither_right_nor_quick_to_be_forgotten() -> None:
    s = score(failed(("drag",)))
    assert (s.outcome, s.found, s.is_noise, s.worse) == ("failed", False, False, False)
    assert "exit code 1: it fell over" in line(s)
    assert "| drag | 1 | 0 | 0 | 0 + 1 failed |" in report([s])
    assert "- failed: seed 0" in report([s])


def scores() -> list[Score]:
    return [
        score(r)
        for r in (
            result(("drag",), step("drag"), before=10.6, seed=1),
            result(("drag",), step("friction", "drag"), before=21.2, after=2.12, seed=2),
            result(("drag",), step("creep"), before=31.8, after=10.6, seed=3),
            result(("creep", "drift"), step("drift"), step("creep"), seed=4),
            result((), after=1.06, before=1.06, seed=5),
            result((), step("drift"), before=1.06, after=1.2, seed=6),
            result(("unknown",), step("unknown"), seed=60),
        )
    ]


def test_the_table_counts_every_case_once() -> None:
    page = report(scores())
    assert "Training on the thesis's record alone, 7 cases" in page
    assert "| drag | 3 | 1 | 1 | 1 | 20 -> 2 | 1 of 3 | 10 | 12 / 13 |" in page
    assert "| two effects | 1 | 1 | 0 | 0 |" in page
    assert "| in no family | 1 | 1 | 0 | 0 |" in page
    assert "| nothing | 2 | 1 | 0 | 1 |" in page
    assert "rich one" not in page


def test_the_totals_are_held_against_what_is_wanted() -> None:
    page = report(scores())
    assert "| named right or in the group | 3 of 4 (75%) | >= 90% | **no** |" in page
    assert "| within 15 % of the noise | 2 of 4 (50%) | >= 85% | **no** |" in page
    assert "| both of two effects named | 1 of 1 (100%) |" in page
    assert "| of no family, and said so | 1 of 1 (100%) | >= 80% | yes |" in page
    assert "| false alarms | 1 of 2 | <= 0 | **no** |" in page
    assert "| worse than before | 1 of 7 | <= 0 | **no** |" in page
    assert "| longer than 60 s | 1 of 7 | <= 0 | **no** |" in page


def test_verdicts_are_held_against_the_errors() -> None:
    near, far = (score(result(("drag",), step("drag"), after=a * FLOOR)) for a in (1.1, 1.3))
    closed = [replace(s, verdict="explained") for s in (near, far)]
    page = report([*closed, replace(far, verdict="partly_explained")])
    assert "| explained or nothing_missing, and within 15 % | 1 of 2 (50%) |" in page
    assert "| any other verdict, and within 15 % | 0 of 1 (0%) |" in page


def test_what_is_of_one_run_alone_is_nobodys_error() -> None:
    drifting = score(result(("drift",), step("drift"), after=11.0, own=10.0))
    assert drifting.is_noise
    assert not score(result(("drift",), step("drift"), after=12.5, own=10.0)).is_noise
    assert not score(result(("drift",), step("drift"), after=11.0)).is_noise
    page = report([drifting, score(result(("drag",), step("drag"), after=2.0))])
    assert "| within 15 % of the noise | 1 of 2 (50%)" in page
    assert "| ... of what hides no drift that changes from run to run | 0 of 1 (0%) |" in page


def test_one_false_alarm_in_fifty_is_allowed() -> None:
    clean = [score(result((), seed=i)) for i in range(49)]
    once = [*clean, score(result((), step("drift"), seed=49))]
    assert "| false alarms | 1 of 50 | <= 1 | yes |" in report(once)
    twice = [*once[1:], score(result((), step("drift"), seed=50))]
    assert "| false alarms | 2 of 50 | <= 1 | **no** |" in report(twice)


def test_what_went_wrong_is_listed_with_its_seed() -> None:
    listed = [row for row in report(scores()).splitlines() if row.startswith("- ")]
    assert [row.split(",")[0] for row in listed] == ["- wrong: seed 3", "- wrong: seed 6"]
    assert listed[0].endswith("hidden: drag")
    assert "drag (30 um), named creep, 31.80 -> 10.60 um" in listed[0]
    assert "1.06 -> 1.20 um, WORSE" in listed[1]


def test_probabilities_are_held_against_what_is_true() -> None:
    sure = result(("drag",), step("drag"))
    sure["diagnosis"]["families"] = [
        {"family": "drag", "probability": 0.9}, {"family": "creep", "probability": 0.1}
    ]  # fmt: skip
    sure["processor_s"] = 12.5
    s = score(sure)
    assert (s.probability, s.processor) == (0.9, 12.5)
    assert s.brier == pytest.approx(0.1**2 + 0.1**2)
    page = report([s])
    assert "The probability given to what is true is 0.90 in the mean" in page
    assert "1 times at least 0.9" in page
    assert "Seconds of processors: median 12.5" in page
    assert "| said with 0.9 or more, and true | 1 of 1 (100%) | >= 90% | yes |" in page
    assert "| longer than 60 s of processors | 0 of 1 |" in page
    sure["diagnosis"]["families"][0]["family"] = "thermal"
    assert (score(sure).leading, score(sure).leads_right) == ("thermal", False)
    assert "| said with 0.9 or more, and true | 0 of 1 (0%) | >= 90% | **no** |" in report(
        [score(sure)]
    )
    clean = result(())
    clean["diagnosis"]["families"] = [{"family": "none", "probability": 1.0}]
    assert score(clean).brier == 0.0


def test_what_leaves_the_intervals_out_takes_the_same_arguments() -> None:
    whole = inspect.signature(estimates_with_intervals)
    inspect.signature(values_alone).bind(**dict.fromkeys(whole.parameters))


def test_modes_have_tables_of_their_own() -> None:
    rich = score(result(("drag",), step("creep", "drag"), mode="rich"))
    page = report([*scores(), rich])
    assert page.index("record alone, 7") < page.index("the rich one, 1 cases")
    assert "| named right or in the group | 1 of 1 (100%) | >= 95% | yes |" in page


def test_nothing_to_report_is_said() -> None:
    assert report([]) == "No results."


def test_seeds_are_chosen_by_what_they_hide() -> None:
    clean = clean_seeds(3)
    assert all(drawn(seed).families == () for seed in clean)
    assert clean[0] >= CLEAN_FROM
    assert all(drawn(seed).families == ("drag",) for seed in family_seeds("drag", 2))
    seeds = chosen(5, 10, 3, 1)
    assert seeds[:10] == list(range(5, 15))
    assert seeds[-3:] == clean
    assert len(set(seeds)) == len(seeds)
    assert len(chosen(CLEAN_FROM, clean[0] - CLEAN_FROM + 1, 1, 0)) == clean[0] - CLEAN_FROM + 1
    second = chosen(5, 0, 1, 1, "second")
    families = [drawn(seed, "second").families for seed in second]
    assert ("viscoplasticity",) in families
    assert families[-1] == ()


def test_cases_of_hands_and_noises_are_kept_apart(tmp_path: Path) -> None:
    bench = Bench(tmp_path, 200.0)
    case = Case(7, "thesis", "second", "spikes")
    assert case.address == "sim:7:second:spikes"
    there = {**result(("drag",), seed=7), "hand": "second", "noise": "spikes"}
    (tmp_path / "200Hz" / "thesis-7-second-spikes.json").write_text(json.dumps(there), "utf-8")
    assert bench.kept(case, any_sources=True) == there
    assert case_of(there) == case
    assert bench.kept(Case(7, "thesis"), any_sources=True) is None


def test_kinds() -> None:
    assert [kind_of(f) for f in ((), ("drag",), ("creep", "drag"), ("unknown",))] == [
        "clean", "covered", "pair", "unknown",
    ]  # fmt: skip


def test_results_of_other_sources_are_not_mixed_in(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    bench = Bench(tmp_path, 200.0)
    there = {**result(("drag",), seed=7), "sources": play.sources_digest()}
    (bench.folder / "thesis-7.json").write_text(json.dumps(there), encoding="utf-8")
    assert bench.kept(Case(7, "thesis"), any_sources=False) == there
    assert bench.kept(Case(7, "rich"), any_sources=True) is None
    assert Bench(tmp_path, 100.0).kept(Case(7, "thesis"), any_sources=True) is None
    monkeypatch.setattr(play, "sources_digest", lambda: "changed since")
    assert bench.kept(Case(7, "thesis"), any_sources=False) is None
    assert bench.kept(Case(7, "thesis"), any_sources=True) == there


@pytest.mark.deep
def test_one_case_from_end_to_end(tmp_path: Path) -> None:
    """A film that hides nothing: the rig's seed goes in, a score comes out."""
    case = Case(clean_seeds(1)[0], "thesis")
    bench = Bench(tmp_path, 100.0)
    s = score(bench.play(case))
    assert s.error == ""
    assert (s.kind, s.outcome, s.verdict) == ("clean", "right", "nothing_missing")
    assert s.is_noise
    assert s.floor_read == pytest.approx(s.floor, rel=0.15)
    assert score(bench.all_kept()[0]) == s
