from __future__ import annotations

import io
import json
import math
import re
import threading

import pytest
from rich.console import Console
from rich.progress import ProgressSample, Task, TaskID

from dearig.cli.lost_interrupt import note_lost
from dearig.cli.progress_bar import _Times, progress
from dearig.cli.terminal import branch_table, identify_table, validate_tables
from dearig.errors import InputError
from dearig.recording.json_file import write_json
from dearig.report.as_json import outcome_json
from dearig.report.text.numbers import significant
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


def shown(renderable, width: int = 80, encoding: str = "utf-8") -> str:
    buffer = io.BytesIO()
    stream = io.TextIOWrapper(buffer, encoding=encoding, newline="\n")
    Console(file=stream, width=width, legacy_windows=False).print(renderable)
    stream.flush()
    return buffer.getvalue().decode(encoding)


LONG = actuator_comparison("a-rather-long-name-of-a-recording-of-2024-05-17-afternoon-7.h5")


class TestTables:
    @pytest.mark.parametrize("encoding", ["utf-8", "ascii"])
    @pytest.mark.parametrize("width", [80, 44, 24])
    @pytest.mark.parametrize(
        "table",
        [
            identify_table(identify_outcome(validation=validation_runs())),
            identify_table(identify_outcome(train=(LONG,), fit=without_intervals())),
            identify_table(film_outcome()),
            branch_table(film_outcome()),
            validate_tables(validate_outcome()),
        ],
        ids=["identify", "bare", "film", "branches", "validate"],
    )
    def test_fit_the_width(self, table, width, encoding):
        text = shown(table, width, encoding)
        assert max(map(len, text.splitlines())) <= width

    def test_nothing_is_cut_off_at_80_columns(self):
        outcome = identify_outcome(validation=validation_runs())
        text = shown(identify_table(outcome))
        assert "…" not in text
        for c in (*outcome.train, *outcome.validation):
            for value in (c.errors.rms * 1e6, c.errors.nrmse_pct, c.errors.e_m_thesis_pct):
                assert significant(value) in text
        lines = {line[:11].strip(): line.split() for line in text.splitlines()}
        e = outcome.validation[0].errors
        assert lines["f\xa0=\xa00.2\xa0Hz"][-4:] == [
            significant(e.e_rms_thesis_pct), "5.85", significant(e.e_m_thesis_pct), "6.97",
        ]  # fmt: skip

    def test_parameters(self):
        text = shown(identify_table(identify_outcome()))
        assert "45.65 to 45.89" in text
        assert "J₁: not determined by these data" in text
        assert "Warning: The residual is 3 times the noise." in text

    def test_ascii(self):
        text = shown(identify_table(identify_outcome()), encoding="ascii")
        assert "mu_2" in text
        assert " um RMS" in text
        assert "|" not in text

    def test_names_are_no_markup(self):
        outcome = validate_outcome(comparisons=(actuator_comparison("[bold]x[/].h5"),))
        assert "[bold]x[/].h5" in shown(validate_tables(outcome))

    def test_long_names_are_cut_in_the_middle(self):
        text = shown(validate_tables(validate_outcome(comparisons=(LONG,))), 66)
        assert re.search(r"^a-rather-lon\S*…\S*afternoon-7.h5 ", text, re.MULTILINE)

    def test_film_is_in_kilopascals(self):
        text = shown(identify_table(film_outcome()))
        assert "kPa" in text
        assert "µm" not in text
        assert "e_rms" not in text

    def test_branches(self):
        text = shown(branch_table(film_outcome()))
        assert "3 *" in text
        assert "22.1" in text
        assert not shown(branch_table(identify_outcome())).strip()


class TestProgress:
    def test_silent_where_there_is_no_terminal(self):
        stream = io.StringIO()
        with progress("fitting", Console(file=stream, force_terminal=False)) as report:
            report("search", 0.5)
        assert stream.getvalue() == ""

    def test_shows_stages_and_leaves_nothing(self):
        stream = io.StringIO()
        console = Console(file=stream, force_terminal=True, width=80, legacy_windows=False)
        with progress("fitting [a]", console) as report:
            for stage in ("search", "descents"):
                for fraction in (0.0, 0.5, 1.5, math.nan):
                    report(stage, fraction)
            report("intervals", 0.25)
        text = stream.getvalue()
        assert "fitting [a]: intervals" in text
        assert "25 %" in text
        assert "\x1b[2K" in text.rpartition("intervals")[2]

    def test_of_the_whole_work_the_bar_goes_on_through_all_stages(self):
        stream = io.StringIO()
        console = Console(file=stream, force_terminal=True, width=80, legacy_windows=False)
        with progress("diagnosing", console, whole=True) as report:
            report("baseline", 0.25)
            report("refitting", 0.75)
        text = stream.getvalue()
        last = text.rpartition("diagnosing: refitting")[2]
        assert "75 %" in last
        # a new stage does not take the bar back to its beginning
        assert " 0 %" not in text.partition("diagnosing: baseline")[2]

    def test_each_time_of_the_bar_has_its_name_after_it(self):
        task = Task(TaskID(0), "", 1.0, 0.25, _get_time=lambda: 102.0, _lock=threading.RLock())
        task.start_time = 0.0
        assert str(_Times().render(task)) == "0:01:42 so far"
        for at, done in ((90.0, 0.1), (100.0, 0.5)):
            task._progress.append(ProgressSample(at, done))
        remaining = task.time_remaining
        assert remaining is not None
        shown = f"0:01:42 so far, about 0:00:{int(remaining):02d} to go"
        assert str(_Times().render(task)) == shown

    def test_survives_an_exception(self):
        stream = io.StringIO()
        console = Console(file=stream, force_terminal=True, width=80, legacy_windows=False)

        def interrupted() -> None:
            with progress("fitting", console) as report:
                report("search", 0.1)
                raise KeyboardInterrupt

        with pytest.raises(KeyboardInterrupt):
            interrupted()
        assert "\x1b[?25h" in stream.getvalue().rpartition("\x1b[?25l")[2]


