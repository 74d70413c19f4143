"""Trends of many recordings: known effects are found, and told common or one film's own."""

from __future__ import annotations

import json
import math
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest

from dearig.batch.changes import find_jumps, jump_penalty
from dearig.batch.mixed_model import Sample, fit_linear
from dearig.batch.table_file import read_table, write_csv, write_parquet
from dearig.batch.trend_columns import columns_in
from dearig.batch.trends import Trends, find_trends
from dearig.errors import InputError
from tests.tools.command import dearig, done, refused
from tests.tools.made_campaign import TRUTH, made_rows

pytest.importorskip("statsmodels", reason='takes the extra "trends"')

SOURCE = Path("study.csv")
STORY = {"own": {"F05": 0.03}, "jump": ("F07", 6, -0.12)}


def trends_of(rows: list, **options) -> Trends:
    return find_trends(rows, source=SOURCE, **options)


def verdicts(trends: Trends) -> dict[tuple[str, str], str]:
    return {
        (trend.name, effect.column.label): effect.verdict
        for trend in trends.trends
        for effect in trend.effects
    }


@pytest.fixture(scope="module")
def story() -> Trends:
    return trends_of(made_rows(1, films=12, **STORY), numbers=["mu_0_kPa", "permittivity"])


def test_common_effects_are_recovered_beside_those_of_single_films(story: Trends) -> None:
    seen = verdicts(story)
    assert seen["mu_0_kPa", "temperature"] == "one_film"
    assert seen["mu_0_kPa", "humidity"] == "common"
    assert seen["permittivity", "humidity"] == "common"
    for trend in story.trends:
        assert trend.fit.mixed
        for effect in trend.effects[:2]:
            true = 100.0 * math.expm1(TRUTH[trend.name][effect.column.label])
            # three standard errors: one seed
            half = 1.5 * (effect.high - effect.low) / 2.0
            assert abs(effect.slope - true) < half


def test_simultaneous_intervals_are_those_of_sidak(story: Trends) -> None:
    assert story.intervals == 8
    assert math.isclose(story.confidence_of_each**8, 0.95)
    # the normal quantiles of (1 + 0.95^(1/8)) / 2 and 0.975; Student's t is a little wider
    for trend in story.trends:
        for effect in trend.effects:
            wide = np.log1p(np.array(effect.simultaneous) / 100.0)
            single = np.log1p(np.array([effect.low, effect.high]) / 100.0)
            ratio = np.ptp(wide) / np.ptp(single)
            assert 2.727 / 1.960 < ratio < 1.02 * 2.727 / 1.960
            assert math.isclose(wide.mean(), single.mean())


@pytest.mark.parametrize(
    ("apart", "label", "unit"),
    [("day", "days", "day"), ("hour", "hours", "h"), ("minute", "minutes", "min")],
)
def test_slopes_over_time_are_per_a_unit_that_the_runs_span(
    apart: str, label: str, unit: str
) -> None:
    rows = made_rows(3, films=3, runs=6)
    for i, row in enumerate(rows):
        step = timedelta(**{f"{apart}s": i})
        row["started"], row["cycles"] = (datetime(2026, 11, 2, tzinfo=UTC) + step).isoformat(), None
        row["mu_0_kPa"] = 40.0 * 0.99**i  # a percent less each time
    (trend,) = trends_of(rows, numbers=["mu_0_kPa"]).trends
    (effect,) = [e for e in trend.effects if e.column.label == label]
    assert effect.column.unit == unit
    assert effect.slope == pytest.approx(-1.0, abs=0.2)  # % per unit, not -100 % per day


def test_slopes_per_day_of_runs_within_seconds_are_numbers() -> None:
    rows = made_rows(3, films=3, runs=6)
    for i, row in enumerate(rows):
        row["started"], row["cycles"] = f"2026-11-02T08:00:{i:02d}+00:00", None
    found = trends_of(rows, numbers=["mu_0_kPa"])
    assert "minutes" in {effect.column.label for effect in found.trends[0].effects}
    for row in found.effect_rows():
        assert math.isfinite(row["high95_simultaneous"])


@pytest.mark.parametrize(("rigs", "compared"), [(3, 0), (2, 1)])
def test_rigs_are_compared_where_they_can_be_told_from_films(rigs: int, compared: int) -> None:
    rows = made_rows(3, films=4, runs=6)
    for row in rows:
        row["rig"] = f"rig {int(row['film'][1:]) % rigs}"
    (trend,) = trends_of(rows, numbers=["mu_0_kPa"]).trends
    assert sum(effect.column.label.startswith("rig") for effect in trend.effects) == compared


