"""Which effects of the room's air several recordings can show, and what is said otherwise."""

from __future__ import annotations

import pytest

from dearig.model.readings.environment import air_texts, recorded_of


@pytest.mark.parametrize(
    ("temperatures", "humidities", "shown"),
    [
        ([0.0, 3.0], [0.0, 0.2], {"temperatures", "humidity"}),
        ([0.0, 0.5], [0.0, 0.02], set()),
        ([0.0], [0.2], set()),
        ([0.0, 3.0, None], [None, None, None], set()),
    ],
)
def test_effects_of_the_air_need_recordings_that_differ(
    temperatures: list, humidities: list, shown: set
) -> None:
    assert recorded_of(temperatures, humidities) == shown


@pytest.mark.parametrize(
    ("humidities", "words"),
    [
        ([None, None], []),
        ([-0.1, 0.1], []),
        ([0.0], ["the room's humidity was recorded (50.0 %), but one recording cannot show"]),
        ([0.0, None], ["the room's humidity was recorded in 1 of 2 recordings"]),
        ([0.0, 0.01], ["differs too little between the recordings (50.0 to 51.0 %)"]),
    ],
)
def test_what_recordings_cannot_show_is_said(humidities: list, words: list[str]) -> None:
    said = list(air_texts([None] * len(humidities), humidities))
    assert len(said) == len(words)
    for sentence, part in zip(said, words, strict=True):
        assert part in sentence