MEASURES = {"rms_um", "nrmse_pct", "e_rms_thesis_pct", "e_m_thesis_pct", "max_um"}


def strict(obj):
    """Through JSON and back, without the numbers that it does not have."""
    return json.loads(json.dumps(obj, allow_nan=False))


class TestJson:
    def test_identification(self):
        outcome = identify_outcome(validation=validation_runs())
        found = strict(outcome_json(outcome))
        assert found["format"] == "dearig-identification/1"
        assert found["method"] == "hybrid"
        assert found["converged"] is True
        assert found["seconds"] == 12.34
        assert found["noise_floor_um"] == pytest.approx(1.0)
        assert found["warnings"] == ["The residual is 3 times the noise."]
        assert found["published_fit"] == {"e_rms_pct": 2.13, "e_m_pct": 4.07}
        run, e = found["train"][0], outcome.train[0].errors
        assert set(run) >= MEASURES
        assert run["rms_um"] == pytest.approx(e.rms * 1e6)
        assert run["max_um"] == pytest.approx(e.max * 1e6)
        assert run["e_rms_thesis_pct"] == pytest.approx(e.e_rms_thesis_pct)
        assert [v["table"] for v in found["validation"]] == ["A"] * 5 + ["B"] * 5
        assert found["validation"][0]["published"] == {"e_rms_pct": 5.8484, "e_m_pct": 6.9696}

    def test_parameters(self):
        found = {p["name"]: p for p in strict(outcome_json(identify_outcome()))["parameters"]}
        assert found["mu_2"]["ci95"] == [45650.0, 45890.0]
        assert found["mu_2"]["unit"] == "Pa"
        assert found["mu_2"]["determined"] is True
        assert found["mu_1"]["ci95"] == [None, 91481.5]
        assert found["J_0"]["ci95"] == [59.595, None]
        assert found["J_1"] == {
            "name": "J_1", "value": 1e4, "unit": "", "ci95": [None, None], "determined": False,
            "free": True, "at_bound": False, "systematic": 0.0, "ci95_combined": [None, None],
            "note": "not determined by these data", "fixed": False, "bounds": None, "prior": None,
        }  # fmt: skip
        assert found["mu_0"]["free"] is False

    def test_validation(self):
        found = strict(outcome_json(validate_outcome()))
        assert found["format"] == "dearig-validation/1"
        assert len(found["recordings"]) == 10
        assert set(found["recordings"][0]) >= MEASURES

    def test_film_is_in_kilopascals(self):
        outcome = film_outcome()
        found = strict(outcome_json(outcome))
        run, e = found["train"][0], outcome.train[0].errors
        assert run["rms_kPa"] == pytest.approx(e.rms * 1e-3)
        assert run["max_kPa"] == pytest.approx(e.max * 1e-3)
        assert run["peak_pct"] == pytest.approx(e.peak_pct)
        assert run["e_rms_thesis_pct"] is None
        assert found["noise_floor_kPa"] == pytest.approx(0.1)
        assert found["validation"][0]["noise_floor_kPa"] is None
        assert found["trials"][2]["chosen"] is True
        assert found["trials"][0]["train_rms_kPa"] == pytest.approx(5.66)
        assert not any(key.endswith("_um") for key in (*found, *run))

    def test_infinite_figures_become_null(self):
        flat = film_comparison()
        outcome = validate_outcome(
            kind="film",
            comparisons=(
                film_comparison(
                    errors=type(flat.errors)(1.0, math.inf, 2.0, math.nan, 3.0, 4.0, 9)
                ),
            ),
        )
        run = strict(outcome_json(outcome))["recordings"][0]
        assert run["nrmse_pct"] is None
        assert run["peak_pct"] is None

    def test_to_a_file_and_to_the_screen(self, tmp_path, capsys):
        found = outcome_json(identify_outcome(title="Größe 1 µm", fit=fit()))
        write_json(found, tmp_path / "out.json")
        assert json.loads((tmp_path / "out.json").read_text(encoding="utf-8")) == found
        assert list(tmp_path.iterdir()) == [tmp_path / "out.json"]
        write_json(found, "-")
        assert json.loads(capsys.readouterr().out) == found

    def test_refuses_what_cannot_be_written(self, tmp_path):
        with pytest.raises(InputError, match="no folder"):
            write_json({}, tmp_path / "no" / "out.json")
        with pytest.raises(InputError, match="is a folder"):
            write_json({}, tmp_path)
        with pytest.raises(ValueError, match="not JSON compliant"):
            write_json({"x": math.nan}, tmp_path / "out.json")
        assert not list(tmp_path.iterdir())

    def test_a_closed_standard_output_is_told(self, monkeypatch):
        class Closed(io.StringIO):
            def write(self, _):
                raise BrokenPipeError("broken pipe")

        monkeypatch.setattr("sys.stdout", Closed())
        with pytest.raises(InputError, match="standard output"):
            write_json({}, "-")


@pytest.mark.parametrize("terminal", [True, False])
def test_an_interrupt_that_a_callback_lost_is_raised_by_the_next_progress(terminal: bool) -> None:
    with progress("dearig", console=Console(file=io.StringIO(), force_terminal=terminal)) as report:
        report("reading", 0.1)
        note_lost()
        with pytest.raises(KeyboardInterrupt):
            report("reading", 0.2)
        report("reading", 0.3)  # once
