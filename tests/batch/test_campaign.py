"""Campaigns on a rig on paper: every end, and every place where a kill can come."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from dearig.acquisition.interrupts import Interrupts
from dearig.acquisition.run import RunResult
from dearig.batch import campaign as module
from dearig.batch.after import AfterRun
from dearig.batch.ask import ask
from dearig.batch.campaign import Arming
from dearig.batch.forecast import foresee, survey
from dearig.batch.journal import JOURNAL, REQUESTS
from dearig.batch.queue import Queue
from dearig.batch.watching import seen
from dearig.cli.output import with_hints
from dearig.config.modelfile import save_model
from dearig.drivers.errors import RigError
from dearig.errors import DiskFault, InputError, InstrumentFault, Interrupted, SafetyStop
from dearig.model.film.material import TABLE_3, THESIS_FILM, THESIS_LOAD
from dearig.model.simulation.actuator import Actuator
from dearig.output_state import OutputState
from dearig.report.pages.campaign import campaign_table
from tests.tools.command import LOBE
from tests.tools.played import CONFIRMED, PLAN, RIG_FILE, UNKNOWN, Bench, Killed

NAMES = ["three-0001", "three-0002", "three-0003"]
LOOKED = Arming("Ada", acknowledged="0 V at the amplifier")


def states(bench: Bench) -> list[str]:
    return [run.state for run in seen(bench.out).queue.listed]


def test_every_run_is_played_once_in_order(bench: Bench) -> None:
    outcome = bench.play()
    assert outcome.status == "complete"
    assert list(bench.played.items()) == [(name, 1) for name in NAMES]
    assert len(set(bench.seeds.values())) == 3
    assert states(bench) == ["done"] * 3
    with pytest.raises(InputError, match="with 3 of 3 runs done; continue it, or"):
        bench.play()


#: A first run and a last one: a kill between further ones is like a kill between these.
TWO = PLAN.replace("repeat = 3", "repeat = 2")


def places() -> int:
    """Twice the entries of the journal of two runs: planned, armed, three for each, the end."""
    return 2 * (2 + 2 * 3 + 1)


@pytest.mark.parametrize("place", range(places()))
def test_no_kill_between_two_entries_loses_or_doubles_a_run(bench: Bench, place: int) -> None:
    bench.kill_at = place
    with pytest.raises(Killed):
        bench.play(TWO)
    bench.kill_at = -1
    assert bench.continued(TWO).status == "complete"
    assert dict(bench.played) == dict.fromkeys(NAMES[:2], 1)
    assert states(bench) == ["done"] * 2
    assert {p.stem for p in bench.out.glob("*.h5")} == set(NAMES[:2])


@pytest.mark.parametrize("place", range(0, 12))
def test_a_second_kill_while_the_first_is_settled_changes_nothing(bench: Bench, place: int) -> None:
    bench.fates["three-0002"] = "killed"
    with pytest.raises(Killed):
        bench.play()
    bench.kill_at = place
    try:
        bench.continued()
    except Killed:
        bench.kill_at = -1
        bench.continued()
    assert dict(bench.played) == dict.fromkeys(NAMES, 1)
    assert states(bench) == ["done", "lost", "done"]


def test_a_torn_last_line_is_removed(bench: Bench) -> None:
    bench.fates["three-0002"] = "killed"
    with pytest.raises(Killed):
        bench.play()
    journal = bench.out / JOURNAL
    journal.write_bytes(journal.read_bytes() + b'{"at": "2026-11-27T01:54:08", "eve')
    assert bench.continued().status == "complete"
    assert [json.loads(line)["event"] for line in journal.read_text("utf-8").splitlines()]


def test_a_run_that_was_whole_when_the_kill_came_is_kept(bench: Bench) -> None:
    bench.fates["three-0002"] = "killed at the end"
    with pytest.raises(Killed):
        bench.play()
    bench.continued()
    assert bench.played["three-0002"] == 1
    assert states(bench) == ["done"] * 3


def test_a_lost_recording_is_repeated_only_if_the_plan_says_so(bench: Bench) -> None:
    plan = PLAN + "repeat_lost = 1\n"
    bench.fates["three-0002"] = "killed"
    with pytest.raises(Killed):
        bench.play(plan)
    bench.fates["three-0002-attempt-2"] = "killed"
    with pytest.raises(Killed):
        bench.continued(plan)
    assert bench.continued(plan).status == "complete"
    assert states(bench) == ["done", "lost", "done"]
    assert dict(bench.played) == {
        "three-0001": 1, "three-0002": 1, "three-0002-attempt-2": 1, "three-0003": 1
    }  # fmt: skip
    assert (bench.out / "three-0002.h5").exists()  # what was recorded until the kill


def fault_of_the_card(code: int | None) -> InstrumentFault:
    error = InstrumentFault("a fault of the card; the rig was made safe")
    error.__cause__ = RigError("a fault", code)
    return error


BY_GUARDIAN = replace(CONFIRMED, by_guardian=True)
OVERFLOW, UNDERFLOW = -200279, -200290


@pytest.mark.parametrize(
    ("named", "code", "state", "goes_on"),
    [
        ('["input-overflow"]', OVERFLOW, CONFIRMED, True),
        ('["input-overflow", "output-underflow"]', UNDERFLOW, CONFIRMED, True),
        ("[]", OVERFLOW, CONFIRMED, False),
        ('["output-underflow"]', OVERFLOW, CONFIRMED, False),
        ('["input-overflow"]', OVERFLOW, UNKNOWN, False),
        ('["input-overflow"]', OVERFLOW, BY_GUARDIAN, False),
        ('["input-overflow"]', None, CONFIRMED, False),
    ],
)
def test_only_named_ends_at_confirmed_zero_are_repeated(
    bench: Bench, named: str, code: int | None, state: OutputState, goes_on: bool
) -> None:
    bench.fail("three-0002", fault_of_the_card(code), state)
    plan = PLAN + f"repeat_lost = 1\nrepeat_after = {named}\n"
    if goes_on:
        assert bench.play(plan).status == "complete"
        assert states(bench) == ["done"] * 3
        assert bench.played["three-0002-attempt-2"] == 1
        return
    with pytest.raises(InstrumentFault):
        bench.play(plan)
    with pytest.raises(InputError, match="the campaign is halted"):
        bench.play(plan, resume=True)
    assert bench.played["three-0002-attempt-2"] == 0


def test_an_end_that_comes_again_halts_after_the_allowed_repeats(bench: Bench) -> None:
    bench.fail("three-0002", fault_of_the_card(OVERFLOW))
    bench.fail("three-0002-attempt-2", fault_of_the_card(OVERFLOW))
    plan = PLAN + 'repeat_lost = 1\nrepeat_after = ["input-overflow"]\n'
    with pytest.raises(InstrumentFault):
        bench.play(plan)
    assert bench.played["three-0002-attempt-3"] == 0
    with pytest.raises(InputError, match="the campaign is halted: run three-0002"):
        bench.play(plan, resume=True)


@pytest.mark.parametrize("error", [SafetyStop("arc"), InstrumentFault("no card")])
def test_an_interlock_and_a_fault_halt_until_a_person_has_looked(bench: Bench, error) -> None:
    bench.fail("three-0001", error)
    with pytest.raises(type(error)):
        bench.play(PLAN + "repeat_lost = 3\n")
    plan = PLAN + "repeat_lost = 3\n"
    with pytest.raises(InputError, match="the campaign is halted: run three-0001"):
        bench.play(plan, resume=True)
    with pytest.raises(InputError, match="needs the name of who looked"):
        bench.play(plan, Arming(acknowledged="looked"), resume=True)
    with pytest.raises(InputError, match="the campaign is halted: run three-0001"):
        bench.play(plan, Arming("Ada", acknowledged=" "), resume=True)
    assert bench.played.total() == 1
    assert bench.play(plan, LOOKED, resume=True).status == "complete"
    # what an interlock ended is never repeated
    stopped = isinstance(error, SafetyStop)
    assert states(bench)[0] == ("stopped" if stopped else "done")
    with pytest.raises(InputError, match="nothing to acknowledge"):
        bench.play(plan, LOOKED, resume=True)


def test_a_doubt_about_zero_volts_halts_even_after_a_whole_run(bench: Bench) -> None:
    bench.fates["three-0001"] = UNKNOWN
    with pytest.raises(SafetyStop, match="switch the amplifier off"):
        bench.play()
    assert states(bench) == ["done", "waiting", "waiting"]
    assert bench.play(PLAN, LOOKED, resume=True).status == "complete"


@pytest.mark.parametrize("place", range(4, 12))
def test_no_kill_hides_a_doubt_about_zero_volts(bench: Bench, place: int) -> None:
    bench.fates["three-0001"] = UNKNOWN
    bench.kill_at = place
    with pytest.raises((Killed, SafetyStop)):
        bench.play()
    bench.kill_at = -1
    if bench.played.total() == 0 or not seen(bench.out).queue.halted:
        # killed before the doubt was known, on a rig that ended with the process
        return
    with pytest.raises(InputError, match="is halted"):
        bench.continued()
    assert bench.played.total() == 1


def test_a_full_disk_costs_one_run_and_the_next_is_played(bench: Bench) -> None:
    bench.fail("three-0002", DiskFault("full"))
    assert bench.play().status == "complete"
    assert states(bench) == ["done", "lost", "done"]


def test_a_run_that_the_gate_refuses_ends_the_session_and_stays_in_the_queue(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_, **__):
        raise InputError("the run needs 3 GB")

    with monkeypatch.context() as change:
        change.setattr("dearig.batch.campaign.record", refuse)
        with pytest.raises(InputError, match="run three-0001: the run needs 3 GB"):
            bench.play()
    assert states(bench) == ["waiting"] * 3
    assert bench.continued().status == "complete"


def test_ctrl_c_in_a_run_ends_the_session_and_the_rest_is_left(bench: Bench) -> None:
    bench.fail("three-0002", Interrupted("by the operator"))
    with pytest.raises(Interrupted):
        bench.play()
    assert states(bench) == ["done", "lost", "waiting"]
    assert bench.continued().status == "complete"


def test_ctrl_c_between_two_runs_ends_the_session(bench: Bench) -> None:
    def interrupt(_: float) -> None:
        raise KeyboardInterrupt

    with pytest.raises(Interrupted, match="2 runs are left"):
        bench.play(PLAN + "rest_s = 5.0\n", wait=interrupt, paced=True)
    assert seen(bench.out).status == "interrupted"


def test_another_thread_ends_it_between_two_runs_and_in_a_computation(bench: Bench) -> None:
    interrupts = Interrupts()
    with pytest.raises(Interrupted, match="2 runs are left"):
        bench.play(
            PLAN + "rest_s = 5.0\n", computing=lambda *_: interrupts.ask() or AfterRun(),
            interrupts=interrupts,
        )  # fmt: skip
    assert states(bench) == ["done", "waiting", "waiting"]
    with pytest.raises(Interrupted, match="nothing was played"):
        bench.play(PLAN + "rest_s = 5.0\n", resume=True, interrupts=interrupts)
    assert bench.played.total() == 1


def test_who_looks_on_sees_the_journal_and_comes_to_the_same_state(bench: Bench) -> None:
    bench.fates["three-0002"] = "killed"
    with pytest.raises(Killed):
        bench.play()
    told: list[dict] = []
    bench.play(resume=True, noted=told.extend)
    journal = bench.out / JOURNAL
    assert Queue.after(told, journal) == Queue.of(journal)


def test_other_sequences_than_those_that_were_shown_are_refused(bench: Bench) -> None:
    shown = survey(bench.campaign(), RIG_FILE, bench.out).digests
    (bench.folder / "lobe.toml").write_text(
        LOBE.replace("frequency_Hz = 1.0", "frequency_Hz = 0.9"), "utf-8"
    )
    with pytest.raises(InputError, match="not those that were armed"):
        bench.play(arming=Arming("Ada", shown=shown))
    assert not bench.out.exists()
    shown = survey(bench.campaign(), RIG_FILE, bench.out).digests
    assert bench.play(arming=Arming("Ada", shown=shown)).status == "complete"


def test_a_survey_says_of_every_run_why_it_is_refused(bench: Bench) -> None:
    plan = PLAN.replace("repeat = 3", "") + '[grid]\n"segment.0.amplitude_kV" = [6.0, 99.0, 5.0]\n'
    found = survey(bench.campaign(plan), RIG_FILE, bench.out)
    assert [bool(reason) for reason in found.refused] == [False, True, False]
    assert "99 kV" in found.refused[1]
    assert found.sizes[0] > 0
    with pytest.raises(InputError, match=r"run three-0002: .* is refused"):
        foresee(bench.campaign(plan), RIG_FILE, bench.out)


# ---------------------------------------------------------------- arming


def test_a_real_rig_is_armed_by_a_person_for_runs_and_hours(bench: Bench) -> None:
    bench.simulated = False
    nobody = Arming(" \t\u200b", runs=2, hours=1.0)
    for arming in (Arming(), Arming("Ada"), Arming("Ada", runs=2), Arming("", 2, 1.0), nobody):
        with pytest.raises(InputError, match="say who arms it, for how many runs"):
            bench.continued(arming=arming)
    assert bench.play(arming=Arming("Ada", 2, 1.0)).status == "armed_runs"
    assert states(bench) == ["done", "done", "waiting"]
    assert bench.continued(arming=Arming()).status == "armed_runs"  # nothing is left of it
    assert bench.continued(arming=Arming("Ada", 9, 0.0001)).status == "armed_time"
    assert bench.continued(arming=Arming("Ada", 1, 1.0)).status == "complete"


@pytest.mark.parametrize("kill_at", [-1, 2 * 5])  # within a session, or before the next one
def test_a_clock_that_is_set_back_does_not_make_the_armed_time_longer(
    bench: Bench, kill_at: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    def half_an_hour(*given: object, **more: object) -> RunResult:
        bench.pass_time(1800.0)
        bench.at -= 86_400.0 if kill_at < 0 else 0.0
        return bench.record(*given, **more)

    monkeypatch.setattr(module, "record", half_an_hour)
    bench.simulated, bench.kill_at = False, kill_at
    arming = Arming("Ada", 9, 0.51)
    if kill_at < 0:
        assert bench.play(arming=arming).status == "armed_time"
    else:
        with pytest.raises(Killed):
            bench.play(arming=arming)
        bench.kill_at, bench.at = -1, bench.at - 86_400.0
        assert bench.continued(arming=Arming()).status == "armed_time"
    assert states(bench) == ["done", "done", "waiting"]
    # a new arming is by the clock as it is
    assert bench.continued(arming=Arming("Ada", 9, 0.51)).status == "complete"


@pytest.mark.parametrize("step", [-3600.0, 3600.0])
def test_a_rest_is_by_the_time_that_has_passed(bench: Bench, step: float) -> None:
    rested = []

    def wait(seconds: float) -> None:
        bench.pass_time(seconds)
        bench.at += step
        rested.append(seconds)

    plan = PLAN + "rest_s = 5.0\n"
    assert bench.play(plan, wait=wait, paced=True).status == "complete"
    assert sum(rested) == pytest.approx(2 * 5.0)


def test_what_is_left_of_an_arming_survives_a_kill(bench: Bench) -> None:
    bench.simulated = False
    bench.kill_at = 2 * 5  # between the first and the second run
    with pytest.raises(Killed):
        bench.play(arming=Arming("Ada", 2, 1.0))
    bench.kill_at = -1
    assert bench.continued().status == "armed_runs"
    assert bench.played.total() == 2


def test_a_kill_during_a_run_on_a_real_rig_needs_a_look_at_the_amplifier(bench: Bench) -> None:
    bench.simulated = False
    arming = Arming("Ada", 3, 1.0)
    bench.fates["three-0001"] = "killed"
    with pytest.raises(Killed):
        bench.play(arming=arming)
    # an acknowledgement is of what was seen: this halt is new
    with pytest.raises(InputError, match="whether the output is at 0 V is not known"):
        bench.continued(arming=Arming("Ada", 3, 1.0, "all fine"))
    with pytest.raises(InputError, match="is halted"):
        bench.continued()
    assert bench.played.total() == 1
    assert bench.continued(arming=Arming("Ada", 3, 1.0, "0 V")).status == "complete"


# ---------------------------------------------------------------- requests


def test_runs_are_moved_left_out_and_ended_on_request(bench: Bench) -> None:
    bench.kill_at = 2 * 2  # before the first run
    with pytest.raises(Killed):
        bench.play()
    bench.kill_at = -1
    ask(bench.out, [("first", "three-0003"), ("skip", "three-0001")])
    assert bench.continued().status == "complete"
    assert list(bench.played) == ["three-0003", "three-0002"]
    assert seen(bench.out).queue.runs["three-0001"].state == "skipped"


def test_a_pause_holds_until_it_is_continued(bench: Bench) -> None:
    waited = []

    def wait(seconds: float) -> None:
        waited.append(seconds)
        if len(waited) == 3:
            ask(bench.out, [("continue", "")])

    bench.kill_at = 2 * 2
    with pytest.raises(Killed):
        bench.play()
    bench.kill_at = -1
    ask(bench.out, [("pause", "")])
    assert bench.play(resume=True, wait=wait).status == "complete"
    assert len(waited) == 3


def test_an_end_on_request_is_no_error_and_can_be_continued(bench: Bench) -> None:
    def end(_: float) -> None:
        ask(bench.out, [("end", "")])

    plan = PLAN + "rest_s = 0.4\n"
    assert bench.play(plan, wait=end, paced=True).status == "ended"
    assert states(bench).count("done") == 1
    # a request is taken once
    assert bench.play(plan, resume=True).status == "complete"


def test_a_request_that_a_kill_cut_off_is_left_out(bench: Bench) -> None:
    bench.kill_at = 2 * 2
    with pytest.raises(Killed):
        bench.play()
    bench.kill_at = -1
    (bench.out / REQUESTS).write_bytes(b'{"event": "sk')
    ask(bench.out, [("skip", "three-0001")])
    assert bench.continued().status == "complete"
    assert states(bench) == ["skipped", "done", "done"]
    with pytest.raises(InputError, match="did you mean three-0001"):
        ask(bench.out, [("skip", "three-1")])
    with pytest.raises(InputError, match="run three-0002 is done"):
        ask(bench.out, [("first", "three-0002")])


# ---------------------------------------------------------------- the same campaign


def test_another_plan_or_sequence_does_not_continue_it(bench: Bench) -> None:
    bench.kill_at = 2 * 2
    with pytest.raises(Killed):
        bench.play()
    bench.kill_at = -1
    with pytest.raises(InputError, match="the plan has changed since"):
        bench.continued(PLAN + "rest_s = 1.0\n")
    lobe = bench.folder / "lobe.toml"
    lobe.write_text(lobe.read_text("utf-8").replace("3.0", "4.0"), "utf-8")
    with pytest.raises(InputError, match="the sequence of run three-0001 has changed since"):
        bench.continued()
    assert not bench.played


def test_two_processes_do_not_play_one_campaign(bench: Bench) -> None:
    from dearig.batch.journal import Journal

    bench.kill_at = 2 * 2
    with pytest.raises(Killed):
        bench.play()
    bench.kill_at = -1
    with Journal(bench.out):
        assert seen(bench.out).status == "running"
        with pytest.raises(InputError, match="is running in another process"):
            bench.continued()
    assert seen(bench.out).status == "killed"


def test_recordings_that_are_not_kept_are_reduced_to_their_extremes(bench: Bench) -> None:
    plan = PLAN + "[keep]\nevery = 2\n"
    bench.play(plan)
    assert {p.name for p in bench.out.glob("*.h5")} == {"three-0001.h5", "three-0003.h5"}
    rows = (bench.out / "three-0002.csv").read_text("utf-8").splitlines()
    assert rows[0].startswith("cycle,start_s,voltage_monitor_min_kV,voltage_monitor_max_kV")
    assert len(rows) > 1
    assert not list(bench.out.glob("*-cycles.csv"))


def test_every_nth_cycle_of_the_others_is_kept_at_full_rate(bench: Bench) -> None:
    bench.play(PLAN + "[keep]\nevery = 2\nevery_cycle = 1\n")
    rows = (bench.out / "three-0002-cycles.csv").read_text("utf-8").splitlines()
    assert rows[0].startswith("cycle,time_s,voltage_monitor_kV,current_monitor_mA")
    times = np.array([float(row.split(",")[1]) for row in rows[1:]])
    assert times.size > 100
    steps = np.diff(times)
    assert steps[steps > 0.0] == pytest.approx(1e-3)


@pytest.mark.parametrize("place", range(10, places()))
def test_no_kill_loses_the_extremes_of_a_run(bench: Bench, place: int) -> None:
    plan = TWO + "[keep]\nevery = 2\n"
    bench.kill_at = place
    with pytest.raises(Killed):
        bench.play(plan)
    bench.kill_at = -1
    bench.continued(plan)
    assert dict(bench.played) == dict.fromkeys(NAMES[:2], 1)
    assert {p.name for p in bench.out.glob("three*")} == {"three-0001.h5", "three-0002.csv"}


# ---------------------------------------------------------------- computations


def computed(monkeypatch: pytest.MonkeyPatch, **facts) -> None:
    """Let each run have these results."""
    monkeypatch.setattr(module, "compute", lambda *_: AfterRun(**facts))


def test_a_number_that_leaves_its_band_halts_it_and_no_kill_hides_that(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    plan = PLAN + '[after]\nidentify = true\nstop_when = "mu_0_kPa < 40"\n'
    computed(monkeypatch, numbers={"mu_0_kPa": 39.0})
    bench.kill_at = 2 * 5  # after the halt, before the end of the run is noted
    with pytest.raises(Killed):
        bench.play(plan)
    bench.kill_at = -1
    with pytest.raises(InputError, match="mu_0_kPa is 39, and the plan stops when mu_0_kPa < 40"):
        bench.continued(plan)
    assert bench.played.total() == 1
    computed(monkeypatch, numbers={"mu_0_kPa": 41.0})
    assert bench.continued(plan, LOOKED).status == "complete"
    assert seen(bench.out).queue.runs["three-0002"].numbers == {"mu_0_kPa": 41.0}


def test_the_gate_checks_a_run_with_the_film_s_present_model(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    soft = replace(TABLE_3, equilibrium=replace(TABLE_3.equilibrium, modulus=3e3), branches=())
    save_model(
        bench.folder / "soft.toml", "soft", Actuator(THESIS_FILM, THESIS_LOAD, soft), {}, True
    )
    computed(monkeypatch, model="../soft.toml")
    plan = PLAN + "[after]\nidentify = true\n"
    with pytest.raises(
        InputError, match=r"with the film's present model .* three-0002 out"
    ) as told:
        bench.play(plan)
    assert with_hints(told.value).endswith(f" (dearig campaign-queue {bench.out} --skip)")
    assert bench.played.total() == 1
    assert states(bench) == ["done", "waiting", "waiting"]


def test_the_table_of_runs_has_the_settings_that_differ(bench: Bench) -> None:
    bench.play(
        PLAN.replace("repeat = 3", "")
        + '[grid]\n"segment.0.amplitude_kV" = [2.0, 3.0]\n"segment.0.frequency_Hz" = [1.0]\n'
    )
    table = campaign_table(seen(bench.out))
    head = [name for name, _ in table.head]
    assert head == ["", "amplitude (kV)", "State", "peak_displacement_mm"]
    assert [row.cells[1:3] for row in table.rows] == [("2.0", "done"), ("3.0", "done")]
