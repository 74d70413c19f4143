"""The hardware watchdog: whether it is wired is said, and without one a run needs a declaration."""

from __future__ import annotations

import pytest

from dearig.acquisition.check import check_rig
from dearig.config.rigfile import RigFile, load_rig_file
from dearig.drivers.daqmx.watchdog import WATCHDOG, watchdog_text
from dearig.errors import InputError
from dearig.sim_backend.daqmx.properties import attributes
from tests.deep import mostly_deep
from tests.tools.command import LOBE, dearig, done, names, refused, write
from tests.tools.daqmx import served

IS_SIMULATED = ("Device", 0x22CA)
NO_WATCHDOG = "nothing takes the voltage down if run and guardian die together"
WIRED = '[card]\ndo_hv_enable = "port0/line0"\n'
DECLARED = "[card]\ni_have_no_watchdog = true\n"


@pytest.fixture
def real(monkeypatch):
    """The simulated card reports that it is a real one."""
    answered = attributes.get

    def get(group, number, asked):
        return False if (group, number) == IS_SIMULATED else answered(group, number, asked)

    monkeypatch.setattr(attributes, "get", get)


def run(card, tmp_path, rig_toml):
    rig = write(tmp_path / "rig.toml", '[film]\nname = "A7"\n' + rig_toml)
    sequence = write(tmp_path / "lobe.toml", LOBE)
    address = f"daqmx:Dev1@127.0.0.1:{card.server.port}"
    out = tmp_path / "run.h5"
    return dearig("record", sequence, "--rig", address, "--rig-file", rig, "--out", out), out


@pytest.mark.usefixtures("real")
def test_a_real_card_without_watchdog_and_declaration_is_refused_untouched(tmp_path):
    with served() as card:
        answer, out = run(card, tmp_path, "")
        assert card.device.history()[-1].wire == 0.0
        assert len(card.device.history()) == 1
    sentence = refused(answer, NO_WATCHDOG, "card.do_hv_enable", "i_have_no_watchdog = true")
    assert "Dev1" in sentence
    assert not out.exists()


@pytest.mark.usefixtures("real")
def test_a_campaign_on_such_a_card_is_refused_before_its_folder_is_made(tmp_path):
    rig = write(tmp_path / "rig.toml", '[film]\nname = "A7"\n')
    write(tmp_path / "lobe.toml", LOBE)
    plan = write(tmp_path / "plan.toml", 'name = "one"\nsequence = "lobe.toml"\n')
    before = names(tmp_path)
    with served() as card:
        answer = dearig(
            "campaign", plan, "--rig", f"daqmx:Dev1@127.0.0.1:{card.server.port}", "--rig-file",
            rig, "--out", tmp_path / "out", "--operator", "Ada", "--runs", 1, "--hours", 1,
        )  # fmt: skip
        assert len(card.device.history()) == 1
    assert answer.code == 2
    assert NO_WATCHDOG in answer.err
    assert names(tmp_path) == before


@pytest.mark.usefixtures("real")
@pytest.mark.parametrize("rig_toml", ["", '[card]\ndo_hv_enable = "port0/line0"\n'
                                      "hv_enable_watchdog_s = 0.0\n"])  # fmt: skip
def test_check_says_that_a_run_would_be_refused(tmp_path, rig_toml):
    rig = write(tmp_path / "rig.toml", '[film]\nname = "A7"\n' + rig_toml)
    with served() as card:
        address = f"daqmx:Dev1@127.0.0.1:{card.server.port}"
        answer = dearig("check", "--rig", address, "--rig-file", rig)
    assert answer.code == 2
    assert NO_WATCHDOG in " ".join(answer.out.split())


