"""What the electrical channels say of an effect: evidence, denial, sentences."""

from __future__ import annotations

from dataclasses import replace

import pytest

from dearig.model.diagnosis.channels import ChannelEvidence
from dearig.model.diagnosis.settings import DiagnosisSettings
from dearig.model.fitting.channels import Channels
from dearig.model.readings.channels import CURRENT, VOLTAGE_MONITOR
from tests.model.fitting.test_channels import ELECTRODE, LAG, LEAK, PLAIN, SATURATION, record


def evidence_of(made):
    return ChannelEvidence(Channels([made], PLAIN), DiagnosisSettings(), PLAIN)


def with_(*effects):
    return replace(PLAIN, effects=tuple(e for some in effects for e in some))


def test_the_plain_circuit_is_the_measure():
    evidence = evidence_of(record())
    assert evidence.of(PLAIN) == {VOLTAGE_MONITOR: 0.0, CURRENT: 0.0}
    assert evidence.denied(PLAIN) is None
    assert not evidence.is_open(PLAIN)
    # an effect on the springs alone changes no channel
    drag = with_((("linear drag", (("drag", 50.0),)),))
    assert evidence.total(drag) == 0.0


def test_a_lag_that_the_monitor_does_not_show_is_denied():
    evidence = evidence_of(record())
    assert evidence.denied(with_(LAG)) == ("amplifier lag", VOLTAGE_MONITOR)
    assert evidence.total(with_(LAG)) > 1e3
    denial = evidence.denial("amplifier lag", with_(LAG))
    assert denial is not None
    assert denial.implied > 50.0 > denial.seen
    assert "the voltage monitor denies it" in denial.text
    assert "(noise 1" in denial.text
    (monitor, _) = evidence.says(with_(LAG), "amplifier lag")
    assert (monitor.channel, monitor.verdict) == (VOLTAGE_MONITOR, "denies")


def test_a_lag_that_the_monitor_shows_is_confirmed():
    evidence = evidence_of(record(LAG))
    assert evidence.is_open(PLAIN)
    assert evidence.denied(with_(LAG)) is None
    assert evidence.demands(PLAIN, with_(LAG))
    (monitor, _) = evidence.says(with_(LAG), "amplifier lag")
    assert monitor.verdict == "confirms"
    assert evidence.total(with_(LAG)) < -1e3


def test_the_current_tells_a_leak_from_an_amplifier_that_bends():
    evidence = evidence_of(record(LEAK, leak_ohm=2e6))
    assert evidence.is_open(PLAIN)
    assert evidence.denied(with_(LEAK)) is None
    assert evidence.demands(with_(SATURATION), with_(LEAK))
    assert evidence.denied(with_(SATURATION)) == ("amplifier saturation", VOLTAGE_MONITOR)


def test_beside_a_true_effect_a_false_one_is_denied():
    evidence = evidence_of(record(LEAK, leak_ohm=2e6))
    assert evidence.denied(with_(LEAK, LAG)) == ("amplifier lag", VOLTAGE_MONITOR)


def test_a_loss_without_a_current_is_denied():
    evidence = evidence_of(record())
    assert evidence.denied(with_(LEAK)) == ("leakage", CURRENT)


def test_a_true_resistance_of_the_electrodes_is_not_denied():
    evidence = evidence_of(record(ELECTRODE))
    assert evidence.denied(with_(ELECTRODE)) is None
    assert evidence.total(with_(ELECTRODE)) < 0.0
    assert evidence.total(with_(LAG)) > 1e3


@pytest.mark.parametrize("value", [0.0, 1e-6])
def test_near_nothing_is_neither_confirmed_nor_denied(value):
    lag = (("amplifier lag", (("time_constant", value),)),)
    evidence = evidence_of(record())
    assert evidence.denied(with_(lag)) is None
    assert [s.verdict for s in evidence.says(with_(lag), "amplifier lag")] == ["silent", "silent"]
