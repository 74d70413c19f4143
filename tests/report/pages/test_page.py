from __future__ import annotations

import math
import re
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest

from dearig.analysis.outcomes import pooled_rms
from dearig.errors import InputError
from dearig.model.fitting.parameters import Contribution, GivenValue
from dearig.model.readings.measures import errors
from dearig.report.as_json import outcome_json
from dearig.report.pages.html import write_demo_report, write_identify_report, write_validate_report
from dearig.report.text.numbers import (
    NO_VALUE,
    interval,
    quoted,
    seconds,
    significant,
    symbol,
    to_ascii,
)
from dearig.report.text.sentences import (
    identify_summary,
    undetermined_text,
    validate_summary,
    warnings_of,
)
from dearig.report.text.tables import error_table, parameter_table, thesis_error_table
from tests.tools.reports import (
    actuator_comparison,
    film_comparison,
    film_outcome,
    fit,
    identify_outcome,
    validate_outcome,
    validation_runs,
    without_intervals,
)

VOID = {"meta", "wbr", "link", "br", "hr", "img", "input"}


class Page(HTMLParser):
    """Reads a page strictly: every element closed, in order; its tables, links and identifiers."""

    def __init__(self, text: str) -> None:
        super().__init__(convert_charrefs=True)
        self.open: list[str] = []
        self.seen: list[str] = []
        self.ids: list[str] = []
        self.refers: list[str] = []
        self.cells: list[str] = []
        self.text: list[str] = []
        self.broken = False
        self.feed(text)
        self.close()
        assert not self.open, f"never closed: {self.open}"

    def handle_starttag(self, tag, attrs):
        self.broken = tag == "wbr"
        self.seen.append(tag)
        for name, value in attrs:
            assert not name.startswith("on"), f"{tag} has {name}"
            if name == "id":
                self.ids.append(value)
            if name in ("src", "href", "xlink:href", "action", "data", "srcset"):
                self.refers.append(value)
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.handle_starttag(tag, attrs)
        if tag not in VOID:
            self.open.pop()

    def handle_endtag(self, tag):
        assert self.open, f"</{tag}> closes nothing"
        assert self.open[-1] == tag, f"</{tag}> closes {self.open[-1]}"
        self.open.pop()

    def handle_data(self, data):
        cell = "td" in self.open or ("th" in self.open and "tbody" in self.open)
        for kept in (self.text, *([self.cells] if cell else [])):
            if self.broken:  # where a word may be broken, it goes on
                kept[-1] += data
            else:
                kept.append(data)
        self.broken = False

    @property
    def words(self) -> str:
        return re.sub(r"\s+", " ", " ".join(self.text))


def check(path) -> Page:
    text = path.read_text(encoding="utf-8")
    assert text.startswith("<!DOCTYPE html>")
    page = Page(text)
    assert not {"script", "link", "img", "iframe", "object"} & set(page.seen)
    data = ("data:text/csv;", "data:application/json,")
    local = [ref for ref in page.refers if not ref.startswith(data)]
    assert all(ref.startswith("#") and ref[1:] in page.ids for ref in local)
    assert len(page.ids) == len(set(page.ids)), "two elements share an id"
    assert not re.search(r"https?:|url\((?!#)|@import", text)
    assert 'name="viewport"' in text
    assert "@media print" in text
    assert "nan" not in page.words.lower().split()
    return page


FOUR = validation_runs()[::3]  # two of each of the thesis's tables


@pytest.fixture(scope="module")
def demo(tmp_path_factory):
    path = tmp_path_factory.mktemp("demo") / "report.html"
    assert write_demo_report(identify_outcome(), validate_outcome(comparisons=FOUR), path) == path
    assert path.stat().st_size < 3_000_000
    return check(path)


