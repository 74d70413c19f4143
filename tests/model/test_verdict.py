"""The verdict is never more than the numbers support."""

from __future__ import annotations

import math

import pytest

from dearig.model.verdict import (
    BUDGET,
    COMPLETE,
    CONFIRMING,
    EXPLAINED,
    NOT_CONFIRMED,
    NOTHING_MISSING,
    PARTLY_EXPLAINED,
    STOPPED,
    UNEXPLAINED,
    Judgement,
    judge,
    p_text,
)

BETTER = (4.4, 1.1)  # cross-validation error over the noise, before and after


@pytest.mark.parametrize("found", [EXPLAINED, NOTHING_MISSING])
@pytest.mark.parametrize("status", [COMPLETE, BUDGET])
@pytest.mark.parametrize("validation", [[], [1.0], [0.97, 1.14]])
def test_errors_at_the_noise_confirm_what_was_found(found, status, validation):
    assert judge(found, status, [1.02], validation, BETTER) == Judgement(found)


@pytest.mark.parametrize("found", [EXPLAINED, NOTHING_MISSING])
@pytest.mark.parametrize("left", [1.16, 4.2, math.inf])
def test_one_validation_recording_with_more_than_noise_is_a_reason_against(found, left):
    told = judge(found, COMPLETE, [1.0, 1.0], [1.0, left, 1.0], BETTER)
    assert told == Judgement(PARTLY_EXPLAINED, ("validation",))


def test_one_training_recording_with_more_than_noise_is_not_hidden_by_the_others():
    told = judge(EXPLAINED, COMPLETE, [*[1.0] * 20, 1.9], [1.0], BETTER)
    assert told == Judgement(PARTLY_EXPLAINED, ("training",))


def test_effects_that_raise_the_cross_validation_error_explain_nothing_for_sure():
    told = judge(EXPLAINED, COMPLETE, [1.0], [], (4.4, 72.0))
    assert told == Judgement(PARTLY_EXPLAINED, ("selection",))
    # at the noise a small rise means nothing
    assert judge(EXPLAINED, COMPLETE, [1.0], [], (1.04, 1.05)).verdict == EXPLAINED
    # where nothing was added, nothing rises: both are of one fit
    assert judge(NOTHING_MISSING, COMPLETE, [1.0], [], (1.20, 1.21)).verdict == NOTHING_MISSING


@pytest.mark.parametrize("validation", [[], [1.0], [3.0]])
def test_a_search_that_was_stopped_never_says_that_nothing_is_missing(validation):
    told = judge(NOTHING_MISSING, STOPPED, [1.0], validation, (1.0, 1.0))
    assert told.verdict == PARTLY_EXPLAINED
    assert "stopped" in told.reasons
    # an effect that was found before the stop explains what it explains
    assert judge(EXPLAINED, STOPPED, [1.0], [1.0], BETTER).verdict == EXPLAINED


@pytest.mark.parametrize("found", [PARTLY_EXPLAINED, UNEXPLAINED])
def test_what_the_search_did_not_explain_no_number_explains(found):
    assert judge(found, COMPLETE, [1.0], [1.0], BETTER) == Judgement(found)


def test_nothing_is_not_missing_where_the_readings_move_at_rest():
    told = judge(NOTHING_MISSING, COMPLETE, [1.0], [1.0], BETTER, True)
    assert told == Judgement(PARTLY_EXPLAINED, ("rest",))
    # what was found may be what moves
    assert judge(EXPLAINED, COMPLETE, [1.0], [1.0], BETTER, True) == Judgement(EXPLAINED)


@pytest.mark.parametrize("found", [EXPLAINED, PARTLY_EXPLAINED])
@pytest.mark.parametrize("gain", [-math.inf, -300.0, 0.0, 0.99 * CONFIRMING])
def test_what_untouched_recordings_do_not_confirm_is_not_confirmed(found, gain):
    told = judge(found, COMPLETE, [1.0], [1.0, 6.2], BETTER, gain=gain)
    assert told == Judgement(NOT_CONFIRMED, ("prediction",))


@pytest.mark.parametrize("found", [EXPLAINED, PARTLY_EXPLAINED])
def test_what_helps_on_most_recordings_and_ruins_one_is_not_confirmed(found):
    validation, much = [1.0, 126.0], 2.0 * CONFIRMING
    told = judge(found, COMPLETE, [1.0], validation, BETTER, gain=much, predicts_better=False)
    assert told == Judgement(NOT_CONFIRMED, ("prediction",))


def test_a_better_prediction_that_is_not_yet_noise_is_a_part():
    assert judge(EXPLAINED, COMPLETE, [1.0], [6.2], BETTER, gain=CONFIRMING).reasons == (
        "validation",
    )
    # at the noise, recordings that do not excite the effect deny nothing
    assert judge(EXPLAINED, COMPLETE, [1.0], [1.1], BETTER, gain=0.0).verdict == EXPLAINED
    # where nothing was added nothing can be confirmed
    assert judge(NOTHING_MISSING, COMPLETE, [1.0], [6.2], BETTER).verdict == PARTLY_EXPLAINED


def test_a_probability_is_written_as_far_as_a_number_knows_it():
    assert p_text(0.0213) == "p = 0.02"
    assert p_text(3e-12) == "p = 3e-12"
    assert p_text(0.0) == "p < 1e-15"


def test_an_error_that_training_leaves_open_is_said_to_be_so():
    given = (EXPLAINED, COMPLETE, [1.0], [1.0, 5.0], (3.0, 1.0))
    plain, open_ = judge(*given), judge(*given, undetermined=True)
    assert plain == Judgement(PARTLY_EXPLAINED, ("validation",))
    assert open_ == Judgement(PARTLY_EXPLAINED, ("validation", "excitation"))
    # without an error above the noise there is nothing to excuse
    assert judge(EXPLAINED, COMPLETE, [1.0], [1.0], (3.0, 1.0), undetermined=True).reasons == ()
