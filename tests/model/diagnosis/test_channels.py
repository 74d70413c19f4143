"""What the electrical channels say of an effect: evidence, denial, sentences."""

from __future__ import annotations

from dataclasses import replace

import pytest

from dearig.model.diagnosis.channels import ChannelEvidence
from dearig.model.diagnosis.evidence import Judge
from dearig.model.diagnosis.fits import Fitter
from dearig.model.diagnosis.settings import DiagnosisSettings
from dearig.model.fitting.channels import Channels, JointProblem
from dearig.model.fitting.slow_noise import WhitenedProblem
from dearig.model.readings.channels import CURRENT, VOLTAGE_MONITOR
from dearig.model.readings.records import ActuatorRecord
from tests.model.diagnosis.test_evidence import fit
from tests.model.fitting.test_channels import ELECTRODE, LAG, LEAK, PLAIN, SATURATION, record
from tests.tools.engine import typical


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


def test_a_fault_that_the_monitor_does_not_show_has_its_share_of_the_probability():
    baseline = fit(PLAIN, 4.0)
    judge = Judge(DiagnosisSettings(), baseline, Channels([record()], PLAIN))
    field = fit(with_((typical("field-dependent permittivity"),)), 1.0)
    bent, worse = (fit(with_(SATURATION), cost) for cost in (0.98, 1.5))
    assert judge.is_denied(bent)
    assert judge.probabilities([baseline, field, bent])["amplifier"] == pytest.approx(0.0)
    unseen = judge.unseen(bent, "amplifier saturation", field)
    shares = judge.probabilities([baseline, field, unseen])
    assert shares["amplifier"] == pytest.approx(0.25 * shares["permittivity"])
    assert judge.ranked([unseen, field])[0] is field
    far = judge.unseen(worse, "amplifier saturation", field)
    assert judge.probabilities([baseline, field, far])["amplifier"] < 0.01


@pytest.mark.parametrize("value", [0.0, 1e-6])
def test_near_nothing_is_neither_confirmed_nor_denied(value):
    lag = (("amplifier lag", (("time_constant", value),)),)
    evidence = evidence_of(record())
    assert evidence.denied(with_(lag)) is None
    assert [s.verdict for s in evidence.says(with_(lag), "amplifier lag")] == ["silent", "silent"]


def test_without_channels_problems_and_criterion_are_those_of_the_displacement():
    made = record()
    seen = made.displacement - made.displacement[: made.lead_in].mean()
    alone = ActuatorRecord("made", made.drive, seen, 1e-6, lead_in=made.lead_in)
    fitter = Fitter([alone], PLAIN, DiagnosisSettings(), workers=1)
    fitter.read_noise(PLAIN)
    assert not fitter.channels
    problem = fitter.problem(with_(LAG))
    assert type(problem) is WhitenedProblem
    x = problem.layout.coordinates(problem.layout.initial())
    fit = fitter.descend(problem, x, 0)
    assert fit.residuals.size == problem.measured.size
    judge = Judge(DiagnosisSettings(), fit, fitter.channels)
    assert judge.channels is None
    assert judge.evidence(fit) == judge.of_displacement(fit)


def test_with_channels_the_cost_of_a_fit_is_still_that_of_the_displacement():
    made = record()
    seen = made.displacement - made.displacement[: made.lead_in].mean()
    both = ActuatorRecord("made", made.drive, seen, 1e-6, lead_in=made.lead_in, electric=made)
    fitter = Fitter([both], PLAIN, DiagnosisSettings(), workers=1)
    fitter.read_noise(PLAIN)
    problem = fitter.problem(with_(LAG))
    assert isinstance(problem, JointProblem)
    x = problem.layout.coordinates(problem.layout.initial())
    fit = fitter.descend(problem, x, 0)
    alone = JointProblem.alone(problem)
    assert fit.cost == pytest.approx(float(alone.evaluate(x[None])[0][0]), rel=1e-9)
    assert fit.residuals.size == alone.measured.size
    # a lag that the monitor does not show is out of the question
    judge = Judge(DiagnosisSettings(), fit, fitter.channels)
    assert judge.criterion(fit) > judge.of_displacement(fit).criterion + 1e5
