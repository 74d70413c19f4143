"""Runs that ended early: marked wherever their recordings are used, warned of, cut or left out."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from dearig.acquisition.run import RunOptions, record
from dearig.analysis.identify import identify_recordings
from dearig.analysis.readings.early_ends import choose, early_end_warnings
from dearig.analysis.readings.enough import few_data
from dearig.analysis.readings.record import Readings
from dearig.analysis.summary import read_entries, summary_of
from dearig.config.rigfile import RigFile
from dearig.config.sequencefile import parse_sequence
from dearig.errors import InputError, SafetyStop
from dearig.recording.reading.early_end import early_end
from dearig.recording.reading.reader import open_recording
from dearig.recording.reading.recording import RecordedEvent
from dearig.report.as_json import outcome_json
from dearig.report.text.sentences import identify_summary, warnings_of
from dearig.report.text.tables import error_table
from tests.tools.command import dearig, done

LOBES = """\
name = "lobes"
lead_in_s = 0.5
[[segment]]
kind = "half_sine"
amplitude_kV = 6.0
frequency_Hz = 1.0
repeats = 4
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run that ended in an arc, and one that came to its end."""
    folder = tmp_path_factory.mktemp("early")
    loaded = parse_sequence(LOBES, "lobes", Path())
    arc = RunOptions(faults=["arc@3.2"])
    with pytest.raises(SafetyStop):
        record(loaded, "sim", RigFile(), folder / "arc.h5", arc)
    record(loaded, "sim", RigFile(), folder / "whole.h5", RunOptions(seed=1))
    return folder


def test_an_arc_is_told_with_its_time_and_what_it_means(folder):
    end = early_end(open_recording(folder / "arc.h5"))
    assert end is not None
    assert end.kind == "interlock"
    assert end.time == pytest.approx(3.2, abs=0.1)
    assert end.sentence == (
        f"ended in an interlock at {end.time:.2f} s ({end.cause}): the last 0.5 s may show the "
        f"fault, not the film"
    )
    assert "arc" in end.cause
    # the summary of a listing says the same
    (entry,) = read_entries(folder, ["arc.h5"])
    assert early_end(summary_of(folder, entry)) == end
    assert early_end(open_recording(folder / "whole.h5")) is None
    assert early_end_warnings([open_recording(folder / f"{n}.h5") for n in ("arc", "whole")]) == (
        f"arc {end.sentence}",
    )


def test_cutting_leaves_out_what_may_show_the_fault(folder):
    whole = open_recording(folder / "arc.h5")
    end = early_end(whole)
    ((cut, other), said) = choose([whole, open_recording(folder / "whole.h5")], "cut")
    assert said == []
    assert cut.time[-1] <= end.time - 0.5 < cut.time[-1] + 2.0 / cut.rate
    np.testing.assert_array_equal(cut.signal, whole.signal[: cut.samples])
    np.testing.assert_array_equal(cut.window("time", 0, 10**9), cut.time)
    assert cut.noise_floor == whole.noise_floor
    assert early_end(cut).is_cut
    assert "is left out" in early_end(cut).sentence
    assert early_end(other) is None


def test_leaving_out_says_so_and_never_leaves_nothing(folder):
    both = [open_recording(folder / f"{name}.h5") for name in ("arc", "whole")]
    used, said = choose(both, "leave-out")
    assert [r.name for r in used] == ["whole"]
    assert said[0].startswith("arc ended in an interlock")
    with pytest.raises(InputError, match="every recording is left out"):
        choose(both[:1], "leave-out")


def test_a_fit_marks_it_in_sentences_tables_and_json(folder):
    outcome = identify_recordings([folder / "arc.h5"], branches=(1,), intervals=False)
    assert any("arc: ended in an interlock at" in w for w in warnings_of(outcome))
    assert error_table("x", outcome.train).rows[0].cells[0] == "arc (interlock)"
    told = outcome_json(outcome)
    assert told["train"][0]["ended_early"]["kind"] == "interlock"
    # three lobes are few, and it says so
    assert "under voltage" in outcome.few_data
    assert any(outcome.few_data in sentence for sentence in identify_summary(outcome))
    cut = identify_recordings(
        [folder / "arc.h5"], branches=(1,), intervals=False, ended_early="cut"
    )
    assert cut.train[0].ended.is_cut
    assert cut.train[0].time.size < outcome.train[0].time.size


@pytest.mark.parametrize("command", ["identify", "diagnose"])
def test_the_commands_warn_before_they_fit(folder, tmp_path, command):
    out = ("--out", tmp_path / "m.toml") if command == "identify" else ()
    answer = dearig(command, folder / "arc.h5", *out, "--validate", folder / "arc.h5")
    assert answer.code == 2  # no fit: a recording is refused that is to do both
    assert "Warning: arc ended in an interlock at" in answer.out
    assert "--ended-early cut" in answer.out
    answer = dearig(command, folder / "arc.h5", *out, "--ended-early", "leave-out")
    assert answer.code == 2
    assert "every recording is left out" in answer.err


def test_a_fit_of_the_command_can_cut(folder, tmp_path):
    told = done(
        "identify", folder / "arc.h5", "--out", tmp_path / "m.toml", "--branches", "1",
        "--ended-early", "cut", "--no-intervals", "--json", "-",
    ).json  # fmt: skip
    assert told["train"][0]["ended_early"]["cut"] is True


class Run:
    """What is known of how a run ended."""

    def __init__(self, outcome: str, *events: tuple[float, str, str], complete=True) -> None:
        self.outcome, self.complete, self.duration = outcome, complete, 6.9
        self.events = tuple(RecordedEvent(0, time, level, said) for time, level, said in events)


@pytest.mark.parametrize(
    ("run", "kind", "words"),
    [
        (Run("finished"), None, ""),
        (Run("imported from a.csv"), None, ""),
        (
            Run("interrupted by the operator; ramped down to 0 V",
                (6.1, "warning", "interrupted by the operator: ramping down to 0 V")),
            "stopped", "was stopped at 6.10 s (by the operator)",
        ),
        (Run("", complete=False), "incomplete", "is incomplete: the run was killed at 6.90 s"),
        (Run("killed; 690 samples recovered"), "incomplete", "is incomplete"),
        (Run("instrument fault: the card is gone"), "fault", "(the card is gone)"),
        (
            Run("stopped by an interlock: at 6 s the disk had 1 MB left",
                (6.0, "fault", "interlock disk: at 6 s the disk had 1 MB left")),
            "interlock", "(disk almost full): it does not hold the whole sequence",
        ),
        (
            Run("stopped by an interlock: at 6 s load cell read 9 N",
                (6.0, "fault", "interlock channel load: at 6 s load cell read 9 N")),
            "interlock", "(channel load): the last 0.5 s may show the fault",
        ),
    ],
)  # fmt: skip
def test_every_way_to_end(run, kind, words):
    end = early_end(run)
    if kind is None:
        assert end is None
        return
    assert end.kind == kind
    assert words in end.sentence


def test_enough_data_are_not_called_few(folder):
    whole = [Readings(open_recording(folder / "whole.h5"))]
    assert few_data(whole) == "3.99 s under voltage, 4 loadings"
    assert few_data(whole * 3) == ""