def test_one_number_over_one_column_has_one_interval() -> None:
    (trend,) = trends_of(
        made_rows(2, films=6), numbers=["mu_0_kPa"], against=["temperature_degC"]
    ).trends
    (effect,) = trend.effects
    assert effect.simultaneous == (effect.low, effect.high)


def test_one_films_own_slope_and_its_neighbours_jump_are_told_apart(story: Trends) -> None:
    mu = story.trends[0]
    (own,) = mu.effects[0].own
    assert own.film == "F05"
    assert own.low < 100.0 * math.expm1(0.03 + TRUTH["mu_0_kPa"]["temperature"]) < own.high
    (change,) = mu.changes
    assert (change.film, change.last, change.first) == ("F07", "F07-06.h5", "F07-07.h5")
    assert change.low < -12.0 < change.high
    assert not story.trends[1].changes


def test_known_errors_of_the_fits_are_weights() -> None:
    random = np.random.default_rng(4)
    film = np.repeat(np.arange(8), 10)
    x = random.normal(size=(80, 1))
    error = np.where(np.arange(80) % 2, 0.01, 1.0)
    y = 0.5 * x[:, 0] + random.normal(size=8)[film] + error * random.normal(size=80)
    weighted = fit_linear(Sample(y, x, film, error))
    blind = fit_linear(Sample(y, x, film, np.zeros(80)))
    assert weighted.errors[0] < 0.1 * blind.errors[0]
    low, high = weighted.interval(0)
    assert low < 0.5 < high
    # the scatter beyond the errors is none
    assert weighted.scatter < 0.02


def test_films_that_do_not_differ_are_no_failure_of_the_model() -> None:
    random = np.random.default_rng(0)
    film = np.repeat(np.arange(10), 10)
    x = random.normal(size=(100, 1))
    fit = fit_linear(Sample(random.normal(size=100), x, film, np.zeros(100)))
    assert fit.mixed
    assert 0.05 < fit.errors[0] < 0.2


@pytest.mark.parametrize(
    ("films", "runs", "why"),
    [(1, 12, "there is one film"), (12, 1, "each film has one run")],
)
def test_a_table_without_films_to_compare_is_fitted_by_least_squares(
    films: int, runs: int, why: str
) -> None:
    rows = made_rows(2, films=films, runs=runs)
    found = trends_of(rows, numbers=["mu_0_kPa"], against=["temperature_degC"])
    (trend,) = found.trends
    assert not trend.fit.mixed
    assert trend.fit.why == why
    if films == 1:
        assert trend.effects[0].verdict in ("untold", "none", "doubtful")
        assert any(p.kind == "films" for p in found.proposals)


def test_columns_that_show_nothing_are_what_to_vary_next() -> None:
    rows = made_rows(4, films=6)
    for row in rows:
        row["temperature_degC"] = 21.0
        row["cycles"] = None
        # the same to the last digits: humidity and the setting cannot be told apart
        row["set gain"] = 2.0 * row["relative_humidity_percent"]
    found = trends_of(rows, numbers=["permittivity"])
    assert [e.column.label for e in found.trends[0].effects] == ["humidity", "hours"]
    told = {(p.kind, p.columns[0]) for p in found.proposals}
    assert {("vary", "temperature"), ("separate", "gain")} <= told
    assert any("humidity" in s and "gain" in s for s in found.left_out)


def test_a_series_without_a_change_has_none_and_a_jump_is_placed() -> None:
    random = np.random.default_rng(7)
    quiet = [find_jumps(random.normal(100.0, 1.0, 40), jump_penalty(40, 1)) for _ in range(100)]
    assert sum(map(bool, quiet)) <= 3
    series = random.normal(0.0, 1.0, 40) + np.where(np.arange(40) < 25, 0.0, 5.0)
    assert find_jumps(series, jump_penalty(40, 1)) == [25]


def test_tables_are_read_as_they_were_written(tmp_path: Path) -> None:
    rows = made_rows(5, films=2, runs=2)
    rows[0]["mu_0_kPa"] = None
    rows[1]["film"] = "12"
    write_csv(rows, tmp_path / "study.csv")
    assert read_table(tmp_path / "study.csv") == [
        {**row, "reason": row["reason"] or None} for row in rows
    ]
    pytest.importorskip("pyarrow")
    write_parquet(rows, tmp_path / "study.parquet")
    assert read_table(tmp_path / "study.parquet") == rows


