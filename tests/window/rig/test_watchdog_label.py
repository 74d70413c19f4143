"""The Run page says whether the card's hardware watchdog is wired."""

from __future__ import annotations

import pytest
from pytestqt.qtbot import QtBot

from dearig.config.rigfile import RigFile
from dearig.window.run.page import RunPage


@pytest.mark.parametrize(
    ("address", "card", "said"),
    [
        ("sim", {}, ""),
        ("sim:7", {"i_have_no_watchdog": True}, ""),
        ("daqmx:Dev1", {}, "needs card.i_have_no_watchdog = true"),
        ("daqmx:Dev1", {"i_have_no_watchdog": True}, "nothing takes the voltage down"),
        ("daqmx:Dev1@host:1", {"do_hv_enable": "port0/line0"}, "off after 1 s"),
    ],
)
def test_the_label_follows_address_and_rig_file(
    run_page: RunPage, qtbot: QtBot, address: str, card: dict[str, object], said: str
) -> None:
    run_page.session.set_address(address)
    run_page.session.set_rig_file(None, "", RigFile.model_validate({"card": card}))
    # the window is not destroyed while its plan is being made
    qtbot.waitUntil(lambda: run_page.session.preview is not None, timeout=120_000)
    shown = run_page.watchdog.text()
    assert said in shown
    assert bool(shown) is bool(said)
    assert run_page.watchdog.isHidden() is not bool(said)
