"""A campaign on a rig on paper: its runs write short recordings, and can be killed anywhere."""

from __future__ import annotations

import shutil
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

from dearig.acquisition.run import RunOptions, RunResult
from dearig.batch import campaign as module
from dearig.batch.campaign import Arming, play_campaign
from dearig.batch.journal import Journal
from dearig.batch.queue import CampaignOutcome
from dearig.config.campaignfile import Campaign, parse_campaign
from dearig.config.rigfile import load_rig_file
from dearig.drivers.rig import Block
from dearig.errors import DearigError
from dearig.output_state import Known, OutputState
from tests.tools.command import LOBE
from tests.tools.recordings import run_counts, write_run, writer

PLAN = """\
name = "three"
sequence = "lobe.toml"
repeat = 3
"""
RIG_FILE = load_rig_file(None)
CONFIRMED = OutputState(Known.CONFIRMED, 1.8e9, 0.0)
UNKNOWN = OutputState(Known.UNKNOWN, 1.8e9, 500.0)


class Killed(BaseException):
    """The process ends here, as by kill -9: nothing after this is done."""


@dataclass
class Bench:
    """The rig on paper, and the campaign that is played on it."""

    folder: Path
    whole: Path
    partial: Path
    played: Counter[str] = field(default_factory=Counter)
    seeds: dict[str, int] = field(default_factory=dict)
    #: What happens to a run, by its name: an error, an output state, "killed" or "killed at the
    #: end"; each once.
    fates: dict[str, object] = field(default_factory=dict)
    kill_at: int = -1
    appended: int = 0
    simulated: bool = True
    at: float = 1_800_000_000.0
    passed: float = 0.0

    def record(self, *given, **_) -> RunResult:
        """Evaluation in for the run: count it, and leave the recording that its fate asks for."""
        *_, out, options = given
        name = out.stem
        self.played[name] += 1
        self.seeds[name] = options.seed
        assert not out.exists()
        fate = self.fates.pop(name, None)
        shutil.copy(self.partial if fate is not None else self.whole, out)
        if fate == "killed":
            raise Killed
        if fate == "killed at the end":
            shutil.copy(self.whole, out)
            raise Killed
        if isinstance(fate, BaseException):
            raise fate
        if fate is not None:
            shutil.copy(self.whole, out)
        state = fate if isinstance(fate, OutputState) else CONFIRMED
        return RunResult(out, 3000, 1000.0, "finished", (), (), state)

    def play(
        self, plan: str = PLAN, arming: Arming | None = None, *, resume: bool = False,
        wait: Callable[[float], None] | None = None, paced: bool = False, **more: Any,
    ) -> CampaignOutcome:  # fmt: skip
        self.appended = 0
        return play_campaign(
            self.campaign(plan), "sim", RIG_FILE, self.folder / "out",
            RunOptions(paced=paced), arming or Arming(), resume=resume, now=lambda: self.at,
            clock=lambda: self.passed,
            wait=wait or self.pass_time, **more,
        )  # fmt: skip

    def pass_time(self, seconds: float) -> None:
        self.at += seconds
        self.passed += seconds

    def campaign(self, plan: str = PLAN) -> Campaign:
        return parse_campaign(plan, "plan", self.folder)

    def continued(self, plan: str = PLAN, arming: Arming | None = None) -> CampaignOutcome:
        return self.play(plan, arming, resume=(self.out / "campaign.jsonl").exists() and
                         b"planned" in (self.out / "campaign.jsonl").read_bytes())  # fmt: skip

    @property
    def out(self) -> Path:
        return self.folder / "out"

    def fail(self, name: str, error: DearigError, state: OutputState | None = CONFIRMED) -> None:
        error.output_state = state
        self.fates[name] = error


@pytest.fixture(scope="session")
def made_runs(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """A whole recording and one whose run was killed."""
    folder = tmp_path_factory.mktemp("runs")
    write_run(folder / "whole.h5", run_counts(600, quiet=100), block=200)
    recorder = writer(folder / "cut.h5", samples_expected=600)
    recorder.append(Block(0, run_counts(600, quiet=100)[:, :300]))
    recorder._flush_all(1.8e9)
    shutil.copy(folder / "cut.h5", folder / "partial.h5")
    recorder.close()
    return folder / "whole.h5", folder / "partial.h5"


@pytest.fixture
def bench(tmp_path: Path, made_runs: tuple[Path, Path], monkeypatch: pytest.MonkeyPatch) -> Bench:
    """A rig on paper in place of the one that ``record`` would open."""
    made = Bench(tmp_path, *made_runs)
    (tmp_path / "lobe.toml").write_text(LOBE, "utf-8")
    monkeypatch.setattr(module, "record", made.record)
    monkeypatch.setattr(module, "is_simulated", lambda _: made.simulated)
    # nothing here is about a power cut, and a flush takes milliseconds
    monkeypatch.setattr("os.fsync", lambda _: None)
    append = Journal.append

    def killed_at(journal: Journal, event: str, **facts):
        """Kill before or after the append number ``kill_at // 2``."""
        number = made.appended
        made.appended += 1
        if made.kill_at == 2 * number:
            raise Killed
        entry = append(journal, event, **facts)
        if made.kill_at == 2 * number + 1:
            raise Killed
        return entry

    monkeypatch.setattr(Journal, "append", killed_at)
    return made
