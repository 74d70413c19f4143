"""The amplifier's monitors at 0 V."""

from __future__ import annotations

import math

import pytest

from dearig.drivers.contract.amplifier import AmplifierContract
from dearig.drivers.instruments.amplifier import Monitors, zero_findings
from dearig.drivers.instruments.trek import TrekDriver
from dearig.drivers.settings import AmplifierSettings, RigSettings

RIG = RigSettings()


def test_monitors_are_scaled_to_the_film() -> None:
    amplifier = AmplifierSettings(monitor_V_per_kV=0.5, current_monitor_V_per_mA=0.25)
    monitors = Monitors.of_volts(amplifier, 2.0, -1.0)
    assert monitors.voltage == pytest.approx(4000.0)
    assert monitors.current == pytest.approx(-4e-3)


def test_monitors_at_zero_are_well() -> None:
    assert [f.verdict for f in zero_findings(Monitors(-99.0, 0.79e-3), RIG)] == ["ok", "ok"]


@pytest.mark.parametrize(
    ("monitors", "wrong"),
    [
        (Monitors(101.0, 0.0), ["voltage monitor at 0 V"]),
        (Monitors(-8000.0, -2e-3), ["voltage monitor at 0 V", "current monitor at 0 V"]),
        (Monitors(0.0, 0.9e-3), ["current monitor at 0 V"]),
        (Monitors(math.nan, math.inf), ["voltage monitor at 0 V", "current monitor at 0 V"]),
    ],
)
def test_a_voltage_that_should_not_be_there_is_told(monitors: Monitors, wrong: list[str]) -> None:
    findings = zero_findings(monitors, RIG)
    assert [f.item for f in findings if f.verdict == "wrong"] == wrong
    for finding in findings:
        assert ("keep away from the film" in finding.sentence) == (finding.item in wrong)


def test_the_sentence_names_both_values() -> None:
    sentence = zero_findings(Monitors(500.0, 0.0), RIG)[0].sentence
    assert "TREK 10/40A-HS, voltage monitor at 0 V: 0.500 kV, expected less than 0.1 kV" in sentence


class TestTrek(AmplifierContract):
    def driver(self) -> TrekDriver:
        return TrekDriver()