class TestPages:
    def test_numbers_match_the_errors(self, demo):
        for c in (*identify_outcome().train, *FOUR):
            e = c.errors
            for value in (
                e.rms * 1e6, e.max * 1e6, e.nrmse_pct, e.e_rms_thesis_pct, e.e_m_thesis_pct,
            ):  # fmt: skip
                assert significant(value) in demo.cells

    def test_published_figures_stand_beside(self, demo):
        for value in ("5.85", "5.89", "8.67", "4.61", "2.13", "4.07", "45.77", "8.387"):
            assert value in demo.cells

    def test_says_what_is_odd_about_the_thesis_measures(self, demo):
        assert "e_rms is not normalised" in demo.words
        assert "divided by the range of the model , not" in demo.words
        assert "82 mm" in demo.words.replace("\xa0", " ")

    def test_says_what_is_not_determined(self, demo):
        assert "The data do not determine μ₁, J₀, J₁ and T₁" in demo.words
        assert "The residual is 3 times the noise." in demo.words
        assert "only an upper bound" in demo.cells

    def test_provenance(self, demo):
        for word in ("train.h5", "out/model.toml", "hybrid", "12.3 s", "1,234"):
            assert word in demo.words

    def test_figures(self, demo):
        # training, parameters, five of its residual; four of validation, five of their worst
        assert demo.seen.count("svg") == 7 + 9
        assert demo.seen.count("h1") == 1 + 2

    def test_the_demo_shows_each_recording_once(self, tmp_path):
        both = identify_outcome(validation=FOUR[:1])
        one = validate_outcome(comparisons=FOUR[:1])
        write_demo_report(both, one, tmp_path / "demo.html")
        assert check(tmp_path / "demo.html").seen.count("svg") == 7 + 6

    def test_film_page_is_in_kilopascals_and_has_no_thesis_table(self, tmp_path):
        outcome = film_outcome()
        write_identify_report(outcome, tmp_path / "film.html")
        page = check(tmp_path / "film.html")
        e = outcome.train[0].errors
        assert significant(e.rms * 1e-3) in page.cells
        assert significant(e.peak_pct) in page.cells
        assert "thesis" not in page.words.lower().partition("how this report was made")[0]
        assert "e_rms" not in page.words
        assert "Number of branches" in page.words
        assert "not known, so the error cannot be compared with it" in page.words
        assert page.seen.count("svg") == 3 * 2 + 2 + 2 * 5

    def test_names_are_escaped(self, tmp_path):
        evil = '<script>alert("1")</script>&.h5'
        outcome = identify_outcome(
            title=f"On {evil}",
            train=(actuator_comparison(evil, warnings=(f"odd {evil}",)),),
            model_path=evil,
        )
        write_identify_report(outcome, tmp_path / "evil.html")
        assert evil in check(tmp_path / "evil.html").words
        assert "<script" not in (tmp_path / "evil.html").read_text(encoding="utf-8")

    def test_a_name_that_is_no_text_does_not_stop_the_report(self, tmp_path):
        outcome = validate_outcome(comparisons=(actuator_comparison("broken\udcff.h5"),))
        write_validate_report(outcome, tmp_path / "odd.html")
        assert r"broken\udcff.h5" in check(tmp_path / "odd.html").words

    def test_without_intervals(self, tmp_path):
        write_identify_report(identify_outcome(fit=without_intervals()), tmp_path / "de.html")
        page = check(tmp_path / "de.html")
        assert "No intervals were computed" in page.words
        assert "do not determine" not in page.words

    def test_the_file_is_replaced_as_a_whole(self, tmp_path):
        path = tmp_path / "page.html"
        path.write_text("old", encoding="utf-8")
        one = (actuator_comparison(),)
        write_validate_report(validate_outcome(comparisons=one), path)
        check(path)
        assert list(tmp_path.iterdir()) == [path]

    def test_a_folder_that_is_not_there_is_refused(self, tmp_path):
        with pytest.raises(InputError, match="no folder"):
            write_validate_report(validate_outcome(), tmp_path / "no" / "page.html")


