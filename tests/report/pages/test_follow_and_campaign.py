"""Pages of a followed target and of a campaign: labels that are read, and runs that were lost."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from dearig.batch.campaign import CampaignOutcome
from dearig.batch.queue import Queue, RunState
from dearig.report.pages.campaign import campaign_summary, write_campaign_report
from dearig.report.pages.track import errors_figure, track_warnings
from dearig.units import runs_text
from tests.report.pages.test_hostile_names import _tracked as tracked


def test_errors_over_decades_are_labelled_with_numbers(tmp_path: Path) -> None:
    outcome = tracked(tmp_path)
    runs = tuple(
        replace(outcome.runs[0], kind=kind, iteration=i, rms=rms)
        for i, (kind, rms) in enumerate([("linear", 60e-6), ("model", 8e-6), ("learned", 1.5e-6)])
    )
    figure = errors_figure(replace(outcome, runs=runs, noise=1e-6))
    figure.canvas.draw()
    labels = [label.get_text() for label in figure.axes[0].get_yticklabels()]
    assert {"1", "10"} <= set(labels)
    assert not any("$" in label for label in labels)


def test_a_warning_ends_with_one_full_stop(tmp_path: Path) -> None:
    outcome = replace(tracked(tmp_path), warnings=("It is warm.", "It is damp"))
    assert track_warnings(outcome)[:2] == ("It is warm.", "It is damp.")


def test_lost_runs_are_not_shown_in_the_colour_of_the_best(tmp_path: Path) -> None:
    queue = Queue(name="ageing", rig="sim", started="2026-11-27T08:00:00+00:00")
    for name, state in (("run-1", "done"), ("run-2", "lost")):
        queue.runs[name] = RunState(name=name, state=state, settings={})
        queue.order.append(name)
    outcome = CampaignOutcome("ageing", tmp_path / "none", queue, "complete", "")
    page = write_campaign_report(outcome, tmp_path / "campaign.html").read_text("utf-8")
    assert '<section class="ended"' in page
    assert ".ended tr.mark" in page


def test_one_run_is_one_run() -> None:
    assert [runs_text(n) for n in (1, 2, 1000)] == ["1 run", "2 runs", "1,000 runs"]
    assert [runs_text(n, "left") for n in (1, 2)] == ["1 run is left", "2 runs are left"]
    queue = Queue(runs={"a": RunState(name="a", state="done")})
    (said,) = campaign_summary(CampaignOutcome("x", Path("x"), queue, "complete", ""))
    assert said == "1 run: 1 done."
