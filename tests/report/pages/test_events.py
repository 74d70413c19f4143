"""What happened once, and what comes with each run, in sentences and JSON."""

from dataclasses import replace

import pytest

from dearig.model.diagnosis.events import OneTimeEvent
from dearig.report.as_json import diagnosis_json
from dearig.report.text.diagnosis import summary
from tests.tools.diagnosis import diagnose_outcome


def test_events_of_a_recording_stand_beside_its_error():
    outcome = diagnose_outcome()
    (first, *others) = outcome.after.validation
    event = OneTimeEvent("sudden change of reading", 4.2, 3e-5, "m")
    first = replace(first, events=(event,), rms_without_events=0.5 * first.errors.rms)
    after = replace(outcome.after, validation=(first, *others))
    outcome = replace(outcome, stands=(*outcome.stands[:-1], after))
    said = " ".join(summary(outcome))
    assert f"In {first.name} there is a sudden change of reading of" in said
    assert "at 4.20 s" in said
    found = diagnosis_json(outcome)
    assert found["events"] == [
        {"record": first.name, "kind": event.kind, "at_s": 4.2, "size": 3e-5, "unit": "m"}
    ]
    measures = found["final"]["validation_by_record"][first.name]
    assert measures["rms_without_events_um"] == pytest.approx(0.5 * measures["rms_um"])


@pytest.mark.parametrize(("later", "alike"), [(0.01, True), (0.5, False)])
def test_an_event_at_one_moment_of_all_recordings_did_not_happen_once(later, alike):
    outcome = diagnose_outcome()
    event = OneTimeEvent("sudden change of reading", 4.2, 3e-5, "m")
    (train,), (first, last) = outcome.after.train, outcome.after.validation
    first, train = (replace(c, events=(event,)) for c in (first, train))
    last = replace(last, events=(replace(event, time=4.2 + later),))
    after = replace(outcome.after, train=(train,), validation=(first, last))
    said = " ".join(summary(replace(outcome, stands=(*outcome.stands[:-1], after))))
    told = f"at 4.20 s is in {train.name}, {first.name} and {last.name} alike, so it comes with"
    assert (told in said) == alike


def test_what_comes_with_each_run_is_in_the_predictions_and_said_to_be():
    outcome = diagnose_outcome()
    event = OneTimeEvent("sudden loss of field", 9.24, 5e-3, "")
    outcome = replace(outcome, recurring=(event,))
    said = " ".join(summary(outcome))
    assert "The sudden loss of field at 9.24 s is in " in said
    assert "did not happen once, and predictions have it" in said
    assert "predicted without it" not in said
    (stored,) = diagnosis_json(outcome)["recurring_events"]
    assert (stored["kind"], stored["at_s"]) == ("sudden loss of field", 9.24)