class TestNumbers:
    @pytest.mark.parametrize(
        ("value", "digits", "text"),
        [
            (1.2345, 3, "1.23"),
            (9.996, 3, "10.0"),
            (0.0012345, 2, "0.0012"),
            (123456.0, 3, "123000"),
            (1.5e-7, 2, "1.5 \N{MULTIPLICATION SIGN} 10⁻⁷"),
            (9e8, 2, "9.0 \N{MULTIPLICATION SIGN} 10⁸"),
            (0.0, 3, "0"),
            (-2.5, 2, "-2.5"),
            (math.inf, 3, "∞"),
            (math.nan, 3, NO_VALUE),
        ],
    )
    def test_significant(self, value, digits, text):
        assert significant(value, digits) == text

    @pytest.mark.parametrize(
        ("value", "low", "high", "text", "within"),
        [
            (45.7724, 45.65, 45.89, "45.77", "45.65 to 45.89"),
            (83.0023, 83.0023, 83.0023, "83.002", "83.002 to 83.002"),
            (1e4, 59.6, math.inf, "10000", "above 60"),
            (1e4, 0.0, math.inf, "10000", "open"),
            (20.3, 0.0, 91.5, "20", "below 92"),
            (0.36, 0.0195, 0.37, "0.36", "0.019 to 0.37"),
            (45772.4, 44000.0, 48000.0, "45800", "44000 to 48000"),
            (2.32465, 2.3246499, 2.3246501, "2.32465000", "2.32464990 to 2.32465010"),
            (
                48.65e6,
                48.51e6,
                48.79e6,
                "4.865 \N{MULTIPLICATION SIGN} 10⁷",
                "4.851 \N{MULTIPLICATION SIGN} 10⁷ to 4.879 \N{MULTIPLICATION SIGN} 10⁷",
            ),
            (
                1.234e-5,
                1.2e-5,
                1.27e-5,
                "1.234 \N{MULTIPLICATION SIGN} 10⁻⁵",
                "1.200 \N{MULTIPLICATION SIGN} 10⁻⁵ to 1.270 \N{MULTIPLICATION SIGN} 10⁻⁵",
            ),
            (
                -3.2e6,
                -4.0e6,
                -2.4e6,
                "-3.20 \N{MULTIPLICATION SIGN} 10⁶",
                "-4.00 \N{MULTIPLICATION SIGN} 10⁶ to -2.40 \N{MULTIPLICATION SIGN} 10⁶",
            ),
            (
                999_990.0,
                999_900.0,
                1_000_080.0,
                "999990",
                "0.999900 \N{MULTIPLICATION SIGN} 10⁶ to 1.000080 \N{MULTIPLICATION SIGN} 10⁶",
            ),
        ],
    )
    def test_digits_follow_the_interval(self, value, low, high, text, within):
        assert quoted(value, low, high) == text
        assert interval(low, high) == within

    def test_symbols_and_their_plain_form(self):
        assert symbol("mu_10") == "μ₁₀"
        assert symbol("share") == "share"
        assert to_ascii(f"{symbol('mu_10')} = {significant(1.5e-7, 2)}") == "mu_10 = 1.5 x 10^-7"
        assert to_ascii(f"{NO_VALUE} ∞ µm é") == "- inf um \\xe9"

    @pytest.mark.parametrize(
        ("duration", "text"), [(12.34, "12.3 s"), (600.0, "10.0 min"), (9000.0, "2.50 h")]
    )
    def test_seconds(self, duration, text):
        assert seconds(duration) == text


class TestTables:
    def test_errors_over_noise(self):
        comparison = actuator_comparison()
        row = error_table("x", (comparison,)).rows[0]
        assert row.cells[0] == "train.h5"
        assert row.cells[-1] == significant(comparison.errors.rms / comparison.noise)
        assert error_table("x", (actuator_comparison(noise=None),)).rows[0].cells[-1] == NO_VALUE

    def test_film_has_no_thesis_table(self):
        assert thesis_error_table("x", (film_comparison(),)) is None

    def test_parameters(self):
        rows = {r.cells[0]: r for r in parameter_table(fit()).rows}
        assert rows["μ₂"].cells == ("μ₂", "45.77", "kPa", "45.65 to 45.89", "40.04")
        assert rows["μ₁"].cells[1] == "(20)"
        assert rows["μ₁"].muted
        assert rows["μ₀"].cells[3] == "derived"

    def test_tables_of_other_rows_do_not_join(self):
        one, two = (error_table("x", (actuator_comparison(n),)) for n in ("a", "b"))
        with pytest.raises(ValueError, match="same rows"):
            one.with_columns_of(two)