def test_the_command_writes_tables_a_report_and_json(tmp_path: Path) -> None:
    write_csv(made_rows(1, films=4, runs=8), tmp_path / "study.csv")
    answer = done("trends", tmp_path, "--number", "mu_0_kPa", "--json", tmp_path / "trends.json")
    assert "humidity" in answer.out
    told = json.loads((tmp_path / "trends.json").read_text("utf-8"))
    assert told["format"] == "dearig-trends/1"
    assert [number["name"] for number in told["numbers"]] == ["mu_0_kPa"]
    effects = told["numbers"][0]["effects"]
    assert told["simultaneous"]["intervals"] == len(effects)
    for effect in effects:
        wide, single = effect["ci95_simultaneous"], effect["ci95"]
        assert wide[0] < single[0] < single[1] < wide[1]
    assert "hold all true slopes at once in 95 % of studies" in " ".join(answer.out.split())
    page = (tmp_path / "trends.html").read_text("utf-8")
    assert page.count("<svg") == 2
    assert {row["column"] for row in read_table(tmp_path / "trends.csv")} >= {"temperature"}
    # the report is there now
    assert dearig("trends", tmp_path).code == 2


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("", "not a table of a study"),
        ("a,b\n1,2\n", "not a table of a study"),
        ("recording,recording\nx,y\n", "two columns"),
        ("recording,state\nx\n", "1 cells for 2 columns"),
        ("recording,state\nx,failed\n", "no recording in it has a result"),
        ("recording,state,mu_0_kPa,mu_0_kPa_low95\nx,ok,1,1\n", "1 runs have a value"),
    ],
)
def test_a_table_that_is_none_is_refused_in_a_sentence(
    content: str, words: str, tmp_path: Path
) -> None:
    (tmp_path / "t.csv").write_text(content, "utf-8")
    refused(dearig("trends", tmp_path / "t.csv"), words)


def test_unknown_columns_are_named() -> None:
    with pytest.raises(InputError, match="no column 'mu_7'; its numbers are mu_0_kPa"):
        trends_of(made_rows(0, films=2), numbers=["mu_7"])
    with pytest.raises(InputError, match="'moon' is not in the table"):
        trends_of(made_rows(0, films=2), against=["moon"])


def test_every_place_of_a_list_of_numbers_is_a_column() -> None:
    """The template of a plan varies lists, and a table (CSV) holds them as text."""
    rows = [
        {"recording": f"{n}.h5", "set segment.0.amplitudes_kV": value, "set repeat": n}
        for n, value in enumerate([[6.0], [7.0], "[8.0, 3.0]", "[", None, ["x"]])
    ]
    found = {c.label: c.values for c in columns_in(rows, ["F"] * len(rows))}
    assert list(found) == [
        "segment.0.amplitudes_kV.0", "segment.0.amplitudes_kV.1", "repeat",
    ]  # fmt: skip
    nan = np.nan
    np.testing.assert_array_equal(
        found["segment.0.amplitudes_kV.0"], [6.0, 7.0, 8.0, nan, nan, nan]
    )
    np.testing.assert_array_equal(
        found["segment.0.amplitudes_kV.1"], [nan, nan, 3.0, nan, nan, nan]
    )
    np.testing.assert_array_equal(found["repeat"], np.arange(6.0))


@pytest.mark.parametrize(
    ("each", "unit", "last"),
    [(10, "10 cycles", 4.0), (1, "cycle", 4.0), (300, "1000 cycles", 1.2), (50, "100 cycles", 2.0)],
)
def test_cycles_are_counted_in_a_unit_that_the_runs_span(each: int, unit: str, last: float) -> None:
    """A slope per 1000 cycles of runs within 40 was between -100 and 8.6e17 %."""
    rows = [
        {"recording": f"{n}.h5", "cycles": each, "started": f"2026-01-0{n + 1}T00:00:00+00:00"}
        for n in range(5)
    ]
    (cycles,) = (c for c in columns_in(rows, ["F"] * 5) if c.label == "cycles")
    assert cycles.unit == unit
    assert cycles.values[-1] == pytest.approx(last)
