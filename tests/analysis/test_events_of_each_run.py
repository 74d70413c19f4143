"""An event at the same moment of every run comes with each run, and predictions have it."""

from __future__ import annotations

from dataclasses import replace

import pytest

from dearig.acquisition.run import RunOptions, record
from dearig.analysis.diagnose import diagnose_recordings
from dearig.analysis.readings.events import of_each_run, recurring_events, with_events
from dearig.config.rigfile import RigFile
from dearig.config.sequencefile import load_sequence
from dearig.model.diagnosis.events import OneTimeEvent, Own
from tests.tools.diagnosis import finding, stage
from tests.tools.engine import PLAIN, effect

LOSS = "sudden loss of field"
RIG = RigFile.model_validate({"card": {"sample_rate_Hz": 200.0}})


def event(time: float, kind: str = LOSS) -> OneTimeEvent:
    return OneTimeEvent(kind, time, 5e-3, "")


@pytest.mark.parametrize(
    ("events", "count"),
    [
        ({"a": [event(9.22)], "b": [event(9.23)], "c": [event(9.24)]}, 1),
        ({"a": [event(9.22)], "b": [event(9.72)]}, 0),
        ({"a": [event(9.22)], "b": []}, 0),
        ({"a": [event(9.22)], "b": [event(9.22, "sudden change of reading")]}, 0),
        ({"a": [event(9.22)]}, 0),  # one recording does not show it
    ],
)
def test_only_what_all_have_at_one_moment_comes_with_each_run(
    events: dict[str, list[OneTimeEvent]], count: int
) -> None:
    assert len(of_each_run(events)) == count


def test_the_predicting_model_has_it_and_nothing_else_that_happened_once() -> None:
    effects = (
        *effect("linear drag", drag=0.1),
        *effect(LOSS, loss=5e-3, moment=9.24),
        *effect("sudden change of reading", jump=1e-5, moment=3.0),
    )
    final = stage(replace(PLAIN, effects=effects), 1e-6)
    own = {
        name: Own((event(3.0, "sudden change of reading"), event(9.23))[first:], False, 1e-6)
        for name, first in (("train", 0), ("validation", 1))
    }
    found = recurring_events(own, finding(final=final))
    assert found == (event(9.24),)
    kept = [name for name, _ in with_events(final, found).predicting.effects]
    assert kept == ["linear drag", LOSS]


@pytest.mark.deep
def test_a_rig_that_loses_field_at_one_moment_of_each_run_is_predicted(tmp_path) -> None:
    hiding = replace(PLAIN, effects=effect(LOSS, loss=5e-3, moment=9.24))
    files = []
    for seed, name in enumerate(("thesis", "validation-a-0.6")):
        path = tmp_path / f"{name}.h5"
        options = RunOptions(actuator=hiding, seed=seed)
        record(
            load_sequence(name),
            "sim",
            RigFile.model_validate({"card": {"sample_rate_Hz": 200.0}}),
            path,
            options,
        )
        files.append(path)
    outcome = diagnose_recordings(files[:1], validation=files[1:])
    assert [e.kind for e in outcome.recurring] == [LOSS]
    assert outcome.recommends_final
    assert outcome.verdict == "explained"
    assert LOSS in dict(outcome.model.model.effects)
    (validated,) = outcome.after.validation
    assert validated.errors.rms < 1.15 * validated.noise
