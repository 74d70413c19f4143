"""The script that reads reports for contradictions finds those that are put into one."""

from __future__ import annotations

import copy
import functools
import re
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from dearig.report.as_json import diagnosis_json
from dearig.report.text.diagnosis import headline, summary
from tests.blind.contradictions import Said, contradictions
from tests.tools.diagnosis import diagnose_outcome

Json = dict[str, Any]


@functools.cache
def made() -> Said:
    outcome = diagnose_outcome()
    text = " ".join([f"{headline(outcome)}.", *summary(outcome)])
    return Said(text, diagnosis_json(outcome), text, {})


def changed(change: Callable[[Json], object]) -> list[str]:
    """What is said of the result after a ``change`` of its JSON, and not before it."""
    json = copy.deepcopy(dict(made().json))
    change(json)
    before = contradictions(made())
    return [text for text in contradictions(replace(made(), json=json)) if text not in before]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda j: j["steps"][0]["parameters"][0].update(value=1e9), "is outside of its interval"),
        (lambda j: j["final"]["validation"].update(rms_um=77.0), "77 in JSON"),
        (lambda j: j["steps"][0]["selection"].update(rms_um=0.01), "cross-validation 0.01"),
        (
            lambda j: [s.update(is_noise=True, ljung_box_p=1e-18)
                       for s in j["residual_after"]["signature"].values()],
            "is noise, with p = 1e-18",
        ),
        (lambda j: j.update(families=[{"family": "none", "probability": 0.4,
                                       "probability_missing": 0.4}]), "add up to 0.4"),
        (lambda j: j.update(experiment_words="there is nothing to separate"), "is to be separated"),
        (lambda j: j.update(denied=[{"effect": j["steps"][0]["effect"], "channel": "current",
                                     "text": ""}]), "is named, and denied by the current"),
        (lambda j: j["records"].update(train=["lost.h5"]), "lost.h5 is missing"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_found(change: Callable[[Json], object], words: str) -> None:
    found = changed(change)
    assert any(words in text for text in found), found


def test_a_number_of_the_text_is_that_of_the_json() -> None:
    said = made()
    assert not [text for text in contradictions(said) if "in the sentence" in text]
    wrong = re.sub(r"from \S+ to", "from 99.9 to", said.text)
    found = contradictions(replace(said, text=wrong))
    assert any("99.9 in the sentence" in text for text in found)