@pytest.mark.usefixtures("real")
@pytest.mark.parametrize(
    ("rig_toml", "said"),
    mostly_deep(
        [
            pytest.param(WIRED, "the card switches the amplifier off after 1 s"),
            pytest.param(
                WIRED + "hv_enable_watchdog_s = 2.5\n",
                "switches the amplifier off after 2.5 s",
                id="of the rig file",
            ),
            pytest.param(DECLARED, NO_WATCHDOG, id="declared"),
        ],
        ["of the rig file", "declared"],
    ),
)
def test_the_first_line_of_a_run_on_a_card_says_what_the_watchdog_does(tmp_path, rig_toml, said):
    with served() as card:
        answer, out = run(card, tmp_path, rig_toml)
    assert answer.code == 0, answer.err
    first = answer.out.splitlines()[0]
    assert first.startswith("hardware watchdog: ")
    assert said in first
    assert out.exists()


def test_a_card_that_reports_itself_as_simulated_needs_no_declaration(tmp_path):
    with served() as card:
        answer, _ = run(card, tmp_path, "")
    assert answer.code == 0, answer.err
    assert "the card reports itself as simulated" in answer.out.splitlines()[0]


def test_simulated_rigs_need_nothing_and_say_nothing(tmp_path):
    sequence = write(tmp_path / "lobe.toml", LOBE)
    answer = done("record", sequence, "--rig", "sim", "--out", tmp_path / "run.h5")
    assert "watchdog" not in answer.out
    assert all(f.item != WATCHDOG for f in check_rig("sim", RigFile()).findings)


@pytest.mark.parametrize("address", ["daqmx:Dev1", "daqmx:Dev1@127.0.0.1:9"])
def test_a_card_that_cannot_be_reached_has_its_watchdog_checked_too(address):
    found = {f.item: f.verdict for f in check_rig(address, RigFile()).findings}
    # behind a server it may be a simulated one
    assert found[WATCHDOG] == ("wrong" if address == "daqmx:Dev1" else "warning")


def test_a_run_on_a_card_in_this_computer_is_refused_before_its_driver_is_missed(tmp_path):
    sequence = write(tmp_path / "lobe.toml", LOBE)
    rig = write(tmp_path / "rig.toml", '[film]\nname = "A7"\n')
    command = ("record", sequence, "--rig", "daqmx:Dev1", "--out", tmp_path / "run.h5")
    refused(dearig(*command, "--rig-file", rig), "i_have_no_watchdog = true")


@pytest.mark.parametrize(
    ("card", "words"),
    [
        ({"hv_enable_watchdog_s": 34.36, "do_hv_enable": "port0/line0"}, "from 0 to 34.35"),
        ({"hv_enable_watchdog_s": 60.0, "do_hv_enable": "port0/line0"}, "from 0 to 34.35"),
        ({"hv_enable_watchdog_s": 0.2, "do_hv_enable": "port0/line0"}, "below 0.3"),
        ({"hv_enable_watchdog_s": 1.0}, "but not card.do_hv_enable"),
        ({"i_have_no_watchdog": True, "do_hv_enable": "port0/line0"}, "has a watchdog of 1 s"),
        ({"i_have_no_watchdog": "yes"}, "card.i_have_no_watchdog"),
    ],
)
def test_a_watchdog_that_cannot_be_is_refused(tmp_path, card, words):
    keys = "".join(f"{key} = {_toml(value)}\n" for key, value in card.items())
    rig = write(tmp_path / "rig.toml", "[card]\n" + keys)
    with pytest.raises(InputError, match="rig file") as caught:
        load_rig_file(rig)
    assert words in str(caught.value)


def _toml(value):
    if isinstance(value, str):
        return f'"{value}"'
    return str(value).lower()


def test_a_line_without_a_time_has_the_default_watchdog_and_zero_has_none():
    wired = {"do_hv_enable": "port0/line0"}
    assert RigFile.model_validate({"card": wired}).card.watchdog_s == 1.0
    off = RigFile.model_validate({"card": {**wired, "hv_enable_watchdog_s": 0.0}}).card
    assert off.watchdog_s == 0.0
    assert NO_WATCHDOG in watchdog_text(off, simulated=False)
    assert RigFile().card.watchdog_s == 0.0
