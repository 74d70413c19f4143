"""The commands for many runs, from end to end."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.tools.command import LOBE, SLOW_RIG, dearig, done, names, refused, write

PLAN = """\
name = "two"
sequence = "lobe.toml"
rest_s = 3600.0
template = "{segment.0.amplitude_kV}kV"
[grid]
"segment.0.amplitude_kV" = [2.0, 3.0]
[warm_up]
runs = 1
"""


@pytest.fixture
def given(tmp_path: Path) -> list[str | Path]:
    """A plan, and options for its rig and its folder."""
    write(tmp_path / "lobe.toml", LOBE)
    rig = write(tmp_path / "rig.toml", SLOW_RIG)
    return [write(tmp_path / "plan.toml", PLAN), "--rig-file", rig, "--out", tmp_path / "out"]


def test_a_campaign_from_its_check_to_its_page(given, tmp_path: Path) -> None:
    before = names(tmp_path)
    found = done("campaign", *given, "--check", "--json", "-")
    assert "3 runs, of which 1 to warm up, 2 h 0 min without computations" in found.err
    assert found.json["format"] == "dearig-campaign-check/1"
    assert found.json["seconds"] == pytest.approx(7200.0 + 3 * 1.5, abs=0.1)
    assert names(tmp_path) == before
    found = done("campaign", *given, "--json", "-")
    assert (found.json["format"], found.json["status"]) == ("dearig-campaign/1", "complete")
    assert (found.json["planned"], found.json["done"], found.json["failed"]) == (3, 3, 0)
    assert found.json["runs"][2]["settings"] == {"segment.0.amplitude_kV": 3.0}
    assert names(tmp_path / "out") == {
        "two-warm-up-01.h5", "2.0kV.h5", "3.0kV.h5", "campaign.jsonl", "plan.toml", "report.html"
    }  # fmt: skip
    page = (tmp_path / "out" / "report.html").read_text("utf-8")
    assert "3 runs: 3 done." in page
    assert '<th scope="col">amplitude (kV)</th>' in page
    assert '<th scope="row">3.0kV</th><td>3.0</td><td>done</td>' in page
    shown = done("campaign-queue", tmp_path / "out", "--json", "-")
    assert shown.json == found.json
    refused(dearig("campaign", *given), "3 of 3 runs done", "--resume")
    refused(dearig("campaign-queue", tmp_path / "out", "--skip", "2.0kV"), "run 2.0kV is done")


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ('[notify]\nwebhook = "file:///etc/passwd"\n', "notify.webhook is not an address"),
        ('[notify]\ncommand = ["/no/such/program"]\n', "notify.command: the program"),
        ('[after]\nvalidate = true\nmodel = "none.toml"\n', "none.toml is not there"),
        ('[grid]\n"segment.0.amplitude_kV" = ["x"]\n', "plan.toml: run x-0001, sequence"),
    ],
)
def test_a_check_refuses_what_the_campaign_would(more, words, tmp_path: Path) -> None:
    write(tmp_path / "lobe.toml", LOBE)
    plan = write(tmp_path / "plan.toml", 'name = "x"\nsequence = "lobe.toml"\n' + more)
    said = refused(dearig("campaign", plan, "--out", tmp_path / "out", "--check"), words)
    assert said.count("x-0001") <= 1


def test_an_interlock_halts_it_with_code_3_until_a_person_has_looked(given, tmp_path: Path) -> None:
    trip = dearig("campaign", *given, "--fault", "arc@0.6", "--json", "-")
    assert trip.code == 3
    assert trip.json["status"] == "halted"
    assert [run["state"] for run in trip.json["runs"]] == ["stopped", "waiting", "waiting"]
    refused(dearig("campaign", *given, "--resume"), "is halted", "--acknowledge")
    found = done(
        "campaign",
        *given,
        "--resume",
        "--operator",
        "Ada",
        "--acknowledge",
        "no mark",
        "--json",
        "-",
    )
    assert [run["state"] for run in found.json["runs"]] == ["stopped", "done", "done"]


def test_wrong_input_is_refused_and_nothing_is_made(given, tmp_path: Path) -> None:
    _, *options = given
    before = names(tmp_path)
    refused(dearig("campaign", *given, "--resume"), "has no campaign to continue")
    refused(dearig("campaign", *given, "--rig", "foo"), "'foo' is not known")
    # what applies on a real rig is said before it is armed
    answer = dearig("campaign", *given, "--rig", "daqmx:Dev1")
    assert (answer.code, "kV" in answer.out) == (2, True)
    assert all(option in answer.err for option in ("--operator", "--runs", "--hours"))
    refused(dearig("campaign", *given, "--fault", "x"), "fault")
    refused(dearig("campaign-queue", tmp_path), "has no campaign")
    refused(dearig("campaign-queue", tmp_path, "--pause", "--continue"), "exclude each other")
    high = write(tmp_path / "high.toml", PLAN.replace("3.0]", "30.0]"))
    refused(dearig("campaign", high, *options), "run 30.0kV", "is refused")
    assert names(tmp_path) - before == {"high.toml"}


def test_the_written_plan_can_be_checked(tmp_path: Path) -> None:
    plan = tmp_path / "plan.toml"
    done("campaign-file", plan)
    assert done("campaign", plan, "--out", tmp_path / "out", "--check").code == 0


def test_a_card_without_a_film_leaves_nothing_behind(given, tmp_path: Path) -> None:
    before = names(tmp_path)
    card = ("--rig", "daqmx:Dev1", "--operator", "Ada", "--runs", 1, "--hours", 1)
    answer = dearig("campaign", *given, *card)
    assert answer.code == 2
    assert "no film is declared; give a rig file" in answer.err
    assert names(tmp_path) == before


def test_what_is_asked_of_a_campaign_that_nobody_plays_says_so(given, tmp_path: Path) -> None:
    done("campaign", *given, "--runs", 1)
    answer = done("campaign-queue", tmp_path / "out", "--end")
    assert "asked to end; it takes effect when the campaign is continued" in answer.out


def test_a_campaign_that_is_finished_cannot_be_ended(given, tmp_path: Path) -> None:
    done("campaign", *given)
    for request in ("end", "pause", "continue"):
        answer = dearig("campaign-queue", tmp_path / "out", f"--{request}")
        refused(answer, f"is finished: none of its 3 runs waits, so there is nothing to {request}")


@pytest.mark.parametrize("option", [("--seed", 5), ("--paced",)])
def test_what_only_a_simulated_rig_takes_is_refused_for_a_card(
    given, tmp_path: Path, option: tuple[str, ...]
) -> None:
    answer = dearig("campaign", *given, "--rig", "daqmx:Dev1", *option)
    refused(answer, "'daqmx:Dev1' is not simulated", option[0])
    assert not (tmp_path / "out").exists()