class TestWords:
    def test_pooled_rms_is_over_all_samples(self):
        a, b = actuator_comparison(), actuator_comparison(seed=1, rate=50.0)
        left = np.concatenate([c.measured - c.model for c in (a, b)])
        assert pooled_rms((a, b)) == pytest.approx(np.sqrt(np.mean(left**2)))

    def test_identification(self):
        words = " ".join(identify_summary(identify_outcome()))
        e = identify_outcome().train[0].errors
        assert f"{significant(e.rms * 1e6)} µm RMS ({significant(e.nrmse_pct)} % of" in words
        assert "1 recording (train.h5)" in words
        assert "e_rms = 2.13 %" in words

    @pytest.mark.parametrize(
        ("noise", "words"),
        [
            (None, "the error cannot be compared with it"),
            (1e-6, "the model does not describe"),
            (2.0e-6, "too few readings at rest"),
            (5e-6, "the residual is almost only noise"),
        ],
    )
    def test_against_the_noise(self, noise, words):
        outcome = identify_outcome(train=(actuator_comparison(noise=noise),))
        assert words in " ".join(identify_summary(outcome))

    @pytest.mark.parametrize(("over", "rejected"), [(1.0, False), (1.3, True)])
    def test_a_model_that_the_noise_at_rest_denies_is_called_rejected(self, over, rejected):
        train, rng = actuator_comparison(noise=2e-6), np.random.default_rng(1)
        left = 2e-6 * rng.standard_normal(train.time.size)
        wave = np.sin(np.linspace(0.0, 60.0, left.size)) * (np.arange(left.size) >= 200)
        model = train.measured * (np.arange(left.size) >= 200)
        measured = model + left + 2e-6 * math.sqrt(2.0 * (over**2 - 1.0)) * wave
        one = replace(
            train, model=model, measured=measured, quiet_count=200, errors=errors(measured, model)
        )
        outcome = identify_outcome(train=(one,))
        words, found = " ".join(identify_summary(outcome)), outcome_json(outcome)
        assert ("The model is rejected" in words) == rejected
        assert found["rejected"] is rejected
        assert (found["misfit_p"] < 1e-3) == rejected

    def test_training_data_among_validation_are_called_so(self):
        outcome = validate_outcome(
            comparisons=(actuator_comparison("a", "train"), actuator_comparison("b", "validation"))
        )
        assert "a was used to fit this model" in " ".join(validate_summary(outcome))

    def test_doubts(self):
        assert (
            undetermined_text(fit(estimates=(fit().estimates[2],)))
            == "The data determine every parameter."
        )

    def test_given_values_of_a_fit_without_intervals_speak_of_none(self):
        given = Contribution(GivenValue("thickness", 0.02), (), ())
        known, unknown = (
            parameter_table(fit(budget=(given,), **more)).note
            for more in ({}, {"covariance": np.empty((0, 0)), "covariance_names": ()})
        )
        assert "The 95 % interval is of the noise alone" in known
        assert "interval" not in unknown
        assert "(thickness 2.0 %), move a parameter by the column of one" in unknown

    def test_warnings_have_the_symbols_of_the_tables(self):
        told = ("these data determine mu_1 + mu_2, not the parts; see mu_1_kPa in mu_1.toml",)
        said = warnings_of(identify_outcome(fit=fit(warnings=told)))
        both = " + ".join(map(symbol, ("mu_1", "mu_2")))
        assert f"determine {both}, not the parts; see mu_1_kPa in mu_1.toml." in said[0]

    def test_warnings_come_once_with_their_recording(self):
        train = actuator_comparison(warnings=("the laser lost its target", "it was warm."))
        said = warnings_of(identify_outcome(train=(train, train)))
        assert said == (
            "The residual is 3 times the noise.",
            "train.h5: the laser lost its target.",
            "train.h5: it was warm.",
        )
