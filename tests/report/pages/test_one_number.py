"""Every number of a diagnosis is the same in its sentence, its table and the JSON."""

from __future__ import annotations

import re
from dataclasses import replace

import pytest

from dearig.report.as_json import diagnosis_json
from dearig.report.pages.diagnosis import write_diagnosis_report
from dearig.report.text.diagnosis import (
    signatures_of,
    summary,
)
from dearig.report.text.diagnosis_tables import (
    before_after_table,
    step_table,
)
from dearig.report.text.numbers import significant
from tests.tools.diagnosis import diagnose_outcome, finding, signature


def outcome(verdict: str = "explained", over: float = 2.6):
    """A diagnosis whose fits have other errors than its models: they have zeros of their own."""
    made = diagnose_outcome()
    (train,) = made.after.train
    (first, *others) = made.after.validation
    grown = replace(train, errors=replace(train.errors, rms=over * train.noise))
    worse = replace(first, errors=replace(first.errors, rms=over * first.noise), quiet_count=200)
    after = replace(made.after, train=(grown,), validation=(worse, *others))
    left = replace(signature(train, True), rms=1.7 * train.noise)
    found = finding(verdict=verdict, after=(left,))
    return replace(made, finding=found, stands=(made.before, after))


def over_noise(table, name: str) -> str:
    (cells,) = (row.cells for row in table.rows if row.cells[0] == name)
    return cells[-1]


@pytest.mark.parametrize("role", ["train", "validation"])
def test_what_a_recording_keeps_is_the_number_of_its_table(role):
    made = outcome()
    before, after = getattr(made.before, role), getattr(made.after, role)
    table = before_after_table("Errors", before, after, "actuator")
    said = dict(re.findall(r"(\S+\.h5) keeps (\S+) times its noise", " ".join(summary(made))))
    assert said[after[0].name] == over_noise(table, after[0].name) == "2.60"


def test_the_error_of_a_residual_is_that_of_the_table_and_of_the_json():
    made = outcome()
    (train,) = made.after.train
    table = before_after_table("Errors", made.before.train, made.after.train, "actuator")
    (after,) = signatures_of(made)[1]
    (words,) = re.findall(r"(\S+) um RMS, (\S+) times the noise floor", after.words[0])
    row = table.rows[0].cells
    assert words == (row[2], row[-1])
    json = diagnosis_json(made)
    told = json["residual_after"]["signature"][train.name]
    assert told["rms_um"] == pytest.approx(json["final"]["train"]["rms_um"])
    assert significant(told["rms_over_noise"]) == row[-1]
    assert told["words"][0] == after.words[0]


def test_a_model_has_one_training_error():
    made = outcome()
    steps = [row.cells[1] for row in step_table(made).rows]
    (row,) = before_after_table("T", made.before.train, made.after.train, "actuator").rows
    assert (steps[0], steps[-1]) == (row.cells[1], row.cells[2])
    assert significant(diagnosis_json(made)["final"]["train"]["rms_um"]) == steps[-1]


def test_samples_that_were_fitted_are_those_of_the_training_recordings(tmp_path):
    made = outcome()
    page = write_diagnosis_report(made, tmp_path / "r.html").read_text(encoding="utf-8")
    text = re.sub(r"<[^>]*>|\s+", " ", page)
    for label, some in (("fitted", made.after.train), ("validated", made.after.validation)):
        count = f"{sum(c.errors.samples for c in some):,}"
        assert re.search(rf"Samples {label}\s+{count}", text)
